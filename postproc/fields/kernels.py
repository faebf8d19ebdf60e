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
from dembark.postproc.fields.grid import Grid

Array = NDArray[np.float64]

NAMES = ("gaussian", "lucy", "heaviside")
CUTOFF = 3.0  # standard deviations at which the Gaussian is cut
MAX_PANELS = 32


def _erf(value: Array | float) -> Array:
    from scipy.special import erf  # slow to import, and not needed before something is measured

    return np.asarray(erf(value))


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
            raise DembarkError(f"a kernel of width {self.width} m", "coarse graining", "give a positive width in metres")

    @property
    def reach(self) -> float:
        """Distance (m) along each axis beyond which the kernel is zero."""
        return CUTOFF * self.width if self.name == "gaussian" else self.width

    @property
    def variance(self) -> float:
        """Second moment along one axis (m2): the integral of x^2 phi."""
        if self.name == "gaussian":
            density = np.exp(-0.5 * CUTOFF**2) / np.sqrt(2.0 * np.pi)
            return self.width**2 * (1.0 - 2.0 * CUTOFF * density / float(_erf(CUTOFF / np.sqrt(2.0))))
        return self.width**2 * (1.0 / 12.0 if self.name == "lucy" else 0.2)

    def __call__(self, distance: Array) -> Array:
        """phi (1/m3) at the vectors `distance` (..., 3) in m."""
        if self.name == "gaussian":
            norm = np.sqrt(2.0 * np.pi) * self.width * float(_erf(CUTOFF / np.sqrt(2.0)))
            inside = (np.abs(distance) < self.reach).all(axis=-1)
            return np.where(inside, np.exp(-0.5 * (distance**2).sum(axis=-1) / self.width**2) / norm**3, 0.0)
        return self._radial(np.sqrt((distance**2).sum(axis=-1)))

    def _radial(self, distance: Array) -> Array:
        share = np.minimum(distance / self.width, 1.0)
        if self.name == "lucy":
            return 105.0 / (16.0 * np.pi * self.width**3) * (1.0 + 3.0 * share) * (1.0 - share) ** 3
        return np.where(share < 1.0, 3.0 / (4.0 * np.pi * self.width**3), 0.0)

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
    scaled = np.clip(distance / kernel.width, -CUTOFF, CUTOFF)
    return 0.5 + 0.5 * _erf(scaled / np.sqrt(2.0)) / _erf(CUTOFF / np.sqrt(2.0))


def ball_shares(kernel: Kernel, edges: tuple[Array, Array, Array], nodes: int) -> Array:
    """Shares (p, a, b, c) of a spherical kernel about the origin in cells between `edges` ((p, a+1), (p, b+1), (p, c+1)) in m.

    Gauss points in x within the part of a cell that the ball reaches, for each of them in the angle asin(y / chord), in which the chords
    along z are smooth, for each of those in z (where Heaviside's kernel needs only the length). The shares are not yet normalised.
    """
    place, weight = unit_gauss(nodes)
    radius = kernel.width

    def along(edge: Array, chord: Array) -> tuple[Array, Array]:
        """Gauss points and weights (..., cells, nodes) of the parts of cells between `edge` (..., cells + 1) within +-chord (...)."""
        cut = np.clip(edge, -chord[..., None], chord[..., None])
        length = np.diff(cut, axis=-1)[..., None]
        return cut[..., :-1, None] + length * place, length * weight

    x_edges, y_edges, z_edges = edges
    x, x_weight = along(x_edges, np.full(len(x_edges), radius))
    disc = np.sqrt(np.maximum(radius**2 - x**2, 0.0))[..., None]
    share = np.divide(y_edges[:, None, None, :], disc, out=np.zeros((*disc.shape[:-1], y_edges.shape[1])), where=disc > 0.0)
    angle, y_weight = along(np.arcsin(np.clip(share, -1.0, 1.0)), np.full(disc.shape[:-1], np.pi))
    y, y_weight = disc[..., None] * np.sin(angle), disc[..., None] * np.cos(angle) * y_weight
    flat = x[..., None, None] ** 2 + y**2
    chord = np.sqrt(np.maximum(radius**2 - flat, 0.0))
    z_edges = z_edges[:, None, None, None, None, :]
    if kernel.name == "heaviside":
        line = np.diff(np.clip(z_edges, -chord[..., None], chord[..., None]), axis=-1) * kernel(np.zeros(3))
    else:
        z, z_weight = along(z_edges, chord)
        line = (kernel._radial(np.sqrt(flat[..., None, None] + z**2)) * z_weight).sum(axis=-1)
    return np.einsum("pag,pagbh,pagbhc->pabc", x_weight, y_weight, line)
