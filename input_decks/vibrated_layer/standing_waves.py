"""Standing waves on a vibrated layer: its surface over place and time, its power in wave number and frequency, and the onset of waves. A
layer that answers each stroke of the drive (frequency f) alike has lines at f and its multiples; waves whose crests and troughs change
places from stroke to stroke have one at f/2; noise is spread over all lines."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dembark.input_decks.common.vibration import PHASES
from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Array, Estimate
from dembark.postproc.spheres import volume
from dembark.postproc.statistics import student

Mask = NDArray[np.bool_]

# Width of the cells of the surface, in mean diameters.
CELL = 2.0
# Periods of a window of time, each with a spectrum of its own; even, so that f/2 is one of its lines.
WINDOW = 8
# Lines between that at f/2 and those on both sides that stand for the noise.
BESIDE = 2
# Solid volume over area, in mean diameters, that lies above the surface: half of a layer one diameter thick with a solid fraction of 0.6,
# so that a single grain that flies does not count.
SKIN = 0.3


def surface_levels(frame: GrainFrame, length: float, depth: float, diameter: float) -> Array:
    """Height z (cells,) in m of the surface of a bed that is periodic along x in 0 ... `length` (m) and `depth` (m) along y, in cells about
    CELL diameters wide: of the centre of the grain down from which the volume of half a layer lies above. NaN in empty cells. A cell with
    less than that volume has the height of its lowest grain."""
    cells = max(2, round(length / (CELL * diameter)))
    cell = np.floor(frame.positions[:, 0] / length * cells).astype(np.int64) % cells
    order = np.lexsort((-frame.positions[:, 2], cell))
    cell, heights, volumes = cell[order], frame.positions[order, 2], volume(frame.radii[order])
    starts = np.searchsorted(cell, np.arange(cells + 1))
    total = np.concatenate([[0.0], np.cumsum(volumes)])
    due, levels = SKIN * diameter * depth * length / cells, np.full(cells, np.nan)
    for k, (first, end) in enumerate(itertools.pairwise(starts)):
        if end > first:
            levels[k] = heights[min(int(np.searchsorted(total, total[first] + due, side="left")), int(end)) - 1]
    return levels


@dataclass(frozen=True)
class Waves:
    """`heights` (frames, cells) in m: a surface that is periodic over `length` (m), at PHASES frames a period of the drive; `diameter`:
    mean one of the grains (m). Powers are in square diameters. ValueError for fewer frames than a window has."""

    heights: Array
    length: float
    diameter: float

    def __post_init__(self) -> None:
        if len(self.heights) < WINDOW * PHASES:
            raise ValueError(f"{len(self.heights)} frames of the surface: a spectrum needs {WINDOW} periods of {PHASES} frames")

    @cached_property
    def _windows(self) -> Array:
        """Heights (windows, frames, cells) in diameters, empty cells filled with the mean of their frame."""
        count = len(self.heights) // (WINDOW * PHASES)
        filled = np.where(np.isnan(self.heights), np.nanmean(self.heights, axis=1, keepdims=True), self.heights) / self.diameter
        return filled[-count * WINDOW * PHASES :].reshape(count, WINDOW * PHASES, -1)

    @cached_property
    def power(self) -> Array:
        """(windows, modes, lines): power of the mode n, whose waves are length/n long, from n = 0 on, in the line l, the frequency
        l f / WINDOW. All together are the mean square of the height: half the square of the amplitude of a wave that travels, a quarter
        of that of one that stands."""
        cells = self.heights.shape[1]
        both = np.abs(np.fft.fft2(self._windows) / (WINDOW * PHASES * cells)) ** 2
        modes, lines = cells // 2 + 1, WINDOW * PHASES // 2 + 1
        # What is real has each wave twice, at (k, w) and (-k, -w): the lines w >= 0 hold those that travel to either side.
        ahead, back = both[:, :lines, :modes], both[:, :lines, -np.arange(modes)]
        # But for the first and the last of both, which are their own.
        once = np.ones((lines, modes))
        once[[0, -1]] *= 0.5
        once[:, [0, -1] if cells % 2 == 0 else [0]] *= 0.5
        return np.asarray(2.0 * once * (ahead + back)).transpose(0, 2, 1)

    def lengths(self) -> Array:
        """Wavelengths (m) of the modes from 1 on."""
        return self.length / np.arange(1, self.power.shape[1])

    def line(self, part: float, keep: Mask | slice = slice(None)) -> Array:
        """Power (modes,) at the frequency `part` f, of the modes from 1 on, over the windows `keep`."""
        return np.asarray(self.power[keep][:, 1:, round(part * WINDOW)].mean(axis=0))

    def noise(self, keep: Mask | slice = slice(None)) -> Array:
        """Power (modes,) of the modes from 1 on in the lines next to f/2."""
        lines = [WINDOW // 2 - BESIDE, WINDOW // 2 + BESIDE]
        return np.asarray(self.power[keep][:, 1:, lines].mean(axis=(0, 2)))

    def subharmonic(self, keep: Mask | slice = slice(None)) -> float:
        """Power at f/2 of all modes from 1 on, less that of noise."""
        return float((self.line(0.5, keep) - self.noise(keep)).sum())

    def peak(self, keep: Mask | slice = slice(None)) -> float:
        """Power at f/2 of all modes from 1 on, over that of noise: 1 where there is nothing but noise."""
        return float(self.line(0.5, keep).sum() / self.noise(keep).sum())

    def coherence(self) -> float:
        """Part of the power at f/2 of all modes from 1 on that is in the mean amplitude over windows: 1 for waves that stay where they are,
        1 / windows on average for waves that come and go."""
        amplitudes = np.fft.fft2(self._windows)[:, WINDOW // 2, 1:]
        return float((np.abs(amplitudes.mean(axis=0)) ** 2).sum() / (np.abs(amplitudes) ** 2).mean(axis=0).sum())

    def ordered(self) -> bool:
        """Whether at least half of the power at f/2 is coherent, and more than one mode of noise has by chance in one of a hundred cases:
        for n windows its coherence has the distribution 1 - (1 - c)^(n - 1)."""
        count = len(self._windows)
        return count > 1 and self.coherence() >= max(0.5, 1.0 - 0.01 ** (1.0 / (count - 1)))

    def harmonic(self, keep: Mask | slice = slice(None)) -> float:
        """Power at f of all modes from 1 on."""
        return float(self.line(1.0, keep).sum())

    def doubling_power(self, keep: Mask | slice = slice(None)) -> float:
        """Power at f/2 of the mean height: of a layer that is thrown higher at every other stroke."""
        return float(self.power[keep][:, 0, WINDOW // 2].mean())

    def mode(self, keep: Mask | slice = slice(None)) -> int:
        """Number of waves on the length: the mode with the greatest power in all lines but the mean surface."""
        return int(np.argmax(self.power[keep][:, 1:, 1:].mean(axis=0).sum(axis=1))) + 1

    def wavelength(self, keep: Mask | slice = slice(None)) -> float:
        """m, of that mode."""
        return self.length / self.mode(keep)

    def mean_wavelength(self, keep: Mask | slice = slice(None)) -> float:
        """m, from the mean wave number of the power at f/2 above the noise, which knows no steps; NaN where nothing is above it."""
        above = np.maximum(self.line(0.5, keep) - self.noise(keep), 0.0)
        number = float(above @ np.arange(1, len(above) + 1))
        return self.length * float(above.sum()) / number if number > 0.0 else math.nan

    def strongest(self, keep: Mask | slice = slice(None)) -> float:
        """Frequency over f at which that mode has its greatest power."""
        return float(np.argmax(self.power[keep][:, self.mode(keep), 1:].mean(axis=0)) + 1) / WINDOW


def amplitude(power: float) -> float:
    """Amplitude of one standing wave of this power, in the root of its unit; 0 for a power that is none."""
    return 2.0 * math.sqrt(max(power, 0.0))


def onset(drive: Array, power: Array, halves: Array, seen: Mask) -> Estimate:
    """Zero of the straight line through `power` (n,), with half-widths `halves` of 95 % intervals, over `drive` (n,): beyond the onset of
    waves without a jump the square of their amplitude grows linearly, up to its maximum. Points count from the first on from which waves
    are `seen` (n,) in all, to the maximum. Interval: Student's for the scatter about the line, or that of the points' intervals if it is
    wider; infinite for fewer than three points."""
    order = np.argsort(drive)
    x, y, half = (np.asarray(values, float)[order] for values in (drive, power, halves))
    below = np.flatnonzero(~np.asarray(seen, bool)[order])
    x, y, half = (values[below[-1] + 1 if len(below) else 0:] for values in (x, y, half))
    if len(y):
        x, y, half = (values[: int(np.argmax(y)) + 1] for values in (x, y, half))
    if len(x) < 3:
        return Estimate(math.nan, math.inf, f"{len(x)} points from the noise to the maximum are too few")
    slope, start = np.polyfit(x, y, 1)
    if slope <= 0.0:
        return Estimate(math.nan, math.inf, "the power does not grow with the drive")
    value, count, spread = -start / slope, len(x), float(((x - x.mean()) ** 2).sum())
    # A point of power e moves the zero by -weight e / slope.
    weights = 1.0 / count + (value - x.mean()) * (x - x.mean()) / spread
    scatter = math.sqrt(float(((y - slope * x - start) ** 2).sum()) / (count - 2)) if count > 2 else 0.0
    about = student(count - 2) * scatter * math.sqrt(float((weights**2).sum())) / slope
    known = float(np.sqrt(((weights * half) ** 2).sum())) / slope if np.isfinite(half).all() else 0.0
    basis = f"scatter of {count} points about a line" if about >= known else f"propagated from {count} points"
    return Estimate(float(value), max(about, known), basis)


def order_onset(drive: Array, ordered: Mask) -> Estimate:
    """Between the highest of `drive` (n,) at which waves are not `ordered` (n,) and the next one, from which on all are; or NaN."""
    order = np.argsort(drive)
    x, without = np.asarray(drive, float)[order], np.flatnonzero(~np.asarray(ordered, bool)[order])
    if not len(without):
        return Estimate(math.nan, math.inf, "waves are ordered at all levels")
    if without[-1] == len(x) - 1:
        return Estimate(math.nan, math.inf, "waves are not ordered at the highest level")
    low, high = x[without[-1]], x[without[-1] + 1]
    return Estimate(float(0.5 * (low + high)), float(0.5 * (high - low)), "two neighbouring levels")
