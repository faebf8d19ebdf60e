"""Runs of a fluid of particles: pressures, growth of energy, and what is outside of the walls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Array, Replica, Value, exact

STORED = ("kinetic_energy", "potential_energy", "compression_energy")


def pressure(frame: GrainFrame) -> Array:
    """Pa, of the particles (n,): the column `pressure` of the dump, or `p`."""
    return np.asarray(frame.extra["pressure" if "pressure" in frame.extra else "p"])


def growth(times: Mapping[str, Array]) -> float:
    """The largest rise (J) of the stored energies together above their lowest value before."""
    stored = np.sum([times[name] for name in STORED], axis=0)
    return float(np.max(stored - np.minimum.accumulate(stored)))


def common_values(run: Replica, energy: float, outside: Callable[[Array], Array] | None = None) -> dict[str, Value]:
    """What each run of a fluid between walls at rest is judged by: growth of energy over `energy` (J), and the most particles in a frame
    that are `outside` of the walls (of positions (n, 3); nothing: below a floor at y = 0 or left of a wall at x = 0), by half a spacing."""
    spacing = run.derived["spacing"] if "spacing" in run.derived else run.parameters["spacing"]

    def beyond(places: Array) -> Array:
        return np.asarray((places[:, :2] < -0.5 * spacing).any(axis=1))

    count = run.derived.get("grain_count", 0)
    lost = [int((outside or beyond)(frame.positions).sum()) + int(count - len(frame.ids)) for frame in run.grains()]
    return {"energy_growth": Value(exact(growth(run.times()) / energy), exact(0.0)), "leaked": Value(exact(float(max(lost))), exact(0.0))}


@dataclass(frozen=True)
class Tank:
    """Walls of the thickness `thick` (m) and a floor at z = 0 around a fluid in space: `back` (m) before x = 0, `front` (m) behind it,
    `half` (m) to either side of y = 0, and `top` (m) high. `spacing` (m) is that of the particles, `gravity` (m/s²) along -z."""

    back: float
    front: float
    half: float
    top: float
    thick: float
    spacing: float
    gravity: float

    def outside(self, places: Array, velocities: Array) -> tuple[Array, Array]:
        """Which particles (n,) are in walls or the floor, deeper than half a spacing, or beyond them, and which have gone over the walls:
        those that are above a wall, or were not lower than its top, back in free flight, at one of its faces. What bounces on the top was
        so at the outer one only."""
        x, y, z = places.T
        beyond = np.stack([y - self.half, -y - self.half, x - self.front, -x - self.back])
        speed = np.stack([velocities[:, 1], -velocities[:, 1], velocities[:, 0], -velocities[:, 0]])
        crossed = np.full(len(z), -np.inf)
        for face in (0.0, self.thick):
            flying = (beyond > face) & (speed > 0.0)
            since = np.max((beyond - face) / np.where(flying, speed, 1.0) * flying, axis=0)
            crossed = np.fmax(crossed, z - velocities[:, 2] * since - 0.5 * self.gravity * since**2)
        out = (beyond > 0.5 * self.spacing).any(axis=0)
        over = out & (crossed >= self.top)
        return np.asarray((out | (z < -0.5 * self.spacing)) & ~over), np.asarray(over)
