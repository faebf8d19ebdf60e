"""Runs a scenario with dembark.physics alone."""

from __future__ import annotations

from functools import cache

import numpy as np

from dembark.physics import (
    Body,
    Contact,
    FinnieRabinowicz,
    RollingResistance,
    collide,
    drop,
    effective_shear_modulus,
    effective_youngs_modulus,
)
from rig.motion import Motion
from rig.scenarios import Material, Scenario, evaluate


# A table of bridges takes as long as a run.
@cache
def contact(m: Material) -> Contact:
    elastic = (m.youngs_modulus, m.poisson_ratio, m.youngs_modulus, m.poisson_ratio)
    return Contact(
        effective_youngs_modulus=effective_youngs_modulus(*elastic), effective_shear_modulus=effective_shear_modulus(*elastic),
        restitution=m.restitution, normal_law=m.normal_law, characteristic_velocity=m.characteristic_velocity,
        bridge_volume=m.bridge_volume, surface_tension=m.surface_tension, contact_angle=m.contact_angle, capillary_model=m.capillary_model,
        viscosity=m.viscosity, minimum_gap=m.minimum_gap,
        rolling=RollingResistance(model=m.rolling_resistance, friction=m.rolling_friction, damping_ratio=m.rolling_damping_ratio),
        friction=FinnieRabinowicz(
            static_friction=m.static_friction, kinetic_friction=m.kinetic_friction, critical_slip_distance=m.critical_slip_distance,
            interface_shear_strength=m.interface_shear_strength, presliding=m.presliding, friction_limit=m.friction_limit,
            healing_time=m.healing_time))


def prescribed(case: Scenario) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities and angular velocities (steps + 1, grains, 3) of a prescribed case at every step."""
    time = case.time_step * np.arange(case.steps + 1)
    position = np.stack([np.array(g.position) + np.stack([evaluate(e, time) for e in g.path.displacement], 1) for g in case.grains], 1)
    velocity = np.stack([np.stack([evaluate(e, time) for e in g.path.velocity], 1) for g in case.grains], 1)
    spin = np.broadcast_to(np.array([g.angular_velocity for g in case.grains]), position.shape)
    return position, velocity, np.array(spin)


def _follow(case: Scenario) -> Motion:
    x, v, w = prescribed(case)
    n = len(case.grains)
    one = case.grains[0]
    radius, mass = (np.inf, np.inf) if case.wall else (case.grains[1].radius, case.grains[1].mass)
    state = contact(case.material).begin()
    force, torque = np.zeros_like(x), np.zeros_like(x)
    still = (0.0, 0.0, 0.0)
    for k in range(case.steps + 1):
        separation = (0.0, 0.0, x[k, 0, 2]) if case.wall else tuple(x[k, 0] - x[k, 1])
        v2, w2 = (still, still) if case.wall else (tuple(v[k, 1]), tuple(w[k, 1]))
        out = state.step(separation, tuple(v[k, 0]), v2, tuple(w[k, 0]), w2, one.radius, radius, one.mass, mass, case.time_step, k > 0)
        force[k, 0], torque[k, 0] = out[0], out[1]
        if n == 2:
            force[k, 1], torque[k, 1] = -force[k, 0], out[2]
    keep = slice(case.stride, None, case.stride)
    return Motion((case.time_step * np.arange(case.steps + 1))[keep], x[keep], v[keep], w[keep], force[keep], torque[keep])


def run(case: Scenario) -> Motion:
    if case.prescribed:
        return _follow(case)
    bodies = [Body(radius=g.radius, mass=g.mass, position=g.position, velocity=g.velocity, angular_velocity=g.angular_velocity)
              for g in case.grains]
    settings = {"time_step": case.time_step, "steps": case.steps, "gravity": case.gravity}
    out = drop(contact(case.material), bodies[0], **settings) if case.wall else collide(contact(case.material), *bodies, **settings)
    force, torque = np.zeros_like(out.position), np.zeros_like(out.position)
    on_1 = np.array([c.force for c in out.contacts])
    torque[:, 0] = [c.torque_1 for c in out.contacts]
    force[:, 0] = on_1
    if len(bodies) == 2:
        force[:, 1] = -on_1
        torque[:, 1] = [c.torque_2 for c in out.contacts]
    force += np.array([g.mass for g in case.grains])[:, None] * np.array(case.gravity)
    keep = slice(case.stride - 1, None, case.stride)
    return Motion(out.time[keep], out.position[keep], out.velocity[keep], out.angular_velocity[keep], force[keep], torque[keep])
