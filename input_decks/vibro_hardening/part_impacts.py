"""Impacts on a clamped part, from a record of all grains that touch it every few steps: how often, how hard, and what friction does. The
record touches.dump has frames `stride` steps apart, with the grains that the part pushes in that step. An impact begins in a frame whose
predecessor does not have the grain, and ends with the last frame that does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dembark.postproc import GrainsDump
from dembark.postproc.measurement import Array, Curve, Estimate, profile
from dembark.postproc.statistics import block_mean

if TYPE_CHECKING:
    from pathlib import Path

    from dembark.physics import WallMotion


def nearest(corners: Array, places: Array) -> Array:
    """Points (n, 2) of the closed polygon `corners` (k, 2) in m that are nearest to `places` (n, 2)."""
    sides = np.roll(corners, -1, axis=0) - corners
    along = np.einsum("nka,ka->nk", places[:, None] - corners, sides) / (sides**2).sum(axis=1)
    points = corners + np.clip(along, 0.0, 1.0)[..., None] * sides
    return np.asarray(points[np.arange(len(places)), np.argmin(((points - places[:, None]) ** 2).sum(axis=2), axis=1)])


@dataclass(frozen=True)
class ContactRecord:
    """All (n,) samples of grains on the part: `steps`, `ids`, `masses` (kg), `closing` (m/s): speed towards the part along its normal,
    `forces` (n, 3) of the part on the grain (N), `rubbing` (W): friction times slip; of a window of `periods` periods of `period` s after
    the step `first`, sampled every `stride` steps of `time_step` s; `area` of the part (m2)."""

    steps: NDArray[np.int64]
    ids: NDArray[np.int64]
    masses: Array
    closing: Array
    forces: Array
    rubbing: Array
    stride: int
    time_step: float
    first: int
    periods: int
    period: float
    area: float

    @property
    def begins(self) -> NDArray[np.bool_]:
        """Samples (n,) in which an impact begins: the grain was not on the part one frame before, and came from outside."""
        order = np.lexsort((self.steps, self.ids))
        same = (np.diff(self.ids[order]) == 0) & (np.diff(self.steps[order]) == self.stride)
        begins = np.ones(len(order), bool)
        begins[order[1:]] = ~same
        return begins & (self.closing > 0.0) & (self.steps > self.first)

    def _by_period(self, values: Array, chosen: NDArray[np.bool_]) -> Array:
        number = ((self.steps[chosen] - self.first - 1) * self.time_step / self.period).astype(int)
        return np.bincount(np.clip(number, 0, self.periods - 1), values[chosen], self.periods).astype(float)

    def rate(self) -> Estimate:
        """Impacts per second."""
        return block_mean(self._by_period(np.ones(len(self.steps)), self.begins) / self.period)

    def energies(self) -> Array:
        """Energies (impacts,) in J of the normal motion, m v^2 / 2: the part is far heavier than a grain."""
        chosen = self.begins
        return np.asarray(0.5 * self.masses[chosen] * self.closing[chosen] ** 2)

    def energy(self) -> Estimate:
        """Mean energy of an impact (J), with the interval of the ratio of both sums over periods."""
        chosen = self.begins
        sums = self._by_period(0.5 * self.masses * self.closing**2, chosen)
        counts = self._by_period(np.ones(len(self.steps)), chosen)
        mean = float(sums.sum() / counts.sum())
        # Linear in what each period adds: the residuals about the mean have the ratio's error.
        rest = block_mean(sums - mean * counts)
        return Estimate(mean, rest.half / float(counts.mean()), rest.basis)

    def friction(self) -> Estimate:
        """Power of friction on the part over its area (W/m2)."""
        every = np.ones(len(self.steps), bool)
        return block_mean(self._by_period(self.rubbing, every) * self.stride * self.time_step / self.period / self.area)

    def impulse(self) -> Array:
        """Impulse (3,) in N s of the part on the grains in the window."""
        inside = self.steps > self.first
        return np.asarray(self.forces[inside].sum(axis=0) * self.stride * self.time_step)


def read_record(path: Path, motion: WallMotion, corners: Array, *, stride: int, time_step: float, first: int, periods: int, period: float,
                 depth: float) -> ContactRecord:
    """The record `path` of a part whose cross-section in the plane of x and z has the `corners` (k, 2) at rest (m), is `depth` (m) wide
    and moves as `motion`; the window begins with step `first`."""
    dump = GrainsDump(path)
    # In most frames nothing touches the part: these need not be read.
    frames = [dump[int(number)] for number in np.flatnonzero(dump.counts)]
    steps = np.concatenate([np.full(len(frame.ids), frame.step) for frame in frames] or [np.empty(0, np.int64)]).astype(np.int64)

    def column(name: str) -> Array:
        return np.concatenate([getattr(frame, name) for frame in frames])

    forces, places = np.concatenate([frame.wall_forces["vessel"] for frame in frames]), column("positions")
    shift, speed = motion.displacement(steps * time_step), motion.velocity(steps * time_step)
    here = places[:, [0, 2]] - shift[:, [0, 2]]
    away = here - nearest(corners, here)
    length = np.linalg.norm(away, axis=1, keepdims=True)
    normal = np.zeros_like(places)
    normal[:, [0, 2]] = away / length
    own = column("velocities") - speed
    surface = own + np.cross(column("omegas"), -length * normal)
    push = np.einsum("na,na->n", forces, normal)
    slip = surface - np.einsum("na,na->n", surface, normal)[:, None] * normal
    rubbing = -np.einsum("na,na->n", forces - push[:, None] * normal, slip)
    around = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).sum())
    return ContactRecord(steps, column("ids").astype(np.int64), column("masses"), -np.einsum("na,na->n", own, normal), forces, rubbing,
                         stride, time_step, first, periods, period, around * depth)


def histogram(runs: list[ContactRecord], unit: float) -> Curve:
    """Curve of the impacts per second over the logarithm of their energy in units of `unit` (J)."""
    edges = np.linspace(-4.0, 2.0, 25)
    found = [np.histogram(np.log10(one.energies() / unit), bins=edges)[0] / (one.periods * one.period) for one in runs]
    return profile("impacts", "Impacts on the part", "log₁₀ of the energy / (m V² / 2)", "impacts per second and bin",
                   0.5 * (edges[1:] + edges[:-1]), found)
