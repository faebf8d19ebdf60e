"""What decides an open check, and whether that many packings do decide it."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from dembark.postproc.statistics import replica_mean
from dembark.validation.judge.decision import decides
from dembark.validation.judge.verdict import judge


@given(st.integers(3, 12), st.floats(-0.3, 0.3), st.floats(0.01, 3.0))
def test_that_many_packings_of_the_same_scatter_decide_and_fewer_do_not(count: int, deviation: float, scatter: float) -> None:
    def half(packings: int) -> float:
        values = np.arange(packings) - 0.5 * (packings - 1)
        return replica_mean(scatter * values / values.std(ddof=1)).half

    assume(judge(deviation, half(count), 0.1)[0] == "info" and abs(abs(deviation) - 0.1) > 1e-6)
    needed = int(re.fullmatch(r"(?:about|more than) (\d+) packings", decides(deviation, half(count), 0.0, 0.1, f"{count} replicas"))[1])
    if needed < 1000:
        assert judge(deviation, 0.999999 * half(needed), 0.1)[0] == ("pass" if abs(deviation) < 0.1 else "fail")
        assert needed == count or judge(deviation, half(needed - 1), 0.1)[0] == "info"


@pytest.mark.parametrize(("own", "reference", "basis", "words"), [
    (0.2, 0.0, "within 1 replica: 5 blocks", "3 packings or more"),
    (0.2, 0.0, "within 2 replicas: 5 blocks", "3 packings or more, or runs about 4 times as long"),
    (0.2, 0.0, "8 time blocks", "runs about 4 times as long"),
    (0.104, 0.0, "8 time blocks", "runs about 1.1 times as long"),
    (math.inf, 0.0, "one run", "3 packings or more"),
    (math.inf, 0.0, "3 replicas with equal values: one run", "packings whose values differ, or a finer reading"),
    (0.2, 0.0, "the inputs", "inputs known well enough to change the value by at most ±0.1, now ±0.2"),
    (0.01, 0.3, "5 replicas", "a reference known to ±0.1, now ±0.3"),
    (0.01, 0.1004, "5 replicas", "a reference known to ±0.1, now ±0.1004"),
    (0.01, math.inf, "5 replicas", "a reference with an interval")])
def test_what_decides_depends_on_where_the_interval_comes_from(own: float, reference: float, basis: str, words: str) -> None:
    assert decides(0.0, own, reference, 0.1, basis) == words


def test_what_no_number_of_packings_decides_is_not_given_one() -> None:
    assert decides(0.0999999, 0.2, 0.0, 0.1, "5 replicas") == "more than 1000 packings"


def test_nothing_decides_what_is_no_number() -> None:
    assert not decides(math.nan, 0.1, 0.0, 0.1, "5 replicas")
