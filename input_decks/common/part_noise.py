"""Noise of a part that grains hammer: the force on it in third octaves, as recorded and as the sum of half-sine pulses. What of it becomes
sound depends on the part and on the machine, which are rigid here."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dembark.postproc.measurement import Array, Curve, profile
from dembark.postproc.third_octaves import Bands, band_of, mean_squares, pulse_mean_squares

if TYPE_CHECKING:
    from .part_impacts import ContactRecord

# Third octaves in which noise is heard, and those in which recorded and computed pulses are compared: above what the drive and the bed's
# motion make, and below the rate of the record (Hz).
AUDIBLE, COMPARED = (20.0, 20e3), (500.0, 2000.0)


class Noise:
    """Third octaves of one run: `bands`, with the mean squares (b,) in N^2 of the `recorded` normal force on the part, and of lone impacts
    with the modulus of the run, `soft`; the `audible_bands` with those of lone impacts with the true modulus, `hard`; `unexplained`: the
    variance less the sum of all bands, over the variance."""

    def __init__(self, one: ContactRecord, soft: tuple[Array, Array], hard: tuple[Array, Array]) -> None:
        """Of a record; `soft`, `hard`: peak forces (impacts,) in N and durations (impacts,) in s of its impacts."""
        force = one.normal_force()
        self.bands, self.recorded = mean_squares(force, one.stride * one.time_step)
        self.soft = pulse_mean_squares(self.bands, *soft, one.window)
        self.audible_bands = Bands.covering(*AUDIBLE)
        self.hard = pulse_mean_squares(self.audible_bands, *hard, one.window)
        self.unexplained = 1.0 - float(self.recorded.sum() / force.var(axis=0).sum())

    @property
    def ratio(self) -> float:
        """Mean square of lone impacts over the recorded one in the bands COMPARED; nan of a record without these."""
        first, last = band_of(COMPARED)
        here = (self.bands.numbers >= first) & (self.bands.numbers <= last)
        return float(self.soft[here].sum() / self.recorded[here].sum()) if here.any() else math.nan

    @property
    def audible(self) -> float:
        """Root mean square (N) of the force of lone impacts with the true modulus in the AUDIBLE bands."""
        return math.sqrt(self.hard.sum())


def octave_curves(noise: list[Noise]) -> list[Curve]:
    """Levels in third octaves: of the record, with that of lone impacts for comparison, and of impacts with the true modulus."""
    def level(squares: Array) -> Array:
        return np.asarray(10.0 * np.log10(np.maximum(squares, 1e-12)))

    along, across = "log₁₀ of the mid-band frequency / Hz", "dB, 10 lg of the mean square / N²"
    low = max(int(band_of(AUDIBLE[0])), *(int(one.bands.numbers[0]) for one in noise))
    top = min(int(one.bands.numbers[-1]) for one in noise)
    chosen = [slice(low - int(one.bands.numbers[0]), top + 1 - int(one.bands.numbers[0])) for one in noise]
    soft = np.mean([one.soft[part] for one, part in zip(noise, chosen, strict=True)], axis=0)
    return [profile("octaves", "Force on the part in third octaves", along, across, np.log10(Bands(np.arange(low, top + 1)).middles),
                    [level(one.recorded[part]) for one, part in zip(noise, chosen, strict=True)], reference=level(soft),
                    reference_label="impacts of single grains, half-sine pulses"),
            profile("octaves_hard", "Impacts with the true modulus in third octaves", along, across,
                    np.log10(noise[0].audible_bands.middles), [level(one.hard) for one in noise])]
