"""Kernels of coarse graining and their averages over the cells of a grid.

A kernel phi has the integral 1 in three dimensions. With s = |r| and the width w:

gaussian   phi = product over the axes of exp(-x^2 / 2 w^2) / N for |x| < 3 w, else 0; cut along each axis, so that it stays a product
lucy       phi = 105 / (16 pi w^3) (1 + 3 s/w) (1 - s/w)^3 for s < w (L. B. Lucy, Astron. J. 82 (1977) 1013)
heaviside  phi = 3 / (4 pi w^3) for s < w

What a field takes of a grain in a cell is the integral of phi over that cell, never a sample at its centre: the shares of one point
in all cells sum to 1 whether the kernel is narrower than a cell or wider than the grid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError

from .grid import Grid

Array = NDArray[np.float64]

NAMES = ("gaussian", "lucy", "heaviside")
CUTOFF = 3.0  # standard deviations at which the Gaussian is cut
MAX_PANELS = 32


@dataclass(frozen=True)
class Kernel:
    """A kernel `name` of `width` (m); see the module."""

    name: str
    width: float

    def __post_init__(self) -> None:
        """Refuse (DembarkError) an unknown name and a width that is not positive."""
        if self.name not in NAMES:
            raise DembarkError(f"unknown kernel '{self.name}'", "coarse graining", f"choose one of {', '.join(NAMES)}")
        if not (np.isfinite(self.width) and self.width > 0.0):
            raise DembarkError(f"a kernel cannot have the width {self.width} m", "coarse graining", "give a positive width in metres")

    @property
    def reach(self) -> float:
        """Distance (m) along each axis beyond which the kernel is zero."""
        return CUTOFF * self.width if self.name == "gaussian" else self.width

    @property
    def variance(self) -> float:
        """Second moment along one axis (m2): the integral of x^2 phi."""
        if self.name == "gaussian":
            from scipy.special import erf
            density = np.exp(-0.5 * CUTOFF**2) / np.sqrt(2.0 * np.pi)
            return self.width**2 * (1.0 - 2.0 * CUTOFF * density / float(erf(CUTOFF / np.sqrt(2.0))))
        return self.width**2 * (1.0 / 12.0 if self.name == "lucy" else 0.2)

    @property
    def nodes_per_panel(self) -> int:
        """Gauss points of each panel of a line integral."""
        return 4 if self.name == "gaussian" else 3

    def panels(self, length: float) -> int:
        """Into how many panels a line of `length` (m) is cut for its line integral.

        A panel is at most 1.25 widths long for the Gaussian, half of one for Lucy's kernel, a quarter for Heaviside's; at most MAX_PANELS.
        """
        per_width = {"gaussian": 0.8, "lucy": 2.0, "heaviside": 4.0}[self.name]
        return int(np.clip(np.ceil(per_width * length / self.width * (1.0 - 1e-9)), 1, MAX_PANELS))

    def nodes_per_cell(self, grid: Grid) -> int:
        """Gauss points along each axis of a cell for Lucy's and Heaviside's kernels."""
        return int(np.clip(np.ceil(8.0 * grid.spacing.max() / self.width), 2, 16))


def unit_gauss(count: int) -> tuple[Array, Array]:
    """Places and weights (count,) of Gauss and Legendre on 0 ... 1."""
    place, weight = np.polynomial.legendre.leggauss(count)
    return 0.5 * (place + 1.0), 0.5 * weight


def line_nodes(kernel: Kernel, length: float) -> tuple[Array, Array]:
    """Places (q,) from 0 to 1 and weights (q,), of sum 1, of the line integral over a branch of at most `length` (m)."""
    if length == 0.0:
        return np.array([0.0]), np.array([1.0])
    count = kernel.panels(length)
    place, weight = unit_gauss(kernel.nodes_per_panel)
    return (np.arange(count)[:, None] + place).ravel() / count, np.tile(weight, count) / count


def cumulative(kernel: Kernel, distance: Array) -> Array:
    """Integral of the Gaussian's factor of one axis from minus infinity to `distance` (m); 0 ... 1."""
    from scipy.special import erf
    scaled = np.clip(distance / kernel.width, -CUTOFF, CUTOFF)
    return np.asarray(0.5 + 0.5 * erf(scaled / np.sqrt(2.0)) / erf(CUTOFF / np.sqrt(2.0)))
