"""Third octaves: the bands of the standard, tones, Parseval's sum, and pulses whose spectrum is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dembark.postproc.third_octaves import Bands, band_of, half_sine, mean_squares, pulse_mean_squares

# IEC 61260-1:2014, table E.1: exact frequencies of the base-ten system, rounded to five digits.
EXACT = [19.953, 25.119, 31.623, 39.811, 50.119, 63.096, 79.433, 100.0, 125.89, 158.49, 199.53, 251.19, 316.23, 398.11, 501.19, 630.96,
         794.33, 1000.0]


def test_the_bands_are_those_of_the_standard() -> None:
    bands = Bands.covering(20.0, 1000.0)
    np.testing.assert_allclose(bands.middles, EXACT, rtol=3e-5)
    np.testing.assert_allclose(bands.edges[-2:], [891.25, 1122.02], rtol=1e-5)
    np.testing.assert_allclose(np.diff(np.log10(bands.edges)), 0.1, rtol=1e-12)


@given(st.floats(0.01, 1e6))
def test_a_frequency_is_within_the_edges_of_its_band(frequency: float) -> None:
    low, high = Bands(band_of([frequency])).edges
    assert low * (1.0 - 1e-12) <= frequency <= high * (1.0 + 1e-12)


@pytest.mark.parametrize("number", [-15, -3, 0, 6, 10])
def test_a_tone_is_in_its_band_alone(number: int) -> None:
    rate, count = 40_000.0, 40_000
    tone = np.round(Bands(np.array([number])).middles[0])
    signal = 5.0 + 3.0 * np.sin(2.0 * np.pi * tone * np.arange(count) / rate)
    bands, squares = mean_squares(signal, 1.0 / rate)
    assert squares[bands.numbers == number] == pytest.approx(4.5)
    assert squares[bands.numbers != number].max() < 1e-20


@pytest.mark.parametrize("shape", [(999,), (1000,), (1000, 3)])
def test_the_sum_over_all_bands_is_the_variance(shape: tuple[int, ...]) -> None:
    signal = np.random.default_rng(1).standard_normal(shape)
    _, squares = mean_squares(signal, 1e-3)
    assert squares.sum() == pytest.approx(signal.var(axis=0).sum(), rel=1e-12)


def test_one_sample_has_no_spectrum() -> None:
    with pytest.raises(ValueError, match="two samples"):
        mean_squares(np.ones(1), 1e-3)


@pytest.mark.parametrize("frequency", [0.0, 130.0, 500.0, 500.0005, 1499.0, 4e3])
def test_the_spectrum_of_one_pulse_is_its_fourier_integral(frequency: float) -> None:
    peak, lasts = 7.0, 1e-3
    time, weights = np.polynomial.legendre.leggauss(200)
    time, weights = 0.5 * lasts * (time + 1.0), 0.5 * lasts * weights
    due = abs((weights * peak * np.sin(np.pi * time / lasts) * np.exp(-2j * np.pi * frequency * time)).sum())
    assert half_sine(frequency, peak, lasts) == pytest.approx(due, rel=1e-5, abs=1e-12)


def test_a_train_of_pulses_has_the_closed_spectrum() -> None:
    """Pulses of two kinds at random times, sampled; and every band of them within the scatter of 4000 pulses."""
    random = np.random.default_rng(3)
    window, rate = 10.0, 50_000.0
    peaks, lasts = np.repeat([2.0, 1.0], 2000), np.repeat([4e-4, 1e-3], 2000)
    signal, time = np.zeros(int(window * rate)), np.arange(int(window * rate)) / rate
    for begin, peak, last in zip(random.uniform(0.0, window - 1e-3, len(peaks)), peaks, lasts, strict=True):
        inside = slice(int(np.ceil(begin * rate)), int(np.ceil((begin + last) * rate)))
        signal[inside] += peak * np.sin(np.pi * (time[inside] - begin) / last)
    bands, squares = mean_squares(signal, 1.0 / rate)
    wide = (bands.middles > 100.0) & (bands.middles < 5000.0)
    found = squares / pulse_mean_squares(bands, peaks, lasts, window)
    np.testing.assert_allclose(found[wide], 1.0, atol=0.15)
    # Pulses that last half as long have another spectrum.
    assert np.abs(squares / pulse_mean_squares(bands, peaks, 0.5 * lasts, window) - 1.0)[wide].max() > 1.0


def test_long_trains_are_summed_in_parts() -> None:
    bands, one = Bands.covering(100.0, 1000.0), pulse_mean_squares(Bands.covering(100.0, 1000.0), np.ones(1), np.full(1, 1e-3), 1.0)
    np.testing.assert_allclose(pulse_mean_squares(bands, np.ones(4500), np.full(4500, 1e-3), 1.0), 4500 * one, rtol=1e-12)
