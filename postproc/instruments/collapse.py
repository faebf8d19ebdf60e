"""A collapsed column as a run wrote it: energies row by row, deposit, and how well the energies fit together.

Energies in J; works are positive when they make grains faster.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dembark.postproc import DumpError, GrainFrame
from dembark.postproc.instruments import momentum
from dembark.postproc.instruments.heaps import height, surface
from dembark.postproc.measurement import Array, Replica, profile

PARTS = ("normal_elastic", "normal_viscous", "tangential_elastic", "tangential_viscous", "capillary", "liquid_viscous")
DISSIPATING = ("normal_viscous", "tangential_viscous", "liquid_viscous")
# Share of the mass behind the front: single grains roll on after the others have come to rest.
FRONT = 0.98


@dataclass(frozen=True)
class Collapse:
    """One run: `rows`, the columns of time.csv; `opening`, the row in which the gate begins to move; `first`, `last`: grains then and at
    the end; W and d in m. Shares are those of `fallen`, the potential energy lost since the opening in the last row."""

    rows: Mapping[str, Array]
    opening: int
    first: GrainFrame
    last: GrainFrame
    width: float
    diameter: float

    def gained(self, name: str) -> Array:
        """Change of a column since the opening."""
        return self.rows[name][self.opening :] - self.rows[name][self.opening]

    @property
    def fallen(self) -> float:
        """J."""
        return float(-self.gained("potential_energy")[-1])

    def lost_in(self, name: str) -> Array:
        """Share that this way has taken since the opening."""
        takers = {"friction": {"tangential_elastic": -1, "tangential_stored": -1}, "held": {"normal_stored": 1, "tangential_stored": 1},
                  "kinetic": {"kinetic_energy": 1}, "gate": {"walls": -1}, "potential": {"potential_energy": -1}}
        return np.sum([sign * self.gained(column) for column, sign in takers.get(name, {name: -1}).items()], axis=0) / self.fallen

    def imbalance(self) -> float:
        """Largest difference between kinetic energy and the works of known forces, over the energy turned over so far.

        What the account found besides, `other` and `imposed`, counts as unexplained: this case has neither.
        """
        return momentum.imbalance(self.rows, PARTS)

    def potential_error(self, column: str = "potential_energy") -> float:
        """Largest difference between gravity's work since the first row and the potential energy lost, over the largest such work."""
        work, energy = self.rows["gravity"] - self.rows["gravity"][0], self.rows[column]
        return float(np.abs(work + energy - energy[0]).max() / np.abs(work).max())

    def given_back(self) -> float:
        """Largest energy that a dissipating part gave from one row to the next, over the energy turned over; 0 when none ever did."""
        return float(max(np.diff(self.rows[name], prepend=0.0).max() for name in DISSIPATING) / self.rows["scale"][-1])

    def step_error(self) -> float:
        """Share that the step added to or took from the normal springs, the largest since the opening."""
        return float(np.abs(self.gained("step_error")).max() / self.fallen)

    def height(self) -> float:
        """m, of the column: twice that of its centre of mass."""
        return height(self.first)

    def front(self) -> float:
        """m, behind which a share FRONT of the mass lies at the end."""
        order = np.argsort(self.last.positions[:, 0])
        behind = np.cumsum(self.last.masses[order]) / self.last.masses.sum()
        return float(self.last.positions[order[np.searchsorted(behind, FRONT)], 0])

    def centre(self) -> Array:
        """Centre of mass (3,) of the deposit in m."""
        return np.average(self.last.positions, axis=0, weights=self.last.masses)

    def height_at_wall(self) -> float:
        """m, of the deposit: the highest grain within 2 d of the back wall."""
        return float(surface(self.last, np.array([0.0, 2.0 * self.diameter]))[0])


def read(replica: Replica) -> Collapse:
    """What was written; DumpError when the first frame has no row in time.csv."""
    frames, rows = replica.grains(), replica.times()
    opening = np.flatnonzero(rows["step"] == frames[0].step)
    if len(opening) != 1 or opening[0] + 1 >= len(rows["step"]):
        raise DumpError(f"{replica.folder}: time.csv has no row at step {frames[0].step}, the first of grains.dump, or none after it")
    p = replica.parameters
    return Collapse(rows, int(opening[0]), frames[0], frames[len(frames) - 1], p["column_width"], p["grain_diameter"])


def shares(runs: Sequence[Collapse], ways: Mapping[str, str]) -> list[dict[str, Any]]:
    """Curves over time of the shares that `ways` have taken, by name with a title."""
    times = [one.gained("time") for one in runs]
    place = np.linspace(0.0, times[0][-1], 101)
    return [profile(name, title, "time since the gate moves (s)", "fraction of the potential energy lost", place,
                    [np.interp(place, time, one.lost_in(name)) for time, one in zip(times, runs, strict=True)])
            for name, title in ways.items()]


def deposits(runs: Sequence[Collapse]) -> dict[str, Any]:
    """Curve of the deposit's surface beside that of the column."""
    width, edges = runs[0].width, np.arange(0.0, 5.0 * runs[0].width, runs[0].diameter)
    before = np.mean([surface(one.first, edges) for one in runs], axis=0) / width
    return profile("deposit", "Deposit", "x / W", "height / W", 0.5 * (edges[1:] + edges[:-1]) / width,
                   [surface(one.last, edges) / width for one in runs], reference=before, reference_label="when the gate opens")
