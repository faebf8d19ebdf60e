"""Compressed chain: spheres in a row whose ends are held, pushed out of their places as the highest mode has them."""

import math

import numpy as np

from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts


def setup(p: Parameters) -> Setup:
    """The row swings from rest; the time step is `phase` over the angular frequency of the mode."""
    d, count = p.grain_diameter, p.grain_count
    angular = 2.0 * math.sqrt(hooke(p) / mass(p)) * math.sin(0.5 * math.pi * (count - 2) / (count - 1))
    shape = np.sin(math.pi * (count - 2) * np.arange(count) / (count - 1))
    shape[[0, -1]] = 0.0
    places = np.zeros((count, 3))
    places[:, 0] = (d - p.overlap) * np.arange(count) + p.amplitude * shape
    box = np.array([(-4.0 * d, (count + 4.0) * d), (-4.0 * d, 4.0 * d), (-4.0 * d, 4.0 * d)])
    kinds = np.where(shape == 0.0, 2, 1).astype(np.int64)
    bodies = Packing(box, places, np.full(count, d), np.full(count, p.grain_density), kinds)
    stride, sample = p.run_steps // p.frames, 1 if p.run_steps < 10000 else 20
    return Setup(p.run_steps, p.phase / angular, bodies,
                 {"angular": angular, "sample": sample, "first": stride, "stride": stride, **contacts(p, skin=0.2)})


def mass(p: Parameters) -> float:
    """kg, of a sphere."""
    return float(p.grain_density * math.pi / 6.0 * p.grain_diameter**3)


def hooke(p: Parameters) -> float:
    """k (N/m) of two spheres whose overlap at the characteristic velocity is that by Hertz's law."""
    rigidity = 0.5 * p.youngs_modulus / (1.0 - p.poisson_ratio**2) * math.sqrt(0.25 * p.grain_diameter)
    return float(16.0 / 15.0 * rigidity * (15.0 * 0.5 * mass(p) * p.characteristic_velocity**2 / (16.0 * rigidity)) ** 0.2)
