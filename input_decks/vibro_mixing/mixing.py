"""Mixing and segregation of grains of two kinds: Lacey's index, how far apart the kinds are in height, how fast either changes, and the
drift at the walls that carries grains round. `kinds` (n,) is true for the grains of one kind; they may be of one material, distinguished
by where they once were."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dembark.input_decks.common.drive_phases import Phases
from dembark.input_decks.common.vibration import PHASES
from dembark.postproc.measurement import Array, Estimate
from dembark.postproc.statistics import block_mean, student

Kinds = NDArray[np.bool_]

# Width of the samples and of the zone at a wall, in mean diameters.
SAMPLE, BESIDE = 3.0, 2.0


def samples(places: Array, edges: tuple[Array, ...]) -> NDArray[np.int64]:
    """Number of the sample (n,), the cell between `edges` (one array an axis, m) that holds each of `places` (n, axes); what lies outside
    counts to the nearest cell."""
    index = [np.clip(np.searchsorted(edge, place, side="right") - 1, 0, len(edge) - 2)
             for edge, place in zip(edges, places.T, strict=True)]
    return np.asarray(np.ravel_multi_index(index, [len(edge) - 1 for edge in edges]), np.int64)


def cells(places: Array, width: float) -> tuple[Array, ...]:
    """Edges (m) of cells about `width` (m) wide, equal along each axis, that cover `places` (n, axes)."""
    low, high = places.min(axis=0), places.max(axis=0)
    return tuple(np.linspace(a, b, max(1, round((b - a) / width)) + 1) for a, b in zip(low, high, strict=True))


def lacey_index(kinds: Kinds, sample: NDArray[np.int64]) -> float:
    """Lacey's index (sigma_0^2 - sigma^2) / (sigma_0^2 - sigma_r^2) of grains of two `kinds` (n,) in samples with the numbers `sample`
    (n,). sigma^2: variance of the share of one kind in the samples, weighted by their grains; sigma_0^2 = p (1 - p), unmixed (index 0);
    sigma_r^2 = sigma_0^2 / n, random (index 1), n: mean number of grains a sample. P. M. C. Lacey, J. Appl. Chem. 4 (1954) 257. NaN for a
    single kind, or one grain a sample."""
    total = np.bincount(sample)
    used = total > 0
    share = np.bincount(sample, kinds)[used] / total[used]
    p, count = float(np.mean(kinds)), len(kinds) / int(used.sum())
    apart = p * (1.0 - p)
    if not apart > 0.0 or not count > 1.0:
        return math.nan
    variance = float(total[used] @ (share - p) ** 2) / len(kinds)
    return (apart - variance) / (apart - apart / count)


def segregation(kinds: Kinds, heights: Array) -> float:
    """(mean height of the `kinds` - mean height of the others) / H, H: twice the mean height of all above the lowest; from -1 to 1."""
    level = 2.0 * float(heights.mean() - heights.min())
    return float(heights[kinds].mean() - heights[~kinds].mean()) / level


def lower_half(values: Array) -> Kinds:
    """True for the half (n,) of the grains with the smaller `values` (n,)."""
    found = np.zeros(len(values), bool)
    found[np.argsort(values, kind="stable")[: len(values) // 2]] = True
    return found


def rate(series: Array, blocks: int = 4) -> Estimate:
    """Slope of the straight line through `series` (n,), a sample a period, with Student's interval from the slopes between the means of
    `blocks` + 1 parts, for what is left about the line is correlated; inf for fewer samples than twice as many."""
    count = len(series)
    if count < 3:
        return Estimate(math.nan, math.inf, f"{count} periods are too few")
    slope = float(np.polyfit(np.arange(count), series, 1)[0])
    if count < 2 * (blocks + 1):
        return Estimate(slope, math.inf, f"{count} periods are too few")
    parts = np.array_split(np.asarray(series, float), blocks + 1)
    middle = np.array([part.mean() for part in parts])
    place = np.array([part.mean() for part in np.array_split(np.arange(count, dtype=float), blocks + 1)])
    slopes = np.diff(middle) / np.diff(place)
    half = student(blocks - 1) * float(slopes.std(ddof=1)) / math.sqrt(blocks)
    return Estimate(slope, half, f"slopes between {blocks + 1} parts of the time")


def mixing_rate(index: Array) -> Estimate:
    """Rate r (1/period) of 1 - M = c exp(-r t), M: the `index` (n,) at one phase of each period, up to where nine tenths are mixed."""
    left = 1.0 - np.asarray(index, float)
    end = np.flatnonzero(left < 0.1)
    found = rate(np.log(left[: int(end[0]) if len(end) else len(left)]))
    return Estimate(-found.value, found.half, found.basis)


def wall_drift(run: Phases, low: float, high: float, diameter: float) -> Estimate:
    """Mean vertical displacement in a period, in mean diameters, of the grains within BESIDE diameters of the walls x = `low` and x =
    `high` (m), less that of all grains; negative: down at the walls. Interval from blocks of time. A grain that is there at one end of the
    period only counts half: otherwise grains that wander would have a mean displacement without circulation."""
    ways = run.displacements()[::PHASES, :, 2] / diameter
    places = np.array([frame.positions[:, 0] for frame in run.frames[::PHASES]])
    near = np.minimum(places - low, high - places) < BESIDE * diameter
    weights = (near[:-1].astype(float) + near[1:])[: len(ways)]
    return block_mean((weights * ways).sum(axis=1) / weights.sum(axis=1) - ways.mean(axis=1))
