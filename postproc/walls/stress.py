"""Stress distribution on a wall over time: means, fluctuations, intervals, peaks, and the forces of single contacts.

All forces are those of the wall on the grains; the load on the wall is their negative. Normal stress is positive in compression.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError

from ..contacts import ContactFrame
from ..dumps import DumpError
from ..grains import GrainFrame
from . import Inclusion, Places, Wall, into_box, touching
from .patches import Patches
from .peaks import Blocks, Histogram, PeakFinder

Array = NDArray[np.float64]

COMPONENTS = ("normal", "shear_1", "shear_2")


@dataclass(frozen=True, eq=False)
class WallStress:
    """Load of a wall with p patches over T frames; SI units.

    Time series: `steps`, `times` (T,) in s, `displacements` (T, 3) of the wall (of an inclusion: its centre) in m, `force` (T, 3) of the
    wall on the grains in N, `outside` (T, 3) its part that acts beyond all patches, `normal_force` (T,) the sum of the normal components.
    Patches, components normal, shear_1 and shear_2: `mean` stress (p, 3) in Pa, `deviation` (p, 3) its standard deviation in time, `half`
    (p, 3) half-width of the 95 % interval of the mean from `blocks` means over time (inf with fewer than 8), `mean_force` (p, 3) in N along
    x, y, z, `contacts` (p,) number of contacts counted in all frames, `series` (T, p, 3) in Pa when it was kept.
    Histograms: `peak_stress`, local maxima in time of the patches' normal stress (Pa); `contact_force`, normal forces of single contacts
    (N). Peaks of the complete wall: `peak_times` (s), `peak_forces` (N), local maxima of `normal_force`.
    `reach` (2,): smallest and largest distance of a contact point from its grain's centre over the grain's radius; about 1 when the
    wall is where the grains feel it.
    """

    wall: Wall | Inclusion
    patches: Patches
    steps: NDArray[np.int64]
    times: Array
    displacements: Array
    force: Array
    outside: Array
    normal_force: Array
    mean: Array
    deviation: Array
    half: Array
    blocks: int
    mean_force: Array
    contacts: NDArray[np.int64]
    series: Array | None
    peak_stress: Histogram
    contact_force: Histogram
    peak_times: Array
    peak_forces: Array
    reach: tuple[float, float]

    @property
    def shear(self) -> Array:
        """Magnitude (p,) of the mean shear stress, Pa."""
        return np.hypot(self.mean[:, 1], self.mean[:, 2])

    def on_grid(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (p, ...) of patches in the order of their coordinates, (a, b, ...); unchanged for a mesh."""
        return values.reshape(*self.patches.shape, *values.shape[1:])

    def imbalance(self) -> float:
        """How far the patches' mean forces and those outside are from the mean force of the wall, over its largest component."""
        total = self.mean_force.sum(axis=0) + self.outside.mean(axis=0)
        mean = self.force.mean(axis=0)
        return float(np.abs(total - mean).max() / max(np.abs(mean).max(), 1e-300))


class WallRecorder:
    """Adds frames up to a WallStress, one at a time; memory does not grow with their number unless the series is kept."""

    def __init__(self, wall: Wall | Inclusion, patches: Patches, *, keep_series: bool = True) -> None:
        """`keep_series`: keep the patches' stresses of every frame, 24 bytes for each patch and frame."""
        self._wall, self._patches = wall, patches
        size = len(patches)
        self._steps: list[int] = []
        self._rows: list[tuple[float, Array, Array, Array, float]] = []
        self._mean, self._squares, self._mean_force = np.zeros((size, 3)), np.zeros((size, 3)), np.zeros((size, 3))
        self._contacts = np.zeros(size, np.int64)
        self._series: list[Array] | None = [] if keep_series else None
        self._blocks, self._peaks, self._whole = Blocks(), PeakFinder((size,)), PeakFinder(())
        self._peak_stress, self._contact_force = Histogram(), Histogram()
        self._whole_peaks: list[tuple[float, float]] = []
        self._reach = (np.inf, 0.0)

    def add(self, frame: GrainFrame, contacts: ContactFrame | None = None, time: float = 0.0) -> None:
        """Take the next frame at `time` (s); an inclusion needs the `contacts` of the same step."""
        size = len(self._patches)
        places, forces, shift = self._loads(frame, contacts, time)
        local = np.einsum("kab,kb->ka", places.basis, forces)
        patch = self._patches.locate(places.coordinates)
        inside = patch >= 0
        patch = patch[inside]
        traction, force = (np.column_stack([np.bincount(patch, column, size) for column in values[inside].T]) for values in (local, forces))
        stress = traction / self._patches.areas[:, None]
        count = len(self._steps) + 1
        change = stress - self._mean
        self._mean += change / count
        self._squares += change * (stress - self._mean)
        self._mean_force += (force - self._mean_force) / count
        self._contacts += np.bincount(patch, minlength=size)
        self._blocks.add(stress)
        if self._series is not None:
            self._series.append(stress)
        before, peak = self._peaks.feed(stress[:, 0])
        self._peak_stress.add(before[peak])
        self._contact_force.add(local[:, 0])
        normal = float(local[:, 0].sum())
        before, peak = self._whole.feed(np.array(normal))
        if peak:
            self._whole_peaks.append((self._rows[-1][0], float(before)))
        self._steps.append(frame.step)
        self._rows.append((time, shift, forces.sum(axis=0), forces[~inside].sum(axis=0), normal))

    def _loads(self, frame: GrainFrame, contacts: ContactFrame | None, time: float) -> tuple[Places, Array, Array]:
        if isinstance(self._wall, Inclusion):
            if contacts is None or contacts.step != frame.step:
                raise DumpError(f"inclusion {self._wall.name}: the contacts of step {frame.step} are needed, "
                                f"{'none are given' if contacts is None else f'these are of step {contacts.step}'}")
            places, forces = self._wall.loads(frame, contacts)
            members, relative = self._wall.members(frame)
            return places, forces, members.positions[0] - relative[0]
        mask, forces = touching(frame, self._wall.name)
        centres = into_box(frame)[mask]
        wall = self._wall.at(time)
        places = wall.places(centres)
        if len(centres):
            gaps = np.linalg.norm(places.points - centres, axis=1) / frame.radii[mask]
            self._reach = min(self._reach[0], float(gaps.min())), max(self._reach[1], float(gaps.max()))
        return places, forces, self._wall.motion.shift(time)

    def result(self) -> WallStress:
        """What was added up; DembarkError when that is no frame."""
        if not self._steps:
            raise DembarkError(f"wall {self._wall.name}: there is no frame")
        times, shifts, force, outside, normal = (np.array(column, float) for column in zip(*self._rows, strict=True))
        peaks = np.array(self._whole_peaks, float).reshape(-1, 2)
        return WallStress(
            self._wall, self._patches, np.array(self._steps), times, shifts, force, outside, normal, self._mean.copy(),
            np.sqrt(self._squares / len(self._steps)), self._blocks.half(self._mean.shape), self._blocks.count, self._mean_force.copy(),
            self._contacts.copy(), None if self._series is None else np.array(self._series), self._peak_stress, self._contact_force,
            peaks[:, 0], peaks[:, 1], self._reach)


def wall_stress(frames: Iterable[GrainFrame], wall: Wall | Inclusion, patches: Patches, *, time_step: float = 1.0,
                contacts: Iterable[ContactFrame] | None = None, keep_series: bool = True) -> WallStress:
    """Load of `wall` on its `patches` over `frames`, read one at a time.

    `time_step` (s) turns steps into times of frames that have none; an Inclusion needs the `contacts` of the same steps. DumpError when
    the dump lacks the wall's forces, or contacts and frames do not belong together.
    """
    recorder = WallRecorder(wall, patches, keep_series=keep_series)
    touching_frames = iter(contacts) if contacts is not None else None
    for frame in frames:
        recorder.add(frame, next(touching_frames, None) if touching_frames is not None else None, frame.time_by(time_step))
    return recorder.result()
