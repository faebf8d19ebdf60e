"""Checks of case `log_pair`: force, duration and velocities of one impact against exact solutions, and the order of convergence.

Head on and without damping the exact peak force is v sqrt(k m*), the duration pi / omega with omega = sqrt(k / m*), and the logs part as
fast as they met. A scheme with the step tau loses some of it: e = exp(-pi (2 theta - 1) omega tau / 2). Off centre the line of centres
turns during the impact; the exact motion is then an integration of the equations of motion. What the phase of the touch within a step
adds is at most (omega tau)^2 / 8 of the speed and 3 (omega tau)^2 / 8 of the peak force (found by running the scheme's own recursion
over all phases); twice that is allowed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dembark.validation.checks.log_exact import PairMotion, pair_motion
from dembark.validation.checks.logs import SAME, LogRun, energy_curves, exact, fitted_exponent, kept, over_time, read, solver_quantities
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica, profile
from dembark.validation.references import KOLESNIKOV
from numpy.typing import NDArray

Array = NDArray[np.float64]
REFERENCES = (KOLESNIKOV,)


@dataclass(frozen=True)
class Impact:
    """Scales of the impact: reduced mass (kg), stiffness (N/m), omega (1/s), omega tau, approach speed along the normal (m/s)."""

    reduced: float
    stiffness: float
    omega: float
    turn: float
    speed: float
    on_wall: bool

    @property
    def peak(self) -> float:
        """Exact peak force (N) head on without damping."""
        return self.speed * math.sqrt(self.stiffness * self.reduced)


def scales(p: Mapping[str, Any]) -> Impact:
    """Scales of the set-up with parameters `p`."""
    on_wall = p["target"] == "wall"
    reduced = p["mass_1"] if on_wall else p["mass_1"] * p["mass_2"] / (p["mass_1"] + p["mass_2"])
    stiffness = p["stiffness_1"] * p["stiffness_2"] / (p["stiffness_1"] + p["stiffness_2"])
    omega = math.sqrt(stiffness / reduced)
    offset = 0.0 if on_wall else p["offset"] / (p["radius_1"] + p["radius_2"])
    approach = p["velocity_1"] - (0.0 if on_wall else p["velocity_2"])
    return Impact(reduced, stiffness, omega, omega * p["time_step"], approach * math.sqrt(1.0 - offset**2), on_wall)


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, curves and remarks of the run (there is one)."""
    run = read(replicas[0])
    return measured(run)


def measured(run: LogRun) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """The same from a run that was read."""
    p = run.parameters
    scale, motion = scales(p), pair_motion(p, run.times)
    damped = p["damping"] > 0.0 or p["contact_damping"] > 0.0
    square, first_order = scale.turn**2, (2.0 * p["theta"] - 1.0) * scale.turn
    # Neither formula of the scheme's loss holds with damping.
    peak_error = None if damped else 0.25 * math.pi * first_order + 0.75 * square
    loss = 0.5 * math.pi * first_order
    speed_error = None if damped else loss + 0.25 * square
    turned = 0.1 * loss if p["offset"] > 0.0 and not scale.on_wall else 0.0
    records = run.impacts
    found = [
        Quantity(
            "peak_force",
            "largest contact force",
            "N",
            exact(run.history["highest_force"][-1]),
            reference=exact(motion.peak),
            tolerance=peak_error,
            agreement=SAME * motion.peak,
            source="exact solution of the two bodies",
            detail=f"the scheme's own deviation is −π/4 (2θ−1) ωτ = {-25.0 * math.pi * first_order:.2g} %" if not damped else "damped",
        ),
        Quantity(
            "contact_time",
            "duration of the impact",
            "s",
            exact(records[0, 3] if len(records) else math.nan),
            reference=exact(motion.end - motion.begin),
            # The record has twelve digits.
            tolerance=None if damped else run.time_step + 1e-12 * (motion.end - motion.begin),
            absolute=True,
            agreement=1e-6 * (motion.end - motion.begin),
            source="exact solution of the two bodies",
            detail="counted in whole steps, so that one more or less is due; ωτ = " + f"{scale.turn:.3g}",
        ),
    ]
    found += _velocities(run, motion, scale, speed_error)
    e = restitution(run.velocities[:, :, :2], motion, scale)
    e_exact = restitution(motion.velocities, motion, scale)
    found.append(
        Quantity(
            "restitution",
            "speed of parting over speed of approach",
            "1",
            exact(e),
            reference=exact(e_exact * math.exp(-loss)),
            tolerance=None if damped else 0.25 * square + turned,
            absolute=True,
            agreement=SAME,
            source="e = exp(−π (2θ−1) ωτ/2), the scheme at its step",
            detail=f"exact two-body solution: {e_exact:.6f}",
        )
    )
    apart = np.abs(run.velocities[:, 0, :2] - motion.velocities[:, 0]).max() / scale.speed
    found.append(
        Quantity(
            "velocity_curve_error",
            "largest deviation of log 1 from the exact velocity, over the approach speed",
            "1",
            exact(apart),
            agreement=SAME,
            detail="over all frames; its order in τ is what the studies look at",
        )
    )
    energy = run.kinetic[-1] / run.kinetic[0] - 1.0
    # What moves along the line of centres relative to the centre of mass is all that can be lost.
    share = 0.5 * scale.reduced * scale.speed**2 / run.kinetic[0]
    found.append(
        Quantity(
            "energy_change",
            "kinetic energy after over before, − 1",
            "1",
            exact(energy),
            reference=None if damped else exact(share * (math.exp(-2.0 * loss) - 1.0)),
            tolerance=None if damped else share * (0.5 * square + 2.0 * turned),
            absolute=True,
            agreement=SAME,
            source="" if damped else "e² − 1 of the energy along the line of centres, the scheme at its step",
            detail="exact two-body solution without damping: 0",
        )
    )
    total = run.kinetic[1:] + run.history["elastic_energy"] + run.history["dissipated_energy"]
    found.append(
        Quantity(
            "energy_balance",
            "largest |kinetic + elastic + dissipated − initial| / initial, after the impact",
            "1",
            exact(abs(total[-1] / run.kinetic[0] - 1.0)),
            reference=exact(0.0),
            tolerance=1e-10,
            absolute=True,
            compared=False,
            source="conservation law",
            detail="the engine's own account of what was lost",
        )
    )
    if not scale.on_wall:
        found.append(kept("momentum_error", "largest change of the momentum, vector, over Σ m|v|", run.momentum_error(), "over all frames"))
        found.append(
            kept(
                "angular_momentum_error",
                "largest change of the angular momentum over Σ m|x||v|",
                run.angular_momentum_error(),
                "over all frames",
            )
        )
    if not damped and (scale.on_wall or p["offset"] == 0.0) and len(records):
        change = p["mass_1"] * float(np.linalg.norm(run.velocities[-1, 0] - run.velocities[0, 0]))
        found.append(
            Quantity(
                "impulse",
                "impulse in the record of the impact",
                "N*s",
                exact(records[0, 5]),
                reference=exact(change),
                tolerance=1e-8,
                source="change of the momentum of log 1",
                agreement=1e-7 * change,
            )
        )
    found += solver_quantities(run)
    return found, _curves(run, motion), _remarks(scale, damped)


def restitution(velocities: Array, motion: PairMotion, scale: Impact) -> float:
    """Speed of parting in the last frame over that of approach in the first, along the line of centres at touch; `velocities` (frames,
    bodies, 2) in m/s."""
    own = velocities[:, 0] @ motion.normal
    other = velocities[:, 1] @ motion.normal if not scale.on_wall else np.zeros(len(own))
    return float((other[-1] - own[-1]) / (own[0] - other[0]))


def _velocities(run: LogRun, motion: PairMotion, scale: Impact, error: float | None) -> list[Quantity]:
    """Velocities after the impact along and across the line of centres at touch."""
    found = []
    across = np.array([-motion.normal[1], motion.normal[0]])
    directions = [("after", "along the line of centres", motion.normal)]
    if run.parameters["offset"] > 0.0 and not scale.on_wall:
        directions.append(("across_after", "across the line of centres", across))
    for body in range(run.velocities.shape[1]):
        share = scale.reduced / run.masses[body]
        for name, label, direction in directions:
            value = float(run.velocities[-1, body, :2] @ direction)
            due = float(motion.velocities[-1, body] @ direction)
            found.append(
                Quantity(
                    f"velocity_{body + 1}_{name}",
                    f"velocity of log {body + 1} after, {label}",
                    "m/s",
                    exact(value),
                    reference=exact(due),
                    tolerance=None if error is None else share * scale.speed * error,
                    absolute=True,
                    agreement=SAME * scale.speed,
                    source="exact solution of the two bodies",
                    detail=f"before: {float(run.velocities[0, body, :2] @ direction):.6g} m/s",
                )
            )
    return found


def _curves(run: LogRun, motion: PairMotion) -> list[dict[str, Any]]:
    along = run.velocities[:, :, :2] @ motion.normal
    due = motion.velocities @ motion.normal
    force = np.linalg.norm(run.forces[:, 0], axis=1)
    label = "exact"
    curves = [over_time("force", "Contact force", "N (kN)", run.times, force / 1e3, reference=motion.force / 1e3, label=label)]
    curves += [
        over_time(
            f"velocity_{body + 1}",
            f"Velocity of log {body + 1}",
            "v (m/s)",
            run.times,
            along[:, body],
            reference=due[:, body],
            label=label,
            note="along the line of centres at touch",
        )
        for body in range(along.shape[1])
    ]
    return curves + energy_curves(run, 0.5 * motion.force**2 / scales(run.parameters).stiffness)


def _remarks(scale: Impact, damped: bool) -> list[str]:
    remarks = [f"ω = {scale.omega:.1f} 1/s, ωτ = {scale.turn:.3g}: {math.pi / scale.turn:.0f} steps from touch to release."]
    if damped:
        remarks.append("With damping the scheme's loss has no formula here, so what is beside the exact solution has no verdict.")
    remarks.append(f"{KOLESNIKOV.short}: {KOLESNIKOV.statement}")
    return remarks


def picture(parameters: Mapping[str, Any]) -> dict[str, Any] | None:
    """Two logs are no picture."""
    del parameters
    return None


def study(name: str, points: Sequence[dict[str, Any]], along: str) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Orders of convergence: exponents of the errors over the time step, fitted to all points."""
    del name
    steps = np.array([point["parameters"][along] for point in points])
    theta = points[0]["parameters"]["theta"]
    order = 1.0 if theta > 0.5 else 2.0
    found, curves = [], []
    for quantity, label in (("peak_force", "error of the peak force"), ("velocity_curve_error", "largest error of the velocity")):
        errors = np.array([_error(point, quantity) for point in points])
        exponent = fitted_exponent(steps, errors)
        found.append(
            Quantity(
                f"order_{quantity}",
                f"{label} ∝ τ^p, p",
                "1",
                exact(exponent),
                reference=exact(order),
                tolerance=0.1,
                absolute=True,
                agreement=1e-6,
                source="backward differences: 1; reversible in time: 2",
                detail="relative errors "
                + ", ".join(f"{error:.2e}" for error in errors)
                + " at the steps "
                + ", ".join(f"{step:.3g} s" for step in steps),
            )
        )
        shown = np.argsort(steps)
        line = errors[shown][0] * (steps[shown] / steps[shown][0]) ** order
        curves.append(
            profile(
                f"convergence_{quantity}",
                label.capitalize(),
                "log₁₀ τ (s)",
                "log₁₀ error",
                np.log10(steps[shown]),
                [np.log10(errors[shown])],
                reference=np.log10(line),
                reference_label=f"slope {order:g}",
            )
        )
    return found, curves, [f"θ = {theta:g}. Each impact begins at the end of a step, so that the errors differ by the step alone."]


def _error(point: Mapping[str, Any], name: str) -> float:
    one = next(quantity for quantity in point["quantities"] if quantity["name"] == name)
    return abs(one["value"] / one["reference"] - 1.0) if one["reference"] else abs(one["value"])
