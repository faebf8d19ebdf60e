"""Log pair: one impact against the exact motion of two bodies; order of convergence in the studies. A scheme with the step tau and the
weight theta has a restitution e = exp(-pi (2 theta - 1) omega tau / 2). The phase of the touch within a step changes the speed by (omega
tau)^2 / 8 and the peak force by 3 (omega tau)^2 / 8 at most (found with the scheme's recursion over all phases); twice that is allowed."""

import math
from dataclasses import replace

import numpy as np

from dembark.input_decks.common.log_run import read, solver_values, unended
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.physics.exact.pairs import Pair
from dembark.postproc.measurement import Measurement, Numbers, Points, Replicas, number

from .exact_motion import error, pair_curves, restitution, velocities


def pair(p: Numbers) -> Pair:
    """The bodies of a run with parameters `p`; a wall has no mass, radius or velocity of its own, and is met head on."""
    wall = p["target"] == "wall"
    mass, radius, speed, offset = (math.inf, 0.0, 0.0, 0.0) if wall else (p["mass_2"], p["radius_2"], p["velocity_2"], p["offset"])
    stiffness = 1.0 / (1.0 / p["stiffness_1"] + 1.0 / p["stiffness_2"])
    return Pair((p["mass_1"], mass), stiffness, p["radius_1"] + radius, (p["velocity_1"], speed), offset, p["damping"],
                p["contact_damping"])


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of the run (there is one)."""
    run = read(replicas[0])
    p, bodies = run.parameters, pair(run.parameters)
    motion, turn = bodies.motion(run.times, p["lead_time"]), bodies.omega * run.time_step
    loss, square, duration = 0.5 * math.pi * (2.0 * p["theta"] - 1.0) * turn, turn**2, motion.end - motion.begin
    turned = 0.1 * loss if bodies.offset > 0.0 else 0.0
    damped, on_wall = p["damping"] > 0.0 or p["contact_damping"] > 0.0, p["target"] == "wall"
    e, e_exact = (restitution(moving, motion) for moving in (run.velocities[:, :, :2], motion.velocities))
    # What moves along the line of centres relative to the centre of mass is all that can be lost.
    share = 0.5 * bodies.reduced_mass * bodies.speed**2 / run.kinetic[0]
    end = run.kinetic[-1] + run.history["elastic_energy"][-1] + run.history["dissipated_energy"][-1]
    values = {
        "peak_force": number(run.history["highest_force"][-1], motion.peak, bound=0.5 * loss + 0.75 * square, scale=motion.peak,
                             detail="damped" if damped else f"the deviation of the scheme is −π/4 (2θ−1) ωτ = {-50.0 * loss:.2g} %"),
        "contact_time": number(run.impacts[0, 3] if len(run.impacts) else math.nan, duration, bound=run.time_step + 1e-12 * duration,
                               scale=duration, detail=f"counted in steps, uncertain by one; ωτ = {turn:.3g}"),
        **velocities(run, bodies, motion, loss + 0.25 * square),
        "restitution": number(e, e_exact * math.exp(-loss), bound=0.25 * square + turned, detail=f"exact two-body solution: {e_exact:.6f}"),
        "velocity_curve_error": number(np.abs(run.velocities[:, 0, :2] - motion.velocities[:, 0]).max() / bodies.speed),
        "energy_change": number(run.kinetic[-1] / run.kinetic[0] - 1.0, None if damped else share * (math.exp(-2.0 * loss) - 1.0),
                                bound=share * (0.5 * square + 2.0 * turned)),
        "energy_balance": number(abs(end / run.kinetic[0] - 1.0), 0.0),
        **solver_values(run),
    }
    if not on_wall:
        values |= {"momentum_error": number(run.momentum_error(), 0.0), "angular_momentum_error": number(run.angular_momentum_error(), 0.0)}
    early = run.times[-1] < motion.end
    if early:
        values = unended(values, [name for name, one in values.items() if one.bound is not None or name == "energy_change"])
    if damped:
        values |= {name: replace(one, bound=None, reason="there is no formula for the dissipation of the scheme with damping")
                   for name, one in values.items() if one.bound is not None}
    elif bodies.offset == 0.0 and len(run.impacts) and not early:
        change = p["mass_1"] * float(np.linalg.norm(run.velocities[-1, 0] - run.velocities[0, 0]))
        values["impulse"] = number(run.impacts[0, 5], change, scale=change)
    return Measurement(values, pair_curves(run, bodies, motion),
                       [f"ω = {bodies.omega:.1f} 1/s, ωτ = {turn:.3g}: {math.pi / turn:.0f} steps from touch to release."])


def study(_name: str, points: Points, along: str) -> Measurement:
    """Orders of convergence: exponents of the errors over the time step, fitted to all points."""
    points, steps = ordered(points, along)
    theta = points[0]["parameters"]["theta"]
    order, values, curves = 1.0 if theta > 0.5 else 2.0, {}, []
    for quantity, label in (("peak_force", "Error of the peak force"), ("velocity_curve_error", "Largest error of the velocity")):
        errors = PowerLawFit(steps, np.array([error(point, quantity) for point in points]), np.zeros(len(steps)))
        listed = ", ".join(f"{error:.2e} at {step:.3g} s" for error, step in zip(errors.values, steps, strict=True))
        values[f"order_{quantity}"] = number(errors.exponent.value, order, detail=f"relative errors {listed}")
        curves.append(errors.convergence(f"convergence_{quantity}", label, "τ (s)", order))
    return Measurement(values, curves,
                       [f"θ = {theta:g}. Each impact begins at the end of a step, so that the errors depend on the step only."])
