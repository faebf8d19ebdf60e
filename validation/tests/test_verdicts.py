"""Verdicts of quantities and of comparisons of engines."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from dembark.common.errors import RunError
from dembark.postproc.measurement import Value
from dembark.postproc.statistics import Estimate, over_replicas, student
from dembark.validation.case.model import Declared
from dembark.validation.judge.comparison import pair
from dembark.validation.judge.result import QuantityRecord, as_json
from dembark.validation.judge.verdict import judge, judged
from dembark.validation.metrics import measure


def entry(value, half, basis="5 replicas"):
    return QuantityRecord("q", value, "info", label="q", interval=None if half is None else (value - half, value + half), basis=basis)


@pytest.mark.parametrize(
    ("one", "other", "verdict"),
    [
        ((1.0, 0.04), (1.04, 0.04), "pass"),
        ((1.0, 0.04), (1.06, 0.04), "info"),
        ((1.0, 0.01), (1.05, 0.01), "fail"),
        ((1.0, 0.2), (1.15, 0.2), "info"),
        ((1.0, 0.05), (1.3, 0.05), "fail"),
        ((1.0, None), (1.0, 0.1), "info"),
        ((0.0, 0.1), (1.0, 0.1), "fail"),
    ],
)
def test_verdict_of_a_pair(one, other, verdict):
    assert pair(entry(*one), entry(*other), "liggghts", "yade").verdict == verdict


@pytest.mark.parametrize(("one", "other", "verdict"), [
    ((0.0, None), (0.0, None), "pass"), ((0.0, None), (1.0, 0.1), "fail"), ((1.0, 0.1), (0.0, None), "fail"),
    ((0.0, None), (1.0, None), "info"), ((1.0, None), (0.0, None), "info"), ((1.0, None), (1.0, None), "info")])
def test_equal_values_in_all_packings_are_compared_alike_in_either_order(one, other, verdict):
    """They have no interval. Nothing in one engine alone is a difference."""
    found = pair(entry(*one, "3 replicas with equal values"), entry(*other, "3 replicas"), "liggghts", "yade")
    assert found.verdict == verdict
    if one[0]:
        assert found.decides in ("", "packings whose values differ, or a finer reading")


@pytest.mark.parametrize("other", [1.0, 1.05, 1.5])
@pytest.mark.parametrize("packings", ["1 replica", "2 replicas"])
def test_engines_with_fewer_than_three_packings_are_not_compared(other, packings):
    single = f"within {packings}: jackknife over 8 sectors or bands"
    found = pair(entry(1.0, 0.01, single), entry(other, 0.01), "liggghts", "yade", planned=int(packings[0]))
    assert found.standing == "information" and found.deviation == pytest.approx(other - 1.0)
    assert "3 packings in each engine" in found.reason
    # What was planned with more, and did not finish or has no interval, is open.
    assert pair(entry(1.0, 0.01, single), entry(other, 0.01), "liggghts", "yade", planned=5).standing == "open"
    assert pair(entry(1.0, None), entry(other, 0.01), "liggghts", "yade", planned=5).standing == "open"


def test_inputs_that_a_source_does_not_state_widen_the_interval_that_is_judged():
    declared = Declared("q", "q", evidence="experiment", tolerance=0.1, why="scatter", absolute=True, source="A. Author (2000)")
    value = Value(over_replicas([Estimate(one, 0.0) for one in (1.04, 1.05, 1.06)]), Estimate(1.0, 0.01))
    known = judged(declared, value)
    assert known.verdict == "pass" and "U_input" not in known.detail
    unknown = judged(replace(declared, input_uncertainty=0.08, inputs="friction 0.1 and 0.5"), value)
    assert unknown.verdict == "info" and unknown.reason.startswith("its interval (±0.084")
    assert unknown.detail.endswith("U_input = 0.08: friction 0.1 and 0.5") and unknown.interval == known.interval
    # Neither more packings nor a better reference decides it.
    assert unknown.decides == "inputs known to ±0.05, now ±0.081"
    # Without a reference there is nothing to widen.
    assert "U_input" not in judged(replace(declared, input_uncertainty=0.08, inputs="friction"), Value(value.estimate)).detail


@pytest.mark.parametrize(("deviation", "half", "samples"), [(0.3, 0.3, False), (0.02, 0.2, False), (0.3, 0.3, True), (0.02, 0.2, True)])
def test_as_many_packings_as_stated_decide_a_comparison(deviation, half, samples):
    def entries(count):
        """Two engines whose packings scatter as in five with the half-width `half`."""
        places = np.arange(count) - 0.5 * (count - 1)
        spread = half * math.sqrt(5) / student(4) * places / places.std(ddof=1)
        both = (over_replicas([Estimate(one, 0.0) for one in mean + sign * spread]) for mean, sign in ((1.0, 1.0), (1.0 + deviation, -1.0)))
        return [QuantityRecord("q", one.value, "info", interval=one.interval, basis=one.basis, samples=one.samples if samples else ())
                for one in both]

    open_one = pair(*entries(5), "liggghts", "yade", 60)
    needed = int(re.search(r"\d+", open_one.decides)[0])
    assert open_one.standing == "open" and needed > 5
    assert pair(*entries(needed), "liggghts", "yade", 60).verdict == ("fail" if deviation > 0.1 else "pass")
    assert pair(*entries(needed - 1), "liggghts", "yade", 60).verdict == "info"


def test_one_of_many_comparisons_may_lie_beyond_its_interval():
    """Five packings in each engine of one and the same truth: all comparisons of a page together fail once in a hundred pages."""
    random = np.random.default_rng(7)
    samples = random.standard_normal((500, 20, 2, 5)) * 0.01 + 1.0
    verdicts = []
    for page in samples:
        estimates = [[over_replicas([Estimate(value, 0.0) for value in engine]) for engine in quantity] for quantity in page]
        verdicts.append({pair(*(entry(one.value, one.half, one.basis) for one in two), "liggghts", "yade", 20).verdict
                         for two in estimates})
    assert sum("fail" in page for page in verdicts) <= 12
    # Beyond its own 95 % interval is one in twenty; what is equivalent passes nevertheless.
    assert sum(page == {"pass"} for page in verdicts) > 480
    assert pair(entry(1.0, 0.01), entry(1.05, 0.01), "liggghts", "yade", 20).verdict == "fail"


def passes(difference: float, noise: float, packings: int, pages: int = 1200) -> float:
    """Share of comparisons that pass, of engines that differ by `difference` (relative); `noise`: what packings vary by."""
    random = np.random.default_rng(8)
    tables = 1.0 + noise * random.standard_normal((pages, 2, packings))
    tables[:, 1] += difference
    found = [[over_replicas([Estimate(value, 0.0) for value in engine]) for engine in page] for page in tables]
    return float(np.mean([pair(*(entry(one.value, one.half, one.basis) for one in two), "liggghts", "yade", 20).verdict == "pass"
                          for two in found]))


@pytest.mark.parametrize("packings", [3, 5, 10])
@pytest.mark.parametrize("noise", [0.003, 0.02, 0.05])
def test_engines_that_differ_by_the_margin_pass_in_one_of_forty_at_most(noise: float, packings: int) -> None:
    """Two one-sided tests at 2.5 % each: what is not equivalent passes no more often; 1200 pages scatter by 0.45 %."""
    assert passes(0.10, noise, packings) <= 0.025 + 3 * 0.0045
    assert passes(-0.10, noise, packings) <= 0.025 + 3 * 0.0045


def test_noise_does_not_pass_for_agreement() -> None:
    """The negative control of "not significantly different": engines 8 % apart, or the same, in runs that are too noisy to tell."""
    assert passes(0.08, 0.1, 3) < 0.01 and passes(0.0, 0.1, 3) < 0.05
    # Equal engines do pass where packings vary little.
    assert passes(0.0, 0.01, 5) > 0.98


@pytest.mark.parametrize(
    ("deviation", "half", "verdict"),
    [
        (0.05, 0.02, "pass"),
        (-0.1, 0.0, "pass"),
        (0.08, 0.03, "info"),
        (-0.1, 0.1, "info"),
        (0.11, 0.02, "fail"),
        (0.0, 0.2, "info"),
        (0.5, float("inf"), "info"),
        (0.0, float("nan"), "info"),
    ],
)
def test_a_pass_needs_the_whole_interval_within_the_tolerance(deviation, half, verdict):
    assert judge(deviation, half, 0.1)[0] == verdict


def test_nan_fails():
    broken = judged(Declared("q", "q", tolerance=0.1), Value(Estimate(float("nan"), 0.1), Estimate(1.0, 0.0)))
    assert broken.verdict == "fail"
    assert as_json(broken)["value"] is None


def test_a_reference_of_zero_has_no_relative_deviation():
    declared = Declared("q", "q", tolerance=0.1)
    broken = judged(declared, Value(Estimate(0.05, 0.0), Estimate(0.0, 0.0)))
    assert broken.verdict == "fail" and "the reference is 0" in broken.reason and "absolute = true" in broken.reason
    assert judged(replace(declared, absolute=True), Value(Estimate(0.05, 0.0), Estimate(0.0, 0.0))).verdict == "pass"


def test_a_bound_that_is_not_finite_is_none_in_the_file() -> None:
    """A column too small for an interval allows anything; JSON has no number for that."""
    entry = as_json(judged(Declared("field_balance", "balance", tolerance=math.inf, absolute=True),
                           Value(Estimate(0.1, math.inf), Estimate(0.0, 0.0))))
    assert entry["tolerance"] is None and entry["interval"] is None
    json.dumps(entry, allow_nan=False)


def test_no_replica_is_told(tmp_path):
    with pytest.raises(RunError, match="nothing to measure"):
        measure(tmp_path)


def packed(shared: float, own: float, difference: float, random: np.random.Generator, packings: int = 5):
    """The verdict on two engines that start from the same packings, which scatter by `shared`; each engine adds `own` and one of them the
    `difference`, all relative."""
    packing = 1.0 + shared * random.standard_normal(packings)
    both = [packing + own * random.standard_normal(packings) + more for more in (0.0, difference)]
    return pair(*(QuantityRecord("q", one.value, "info", interval=one.interval, basis=one.basis, samples=one.samples)
                  for one in (over_replicas([Estimate(value, 0.0) for value in values]) for values in both)), "liggghts", "yade", 20)


def test_what_a_packing_does_to_all_engines_is_no_part_of_their_difference():
    random = np.random.default_rng(9)
    found = [packed(0.3, 0.003, 0.0, random) for _ in range(200)]
    assert {one.verdict for one in found} == {"pass"} and max(one.joint_half_width for one in found) < 0.02
    assert {packed(0.3, 0.003, 0.05, random).verdict for _ in range(50)} == {"fail"}
    # Without the values of each packing the same engines cannot be compared.
    assert pair(entry(1.0, 0.3), entry(1.05, 0.3), "liggghts", "yade").verdict == "info"


def test_differences_of_the_schemes_below_one_per_cent_do_not_fail_because_packings_are_paired():
    random = np.random.default_rng(10)
    assert {packed(0.1, 1e-5, 0.007, random).verdict for _ in range(50)} == {"pass"}
    assert {packed(0.1, 1e-5, 0.014, random).verdict for _ in range(50)} == {"fail"}
    # They fail where independent packings would show them.
    assert {packed(1e-4, 1e-4, 0.009, random).verdict for _ in range(50)} == {"fail"}


def test_pairs_fail_by_chance_as_seldom_as_independent_packings():
    random = np.random.default_rng(11)
    pages = [{packed(0.1, 0.02, 0.0, random).verdict for _ in range(20)} for _ in range(300)]
    assert sum("fail" in page for page in pages) <= 8
