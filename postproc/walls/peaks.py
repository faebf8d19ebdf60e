"""Statistics of wall loads in time that need no stored series: blocks, local maxima, and a histogram whose range grows as needed."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..statistics import block_halves

Array = NDArray[np.float64]


class Histogram:
    """Counts of positive numbers in `bins` bins of equal width from 0; when a number lies above, the bins double their width by merging
    in pairs, so no count is ever wrong. `below` counts the numbers <= 0, which are in no bin."""

    def __init__(self, bins: int = 64) -> None:
        if bins < 2 or bins % 2:
            raise ValueError(f"a histogram that can merge its bins in pairs needs an even number of them, not {bins}")
        self.counts = np.zeros(bins, np.int64)
        self.width = 0.0
        self.below = 0
        self.total = 0.0
        self.largest = -math.inf

    def add(self, values: Array) -> None:
        """Count `values` (k,), finite numbers."""
        if not len(values):
            return
        self.largest = max(self.largest, float(values.max()))
        positive = values[values > 0.0]
        self.below += len(values) - len(positive)
        self.total += float(values.sum())
        if not len(positive):
            return
        top = float(positive.max())
        if self.width == 0.0:
            # Powers of two, so that bins stay exact when they are merged; the smallest doubles would leave no width.
            self.width = math.ldexp(1.0, max(math.frexp(top)[1] - len(self.counts).bit_length() + 1, -1000))
        while top >= self.width * len(self.counts):
            half = self.counts.reshape(-1, 2).sum(axis=1)
            self.counts = np.concatenate([half, np.zeros_like(half)])
            self.width *= 2.0
        self.counts += np.bincount((positive / self.width).astype(np.int64), minlength=len(self.counts))

    @property
    def number(self) -> int:
        """How many numbers were counted."""
        return int(self.counts.sum()) + self.below

    @property
    def mean(self) -> float:
        """Mean of all numbers, exactly; NaN of none."""
        return self.total / self.number if self.number else math.nan

    @property
    def edges(self) -> Array:
        """Borders (bins + 1,) of the bins."""
        return self.width * np.arange(len(self.counts) + 1, dtype=np.float64)

    def density(self) -> Array:
        """Probability density (bins,) of the positive numbers; zeros when there are none."""
        return self.counts / max(1, int(self.counts.sum())) / (self.width or 1.0)

    def quantile(self, share: float) -> float:
        """The number that `share` of all stay below, to half the width of a bin; NaN of none."""
        if not self.number:
            return math.nan
        rank = share * self.number - self.below
        if rank <= 0.0:
            return 0.0
        level = np.concatenate([[0.0], np.cumsum(self.counts)])
        return float(min(np.interp(rank, level, self.edges), self.largest))


class PeakFinder:
    """Local maxima in time of many series at once: a value that was risen to and is fallen from. Equal values in between belong to the
    peak, which counts once; the first and the last value of a series are none."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._last = np.full(shape, np.nan)
        self._rising = np.zeros(shape, bool)

    def feed(self, values: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Take the next values; the previous ones, and which of them were peaks."""
        before = self._last
        with np.errstate(invalid="ignore"):
            peak = self._rising & (values < before)
            self._rising = np.where(values == before, self._rising, values > before)
        self._last = np.array(values, float)
        return before, peak


class Blocks:
    """Means over blocks of a series of arrays, for intervals of the mean of correlated values. Blocks double their length, so that memory
    does not grow: there are always 64 to 127 of them once there are 64 values, which are a series themselves."""

    _LEAST = 64
    _CHUNK = 4096  # series at a time, whose spectra are in memory

    def __init__(self) -> None:
        self._sums: list[Array] = []
        self._length, self._filled = 1, 0

    def add(self, values: Array) -> None:
        """Take the next array."""
        if self._filled == 0:
            self._sums.append(np.array(values, float))
        else:
            self._sums[-1] += values
        self._filled = (self._filled + 1) % self._length
        if self._filled == 0 and len(self._sums) == 2 * self._LEAST:
            self._sums = [one + other for one, other in zip(self._sums[::2], self._sums[1::2], strict=True)]
            self._length *= 2

    @property
    def count(self) -> int:
        """Number of full blocks."""
        return len(self._sums) - bool(self._filled)

    def half(self, shape: tuple[int, ...]) -> Array:
        """Half-width of the 95 % interval of the mean from the full blocks, corrected for the correlation in time as in `block_mean`; inf
        with fewer than 8."""
        means = np.array(self._sums[: self.count]).reshape(self.count, math.prod(shape)) / self._length
        parts = [block_halves(means[:, start : start + self._CHUNK]) for start in range(0, means.shape[1], self._CHUNK)]
        return np.concatenate([np.zeros(0), *parts]).reshape(shape)
