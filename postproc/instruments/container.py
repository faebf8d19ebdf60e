"""A bed in a container that moves: the period with which it rings, its surface, and how far that has slid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.measurement import Array


def ring_period(times: Array, force: Array) -> float:
    """s, of the strongest line in the spectrum of `force` (n,) at evenly spaced `times` (n,), between two samples and half of the record;
    its place among the frequencies by a parabola through the logarithms of the highest value and its neighbours."""
    window = np.hanning(len(force))
    power = np.abs(np.fft.rfft(window * (force - np.average(force, weights=window)), 8 * len(force))) ** 2
    low = 16
    k = low + int(np.argmax(power[low:-1]))
    left, middle, right = np.log(power[k - 1 : k + 2] + 1e-300)
    curvature = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / curvature if curvature < 0.0 else 0.0
    return float(8 * len(force) * (times[1] - times[0]) / (k + shift))


def tops(places: Array, cell: float, low: float, high: float) -> NDArray[np.int64]:
    """Numbers of the highest grains of the cells, `cell` (m) wide, of x between `low` and `high` (m); `places`: x and z (n, 2)."""
    column = np.floor(places[:, 0] / cell).astype(np.int64)
    inside = (places[:, 0] > low) & (places[:, 0] < high)
    own = [np.flatnonzero(inside & (column == k)) for k in np.unique(column[inside])]
    return np.array([one[np.argmax(places[one, 1])] for one in own])


def slid(places: Sequence[Array], surface: NDArray[np.int64]) -> Array:
    """m, (frames,): how far the grains of the `surface` have come along x in the container since the first of the frames, in the median."""
    return np.array([float(np.median(one[surface, 0] - places[0][surface, 0])) for one in places])
