"""Profiles of solid fraction and velocity over parallel cells, from grains that are shared among cells by their exact volume."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .spheres import slice_volumes

Array = NDArray[np.float64]


def lagrangian_velocities(paths: Array, times: Array) -> Array:
    """Mean velocity (n, 3) in m/s of each grain over the time span: its displacement over the time.

    `paths` (frames, n, 3) are unwrapped positions in m, `times` (frames,) in s.
    """
    if len(times) < 2:
        raise ValueError("a mean velocity needs at least two frames")
    return (paths[-1] - paths[0]) / (times[-1] - times[0])


def surface_height(centres: Array, radii: Array, area: float) -> float:
    """Height (m) of the free surface: where the solid fraction, averaged over one mean diameter, has fallen to half its median.

    Below it lies the packing, above it only the tops of single grains.
    """
    diameter = 2.0 * float(radii.mean())
    levels = np.arange(float((centres - radii).min()), float((centres + radii).max()) + 2.0 * diameter, 0.1 * diameter)
    volume = slice_volumes(centres, radii, levels).sum(axis=0)
    # One diameter, centred on each cell: an even number of cells would be off by half a cell.
    kernel = np.array([0.05, *[0.1] * 9, 0.05])
    smooth = np.convolve(volume, kernel, mode="same") / (area * 0.1 * diameter)
    half = 0.5 * float(np.median(smooth[smooth > 0.05]))
    middle = 0.5 * (levels[1:] + levels[:-1])
    last = int(np.nonzero(smooth >= half)[0][-1])
    if last + 1 >= len(smooth):
        return float(middle[last])
    share = (smooth[last] - half) / (smooth[last] - smooth[last + 1])
    return float(middle[last] + share * (middle[last + 1] - middle[last]))


def inertial_number(shear_rate: Array | float, pressure: Array | float, diameter: float, density: float) -> Array:
    """I = |shear rate| d sqrt(rho / P) (GDR MiDi, Eur. Phys. J. E 14 (2004) 341); 1/s, Pa, m, kg/m3 of the grains' material."""
    return np.abs(shear_rate) * diameter * np.sqrt(density / np.asarray(pressure))
