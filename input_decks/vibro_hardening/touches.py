"""Grains on a part that is clamped or at rest: the record touches.dump has those that the part pushes, with its force on each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dembark.input_decks.common.part_impacts import ContactRecord, surface_area
from dembark.postproc import GrainsDump
from dembark.postproc.measurement import Array, Estimate
from dembark.postproc.statistics import block_mean

if TYPE_CHECKING:
    from pathlib import Path

    from dembark.physics import WallMotion
    from dembark.postproc.walls import MeshWall


@dataclass(frozen=True)
class RubbedRecord(ContactRecord):
    """A record with friction: `rubbing` (n,) in W, friction times slip of the grain's surface."""

    rubbing: Array

    def friction(self) -> Estimate:
        """Power of friction on the part over its area (W/m2)."""
        every = np.ones(len(self.steps), bool)
        return block_mean(self._by_period(self.rubbing, every) * self.stride * self.time_step / self.period / self.area)


def read_record(path: Path, motion: WallMotion, part: MeshWall, *, stride: int, time_step: float, first: int, periods: int, period: float,
                depth: float) -> RubbedRecord:
    """The record `path` of a `part`, which is where it is at rest and moves as `motion`; the window begins with step `first`. The layer of
    grains is `depth` (m) wide, so much of the part counts in its area."""
    dump = GrainsDump(path)
    # In most frames nothing touches the part: these need not be read.
    frames = [dump[int(number)] for number in np.flatnonzero(dump.counts)]
    steps = np.concatenate([np.full(len(frame.ids), frame.step) for frame in frames] or [np.empty(0, np.int64)]).astype(np.int64)

    def column(name: str) -> Array:
        return np.concatenate([getattr(frame, name) for frame in frames])

    forces, places = np.concatenate([frame.wall_forces["vessel"] for frame in frames]), column("positions")
    shift, speed = motion.displacement(steps * time_step), motion.velocity(steps * time_step)
    here = places - shift
    points = part.places(here).points
    away = here - points
    length = np.linalg.norm(away, axis=1, keepdims=True)
    normal = away / length
    own = column("velocities") - speed

    def along(vectors: Array) -> Array:
        return np.asarray(vectors - np.einsum("na,na->n", vectors, normal)[:, None] * normal)

    surface = own + np.cross(column("omegas"), -length * normal)
    rubbing = -np.einsum("na,na->n", along(forces), along(surface))
    radii = column("radii")
    return RubbedRecord(steps, column("ids").astype(np.int64), column("masses"), radii, radii, -np.einsum("na,na->n", own, normal),
                        np.linalg.norm(along(own), axis=1), points, normal, forces, stride, time_step, first, periods, period,
                        surface_area(part, depth), rubbing)
