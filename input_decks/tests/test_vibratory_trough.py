"""Beds in a vibrated trough with known motions: circulation, a part that rides in them, and the spectrum of the force on the walls."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dembark.input_decks.common.vibration import PHASES
from dembark.input_decks.common.vibratory_trough import circulation, drifts, numerical_changes, spectra, spectrum
from dembark.input_decks.tests.synthetic_bed import PERIOD, D, trough


@pytest.mark.parametrize("turning", [0.5, -0.3, 0.0])
def test_a_bed_that_turns_as_a_body(tmp_path: Path, turning: float) -> None:
    one = trough(tmp_path, turning=turning)
    # Of a chord and its radius to the middle: tan of half the angle.
    expected = 2.0 * np.tan(0.5 * turning * PERIOD) / PERIOD
    assert one.turning().value == pytest.approx(expected, abs=1e-4)
    assert one.revolution().value == pytest.approx(turning, rel=0.01, abs=1e-4)
    curve = drifts([one])
    known = [(r * D, v) for r, v in zip(curve["place"], curve["value"], strict=True) if v is not None]
    np.testing.assert_allclose([v for _, v in known], [turning * r for r, _ in known], atol=abs(turning) * 0.7 * D + 1e-6)


def test_circulation_leaves_out_what_all_do_together() -> None:
    random = np.random.default_rng(1)
    places, masses = random.uniform(-1.0, 1.0, (50, 3)), random.uniform(1.0, 2.0, 50)
    ways = 1e-4 * np.column_stack([places[:, 2], 0.0 * masses, -places[:, 0]])
    assert circulation(places, ways, masses) == pytest.approx(1e-4, rel=1e-6)
    assert circulation(places + np.array([5.0, 0.0, -3.0]), ways + np.array([0.01, 0.0, 0.02]), masses) == pytest.approx(1e-4, rel=1e-4)


def test_a_part_like_a_grain_and_one_that_stays(tmp_path: Path) -> None:
    assert abs(trough(tmp_path, noise=1e-4).likeness()) < 2.6
    assert trough(tmp_path, noise=1e-4, still=True).likeness() < -2.6


def test_stirring_grows_with_what_is_random(tmp_path: Path) -> None:
    low, high = (trough(tmp_path, noise=noise).fluctuation_ratio().value for noise in (2e-5, 2e-4))
    assert low < 0.5 * high


def test_agitation_is_what_is_random_over_the_way_of_the_drive(tmp_path: Path) -> None:
    one = trough(tmp_path, turning=0.0, noise=2e-4)
    # PHASES steps at random along x and z, less what the mean of a cell with some 16 grains takes.
    assert one.agitation().value == pytest.approx(2e-4 * np.sqrt(2 * PHASES * (1.0 - 1.0 / 16.0)) / (PERIOD * 0.25), rel=0.03)


def test_power_and_force_of_the_drive(tmp_path: Path) -> None:
    one = trough(tmp_path)
    assert one.power("trough").value == pytest.approx(0.3)
    harmonics, power = one.spectrum("trough")
    # F / (M g) = 1 + 0.5 cos(wt), averaged over a row of 1/128 period.
    assert harmonics[np.argmax(power)] == pytest.approx(1.0) and power.max() == pytest.approx(0.125, rel=1e-3)
    assert one.noise("trough") < 1e-6
    curve = spectra([one], "trough")
    assert curve["place"][0] == 0.0 and 10.0 ** curve["value"][0] == pytest.approx(np.sqrt(0.125), rel=1e-3)


@pytest.mark.parametrize("count", [240, 241])
def test_the_spectrum_sums_up_to_the_variance(count: int) -> None:
    forces = np.random.default_rng(2).standard_normal((count, 3))
    _, power = spectrum(forces, 10)
    assert power.sum() == pytest.approx(forces.var(axis=0).sum())


@pytest.mark.parametrize("count", [2, 4, 6])
def test_the_largest_change_of_points_that_are_the_same_is_none(count: int) -> None:
    """Of the two that are furthest apart the interval of one difference would miss zero in up to a third of all cases."""
    random, missed = np.random.default_rng(count), 0
    for _ in range(1000):
        points = [{"quantities": [{"name": "spin", "value": value, "interval": [value - 0.0196, value + 0.0196]}]}
                  for value in random.normal(1.0, 0.01, count)]
        found = numerical_changes(points, ["spin"]).values["spin_change"].estimate
        missed += found.value > found.half
    assert 0.01 < missed / 1000 < 0.07
