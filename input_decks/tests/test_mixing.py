"""Mixed and separated grains have the indices that they must have; drifts and rates that are put in come out."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.input_decks.common.drive_phases import Phases
from dembark.input_decks.common.vibration import PHASES
from dembark.input_decks.vibro_mixing.mixing import cells, lacey_index, lower_half, mixing_rate, rate, samples, segregation, wall_drift

D = 0.005
# 30 x 12 grains on a lattice, and their samples of 3 x 3.
PLACES = np.array([((i + 0.5) * D, (k + 0.5) * D) for i in range(30) for k in range(12)])
EDGES = (np.linspace(0.0, 30 * D, 11), np.linspace(0.0, 12 * D, 5))
SAMPLES = samples(PLACES, EDGES)


@pytest.mark.parametrize("axis", [0, 1])
def test_separated_grains_have_the_index_0(axis: int) -> None:
    assert lacey_index(lower_half(PLACES[:, axis]), SAMPLES) == pytest.approx(0.0, abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(share=st.floats(0.1, 0.9), seed=st.integers(0, 10**6))
def test_random_labels_have_the_index_1(share: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    labels = np.arange(len(PLACES)) < share * len(PLACES)
    found = np.mean([lacey_index(random.permutation(labels), SAMPLES) for _ in range(50)])
    # 50 means over 40 samples.
    assert found == pytest.approx(1.0, abs=0.03)


def test_grains_in_perfect_order_are_mixed_better_than_at_random() -> None:
    chess = (np.arange(len(PLACES)) // 12 + np.arange(len(PLACES)) % 12) % 2 == 0
    assert 1.0 < lacey_index(chess, SAMPLES) < 9.0 / 8.0


def test_what_has_no_index_is_no_number() -> None:
    assert math.isnan(lacey_index(np.ones(len(PLACES), bool), SAMPLES))
    assert math.isnan(lacey_index(lower_half(PLACES[:, 0]), np.arange(len(PLACES))))


def test_cells_cover_all_places() -> None:
    edges = cells(PLACES, 3.0 * D)
    assert [len(edge) - 1 for edge in edges] == [10, 4]
    np.testing.assert_array_equal(np.bincount(samples(PLACES, edges)), np.full(40, 9))


def test_segregation_of_layers_and_of_sides() -> None:
    # Middles 3 and 9 layers high, of which the lowest is 0 and the height 11.
    assert segregation(~lower_half(PLACES[:, 1]), PLACES[:, 1]) == pytest.approx(6.0 / 11.0)
    assert segregation(lower_half(PLACES[:, 1]), PLACES[:, 1]) == pytest.approx(-6.0 / 11.0)
    assert segregation(lower_half(PLACES[:, 0]), PLACES[:, 1]) == pytest.approx(0.0, abs=1e-12)


def test_rates_with_intervals_that_hold_them() -> None:
    random, held = np.random.default_rng(5), 0
    for _ in range(300):
        found = rate(0.02 * np.arange(40) + 0.1 * random.standard_normal(40))
        held += abs(found.value - 0.02) < found.half
    assert held >= 280
    assert math.isinf(rate(np.arange(6.0)).half) and math.isnan(rate(np.arange(2.0)).value)


def test_the_mixing_rate_is_that_of_what_is_left() -> None:
    found = mixing_rate(1.0 - 0.9 * np.exp(-0.05 * np.arange(60)))
    assert found.value == pytest.approx(0.05) and found.half < 1e-9


def convection(speed: float, seed: int = 0) -> Phases:
    """Grains that go down by `speed` (d) a period within 2 d of the walls, and up between them so that nothing piles up; they shake."""
    random, near = np.random.default_rng(seed), np.minimum(PLACES[:, 0], 30 * D - PLACES[:, 0]) < 2.0 * D
    drift = np.where(near, -speed, speed * near.sum() / (~near).sum())

    def frame(number: int) -> Any:
        moved = drift * number / PHASES + 0.3 * math.sin(2.0 * np.pi * number / PHASES) + 0.05 * random.standard_normal(len(PLACES))
        return SimpleNamespace(positions=np.column_stack([PLACES[:, 0], np.zeros(len(PLACES)), PLACES[:, 1] + D * moved]))

    numbers = np.arange(20 * PHASES + 1)
    return Phases([frame(int(k)) for k in numbers], numbers, 0.1)


def test_drift_at_the_walls() -> None:
    found = wall_drift(convection(0.1), 0.0, 30 * D, D)
    assert found.value == pytest.approx(-0.1, abs=0.02) and found.half < 0.05


def test_no_drift_is_within_its_interval() -> None:
    found = wall_drift(convection(0.0), 0.0, 30 * D, D)
    assert abs(found.value) < found.half


def test_the_drift_of_a_run_backwards_is_the_opposite() -> None:
    """Of grains that wander to the walls and away, the farther the higher they are."""
    random, places, frames = np.random.default_rng(2), PLACES.copy(), []
    for _ in range(40):
        frames.append(SimpleNamespace(positions=np.column_stack([places[:, 0], np.zeros(len(places)), places[:, 1]])))
        places = places + random.standard_normal(places.shape) * places[:, 1:] * [0.3, 0.2]

    def drift(each: list[Any]) -> float:
        filled = [frame for frame in each for _ in range(PHASES)][: 1 - PHASES]
        return wall_drift(Phases(filled, np.arange(len(filled)), 0.1), 0.0, 30 * D, D).value

    assert abs(drift(frames)) > 1e-3
    assert drift(frames[::-1]) == pytest.approx(-drift(frames), rel=1e-9)
