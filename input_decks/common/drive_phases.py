"""Frames of vibrated runs by the phase of the drive: eight a period, always at the same phases. A wall moves with the period T; frames are
written every T/8, so that those of one phase show the bed as a stroboscope does, and what the grains do within a period cancels in their
displacements from period to period."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.dumps import DumpError
from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Array

from .vibration import PHASES


@dataclass(frozen=True)
class Phases:
    """`frames` in the order of time, an eighth of a period apart, with their `numbers` (frames,): eighths of a period since the time zero;
    `period` in s. The phase of a frame is its number modulo 8, 0 where the wall goes up through its middle."""

    frames: Sequence[GrainFrame]
    numbers: NDArray[np.int64]
    period: float

    @property
    def phases(self) -> NDArray[np.int64]:
        """Phase of each frame (frames,), 0 ... 7."""
        return self.numbers % PHASES

    def at(self, phase: int) -> list[GrainFrame]:
        """The frames at one phase, a period apart."""
        return [frame for frame, own in zip(self.frames, self.phases, strict=True) if own == phase % PHASES]

    def displacements(self) -> Array:
        """Displacements (pairs, grains, 3) in m of all grains in one period, from each frame that has another a period later."""
        places = np.array([frame.positions for frame in self.frames])
        return np.asarray(places[PHASES:] - places[:-PHASES])


def read_phases(frames: Iterable[GrainFrame], period_steps: int, time_step: float) -> Phases:
    """`frames` of a drive with a period of `period_steps` steps of `time_step` (s). DumpError when a frame is not at a multiple of an
    eighth of the period, when one is missing, or when grains come or go."""
    kept = list(frames)
    stride, rest = divmod(int(period_steps), PHASES)
    if not kept:
        raise DumpError("there is no frame of the drive; a window of at least one period is needed")
    if rest or stride < 1:
        raise DumpError(f"a period of {period_steps} steps has no eighths; its steps must be a multiple of {PHASES}")
    for frame in kept:
        if frame.step % stride:
            raise DumpError(f"{frame.where or f'step {frame.step}'}: not at an eighth of the period, a multiple of {stride} steps")
    numbers = np.array([frame.step // stride for frame in kept], np.int64)
    if (np.diff(numbers) != 1).any():
        gap = int(np.flatnonzero(np.diff(numbers) != 1)[0])
        raise DumpError(f"frames at steps {kept[gap].step} and {kept[gap + 1].step}: they must be {stride} steps apart")
    if any(len(frame.ids) != len(kept[0].ids) or (frame.ids != kept[0].ids).any() for frame in kept):
        raise DumpError(f"{kept[0].where or 'the dump'}: grains come or go; displacements need the same grains in all frames")
    return Phases(kept, numbers, period_steps * time_step)


def cell_means(values: Array, places: Array, weights: Array, edges: Sequence[Array]) -> Array:
    """Mean of `values` (n,) or (n, k), weighted by `weights` (n,), of what lies at `places` (n, d) in each cell between `edges` (d arrays,
    m): (cells..., k) or (cells...); NaN in empty cells."""
    table = np.asarray(values, float)
    total = np.histogramdd(places, bins=edges, weights=weights)[0]
    columns = table.reshape(len(table), -1).T
    sums = np.stack([np.histogramdd(places, bins=edges, weights=weights * column)[0] for column in columns], axis=-1)
    means = np.divide(sums, total[..., None], out=np.full(sums.shape, np.nan), where=total[..., None] > 0.0)
    return np.asarray(means if table.ndim > 1 else means[..., 0])
