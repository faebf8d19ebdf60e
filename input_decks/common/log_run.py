"""Runs of logs, where nothing is random: a run as arrays, what it must keep, and its curves over time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.postproc import DumpError
from dembark.postproc.dumps import TextDump
from dembark.postproc.measurement import Value, exact, number, profile
from dembark.postproc.replica import Array, Replica, cached_per_replica

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


@cached_per_replica
def read(replica: Replica) -> LogRun:
    """The complete run as arrays; DumpError when files do not fit together."""
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


def unended(values: Mapping[str, Value], names: Sequence[str]) -> dict[str, Value]:
    """The `values` of a run that ends before its impacts do: those of `names` are not known, and the peak force is the largest so far."""
    reason = "the run ends before the last impact does: take a longer duration"

    def unknown(name: str, one: Value) -> Value:
        return replace(one, estimate=one.estimate if name == "peak_force" else exact(math.nan), bound=None, reason=reason)

    return {name: unknown(name, one) if name in names else one for name, one in values.items()}


def solver_values(run: LogRun) -> dict[str, Value]:
    """How well the complementarity problems of all steps were solved, and with how many pivots."""
    rows = run.history
    detail = f"largest at the frames: {rows['pivots'].max():.0f}, of {rows['contacts'].max():.0f} possible contacts"
    return {
        "certificate": number(rows["worst_certificate"][-1], 0.0),
        "pivots_per_step": number(rows["pivots_total"][-1] / float(rows["step"][-1]), detail=detail),
    }


def over_time(name: str, title: str, across: str, times: Array, values: Array, reference: Array | None = None, *, label: str = "exact",
              note: str = "", seconds: bool = False) -> dict[str, Any]:
    """A curve over time in ms, or in `seconds`, of some hundred of the frames, with a `reference` and its `label`."""
    few = slice(None, None, max(1, len(times) // POINTS))
    place, along = (times, "time (s)") if seconds else (1e3 * times, "time (ms)")
    return profile(name, title, along, across, place[few], [values[few]], reference=None if reference is None else reference[few],
                   reference_label="" if reference is None else label, note=note)


def energy_curves(run: LogRun, due: Array) -> list[dict[str, Any]]:
    """Elastic energy and that of the exact motion, `due` (frames,) in J, and what was lost; over the energy at the beginning."""
    start = run.kinetic[0]
    elastic, lost = (np.concatenate([[0.0], run.history[name]]) / start for name in ("elastic_energy", "dissipated_energy"))
    return [
        over_time("elastic", "Elastic energy", "E / E₀", run.times, elastic, due / start),
        over_time("lost", "Energy dissipated", "1000 E / E₀", run.times, 1e3 * lost, np.zeros(len(run.times))),
    ]
