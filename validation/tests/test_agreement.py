"""Numbers of runs in which nothing is random are compared by a stated bound, others by their intervals."""

import math
from dataclasses import replace

import pytest

from dembark.postproc.measurement import Value
from dembark.postproc.statistics import Estimate, exact
from dembark.validation.case.folders import discover
from dembark.validation.case.model import Declared
from dembark.validation.judge.comparison import pair
from dembark.validation.judge.result import as_json
from dembark.validation.judge.verdict import judged


def entry(value, agreement, half=0.0):
    return judged(Declared("speed", "speed", "m/s", agreement=agreement), Value(exact(value, half)))


@pytest.mark.parametrize(
    ("one", "other", "verdict"),
    [
        (1.0, 1.0 + 5e-10, "pass"),
        (1.0, 1.0 + 2e-9, "fail"),
        (0.0, 5e-10, "pass"),
        (0.0, 2e-9, "fail"),
        (math.nan, 1.0, "fail"),
        (1.0, math.nan, "fail"),
    ],
)
def test_deterministic_numbers_agree_within_their_bound(one, other, verdict):
    found = pair(entry(one, 1e-9), entry(other, 1e-9), "liggghts", "yade")
    assert found.verdict == verdict
    if verdict == "pass":
        assert found.deviation_kind == "absolute" and found.tolerance == 1e-9


@pytest.mark.parametrize(("value", "half", "verdict"), [(0.0, 0.0, "pass"), (0.2, 0.1, "fail"), (0.2, 0.3, "info")])
def test_what_does_not_happen_in_one_engine_must_not_in_the_other(value, half, verdict):
    found = pair(entry(0.0, None), entry(value, None, half), "liggghts", "yade")
    assert found.verdict == verdict and found.deviation is None
    assert pair(entry(0.0, None), entry(value, None, half), "liggghts", "yade", planned=1).verdict == verdict


def test_numbers_without_a_bound_are_compared_by_their_intervals():
    assert "agreement" not in as_json(entry(1.0, None))
    assert pair(entry(1.0, None, 0.03), entry(1.04, None, 0.03), "liggghts", "yade").verdict == "pass"
    assert pair(entry(1.0, None, 0.06), entry(1.05, None, 0.06), "liggghts", "yade").verdict == "info"
    assert pair(entry(1.0, None), entry(1.05, None), "liggghts", "yade").verdict == "fail"


@pytest.mark.parametrize("case", sorted(discover()))
def test_one_engine_that_is_off_fails_each_comparison(case):
    """The negative control of comparisons, of every quantity as it is declared."""
    for one in discover()[case].quantities.values():
        random = one.agreement is None
        off, half, basis = (0.25, 0.01, "5 replicas") if random else (max(2.0 * one.agreement, 1e-12), 0.0, "")
        first, same, wrong = (judged(replace(one, tolerance=None), Value(Estimate(value, half, basis))) for value in (1.0, 1.0, 1.0 + off))
        if one.compared:
            assert pair(first, same, "liggghts", "yade").verdict == "pass", one.name
            assert pair(first, wrong, "liggghts", "yade").verdict == "fail", one.name
            assert pair(first, wrong, "liggghts", "yade").control
