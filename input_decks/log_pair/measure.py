"""Log pair: one impact against the exact motion of the two bodies; in the studies, the order of convergence.

A scheme with the step tau and the weight theta parts the logs with e = exp(-pi (2 theta - 1) omega tau / 2) of the exact speed. What the
phase of the touch within a step adds is at most (omega tau)^2 / 8 of the speed and 3 (omega tau)^2 / 8 of the peak force (found by running
the scheme's own recursion over all phases); twice that is allowed.
"""

import math
from dataclasses import replace

import numpy as np

from dembark.physics.exact.pairs import Pair, PairMotion
from dembark.postproc.instruments.growth import Growth, ordered
from dembark.postproc.instruments.logs import LogRun, energy_curves, over_time, read, solver_values
from dembark.postproc.measurement import Array, Curve, Measurement, Numbers, Points, Replicas, Value, number


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
    e, e_exact = (restitution(velocities, motion) for velocities in (run.velocities[:, :, :2], motion.velocities))
    # What moves along the line of centres relative to the centre of mass is all that can be lost.
    share = 0.5 * bodies.reduced_mass * bodies.speed**2 / run.kinetic[0]
    end = run.kinetic[-1] + run.history["elastic_energy"][-1] + run.history["dissipated_energy"][-1]
    values = {
        "peak_force": number(run.history["highest_force"][-1], motion.peak, bound=0.5 * loss + 0.75 * square, scale=motion.peak,
                             detail="damped" if damped else f"the scheme's own deviation is −π/4 (2θ−1) ωτ = {-50.0 * loss:.2g} %"),
        "contact_time": number(run.impacts[0, 3] if len(run.impacts) else math.nan, duration, bound=run.time_step + 1e-12 * duration,
                               scale=duration, detail=f"counted in whole steps, so that one more or less is due; ωτ = {turn:.3g}"),
        **_velocities(run, bodies, motion, loss + 0.25 * square),
        "restitution": number(e, e_exact * math.exp(-loss), bound=0.25 * square + turned, detail=f"exact two-body solution: {e_exact:.6f}"),
        "velocity_curve_error": number(np.abs(run.velocities[:, 0, :2] - motion.velocities[:, 0]).max() / bodies.speed),
        "energy_change": number(run.kinetic[-1] / run.kinetic[0] - 1.0, None if damped else share * (math.exp(-2.0 * loss) - 1.0),
                                bound=share * (0.5 * square + 2.0 * turned)),
        "energy_balance": number(abs(end / run.kinetic[0] - 1.0), 0.0),
        **solver_values(run),
    }
    if not on_wall:
        values |= {"momentum_error": number(run.momentum_error(), 0.0), "angular_momentum_error": number(run.angular_momentum_error(), 0.0)}
    if damped:
        values |= {name: replace(one, bound=None, reason="with damping the scheme's loss has no formula") for name, one in values.items()
                   if one.bound is not None}
    elif bodies.offset == 0.0 and len(run.impacts):
        change = p["mass_1"] * float(np.linalg.norm(run.velocities[-1, 0] - run.velocities[0, 0]))
        values["impulse"] = number(run.impacts[0, 5], change, scale=change)
    return Measurement(values, _curves(run, bodies, motion),
                       [f"ω = {bodies.omega:.1f} 1/s, ωτ = {turn:.3g}: {math.pi / turn:.0f} steps from touch to release."])


def restitution(velocities: Array, motion: PairMotion) -> float:
    """Speed of parting in the last frame over that of approach in the first, along the line of centres at touch; `velocities` (frames,
    bodies, 2) in m/s."""
    along = velocities @ motion.normal
    apart = (along[:, 1] if along.shape[1] > 1 else 0.0) - along[:, 0]
    return float(-apart[-1] / apart[0])


def _velocities(run: LogRun, bodies: Pair, motion: PairMotion, error: float) -> dict[str, Value]:
    """Velocities after the impact along the line of centres at touch and, off centre, across it."""
    directions = {"after": motion.normal}
    if bodies.offset > 0.0:
        directions["across_after"] = np.array([-motion.normal[1], motion.normal[0]])
    values = {}
    for body, mass in enumerate(run.masses):
        for name, direction in directions.items():
            before, after = (float(run.velocities[frame, body, :2] @ direction) for frame in (0, -1))
            values[f"velocity_{body + 1}_{name}"] = number(
                after, float(motion.velocities[-1, body] @ direction), bound=bodies.reduced_mass / mass * bodies.speed * error,
                scale=bodies.speed, detail=f"before: {before:.6g} m/s")
    return values


def _curves(run: LogRun, bodies: Pair, motion: PairMotion) -> list[Curve]:
    along, due = run.velocities[:, :, :2] @ motion.normal, motion.velocities @ motion.normal
    force = np.linalg.norm(run.forces[:, 0], axis=1)
    return [
        over_time("force", "Contact force", "N (kN)", run.times, force / 1e3, motion.force / 1e3),
        *(over_time(f"velocity_{body + 1}", f"Velocity of log {body + 1}", "v (m/s)", run.times, along[:, body], due[:, body],
                    note="along the line of centres at touch") for body in range(along.shape[1])),
        *energy_curves(run, 0.5 * motion.force**2 / bodies.stiffness),
    ]


def study(_name: str, points: Points, along: str) -> Measurement:
    """Orders of convergence: exponents of the errors over the time step, fitted to all points."""
    points, steps = ordered(points, along)
    theta = points[0]["parameters"]["theta"]
    order, values, curves = 1.0 if theta > 0.5 else 2.0, {}, []
    for quantity, label in (("peak_force", "Error of the peak force"), ("velocity_curve_error", "Largest error of the velocity")):
        errors = Growth(steps, np.array([_error(point, quantity) for point in points]), np.zeros(len(steps)))
        told = ", ".join(f"{error:.2e} at {step:.3g} s" for error, step in zip(errors.values, steps, strict=True))
        values[f"order_{quantity}"] = number(errors.exponent.value, order, detail=f"relative errors {told}")
        curves.append(errors.convergence(f"convergence_{quantity}", label, "τ (s)", order))
    return Measurement(values, curves,
                       [f"θ = {theta:g}. Each impact begins at the end of a step, so that the errors differ by the step alone."])


def _error(point: Numbers, name: str) -> float:
    one = next(quantity for quantity in point["quantities"] if quantity["name"] == name)
    return abs(one["value"] / one["reference"] - 1.0) if one["reference"] else abs(one["value"])
