"""Waves that are put in come out: their power, length and frequency, with noise; and the drive at which they begin."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.input_decks.common.vibration import PHASES
from dembark.input_decks.vibrated_layer.standing_waves import WINDOW, Waves, amplitude, onset, surface_levels

D, LENGTH, CELLS = 0.005, 0.4, 40


def surface(height: float = 0.4, waves: int = 5, part: float = 0.5, noise: float = 0.0, periods: int = 16, speed: float = 0.0) -> Waves:
    """A standing wave of `height` (d) with `waves` on the length at `part` of the drive's frequency; or one that travels, where `speed` is
    not 0."""
    random = np.random.default_rng(1)
    turn = 2.0 * np.pi * part * np.arange(periods * PHASES)[:, None] / PHASES
    place = 2.0 * np.pi * waves * (np.arange(CELLS) + 0.5) / CELLS
    moved = np.cos(place - np.sign(speed) * turn) if speed else np.cos(place) * np.cos(turn)
    return Waves(D * (5.0 + height * moved + noise * random.standard_normal(moved.shape)), LENGTH, D)


@settings(max_examples=40, deadline=None)
@given(height=st.floats(0.1, 3.0), waves=st.integers(1, 19), line=st.integers(1, 4 * WINDOW - 1))
def test_a_standing_wave_has_its_amplitude_length_and_frequency(height: float, waves: int, line: int) -> None:
    one = surface(height, waves, line / WINDOW)
    assert one.mode() == waves and one.wavelength() == pytest.approx(LENGTH / waves)
    assert one.strongest() == pytest.approx(line / WINDOW)
    assert amplitude(one.power[:, waves, line].mean()) == pytest.approx(height)


def test_all_powers_are_the_mean_square() -> None:
    one = surface(0.4, noise=0.3)
    windows = (one.heights / D).reshape(-1, WINDOW * PHASES, CELLS)
    np.testing.assert_allclose(one.power.sum(axis=(1, 2)), (windows**2).mean(axis=(1, 2)), rtol=1e-12)


@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_a_wave_that_travels_has_half_the_square_of_its_amplitude(speed: float) -> None:
    one = surface(0.4, speed=speed)
    assert one.line(0.5)[4] == pytest.approx(0.5 * 0.4**2)


def test_noise_is_alike_in_all_lines() -> None:
    one = surface(0.0, noise=0.3, periods=64)
    assert one.peak() == pytest.approx(1.0, abs=0.2)
    assert abs(one.subharmonic()) < 0.2 * one.noise().sum()


def test_a_wave_shows_above_noise_and_has_its_mean_length() -> None:
    one = surface(0.3, waves=4, noise=0.2, periods=64)
    assert one.peak() > 5.0 and one.strongest() == 0.5
    assert amplitude(one.subharmonic()) == pytest.approx(0.3, rel=0.05)
    assert one.mean_wavelength() == pytest.approx(LENGTH / 4, rel=0.15)


def test_a_layer_that_jumps_as_a_whole_is_no_wave() -> None:
    jump = 0.5 * np.cos(np.pi * np.arange(16 * PHASES) / PHASES)[:, None] + np.zeros(CELLS)
    one = Waves(D * (5.0 + jump), LENGTH, D)
    assert amplitude(one.doubling_power()) == pytest.approx(math.sqrt(2.0) * 0.5) and one.line(0.5).sum() < 1e-25


def test_too_few_frames_are_refused() -> None:
    with pytest.raises(ValueError, match="needs 8 periods of 8 frames"):
        surface(periods=7)


def layer(heights: Any, flying: int = 0) -> Any:
    """Columns of grains on a lattice, 2 x 4 in each cell of 2 d by 4 d, as high as `heights` (layers) says; and `flying` grains far above
    the first."""
    place = [((2 * cell + i + 0.5) * D, (j + 0.5) * D, (k + 0.5) * D) for cell, height in enumerate(heights)
             for i in range(2) for j in range(4) for k in range(height)]
    place += [(0.5 * D, 0.5 * D, (30.0 + k) * D) for k in range(flying)]
    return SimpleNamespace(positions=np.array(place), radii=np.full(len(place), 0.5 * D))


def test_the_surface_is_where_half_a_layer_lies_above() -> None:
    found = surface_levels(layer([5, 7, 6, 5], flying=1), 8 * D, 4 * D, D)
    np.testing.assert_allclose(found, D * (np.array([5, 7, 6, 5]) - 0.5))


def test_an_empty_cell_has_no_surface() -> None:
    found = surface_levels(layer([5, 0, 6, 5]), 8 * D, 4 * D, D)
    assert np.isnan(found[1]) and np.isfinite(found[[0, 2, 3]]).all()


def test_places_beyond_the_period_count_where_they_are_in_it() -> None:
    one = layer([5, 7, 6, 5])
    moved = SimpleNamespace(positions=one.positions + np.array([24 * D, 0.0, 0.0]), radii=one.radii)
    np.testing.assert_allclose(surface_levels(moved, 8 * D, 4 * D, D), surface_levels(one, 8 * D, 4 * D, D))


@settings(max_examples=40, deadline=None)
@given(critical=st.floats(2.0, 3.0), slope=st.floats(0.05, 2.0))
def test_onset_of_a_power_that_grows_linearly(critical: float, slope: float) -> None:
    drive = np.array([1.5, 2.0, 3.1, 3.2, 3.4, 3.6])
    power = slope * np.maximum(drive - critical, 0.0)
    found = onset(drive, power, np.zeros(6), power > 0.01 * slope)
    assert found.value == pytest.approx(critical) and found.half < 1e-6


def test_the_interval_of_an_onset_holds_it() -> None:
    random, drive, held = np.random.default_rng(2), np.linspace(2.6, 3.4, 5), 0
    for _ in range(300):
        found = onset(drive, drive - 2.4 + 0.03 * random.standard_normal(5), np.full(5, 0.0), np.ones(5, bool))
        held += abs(found.value - 2.4) < found.half
    assert held >= 270


def test_an_onset_of_points_without_intervals_rests_on_their_scatter() -> None:
    drive, power = np.array([2.6, 2.8, 3.0, 3.2]), np.array([0.11, 0.29, 0.52, 0.68])
    known, unknown = (onset(drive, power, np.full(4, half), np.ones(4, bool)) for half in (0.0, math.inf))
    assert known == unknown and 0.0 < known.half < 0.2


def test_a_power_that_falls_again_does_not_bend_the_line() -> None:
    """Far beyond the onset waves saturate: points beyond the largest power are none of the line."""
    drive = np.array([2.4, 2.6, 2.8, 3.0, 3.2, 3.4])
    power = np.array([0.0, 0.1, 0.2, 0.3, 0.25, 0.2])
    assert onset(drive, power, np.zeros(6), power > 0.01).value == pytest.approx(2.4, rel=1e-12)


def test_too_few_points_above_noise_have_no_onset() -> None:
    seen = np.array([False, False, True, True])
    assert math.isinf(onset(np.array([2.0, 2.5, 3.0, 3.5]), np.array([0.0, 0.0, 0.5, 1.0]), np.zeros(4), seen).half)
    assert math.isnan(onset(np.array([2.0, 2.5, 3.0]), np.array([3.0, 2.0, 1.0]), np.zeros(3), np.ones(3, bool)).value)
