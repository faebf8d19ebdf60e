"""Doses of impacts: how many, how hard and with how much friction, on each log and in each sector of its circumference, over time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..dumps import DumpError
from ..impacts import Impacts
from .laws import ForceRange

Array = NDArray[np.float64]

_CHUNK = 1 << 20  # impacts at a time, so that memory does not grow with a file that is mapped
_FLAT = 1e-6  # largest component of normals along the axis of the logs
_NORMALS = ("nx", "ny", "nz")


@dataclass(frozen=True)
class Logs:
    """The n logs of a load by their ascending `ids`; `radii` (m), `masses` (kg), `length` (m; NaN: unknown)."""

    ids: NDArray[np.int64]
    radii: Array
    masses: Array
    length: float = math.nan

    @property
    def circumferences(self) -> Array:
        """2 pi r (n,) in m."""
        return np.asarray(2.0 * math.pi * self.radii)

    @property
    def surface(self) -> float:
        """Of all logs in m2, without their ends; NaN where the length is unknown."""
        return float(self.circumferences.sum()) * self.length

    def numbers(self, ids: Array) -> NDArray[np.int64]:
        """Places of `ids` among the logs; DumpError where one is none of them."""
        places = np.minimum(np.searchsorted(self.ids, ids), len(self.ids) - 1)
        wrong = self.ids[places] != ids
        if wrong.any():
            raise DumpError(f"an impact is that of log {int(ids[wrong][0])}, which is not among the {len(self.ids)} logs")
        return np.asarray(places)


@dataclass(frozen=True)
class Doses:
    """What the logs got in the spans of time between `edges` (t + 1,) in s. Counts and energies are (t, n, m): span, log, sector.

    useful : impacts with a peak force in the range    damaging : those above it
    friction : J lost by friction, in slow contacts too; half of it for each of two logs, all of it for a log on a wall
    excess : J stored in the log beyond what it stores at the force that damages wood, (F^2 - F_wood^2) / 2s; NaN without a stiffness
    peaks : N, of all impacts of the window; shape : their peak over that of a half sine of the same impulse and duration
    """

    edges: Array
    useful: Array
    damaging: Array
    friction: Array
    excess: Array
    peaks: Array
    shape: Array

    @property
    def effective(self) -> Array:
        """Impacts (t, n, m) that remove bark: those in the range, and those above it."""
        return self.useful + self.damaging


def plane_of(impacts: Impacts) -> tuple[int, int]:
    """The axes across and up (0 to 2, right-handed about the axis of the logs) of the plane that the logs move in; DumpError where normals
    leave every plane of two axes."""
    flat = [all(np.abs(impacts[name][start : start + _CHUNK]).max(initial=0.0) < _FLAT for start in range(0, len(impacts), _CHUNK))
            for name in _NORMALS]
    # A single column of logs lies in two planes; z, then y is the axis that decks have.
    for axis in (2, 1, 0):
        if flat[axis]:
            return (axis + 1) % 3, (axis + 2) % 3
    raise DumpError("the normals of the impacts do not lie in a plane of two axes; sectors and cleared widths are those of logs in "
                    "cross-section: take one sector, and a law by energy")


def doses(impacts: Impacts, logs: Logs, forces: ForceRange, edges: Array, *, sectors: int = 12, least_speed: float = 0.0,
          stiffness: float = math.nan) -> Doses:
    """Doses of `impacts` that began in the spans between `edges` (s, ascending); slower ones than `least_speed` (m/s) count for friction
    only. `stiffness` (N/m): of the logs' surface. The angle in a log's own frame is that of the contact less the log's rotation; with one
    sector it does not count, so logs may turn in space."""
    spans, count = len(edges) - 1, len(logs.ids)
    across, up = plane_of(impacts) if sectors > 1 else (0, 1)
    tables = {name: np.zeros(spans * count * sectors) for name in ("useful", "damaging", "friction", "excess")}
    peaks, shape = [np.zeros(0)], [np.zeros(0)]
    for start in range(0, len(impacts), _CHUNK):
        part = np.ascontiguousarray(impacts[start : start + _CHUNK])
        if len(wrong := np.flatnonzero(~np.isfinite(part.view(np.float64).reshape(len(part), -1)).all(axis=1))):
            # It would be neither below nor above any limit.
            raise DumpError(f"impact {start + wrong[0] + 1} holds a number that is not finite")
        part = part[(part["time"] >= edges[0]) & (part["time"] < edges[-1])]
        fast = part[part["relative_speed"] >= least_speed]
        peaks.append(fast["peak_force"])
        shape.append(fast["peak_force"] * fast["duration"] / (0.5 * math.pi * fast["impulse"]))
        for end, sense in (("a", -1.0), ("b", 1.0)):
            mine = part[part[f"id_{end}"] >= 0.0]
            normal = [sense * mine[_NORMALS[axis]] for axis in (up, across)]
            angle = (np.arctan2(*normal) - mine[f"turn_{end}"]) % (2.0 * math.pi)
            sector = np.minimum((angle * (sectors / (2.0 * math.pi))).astype(np.int64), sectors - 1)
            span = np.searchsorted(edges, mine["time"], "right") - 1
            place = (span * count + logs.numbers(mine[f"id_{end}"])) * sectors + sector
            force, hit = mine["peak_force"], mine["relative_speed"] >= least_speed
            weights = {"useful": hit & (force >= forces.bark) & (force <= forces.wood), "damaging": hit & (force > forces.wood),
                       "friction": mine["friction_loss"] * np.where(mine["id_b"] < 0.0, 1.0, 0.5),
                       "excess": hit * np.maximum(force**2 - forces.wood**2, 0.0) / (2.0 * stiffness)}
            for name, weight in weights.items():
                tables[name] += np.bincount(place, weight, len(tables[name]))
    found = {name: table.reshape(spans, count, sectors) for name, table in tables.items()}
    return Doses(np.asarray(edges, float), peaks=np.concatenate(peaks), shape=np.concatenate(shape), **found)
