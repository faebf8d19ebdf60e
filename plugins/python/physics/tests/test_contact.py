"""Two bodies and one contact: conservation laws and exact results."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.physics import (
    Body,
    Contact,
    FinnieRabinowicz,
    RollingResistance,
    collide,
    drop,
    effective_shear_modulus,
    effective_youngs_modulus,
    rupture_distance,
)
from dembark.physics.contact import ContactForce

ELASTIC = (1e7, 0.3, 1e7, 0.3)
ROUGH = FinnieRabinowicz(static_friction=0.5, kinetic_friction=0.5, critical_slip_distance=1e-5)
CONTACT = Contact(effective_youngs_modulus=effective_youngs_modulus(*ELASTIC), effective_shear_modulus=effective_shear_modulus(*ELASTIC),
                  restitution=0.7, friction=ROUGH)
RADIUS, MASS = 5e-3, 1.3e-3
ONE = Body(radius=RADIUS, mass=MASS, position=(0.0, 0.0, 5.1e-3), velocity=(0.3, -0.1, -0.8), angular_velocity=(20.0, 40.0, -30.0))
TWO = Body(radius=3e-3, mass=0.7e-3, position=(0.0, 0.0, -3e-3), velocity=(-0.1, 0.2, 0.4), angular_velocity=(0.0, -50.0, 10.0))
INERTIA = 0.4 * np.array([MASS * RADIUS**2, 0.7e-3 * 3e-3**2])


def test_effective_moduli():
    assert effective_youngs_modulus(2e6, 0.25, 2e6, 0.25) == pytest.approx(2e6 / (2.0 * (1.0 - 0.25**2)), rel=1e-14)
    assert effective_youngs_modulus(2e6, 0.25, 1e30, 0.3) == pytest.approx(2e6 / (1.0 - 0.25**2), rel=1e-14)
    shear = 2e6 / (2.0 * 1.25)
    assert effective_shear_modulus(2e6, 0.25, 2e6, 0.25) == pytest.approx(shear / (2.0 * (2.0 - 0.25)), rel=1e-14)


@pytest.mark.parametrize("normal_law", ["hertz", "hooke"])
@pytest.mark.parametrize("volume", [0.0, 1e-10])
def test_momenta_are_conserved(normal_law, volume):
    contact = replace(CONTACT, normal_law=normal_law, bridge_volume=volume, surface_tension=0.072)
    motion = collide(contact, ONE, TWO, time_step=1e-6, steps=2500)
    assert motion.contacts[-1].overlap < 0.0 < max(c.overlap for c in motion.contacts)
    mass = np.array([MASS, 0.7e-3])[:, None]
    momentum = (mass * motion.velocity).sum(axis=1)
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), rtol=1e-11)
    # Positions and forces are of one time, so the leapfrog keeps the angular momentum of forces that meet in a point.
    spin = (np.cross(motion.position, mass * motion.velocity) + INERTIA[:, None] * motion.angular_velocity).sum(axis=1)
    np.testing.assert_allclose(spin, np.broadcast_to(spin[0], spin.shape), rtol=0.0, atol=1e-11 * np.abs(spin).max())


@pytest.mark.parametrize("restitution", [0.3, 0.7, 0.95, 1.0])
def test_hooke_returns_its_restitution(restitution):
    """A damped spring: the speed at the end of overlap is e times the speed at its start."""
    contact = replace(CONTACT, normal_law="hooke", restitution=restitution)
    motion = collide(contact, replace(ONE, velocity=(0.0, 0.0, -0.5), angular_velocity=(0.0, 0.0, 0.0)),
                     replace(TWO, velocity=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 0.0)), time_step=2e-7, steps=12000)
    assert motion.contacts[-1].overlap < 0.0
    assert motion.velocity[-1, 0, 2] - motion.velocity[-1, 1, 2] == pytest.approx(0.5 * restitution, rel=2e-3)


def test_elastic_impact_keeps_energy():
    losses = []
    for time_step in (2e-6, 1e-6):
        contact = replace(CONTACT, restitution=1.0, friction=replace(ROUGH, static_friction=0.0, kinetic_friction=0.0))
        motion = collide(contact, ONE, TWO, time_step=time_step, steps=round(2.5e-3 / time_step))
        energy = (0.5 * np.array([MASS, 0.7e-3]) * (motion.velocity**2).sum(axis=2)).sum(axis=1)
        losses.append(abs(energy[-1] / energy[0] - 1.0))
    assert losses[0] < 1e-4
    assert losses[1] < 0.6 * losses[0]


def test_hertz_impact_time():
    """2.94 (15 m* / (16 E* sqrt(R*)))^(2/5) v^(-1/5) (Johnson, Contact Mechanics, 11.4)."""
    contact = replace(CONTACT, restitution=1.0)
    speed, reduced_mass, reduced_radius = 1.0, MASS * 0.7e-3 / (MASS + 0.7e-3), 5e-3 * 3e-3 / 8e-3
    motion = collide(contact, replace(ONE, velocity=(0.0, 0.0, -speed), angular_velocity=(0, 0, 0)),
                     replace(TWO, velocity=(0.0, 0.0, 0.0), angular_velocity=(0, 0, 0)), time_step=1e-7, steps=20000)
    touching = sum(c.overlap > 0.0 for c in motion.contacts) * 1e-7
    deepest = (15.0 * reduced_mass * speed**2 / (16.0 * contact.effective_youngs_modulus * np.sqrt(reduced_radius))) ** 0.4
    assert max(c.overlap for c in motion.contacts) == pytest.approx(deepest, rel=1e-3)
    assert touching == pytest.approx(2.9433 * deepest / speed, rel=1e-3)


def test_sliding_grain_ends_up_rolling():
    """Whatever the friction: 5/7 of the speed is left, but for the arm r - overlap / 2."""
    contact = replace(CONTACT, restitution=0.3)
    body = Body(radius=RADIUS, mass=MASS, position=(0.0, 0.0, RADIUS + 1e-9), velocity=(0.1, 0.0, 0.0))
    motion = drop(contact, body, time_step=1e-5, steps=6000)
    assert motion.velocity[-1, 0, 0] == pytest.approx(0.1 * 5.0 / 7.0, rel=2e-3)
    assert motion.angular_velocity[-1, 0, 1] * RADIUS == pytest.approx(motion.velocity[-1, 0, 0], rel=2e-3)
    assert motion.contacts[-1].normal_force == pytest.approx(MASS * 9.81, rel=1e-6)


def test_spin_about_the_normal_goes_on():
    """A contact in a point holds no torsion."""
    top = Body(radius=RADIUS, mass=MASS, position=(0.0, 0.0, RADIUS + 1e-9), angular_velocity=(0.0, 0.0, 50.0))
    motion = drop(CONTACT, top, time_step=1e-5, steps=2000)
    assert motion.angular_velocity[-1, 0].tolist() == [0.0, 0.0, 50.0]


def test_bridge_holds_a_grain_and_needs_energy_to_part():
    """Slow impacts stick to the wall by a bridge, fast ones leave; the tilted wall does what the level one does."""
    wet = replace(CONTACT, restitution=0.9, bridge_volume=1e-10, surface_tension=0.072)
    reach = rupture_distance(1e-10, 0.0, RADIUS, np.inf)
    ends = {}
    for speed in (0.02, 1.0):
        body = Body(radius=RADIUS, mass=MASS, position=(0.0, 0.0, 5.05e-3), velocity=(0.0, 0.0, -speed))
        motion = drop(wet, body, time_step=5e-6, steps=4000, gravity=(0.0, 0.0, 0.0))
        ends[speed] = -motion.contacts[-1].overlap
        gaps, forces = (np.array([getattr(c, name) for c in motion.contacts]) for name in ("overlap", "capillary_force"))
        first = int(np.argmax(gaps > 0.0))
        assert (forces[:first] == 0.0).all()
        assert (forces[first:][-gaps[first:] < reach * (1 - 1e-9)] > 0.0).all()
        assert (forces[-gaps > reach] == 0.0).all()
    assert ends[0.02] < reach < ends[1.0]
    normal = (0.6, 0.0, 0.8)
    tilted = Body(radius=RADIUS, mass=MASS, position=tuple(5.05e-3 * c for c in normal), velocity=tuple(-c for c in normal))
    other = drop(wet, tilted, time_step=5e-6, steps=4000, gravity=(0.0, 0.0, 0.0), wall_normal=normal)
    np.testing.assert_allclose(other.velocity[:, 0] @ normal, motion.velocity[:, 0, 2], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("change", "words"), [
    ({"restitution": 0.0}, "restitution must be > 0 and <= 1"), ({"restitution": 1.1}, "restitution"),
    ({"restitution": np.nan}, "restitution"),
    ({"effective_youngs_modulus": 0.0}, "youngs_modulus .Pa. must be > 0"), ({"normal_law": "stiff"}, "'hertz' or 'hooke'"),
    ({"bridge_volume": -1e-12}, "bridge_volume"), ({"bridge_volume": 1e-12, "surface_tension": -1.0}, "surface_tension"),
    ({"bridge_volume": 1e-12, "surface_tension": 72.0}, r"surface_tension \(N/m\) must be at most 10, not 72; is it in mN/m\?"),
    ({"bridge_volume": 1e-12, "contact_angle": 2.0}, "contact.angle"), ({"bridge_volume": 1e-12, "capillary_model": "magic"}, "magic"),
    ({"normal_law": "hooke", "characteristic_velocity": 0.0}, "characteristic_velocity"),
    # What no law would use.
    ({"work_of_adhesion": 0.1}, "work_of_adhesion is given, but cohesion is none; it needs dmt or jkr"),
    ({"cohesive_force": 1e-2, "cohesion": "jkr", "work_of_adhesion": 0.1}, "cohesive_force is given, but cohesion is jkr"),
    ({"bridge_volume": 1e-12, "cohesion": "none"}, "bridge_volume is given, but cohesion is none; it needs bridge"),
    ({"viscosity": 1e-3, "minimum_gap": 1e-6}, "liquid_viscosity is given, but cohesion is none; it needs bridge"),
    ({"surface_tension": 0.072}, "surface_tension is given, but cohesion is none"),
    ({"contact_angle": 0.3}, "contact_angle is given, but cohesion is none"),
    ({"bridge_volume": 8e-11}, r"'bridge' needs a surface_tension \(N/m\)"),
    ({"cohesion": "jkr"}, "'jkr' needs a work_of_adhesion > 0"), ({"cohesion": "constant"}, "'constant' needs a cohesive_force > 0"),
    ({"cohesion": "bridge"}, "'bridge' needs a bridge_volume > 0"),
])
def test_bad_contacts(change, words):
    with pytest.raises(ValueError, match=words):
        replace(CONTACT, **change).begin()


def test_the_liquid_of_a_bridge_without_volume_is_no_mistake():
    assert replace(CONTACT, bridge_volume=0.0, surface_tension=0.072, contact_angle=0.3).begin()
    assert replace(CONTACT, bridge_volume=1e-12, surface_tension=0.0).begin()


@pytest.mark.parametrize("arguments", [(-5e6, 0.3, 5e6, 0.3), (5e6, 0.6, 5e6, 0.3), (5e6, 0.3, 0.0, 0.3), (5e6, 0.3, 5e6, -1.0),
                                       (np.nan, 0.3, 5e6, 0.3)])
def test_bad_materials(arguments):
    for function in (effective_youngs_modulus, effective_shear_modulus):
        with pytest.raises(ValueError, match=r"(youngs|poisson)_[12]"):
            function(*arguments)


def test_a_rolling_resistance_that_is_off_has_no_numbers():
    with pytest.raises(ValueError, match="rolling_friction is given, but rolling_resistance is off; it needs constant_torque or "):
        RollingResistance(friction=0.1)
    with pytest.raises(ValueError, match="rolling_damping_ratio is given, but rolling_resistance is constant_torque; it needs"):
        RollingResistance(model="constant_torque", friction=0.1, damping_ratio=0.3)


@pytest.mark.parametrize("value", ["0.5", True])
def test_texts_and_truths_are_no_numbers(value):
    with pytest.raises(TypeError, match="static_friction must be a number"):
        replace(ROUGH, static_friction=value)


def test_few_steps_of_a_contact_are_said():
    ball = Body(radius=RADIUS, mass=MASS, position=(0.0, 0.0, 5.01e-3), velocity=(0.0, 0.0, -0.5))
    with pytest.warns(RuntimeWarning, match=r"a contact lasted \d steps of 0.0002 s only, fewer than 10"):
        drop(CONTACT, ball, time_step=2e-4, steps=40)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drop(CONTACT, ball, time_step=2e-5, steps=400)


def test_what_passes_through_is_refused():
    with pytest.raises(ValueError, match="the bodies pass through each other in step 1"):
        drop(CONTACT, replace(ONE, velocity=(0.0, 0.0, -500.0)), time_step=1e-3, steps=5)
    with pytest.raises(ValueError, match="the bodies pass through each other"):
        collide(CONTACT, replace(ONE, velocity=(0.0, 0.0, -500.0)), TWO, time_step=1e-6, steps=50)
    # Past each other in one step, through a contact that no step sees; far from each other.
    ball = Body(radius=RADIUS, mass=MASS, position=(-6.5e-3, 0.0, 0.0), velocity=(13.0, 0.0, 0.0))
    other = Body(radius=RADIUS, mass=MASS, position=(0.0, 8e-3, 0.0))
    with pytest.raises(ValueError, match="the bodies pass through each other in step 1"):
        collide(CONTACT, ball, other, time_step=1e-3, steps=1)
    collide(CONTACT, ball, replace(other, position=(0.0, 20e-3, 0.0)), time_step=1e-3, steps=1)
    with pytest.raises(ValueError, match="bridge_volume must be at most that of the smallest sphere"):
        drop(replace(CONTACT, bridge_volume=80.0, surface_tension=0.072), ONE, time_step=1e-6, steps=5)


@pytest.mark.parametrize(("change", "words"), [
    ({"radius": 0.0}, "radius"), ({"radius": np.nan}, "radius"), ({"mass": -1.0}, "mass"), ({"mass": np.inf}, "mass"),
    ({"position": (0.0, 1.0)}, "position"), ({"velocity": (0.0, np.nan, 1.0)}, "velocity"), ({"angular_velocity": 3.0}, "angular_velocity"),
])
def test_bad_bodies(change, words):
    with pytest.raises(ValueError, match=words):
        replace(ONE, **change)


@pytest.mark.parametrize(("settings", "words"), [
    ({"time_step": 0.0}, "time_step"), ({"time_step": np.inf}, "time_step"), ({"steps": -1}, "steps"), ({"gravity": (0.0, 1.0)}, "gravity"),
    ({"wall_normal": (0.0, 0.0, 2.0)}, "wall_normal"), ({"wall_point": (0.0, 0.0, np.nan)}, "wall_point"),
    ({"wall_point": (0.0, 0.0, 1.0)}, "must not touch"),
])
def test_bad_settings(settings, words):
    with pytest.raises(ValueError, match=words):
        drop(CONTACT, ONE, **{"time_step": 1e-6, "steps": 5} | settings)


@settings(max_examples=5, deadline=None)
@given(restitution=st.floats(0.1, 1.0), speed=st.floats(0.05, 2.0), normal_law=st.sampled_from(["hertz", "hooke"]),
       presliding=st.sampled_from(["linear", "partial_slip"]), volume=st.sampled_from([0.0, 1e-10]))
def test_friction_limit_is_that_of_the_chosen_normal_force(restitution, speed, normal_law, presliding, volume):
    """A grain with a fast tangential motion slides soon after touch: T = mu N at each step, with N of the spring alone or of spring
    and dashpot; a bridge is in neither."""
    for limit in ("elastic", "total"):
        contact = replace(CONTACT, restitution=restitution, normal_law=normal_law, bridge_volume=volume, surface_tension=0.072,
                          capillary_model="willett", friction=replace(ROUGH, friction_limit=limit, presliding=presliding))
        spring = replace(contact, restitution=1.0)
        body = Body(radius=RADIUS, mass=MASS, position=(0.0, 0.0, RADIUS + 1e-9), velocity=(50.0, 0.0, -speed))
        motion = drop(contact, body, time_step=2e-6, steps=120, gravity=(0.0, 0.0, 0.0))
        touching = [k for k, step in enumerate(motion.contacts) if step.overlap > 0.0]
        assert len(touching) > 40
        # In the first steps the spring has not reached the limit, and a contact that sticks has its dashpot in addition.
        for k in touching[22::20]:
            step = motion.contacts[k]
            at_rest = spring.begin().step((0.0, 0.0, RADIUS - step.overlap), *[(0.0, 0.0, 0.0)] * 4, RADIUS, np.inf, MASS, np.inf, 2e-6,
                                          True)
            load = ContactForce(*at_rest).normal_force if limit == "elastic" else max(step.normal_force, 0.0)
            assert step.tangential[0] == pytest.approx(-0.5 * load, rel=1e-9, abs=1e-12)
