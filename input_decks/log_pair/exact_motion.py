"""Logs and their exact motion: one impact of two logs, or of a log and a wall, and a row of logs."""

from __future__ import annotations

import numpy as np

from dembark.input_decks.common.log_run import LogRun, energy_curves, over_time
from dembark.physics.exact.chains import Chain, ChainMotion
from dembark.physics.exact.pairs import Pair, PairMotion
from dembark.postproc.measurement import Array, Curve, Numbers, Value, number
from dembark.postproc.studies import quantity

# Curves are drawn of so many logs at most.
SHOWN = 5


def restitution(velocities: Array, motion: PairMotion) -> float:
    """Speed of parting in the last frame over that of approach in the first, along the line of centres at touch; `velocities` (frames,
    bodies, 2) in m/s."""
    along = velocities @ motion.normal
    apart = (along[:, 1] if along.shape[1] > 1 else 0.0) - along[:, 0]
    return float(-apart[-1] / apart[0])


def velocities(run: LogRun, bodies: Pair, motion: PairMotion, error: float) -> dict[str, Value]:
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


def pair_curves(run: LogRun, bodies: Pair, motion: PairMotion) -> list[Curve]:
    """Force, velocities along the line of centres and energies over time, with the exact motion."""
    along, due = run.velocities[:, :, :2] @ motion.normal, motion.velocities @ motion.normal
    force = np.linalg.norm(run.forces[:, 0], axis=1)
    return [
        over_time("force", "Contact force", "N (kN)", run.times, force / 1e3, motion.force / 1e3),
        *(over_time(f"velocity_{body + 1}", f"Velocity of log {body + 1}", "v (m/s)", run.times, along[:, body], due[:, body],
                    note="along the line of centres at touch") for body in range(along.shape[1])),
        *energy_curves(run, 0.5 * motion.force**2 / bodies.stiffness),
    ]


def row_curves(run: LogRun, chain: Chain, motion: ChainMotion) -> list[Curve]:
    """Velocities of some logs, forces at both ends of the row and energies over time, with the exact motion."""
    n, along, forces, due = len(run.masses), run.velocities[:, :, 0], run.neighbour_forces() / 1e3, motion.forces / 1e3
    return [
        *(over_time(f"velocity_{log + 1}", f"Velocity of log {log + 1}", "v (m/s)", run.times, along[:, log], motion.velocities[:, log])
          for log in np.unique(np.linspace(0, n - 1, min(n, SHOWN)).round().astype(int))),
        *(over_time(f"force_{one + 1}", f"Force of logs {one + 1} and {one + 2}", "N (kN)", run.times, forces[:, one], due[:, one])
          for one in sorted({0, n - 2})),
        *energy_curves(run, 0.5 * (motion.forces**2 / chain.stiffness).sum(axis=1)),
    ]


def error(point: Numbers, name: str) -> float:
    """Relative error of the quantity `name` of a result, or its absolute value where the reference is 0."""
    one = quantity(point, name)
    return abs(one["value"] / one["reference"] - 1.0) if one["reference"] else abs(one["value"])
