"""Profiles of solid fraction and velocity over parallel cells, from grains that are shared among cells by their exact volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.spheres import slice_volumes

Array = NDArray[np.float64]


@dataclass
class CellSums:
    """Sums over grains per cell of k cells, additive over frames: `frames`, `volume` (m3) (k,), `momentum` = sum V v (k, 3) and
    `energy` = sum V v v (k, 3), V being the part of a grain's volume in the cell (m3) and v its velocity (m/s)."""

    frames: int
    volume: Array
    momentum: Array
    energy: Array

    def __add__(self, other: CellSums) -> CellSums:
        return CellSums(self.frames + other.frames, self.volume + other.volume, self.momentum + other.momentum, self.energy + other.energy)

    def solid_fraction(self, cell_volume: Array | float) -> Array:
        """Mean solid fraction (k,) of cells of `cell_volume` (m3)."""
        return self.volume / (self.frames * np.asarray(cell_volume))

    def velocity(self) -> Array:
        """Mean velocity (k, 3) in m/s, weighted by volume (the Eulerian mean); NaN in cells that were always empty."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.momentum / self.volume[:, None]

    def fluctuation(self) -> Array:
        """Standard deviation (k, 3) in m/s of the grains' velocities about the mean of their cell."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.sqrt(np.maximum(0.0, self.energy / self.volume[:, None] - self.velocity() ** 2))


def cell_sums(
    positions: Array, velocities: Array, radii: Array, axis: int, edges: Array, window: tuple[int, float, float] | None = None
) -> CellSums:
    """Sums of one frame over cells between `edges` (k + 1,) in m along `axis`.

    `window` = (other axis, low, high) in m restricts the cells: a grain that reaches across `low` or `high` counts with the share
    of its volume inside (the shares along both axes are multiplied, exact where the two cuts do not meet in one grain).
    """
    parts = slice_volumes(positions[:, axis], radii, edges)
    if window is not None:
        other, low, high = window
        inside = slice_volumes(positions[:, other], radii, np.array([low, high]))[:, 0]
        parts = parts * (inside / (4.0 / 3.0 * np.pi * radii**3))[:, None]
    return CellSums(1, parts.sum(axis=0), parts.T @ velocities, parts.T @ velocities**2)


def lagrangian_velocities(paths: Array, times: Array) -> Array:
    """Mean velocity (n, 3) in m/s of each grain over the time span: its displacement over the time.

    `paths` (frames, n, 3) are unwrapped positions in m, `times` (frames,) in s.
    """
    if len(times) < 2:
        raise ValueError("a mean velocity needs at least two frames")
    return (paths[-1] - paths[0]) / (times[-1] - times[0])


def solid_fraction_profile(centres: Array, radii: Array, edges: Array, area: float) -> Array:
    """Solid fraction (k,) of slabs between `edges` (k + 1,) in m with cross-section `area` (m2)."""
    return slice_volumes(centres, radii, edges).sum(axis=0) / (area * np.diff(edges))


def surface_height(centres: Array, radii: Array, area: float) -> float:
    """Height (m) of the free surface: where the solid fraction, averaged over one mean diameter, has fallen to half its median.

    Below it lies the packing, above it only the tops of single grains.
    """
    diameter = 2.0 * float(radii.mean())
    levels = np.arange(float((centres - radii).min()), float((centres + radii).max()) + 2.0 * diameter, 0.1 * diameter)
    volume = slice_volumes(centres, radii, levels).sum(axis=0)
    smooth = np.convolve(volume, np.full(10, 0.1), mode="same") / (area * 0.1 * diameter)
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
