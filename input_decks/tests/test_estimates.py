"""Means over the runs of a chaotic motion, of numbers that are read in steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dembark.input_decks.common.estimates import STEP, over_chaotic
from dembark.validation.judge.comparison import pair
from dembark.validation.judge.result import QuantityRecord


def readings(step: float, count: int = 2000) -> np.ndarray:
    """Three each of numbers that scatter by 0.3 about 28.3, read in steps."""
    return step * np.round((28.3 + 0.3 * np.random.default_rng(1).standard_normal((count, 3))) / step)


def test_three_equal_numbers_do_not_show_that_nothing_varies() -> None:
    found = over_chaotic([0.028] * 3)
    assert math.isinf(found.half) and found.basis.startswith("3 replicas with equal values")
    assert over_chaotic([0.028] * 3, 0.0005).half == 0.0005
    assert math.isinf(over_chaotic([0.028], 0.0005).half) and math.isinf(over_chaotic([0.028] * 2, 0.0005).half)


@pytest.mark.parametrize("read", [STEP, math.inf])
def test_intervals_of_numbers_that_are_read_in_steps_hold_their_mean(read: float) -> None:
    found = [over_chaotic(row, read) for row in readings(1.0)]
    assert np.mean([abs(one.value - 28.3) <= one.half for one in found]) >= 0.94


@pytest.mark.parametrize("read", [STEP, math.inf])
def test_engines_that_are_alike_do_not_fail_by_the_steps_of_a_reading(read: float) -> None:
    records = [QuantityRecord("q", one.value, "info", interval=one.interval if math.isfinite(one.half) else None, basis=one.basis)
               for one in (over_chaotic(row, read) for row in readings(1.0, 1000))]
    verdicts = [pair(one, other, "liggghts", "yade", 10, 3).verdict for one, other in zip(records[::2], records[1::2], strict=True)]
    assert verdicts.count("fail") <= 2  # 0.1 % are allowed by chance
