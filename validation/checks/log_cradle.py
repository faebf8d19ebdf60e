"""Checks of case `log_cradle`: the velocities after an impact through a row of logs against the exact motion of the row."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dembark.validation.checks.log_exact import ChainMotion, chain_motion, chain_with_loss
from dembark.validation.checks.logs import SAME, LogRun, energy_curves, exact, kept, over_time, read, solver_quantities
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica
from dembark.validation.references import KOLESNIKOV
from numpy.typing import NDArray

Array = NDArray[np.float64]
REFERENCES = (KOLESNIKOV,)
# Curves are drawn of so many logs at most.
SHOWN = 5


def row(parameters: Mapping[str, Any]) -> tuple[Array, Array, Array, Array]:
    """Masses (n,), stiffnesses of the contacts (n - 1,), gaps (n - 1,) and velocities (n,) of the set-up; SI units."""
    n = int(parameters["log_count"])
    velocity = np.zeros(n)
    velocity[0] = parameters["velocity"]
    # Two boundaries in series.
    return np.full(n, parameters["mass"]), np.full(n - 1, 0.5 * parameters["stiffness"]), np.full(n - 1, parameters["gap"]), velocity


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, curves and remarks of the run (there is one)."""
    return measured(read(replicas[0]))


def measured(run: LogRun) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """The same from a run that was read."""
    p = run.parameters
    mass, stiffness, gaps, velocity = row(p)
    motion = chain_motion(mass, stiffness, gaps, velocity, run.times)
    # The frames are too far apart to see the peak: 1000 points in a period of the highest frequency are off by 5e-6.
    fine = np.linspace(0.0, run.times[-1], math.ceil(run.times[-1] * 2000.0 * math.sqrt(stiffness.max() / mass.min()) / math.tau) + 1)
    peak = float(chain_motion(mass, stiffness, gaps, velocity, fine).forces.max())
    lag = (2.0 * p["theta"] - 1.0) * run.time_step
    due, with_loss = motion.velocities[-1], chain_with_loss(mass, stiffness, gaps, velocity, run.times[-1], lag)
    speed, turn = p["velocity"], 2.0 * math.sqrt(stiffness.max() / mass.min()) * run.time_step
    final = run.velocities[-1, :, 0]
    # What the phases of all the beginnings and ends within a step add up to.
    phase = len(gaps) * turn**2 * speed
    found = [
        Quantity(
            f"velocity_{log + 1}_after",
            f"velocity of log {log + 1} after",
            "m/s",
            exact(final[log]),
            reference=exact(due[log]),
            tolerance=1.25 * abs(with_loss[log] - due[log]) + phase,
            absolute=True,
            agreement=SAME * speed,
            source="exact motion of the row, piecewise linear",
            detail=f"the scheme's loss at its step is expected to change it by {with_loss[log] - due[log]:+.2e} m/s",
        )
        for log in range(len(mass))
    ]
    found += [
        Quantity(
            "scheme_deviation",
            "largest deviation from the row with the scheme's own loss, over v₀",
            "1",
            exact(np.abs(final - with_loss).max() / speed),
            reference=exact(0.0),
            tolerance=phase / speed,
            absolute=True,
            agreement=SAME,
            source="row with N = k (d + (2θ−1) τ d′)",
            detail="second order in τ; the bound is (ωτ)² for each contact, ω the row's highest frequency",
        ),
        Quantity(
            "peak_force",
            "largest contact force",
            "N",
            exact(run.history["highest_force"][-1]),
            reference=exact(peak),
            tolerance=0.25 * math.pi * turn,
            agreement=SAME * peak,
            source="exact motion of the row, piecewise linear",
            detail="what the scheme may lose of it is π/4 ωτ, ω the row's highest frequency",
        ),
        Quantity(
            "energy_kept",
            "kinetic energy after over before",
            "1",
            exact(run.kinetic[-1] / run.kinetic[0]),
            reference=exact(0.5 * mass @ with_loss**2 / run.kinetic[0]),
            tolerance=len(gaps) * turn**2,
            absolute=True,
            agreement=SAME,
            source="row with N = k (d + (2θ−1) τ d′)",
            detail="exact motion: 1",
        ),
        kept("momentum_error", "largest change of the momentum over Σ m|v|", run.momentum_error(), "over all frames"),
        *solver_quantities(run),
    ]
    return found, _curves(run, motion), _remarks(run, motion)


def _curves(run: LogRun, motion: ChainMotion) -> list[dict[str, Any]]:
    n = len(run.masses)
    logs = np.unique(np.linspace(0, n - 1, min(n, SHOWN)).round().astype(int))
    curves = [
        over_time(
            f"velocity_{log + 1}",
            f"Velocity of log {log + 1}",
            "v (m/s)",
            run.times,
            run.velocities[:, log, 0],
            reference=motion.velocities[:, log],
            label="exact",
        )
        for log in logs
    ]
    forces = contact_forces(run)
    for contact in sorted({0, n - 2}):
        curves.append(
            over_time(
                f"force_{contact + 1}",
                f"Force of logs {contact + 1} and {contact + 2}",
                "N (kN)",
                run.times,
                forces[:, contact] / 1e3,
                reference=motion.forces[:, contact] / 1e3,
                label="exact",
            )
        )
    return curves + energy_curves(run, 0.5 * (motion.forces**2).sum(axis=1) / (0.5 * run.parameters["stiffness"]))


def contact_forces(run: LogRun) -> Array:
    """Normal forces (frames, n - 1) in N of neighbours."""
    forces = np.zeros((len(run.touches), len(run.masses) - 1))
    for frame, touch in enumerate(run.touches):
        forces[frame, touch.ids.min(axis=1) - 1] = touch.forces
    return forces


def _remarks(run: LogRun, motion: ChainMotion) -> list[str]:
    shares = ", ".join(f"{value:.4f}" for value in motion.velocities[-1] / run.parameters["velocity"])
    return [
        f"Exact velocities after, over that of the first log: {shares} ({motion.events} contacts close or open on the way). All act "
        "at the same time; a row of separate pairs would hand on the whole speed.",
        f"{KOLESNIKOV.short}: {KOLESNIKOV.statement}",
    ]


def picture(parameters: Mapping[str, Any]) -> dict[str, Any] | None:
    """A row of equal logs is no picture."""
    del parameters
    return None
