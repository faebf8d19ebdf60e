"""Intervals hold what they promise, and known answers come out."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from dembark.postproc.resampling import resampled
from dembark.postproc.statistics import (
    Estimate,
    block_halves,
    block_mean,
    correlation_time,
    jackknife,
    joint_limit,
    over_replicas,
    replica_mean,
    scatter,
    steady_start,
    tail_probability,
    time_blocks,
    variance_half,
)


def correlated(random, count, memory, many=()):
    """First-order autoregressive series (*many, count) of unit variance with correlation `memory` from one value to the next."""
    noise = random.standard_normal((*many, count)) * math.sqrt(1.0 - memory**2)
    noise[..., 0] = random.standard_normal(many)
    return lfilter([1.0], [1.0, -memory], noise)


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_correlation_time_of_an_autoregressive_series(memory):
    series = correlated(np.random.default_rng(3), 200000, memory)
    assert correlation_time(series) == pytest.approx((1.0 + memory) / (1.0 - memory), rel=0.15)


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_block_intervals_cover_the_mean_as_often_as_they_say(memory):
    random = np.random.default_rng(4)
    hits = sum(abs(found.value) <= found.half for found in (block_mean(correlated(random, 600, memory)) for _ in range(300)))
    assert 0.89 <= hits / 300 <= 0.99


@pytest.mark.parametrize("times", [5, 7, 10, 13, 17, 30, 50])
@pytest.mark.parametrize("tau", [4.0, 12.0])
def test_95_percent_intervals_of_correlated_series_cover_the_mean_in_93_to_97_percent(tau, times):
    """Autoregressive series of 5 to 50 correlation times; of 4000 intervals 95 % scatter by 0.35 %."""
    series = correlated(np.random.default_rng(11), int(tau * times), (tau - 1.0) / (tau + 1.0), (4000,))
    means, halves = series.mean(axis=1), block_halves(series.T)
    assert halves[0] == pytest.approx(block_mean(series[0]).half)
    assert 0.93 <= np.mean(np.abs(means) <= halves) <= 0.97
    # Not at the price of intervals that say nothing: two standard errors from 20 correlation times on, the spread of a sample below.
    assert np.median(halves) <= (5.5 if times < 20 else 2.4) * means.std()
    # The negative control: the samples taken for independent ones.
    assert np.mean(np.abs(means) <= 1.96 * series.std(axis=1, ddof=1) / math.sqrt(series.shape[1])) < 0.75


def test_resampled_intervals_cover_as_well():
    series = correlated(np.random.default_rng(12), 52, 0.6, (600,))
    found = [resampled(lambda keep, _, one=one: float(one[keep].mean()), time_blocks(one)) for one in series]
    assert np.mean([abs(one.value) <= one.half for one in found]) >= 0.93


@pytest.mark.parametrize("times", [10, 20, 40])
def test_correlation_time_of_a_short_series_is_hardly_biased(times):
    series = correlated(np.random.default_rng(13), 4 * times, 0.6, (1000,))
    assert np.median([correlation_time(one) for one in series]) == pytest.approx(4.0, rel=0.25)


def test_a_series_within_its_correlation_time_is_a_single_sample():
    drift = np.arange(40.0)
    blocks = time_blocks(drift)
    assert (blocks.single, blocks.count, blocks.widening) == (True, 4, 2.0)
    assert block_mean(drift).half == pytest.approx(3.18245 * np.std([0.0, 10.0, 20.0, 30.0], ddof=1), rel=1e-5)


def test_too_short_a_series_has_no_interval():
    assert block_mean(np.array([1.0, 2.0, 1.5, 1.2, 1.8, 1.1, 1.4])).half == math.inf
    assert math.isfinite(block_mean(np.random.default_rng(5).standard_normal(100)).half)


def test_replica_interval_is_students():
    found = replica_mean([1.0, 2.0, 3.0])
    assert found.half == pytest.approx(4.30265 / math.sqrt(3.0), rel=1e-5)
    assert replica_mean([1.0]).half == math.inf


def test_jackknife_of_a_mean_is_the_standard_error():
    values = np.random.default_rng(6).standard_normal(30)
    found = jackknife(lambda keep: float(values[keep].mean()), np.arange(30))
    assert found.half == pytest.approx(2.04523 * values.std(ddof=1) / math.sqrt(30.0), rel=1e-5)


def test_pooling_below_three_replicas_keeps_their_own_intervals():
    assert over_replicas([Estimate(1.0, 0.3)]).half == 0.3
    assert over_replicas([Estimate(1.25, 0.3), Estimate(1.75, 0.4)]) == Estimate(1.5, 0.25, "within 2 replicas: ")
    assert over_replicas([Estimate(1.0, 0.3), Estimate(2.0, 0.4)]).half == 0.5  # they differ by more than either varies
    assert over_replicas([Estimate(1.0, 9.0), Estimate(1.0, 9.0), Estimate(1.0, 0.0), Estimate(1.3, 0.0)]).half < 0.3


@given(st.integers(1, 6), st.floats(-10.0, 10.0), st.lists(st.floats(0.0, 10.0) | st.just(math.inf), min_size=6, max_size=6))
def test_equal_values_have_the_widest_of_their_own_intervals(count, value, halves):
    """They show no spread. Where nothing is random all are 0."""
    assert over_replicas([Estimate(value, half) for half in halves[:count]]).half == max(halves[:count])
    assert math.isinf(over_replicas([Estimate(one, math.inf) for one in (0.1 + 0.2, 0.3, 0.3)]).half)


@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=9), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_no_number_of_replicas_makes_an_interval_narrower_than_what_they_share(values, half, shared):
    found = over_replicas([Estimate(one, half) for one in values], shared=shared)
    assert found.half >= shared and found.value == pytest.approx(np.mean(values), abs=1e-12)


def test_joint_interval_adds_in_quadrature():
    assert joint_limit(3.0, 4.0, math.inf, math.inf, 0.95) == pytest.approx(5.0)


@pytest.mark.parametrize("counts", [(3, 3), (3, 10), (5, 5)])
def test_joint_limit_is_exceeded_as_often_as_it_says(counts):
    random = np.random.default_rng(10)
    tables = [random.standard_normal((4000, count)) * scale for count, scale in zip(counts, (1.0, 2.0), strict=True)]
    means = [[replica_mean(row) for row in table] for table in tables]
    beyond = [abs(one.value - other.value) > joint_limit(one.half, other.half, *counts, 0.95) for one, other in zip(*means, strict=True)]
    assert 0.03 <= np.mean(beyond) <= 0.06
    assert joint_limit(1.0, 1.0, 5, 5, 0.999) > joint_limit(1.0, 1.0, 5, 5, 0.95)
    assert joint_limit(1.96, 0.0, math.inf, math.inf, 0.95) == pytest.approx(1.96, rel=1e-4)
    assert joint_limit(0.0, 0.0, 3, 3, 0.99) == 0.0
    assert joint_limit(math.inf, 0.1, math.inf, 5, 0.99) == joint_limit(0.1, math.inf, 3, 3, 0.95) == math.inf


def test_the_chance_of_a_value_beyond_a_limit_is_that_of_its_interval():
    assert tail_probability(2.0, 2.0, 4.0) == pytest.approx(0.05) == tail_probability(0.3, 0.3, math.inf)
    assert tail_probability(2.0, 1.0, math.inf) == pytest.approx(math.erfc(2.0 * 1.959964 / math.sqrt(2.0)), rel=1e-5)
    assert tail_probability(2.0, 1.0, 2.0) > tail_probability(2.0, 1.0, 9.0) > tail_probability(2.0, 1.0, math.inf)


@pytest.mark.parametrize("degrees", [4.0, 9.5, 200.0])
def test_the_interval_of_a_variance_holds_it_in_95_percent(degrees):
    found = np.random.default_rng(14).chisquare(degrees, 20000) / degrees
    assert np.mean(np.abs(found - 1.0) <= found * variance_half(degrees)) == pytest.approx(0.95, abs=0.005)
    assert variance_half(3.9) == math.inf


@pytest.mark.parametrize("length", [50, 120])
def test_transient_is_cut_off(length):
    random = np.random.default_rng(7)
    series = 1.0 + 0.05 * random.standard_normal(400)
    series[:length] += 3.0 * np.exp(-np.arange(length) / (0.2 * length))
    start = steady_start(series)
    assert 0.2 * length <= start <= 1.7 * length


def test_steady_series_is_kept_and_drift_is_not_called_steady():
    random = np.random.default_rng(8)
    kept = [steady_start(random.standard_normal(400)) for _ in range(40)]
    assert sum(start < 400 for start in kept) >= 38
    assert steady_start(np.linspace(0.0, 1.0, 400) + 0.01 * random.standard_normal(400)) == 400
    assert steady_start(np.ones(20)) == 20


def test_scatter_recovers_bias_and_spread():
    random = np.random.default_rng(9)
    truth = random.uniform(1.0, 100.0, 20000)
    found = scatter(1.2 * truth * (1.0 + 0.08 * random.standard_normal(20000)), truth * (1.0 + 0.05 * random.standard_normal(20000)), 0.05)
    assert found.bias == pytest.approx(1.2, rel=0.005)
    assert found.model / found.bias == pytest.approx(0.08, rel=0.05)
    assert found.reference == 0.05


def test_scatter_of_equal_pairs_has_neither_bias_nor_spread():
    found = scatter([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], 0.1)
    assert (found.bias, found.model) == (1.0, 0.0)
    with pytest.raises(ValueError, match="two pairs"):
        scatter([1.0], [1.0], 0.1)
