"""A fluid of particles in the plane, compared with water."""

from __future__ import annotations

from collections.abc import Callable, Mapping

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
