"""Means with honest intervals: correlated time series, replicas, resampling in space, the steady part of a run, and scatter statistics.

All intervals are two-sided with 95 % confidence unless `confidence` says otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CONFIDENCE = 0.95
ONE_SAMPLE = "4 time blocks, too correlated to count as more than one sample"
_MIN_BLOCKS = 4
_MOST_BLOCKS = 20  # of a plain mean; where every block is measured once more, ten will do
_BLOCK_LENGTH = 3.5  # correlation times
_WINDOW = 2.5  # correlation times, summed over both signs of the lag: Sokal's five integrated times


@dataclass(frozen=True)
class Estimate:
    """A value with the half-width of its interval (inf when the data allow none) and the `basis` of that interval in words.

    samples : the values of the replicas, in their order, where it is their mean
    """

    value: float
    half: float
    basis: str = ""
    samples: tuple[float, ...] = ()

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper end."""
        return self.value - self.half, self.value + self.half


def exact(value: float, half: float = 0.0) -> Estimate:
    """A number of a run in which nothing is random; `half` is what the time step hides of it."""
    return Estimate(float(value), half, "none, nothing is random" if half == 0.0 else "the time step")


def student(degrees: float, confidence: float = CONFIDENCE) -> float:
    """Two-sided quantile of Student's t distribution."""
    from scipy.special import stdtrit
    return float(stdtrit(degrees, 0.5 + 0.5 * confidence)) if degrees >= 1 else math.inf


def variance_half(degrees: float, confidence: float = CONFIDENCE) -> float:
    """Half-width, over the value, of the symmetric interval of a variance whose value over it is distributed as chi-square with these
    `degrees` of freedom over them; inf for fewer than four, of which it is more than four times the value."""
    from scipy.optimize import brentq
    from scipy.special import chdtr

    def lacks(half: float) -> float:
        above = chdtr(degrees, degrees / (1.0 - half)) if half < 1.0 else 1.0
        return float(above - chdtr(degrees, degrees / (1.0 + half))) - confidence

    return float(brentq(lacks, 0.0, 100.0)) if degrees >= 4.0 else math.inf


def tail_probability(limit: float, half: float, degrees: float) -> float:
    """Probability that a value with the 95 % half-width `half` lies farther from its mean than `limit`; infinite `degrees`: normal."""
    from scipy.special import ndtr, stdtr
    reach = student(degrees) * limit / half
    return 2.0 * float(stdtr(degrees, -reach) if math.isfinite(degrees) else ndtr(-reach))


def correlation_time(series: Array) -> float:
    """Integrated autocorrelation time 1 + 2 sum rho(k) in samples: 1 for independent ones, at most the length of the series.

    The sum ends at the first lag of 2.5 such times, which are five of Sokal's (Monte Carlo methods in statistical mechanics, in:
    Functional Integration (Springer 1997) 131). Every autocovariance about the mean of the series itself is too small by the variance of
    that mean, about sigma^2 tau / n: this bias is taken out as by U. Wolff, Comput. Phys. Commun. 156 (2004) 143. Without it a series of
    10 correlation times seems to have 20.
    """
    return float(_correlation_times(np.asarray(series, float)[:, None])[0])


def _correlation_times(values: Array) -> Array:
    """The same (m,) of the series (n, m)."""
    count, found = len(values), np.ones(values.shape[1])
    deviation = values - values.mean(axis=0)
    varies = (np.abs(deviation) > 1e-14 * np.abs(values).max(axis=0, initial=0.0)).any(axis=0)
    if count < 4 or not varies.any():
        return found
    spectrum = np.fft.rfft(deviation[:, varies], 2 * count, axis=0)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2, axis=0)[:count]
    correlation /= correlation[0]
    tau = 2.0 * np.cumsum(correlation, axis=0) - 1.0
    ended = np.arange(count)[:, None] >= _WINDOW * tau
    lag = np.argmax(ended, axis=0)
    at_lag = np.take_along_axis(tau, lag[None], axis=0)[0]
    left = 1.0 - (2.0 * lag + 1.0 - at_lag) / count
    known = ended.any(axis=0) & (left > 0.0)
    found[varies] = np.where(known, np.clip(at_lag / np.where(known, left, 1.0), 1.0, count), count)
    return found


@dataclass(frozen=True, eq=False)
class TimeBlocks:
    """`groups` (samples,): number of the time block of each sample. Student's interval over the blocks is to be widened by `widening`;
    `single`: they are too correlated to count as several samples."""

    groups: NDArray[np.int64]
    widening: float = 1.0
    single: bool = False

    @property
    def count(self) -> int:
        """How many blocks there are."""
        return int(self.groups[-1]) + 1


def time_blocks(series: Array, most: int = 10) -> TimeBlocks:
    """4 to `most` blocks of `series` (samples,), each at least 3.5 correlation times long; or else four that count as a single sample.

    Neighbouring blocks are still correlated, so their means scatter too little. `widening` makes up for it as it follows for a series
    whose autocorrelation decays exponentially. A single sample has the spread of its four blocks: half of it would be their error.
    """
    length = len(series)
    blocks, widening, single = (one[0] for one in _division(length, np.array([correlation_time(series)]), most))
    return TimeBlocks(np.arange(length) * int(blocks) // length, float(widening), bool(single))


def _division(length: int, tau: Array, most: int) -> tuple[NDArray[np.int64], Array, NDArray[np.bool_]]:
    """Numbers of blocks, `widening` and `single` of series of `length` with the correlation times `tau` (m,); all (m,)."""
    blocks = np.minimum(most, length / (_BLOCK_LENGTH * tau)).astype(np.int64)
    single = blocks < _MIN_BLOCKS
    blocks = np.where(single, _MIN_BLOCKS, blocks)
    total, part = _variance_of_mean(length, tau), _variance_of_mean(length / blocks, tau)
    return blocks, np.sqrt(np.where(single, blocks, total * (blocks - 1) / (part - total))), single


def _variance_of_mean(count: Array | float, tau: Array) -> Array:
    """Variance of the mean of `count` samples of unit variance with the autocorrelation a^k and the correlation time `tau`.

    G. V. Bayley & J. M. Hammersley, J. R. Stat. Soc. Suppl. 8 (1946) 184, for a = (tau - 1) / (tau + 1).
    """
    memory = (tau - 1.0) / (tau + 1.0)
    return tau / count - 2.0 * memory * (1.0 - memory**count) / (count * (1.0 - memory)) ** 2


def block_mean(series: Array, confidence: float = CONFIDENCE) -> Estimate:
    """Mean of a correlated time series with Student's interval over `time_blocks` (batch means: A. M. Law, Nav. Res. Logist. Q. 24 (1977)
    667); no interval (inf) for fewer than eight values.

    In autoregressive series of 5 to 100 correlation times at least 93 % of the intervals hold the true mean.
    """
    values = np.asarray(series, float)
    value = float(values.mean())
    if len(values) < 2 * _MIN_BLOCKS:
        return Estimate(value, math.inf, f"{len(values)} samples are too few")
    blocks = time_blocks(values, most=_MOST_BLOCKS)
    half = float(block_halves(values[:, None], confidence)[0])
    return Estimate(value, half, ONE_SAMPLE if blocks.single else f"{blocks.count} block averages")


def block_halves(values: Array, confidence: float = CONFIDENCE) -> Array:
    """Half-widths (m,) of the intervals that `block_mean` gives the means of the series (n, m)."""
    count, half = len(values), np.full(values.shape[1], np.inf)
    if count < 2 * _MIN_BLOCKS:
        return half
    blocks, widening, _ = _division(count, _correlation_times(values), _MOST_BLOCKS)
    for number in np.unique(blocks):
        chosen, groups = blocks == number, np.arange(count) * int(number) // count
        starts = np.flatnonzero(np.diff(groups, prepend=-1))
        means = np.add.reduceat(values[:, chosen], starts, axis=0) / np.diff(starts, append=count)[:, None]
        half[chosen] = student(number - 1, confidence) * widening[chosen] * means.std(axis=0, ddof=1) / math.sqrt(number)
    return half


def replica_mean(values: Sequence[float], confidence: float = CONFIDENCE) -> Estimate:
    """Mean over independent packings with Student's interval; half-width inf for a single one."""
    data = np.asarray(values, float)
    if len(data) < 2:
        return Estimate(float(data.mean()), math.inf, "1 replica")
    half = student(len(data) - 1, confidence) * float(data.std(ddof=1)) / math.sqrt(len(data))
    return Estimate(float(data.mean()), half, f"{len(data)} replicas", tuple(map(float, data)))


def jackknife(measure: Callable[[NDArray[np.bool_]], float], groups: NDArray[np.int64], confidence: float = CONFIDENCE,
              name: str = "groups") -> Estimate:
    """Delete-a-group jackknife of `measure(keep)`, which computes a quantity from the samples where the mask `keep` is true.

    `groups` (samples,) numbers the group of each sample, `name` says what they are; groups should be independent of each other.
    Standard error sqrt((g - 1)/g sum (q_k - mean q)^2); Efron, The Jackknife, the Bootstrap and Other Resampling Plans (SIAM 1982).
    """
    labels = np.unique(groups)
    value = measure(np.ones(len(groups), bool))
    if len(labels) < _MIN_BLOCKS:
        return Estimate(value, math.inf, f"{len(labels)} {name}: too few or too correlated")
    error = float(jackknife_error(np.array([measure(groups != label) for label in labels])))
    return Estimate(value, student(len(labels) - 1, confidence) * error, f"jackknife over {len(labels)} {name}")


def jackknife_error(left_out: Array) -> Array:
    """Standard errors (...) of quantities whose values without one of g groups each are `left_out` (g, ...), see `jackknife`."""
    count = len(left_out)
    return np.sqrt((count - 1) / count * ((left_out - left_out.mean(axis=0)) ** 2).sum(axis=0))


def combined(parts: Sequence[float]) -> float:
    """Half-width of independent contributions together."""
    return math.sqrt(sum(part**2 for part in parts))


def over_replicas(estimates: Sequence[Estimate], shared: float = 0.0) -> Estimate:
    """One estimate from those of the replicas: Student's interval over replicas from three on, else their own intervals pooled; at least
    `shared`, the half-width that all have in common, such as that of a reading, which no mean makes smaller.

    Two values say little about a spread (t = 12.7 with one degree of freedom); their interval reaches to both at least. Values that are all
    equal show no spread, though there may be one: their widest own interval counts, infinite where a run does not know it. Those of runs in
    which nothing is random are `exact`.
    """
    values, halves, count = [one.value for one in estimates], [one.half for one in estimates], len(estimates)
    within = f"within {count} replica{'' if count == 1 else 's'}: {estimates[0].basis}"
    if max(halves) > 0.0 and all(math.isclose(one, values[0], rel_tol=1e-12) for one in values):
        basis = within if count < 3 else f"{count} replicas with equal values: {estimates[0].basis}"
        return Estimate(values[0], max(*halves, shared), basis)
    if count >= 3:
        found = replica_mean(values)
        return replace(found, half=max(found.half, shared))
    mean = float(np.mean(values))
    return Estimate(mean, max(combined(halves) / count, shared, *(abs(value - mean) for value in values)), within)


def rescaled(half: float, count: float, other: float, confidence: float = CONFIDENCE) -> float:
    """The half-width that the mean of `other` values of the same scatter would have, when that of `count` has `half`; infinite `count`:
    known exactly how they scatter, which no number of values changes."""
    if not math.isfinite(count):
        return half
    now, then = (student(number - 1.0, confidence) / math.sqrt(number) for number in (count, other))
    return half * then / now


def joint_limit(one: float, other: float, count_one: float, count_other: float, confidence: float) -> float:
    """Half-width of the interval of the same difference for another `confidence`, when `one` and `other` are Student's 95 % half-widths
    over `count_one` and `count_other` values (two or more; inf: known exactly how they scatter).

    B. L. Welch, Biometrika 34 (1947) 28: the variances add, and the degrees of freedom are between the smaller of both and their sum.
    """
    degrees = (count_one - 1.0, count_other - 1.0)
    if math.isinf(one + other):
        return math.inf
    squares = [(half / student(degree)) ** 2 for half, degree in zip((one, other), degrees, strict=True)]
    if not sum(squares) > 0.0:
        return 0.0
    common = sum(squares) ** 2 / max(sum(square**2 / degree for square, degree in zip(squares, degrees, strict=True)), 1e-300)
    return student(common, confidence) * math.sqrt(sum(squares))


def steady_start(series: Array, batch: int = 5) -> int:
    """Index from which `series` is steady, by MSER-5 and Geweke's test; len(series) when there is no steady part.

    Of the truncation points d in the first half of the batch means the one with the smallest sum (y_i - mean)^2 / (n - d)^2 over the
    rest is taken (K. P. White, Simulation 69 (1997) 323; White, Cobb & Spratt, Proc. 2000 Winter Simulation Conference, 755). What is
    left counts as steady unless the means of its two halves differ significantly (J. Geweke, in: Bayesian Statistics 4 (Oxford 1992)
    169): by more than Student's 99 % interval of the difference, from five blocks in each half.
    """
    values = np.asarray(series, float)
    count = len(values) // batch
    if count < 2 * _MIN_BLOCKS:
        return len(values)
    means = values[: count * batch].reshape(count, batch).mean(axis=1)
    rest = np.arange(count, 0, -1)
    # About the overall mean, for differences of large squares would lose the small ones.
    total = np.cumsum((means - means.mean())[::-1])[::-1]
    squares = np.cumsum(((means - means.mean()) ** 2)[::-1])[::-1]
    mser = np.maximum(0.0, squares - total**2 / rest) / rest.astype(float) ** 2
    start = int(np.argmin(mser[: count // 2 + 1])) * batch
    blocks = np.array([part.mean() for part in np.array_split(values[start:], 10)])
    one, other = blocks[:5], blocks[5:]
    error = math.sqrt((one.var(ddof=1) + other.var(ddof=1)) / 5.0)
    return start if abs(one.mean() - other.mean()) <= student(8, 0.99) * error else len(values)


@dataclass(frozen=True)
class Scatter:
    """Bias factor `bias` = delta and relative standard deviation `model` = sigma_M of a model against references, with
    `reference` = sigma_E, over `count` pairs."""

    count: int
    bias: float
    model: float
    reference: float


def scatter(model: Sequence[float], reference: Sequence[float], reference_deviation: float) -> Scatter:
    """Scatter statistics of k pairs (M, E) of positive numbers as in the validation guide of the Fire Dynamics Simulator.

    With u^2 = sum (ln(M/E) - mean)^2 / (k - 1), sigma_E = min(`reference_deviation`, u / sqrt 2) and omega^2 = max(0, u^2 - sigma_E^2):
    delta = exp(mean ln(M/E) + omega^2 / 2 - sigma_E^2 / 2), sigma_M = delta omega. Both halves are the shift between the logarithm of
    a mean and the mean of a logarithm. K. McGrattan & B. Toman, Metrologia 48 (2011) 173; form checked with FDS's scatplot script.
    """
    ratio = np.log(np.asarray(model, float) / np.asarray(reference, float))
    if len(ratio) < 2:
        raise ValueError("scatter statistics need at least two pairs")
    u = float(ratio.std(ddof=1))
    sigma = min(reference_deviation, u / math.sqrt(2.0))
    omega2 = max(0.0, u**2 - sigma**2)
    bias = math.exp(float(ratio.mean()) + 0.5 * omega2 - 0.5 * sigma**2)
    return Scatter(len(ratio), bias, bias * math.sqrt(omega2), sigma)
