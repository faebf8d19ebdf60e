"""Runs of logs, where nothing is random: a run as arrays, what it must keep, and its curves over time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.postproc import DumpError
from dembark.postproc.dumptext import TextDump
from dembark.postproc.measurement import Value, number
from dembark.postproc.replica import Array, Replica, once
from dembark.postproc.resampling import profile
from dembark.postproc.statistics import CONFIDENCE, Estimate, student

# Points of a curve, twice as many at most.
POINTS = 100
_CONTACT_COLUMNS = 13


@dataclass(frozen=True)
class TouchFrame:
    """The m contacts with a force at one step: `ids` (m, 2), the second < 0 for a wall; `normals` (m, 3), the direction of the force on
    the first; `gaps` (m,) in m; `forces` (m,) along the normal and `friction` (m, 3) on the first, in N; `places` (m, 3) in m."""

    step: int
    ids: NDArray[np.int64]
    normals: Array
    gaps: Array
    forces: Array
    friction: Array
    places: Array


@dataclass(frozen=True)
class LogRun:
    """A run: `times` (frames,) in s; `positions`, `velocities`, `spins`, `forces` (frames, n, 3) in SI units; `masses`, `radii` (n,);
    `history`, the columns of time.csv, its rows belonging to all frames but the first; `impacts` as in `Replica.impacts`; `touches`."""

    parameters: Mapping[str, Any]
    time_step: float
    times: Array
    positions: Array
    velocities: Array
    spins: Array
    forces: Array
    masses: Array
    radii: Array
    history: Mapping[str, Array]
    impacts: Array
    touches: Sequence[TouchFrame]

    @property
    def kinetic(self) -> Array:
        """Kinetic energy (frames,) in J, with that of the spin of solid cylinders, I = m r^2 / 2."""
        return 0.5 * ((self.velocities**2).sum(axis=2) @ self.masses + (self.spins**2).sum(axis=2) @ (0.5 * self.masses * self.radii**2))

    def momentum_error(self) -> float:
        """Largest change of the momentum (vector) over the sum of all m |v| at the beginning."""
        momentum = np.einsum("tni,n->ti", self.velocities, self.masses)
        scale = float(np.linalg.norm(self.velocities[0], axis=1) @ self.masses)
        return float(np.linalg.norm(momentum - momentum[0], axis=1).max()) / scale

    def angular_momentum_error(self) -> float:
        """Largest change of the angular momentum about z over the sum of all m |x| |v| at the beginning."""
        x, v = self.positions, self.velocities
        orbit = (x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0]) @ self.masses
        total = orbit + self.spins[..., 2] @ (0.5 * self.masses * self.radii**2)
        scale = float((np.linalg.norm(x[0], axis=1) * np.linalg.norm(v[0], axis=1)) @ self.masses)
        return float(np.abs(total - total[0]).max()) / scale

    def neighbour_forces(self) -> Array:
        """Normal forces (frames, n - 1) in N of logs in a row, each with the next."""
        forces = np.zeros((len(self.touches), len(self.masses) - 1))
        for frame, touch in enumerate(self.touches):
            forces[frame, touch.ids.min(axis=1) - 1] = touch.forces
        return forces


def read_touches(path: Path) -> list[TouchFrame]:
    """Frames of a `contacts.dump` of logs; DumpError unless each line has the 13 columns id_a id_b nx ny nz gap N tx ty tz x y z."""
    frames = []
    for raw in TextDump(path):
        v = raw.values
        if len(raw.columns) != _CONTACT_COLUMNS:
            raise DumpError(f"{path}: has {len(raw.columns)} columns instead of {_CONTACT_COLUMNS}")
        frames.append(TouchFrame(raw.step, v[:, :2].astype(np.int64), v[:, 2:5], v[:, 5], v[:, 6], v[:, 7:10], v[:, 10:13]))
    return frames


@once
def read(replica: Replica) -> LogRun:
    """The whole run as arrays; DumpError when files do not fit together."""
    frames, history = list(replica.grains()), replica.times()
    first, steps = frames[0], np.array([frame.step for frame in frames])
    if not np.array_equal(steps[1:], history["step"]):
        raise DumpError(f"{replica.folder}: the rows of time.csv are not those of the frames of grains.dump")
    touches = read_touches(replica.folder / "contacts.dump")
    if [touch.step for touch in touches] != steps.tolist():
        raise DumpError(f"{replica.folder}: grains.dump and contacts.dump hold different steps")
    places, velocities, spins, forces = (np.array([getattr(frame, name) for frame in frames])
                                         for name in ("positions", "velocities", "omegas", "forces"))
    return LogRun(replica.parameters, replica.time_step, steps * replica.time_step, places, velocities, spins, forces, first.masses,
                  first.radii, history, replica.impacts(), touches)


def solver_values(run: LogRun) -> dict[str, Value]:
    """How well the complementarity problems of all steps were solved, and with how many pivots."""
    rows = run.history
    told = f"largest at the frames: {rows['pivots'].max():.0f}, of {rows['contacts'].max():.0f} possible contacts"
    return {
        "certificate": number(rows["worst_certificate"][-1], 0.0),
        "pivots_per_step": number(rows["pivots_total"][-1] / float(rows["step"][-1]), detail=told),
    }


@dataclass(frozen=True)
class Loads:
    """What contacts carry in all frames, in N, along x and y.

    `walls` (frames, walls, 2): force of each wall on the logs; `net` (frames, n, 2): sum of the contact forces on each log; `contacts`
    (frames,): how many carry; `mobilised` (frames,): mean of |T| / N, NaN without contacts.
    """

    walls: Array
    net: Array
    contacts: Array
    mobilised: Array


def loads(run: LogRun, walls: Sequence[int]) -> Loads:
    """Sums over the contacts of each frame; `walls`: the ids of those to tell apart."""
    frames, logs = run.positions.shape[:2]
    on_walls, net, mobilised = np.zeros((frames, len(walls), 2)), np.zeros((frames, logs, 2)), np.full(frames, np.nan)
    for frame, touch in enumerate(run.touches):
        on_first = (touch.normals * touch.forces[:, None] + touch.friction)[:, :2]
        first, second = touch.ids.T
        np.add.at(net[frame], first - 1, on_first)
        pair = second > 0
        np.add.at(net[frame], second[pair] - 1, -on_first[pair])
        on_walls[frame] = [on_first[second == wall].sum(axis=0) for wall in walls]
        if len(touch.forces):
            mobilised[frame] = float(np.mean(np.linalg.norm(touch.friction, axis=1) / touch.forces))
    return Loads(on_walls, net, np.array([len(touch.forces) for touch in run.touches], float), mobilised)


def beginning(run: LogRun, count: int) -> tuple[int, NDArray[np.int64], Array]:
    """(frame, logs, impacts): the last frame before impact `count` + 1 begins, the logs of the first `count` impacts, and these by time."""
    order = run.impacts[np.lexsort((run.impacts[:, 1], run.impacts[:, 0], run.impacts[:, 2]))]
    until = order[count, 2] if len(order) > count else run.times[-1] + 0.5 * run.time_step
    frame = int(np.flatnonzero(run.times < until - 0.5 * run.time_step)[-1])
    ids = np.unique(order[:count, :2].astype(np.int64))
    return frame, ids[ids > 0] - 1, order[:count]


def impact_values(run: LogRun) -> dict[str, Value]:
    """How many impacts there were, the geometric mean of their peak forces and the median of their impulses, with the intervals of as many
    independent ones; nothing of fewer than two."""
    count, z = len(run.impacts), student(1e9, CONFIDENCE)
    if count < 2:
        return {}
    basis, peak, impulse = f"{count} impacts as independent ones", np.log(run.impacts[:, 4]), np.sort(run.impacts[:, 5])
    middle, mean, reach = float(np.median(impulse)), float(np.exp(peak.mean())), 0.5 * z * math.sqrt(count)
    # The interval of a median is that of its order statistics.
    low, high = impulse[max(0, math.floor(0.5 * count - reach))], impulse[min(count - 1, math.ceil(0.5 * count + reach))]
    return {
        "impact_count": Value(Estimate(float(count), z * math.sqrt(count), "counting statistics")),
        "impact_peak": Value(Estimate(mean, float(mean * z * peak.std() / math.sqrt(count)), basis)),
        "impact_impulse": Value(Estimate(middle, float(max(high - middle, middle - low)), basis)),
    }


def over_time(name: str, title: str, across: str, times: Array, values: Array, reference: Array | None = None, *, label: str = "exact",
              note: str = "", seconds: bool = False) -> dict[str, Any]:
    """A curve over time in ms, or in `seconds`, of some hundred of the frames, beside a `reference` with its `label`."""
    few = slice(None, None, max(1, len(times) // POINTS))
    place, along = (times, "time (s)") if seconds else (1e3 * times, "time (ms)")
    return profile(name, title, along, across, place[few], [values[few]], reference=None if reference is None else reference[few],
                   reference_label="" if reference is None else label, note=note)


def energy_curves(run: LogRun, due: Array) -> list[dict[str, Any]]:
    """Elastic energy beside that of the exact motion, `due` (frames,) in J, and what was lost; over the energy at the beginning."""
    start = run.kinetic[0]
    elastic, lost = (np.concatenate([[0.0], run.history[name]]) / start for name in ("elastic_energy", "dissipated_energy"))
    return [
        over_time("elastic", "Elastic energy", "E / E₀", run.times, elastic, due / start),
        over_time("lost", "Energy lost", "1000 E / E₀", run.times, 1e3 * lost, np.zeros(len(run.times))),
    ]
