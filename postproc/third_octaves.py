"""Third-octave bands of IEC 61260-1:2014 (base ten), the mean squares of a signal in them, and those of a train of half-sine pulses.

A pulse of peak P that lasts T has the Fourier transform of size 2 P T / pi |cos(pi f T) / (1 - (2 f T)^2)|. Pulses at random times are
incoherent: their energies add up, and the one-sided spectral density is 2 / W sum |F_i|^2 in a window W (Campbell's theorem).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import rfft

Array = NDArray[np.float64]

# Ratio of an octave, and the frequency (Hz) of band 0.
OCTAVE, REFERENCE = 10.0**0.3, 1000.0
# Points of Gauss's rule in a band.
POINTS = 32
# Pulses at a time, so that memory does not grow with their number.
_BLOCK = 2000


@dataclass(frozen=True)
class Bands:
    """Third-octave bands `numbers` (b,), consecutive; band 0 is that of 1 kHz."""

    numbers: NDArray[np.int64]

    @classmethod
    def covering(cls, low: float, high: float) -> Bands:
        """From the band of `low` to that of `high` (Hz)."""
        first, last = band_of(np.array([low, high]))
        return cls(np.arange(first, last + 1))

    @property
    def middles(self) -> Array:
        """Exact mid-band frequencies (b,) in Hz."""
        return np.asarray(REFERENCE * OCTAVE ** (self.numbers / 3.0))

    @property
    def edges(self) -> Array:
        """Edges (b + 1,) in Hz."""
        return np.asarray(REFERENCE * OCTAVE ** (np.append(self.numbers - 0.5, self.numbers[-1] + 0.5) / 3.0))


def band_of(frequencies: ArrayLike) -> NDArray[np.int64]:
    """Number of the band in which each of the `frequencies` (Hz, > 0) is; a lower edge belongs to its band."""
    return np.asarray(np.floor(3.0 * np.log(np.asarray(frequencies) / REFERENCE) / math.log(OCTAVE) + 0.5), np.int64)


def mean_squares(signal: Array, interval: float) -> tuple[Bands, Array]:
    """Bands from the first to the last that a `signal` (n,) or (n, components), sampled every `interval` (s), has, and its mean square (b,)
    about the mean in each, summed over the components: their sum is its variance (Parseval). Each line of the discrete spectrum counts in
    the band in which it lies; a band narrower than 1 / (n interval) may have none."""
    values = np.asarray(signal, float).reshape(len(signal), -1)
    count = len(values)
    if count < 2:
        raise ValueError(f"a spectrum needs two samples, not {count}")
    lines = np.abs(np.asarray(rfft(values - values.mean(axis=0), axis=0))) ** 2
    sides = np.full(len(lines), 2.0)
    if count % 2 == 0:
        sides[-1] = 1.0
    power = (sides * lines.sum(axis=1) / count**2)[1:]
    number = band_of(np.arange(1, len(lines)) / (count * interval))
    return Bands(np.arange(number[0], number[-1] + 1)), np.bincount(number - number[0], power).astype(float)


def half_sine(frequencies: ArrayLike, peak: ArrayLike, duration: ArrayLike) -> Array:
    """Size (N s) of the Fourier transform of half-sine pulses of `peak` (N) and `duration` (s) at `frequencies` (Hz); broadcast."""
    x = 2.0 * np.asarray(frequencies, float) * np.asarray(duration, float)
    away = np.abs(x - 1.0) > 1e-6
    # The limit at f = 1 / (2 T) is pi / 4.
    shape = np.where(away, np.abs(np.cos(0.5 * np.pi * x) / np.where(away, 1.0 - x**2, 1.0)), 0.25 * np.pi)
    return np.asarray(2.0 / np.pi * np.asarray(peak, float) * np.asarray(duration, float) * shape)


def pulse_mean_squares(bands: Bands, peaks: Array, durations: Array, window: float) -> Array:
    """Mean squares (N^2, (b,)) in `bands` of half-sine pulses at random times, with `peaks` (n,) in N and `durations` (n,) in s, in a
    `window` (s): the integral of their spectral density over each band."""
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    low, width = bands.edges[:-1, None], np.diff(bands.edges)[:, None]
    frequencies, parts = low + 0.5 * width * (points + 1.0), 0.5 * width * weights
    energy = np.zeros_like(frequencies)
    for start in range(0, len(peaks), _BLOCK):
        some = slice(start, start + _BLOCK)
        energy += (half_sine(frequencies[..., None], peaks[some], durations[some]) ** 2).sum(axis=-1)
    return np.asarray(2.0 / window * (energy * parts).sum(axis=1))
