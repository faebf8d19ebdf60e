"""Geometries of silos: walls, their normals, and sectors along them. In both geometries walls have the area 2 / size for each volume, so
that Janssen's law is the same: lambda = size / (2 K mu_mob). A place between the middles of two sectors belongs to both, linearly: sharp
borders would add scatter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dembark.postproc.replica import Array
from dembark.postproc.spheres import volume, volume_below


def _ring(turn: Array, sectors: int) -> Array:
    """Shares (n, sectors) of places `turn` (n,) in [0, 1) once around."""
    distance = np.abs(turn[:, None] * sectors - np.arange(sectors))
    return np.clip(1.0 - np.minimum(distance, sectors - distance), 0.0, None)


@dataclass(frozen=True)
class Cylinder:
    """Inside of a cylinder about the z axis whose radius R is `size` (m). Places are (n, 3) in m."""

    size: float
    names: tuple[str, ...] = ("side",)

    @property
    def area(self) -> float:
        """Cross-section in m2."""
        return np.pi * self.size**2

    def sectors(self, diameter: float) -> int:
        """Number of sectors of about four diameters each, further than forces at the wall know of each other: 6 to 24."""
        return int(np.clip(round(2.0 * np.pi * self.size / (4.0 * diameter)), 6, 24))

    def inward(self, place: Array) -> Array:
        """Unit vectors (n, 3) away from the wall."""
        return -place * [1.0, 1.0, 0.0] / np.maximum(np.hypot(place[:, 0], place[:, 1]), 1e-300)[:, None]

    def pressing(self, lines: Array) -> Array:
        """Part (n,) that presses on the wall of the diagonals (n, 3) of stresses: the mean of x and y, which over a section is the radial
        stress at the wall by the virial theorem."""
        return np.asarray(0.5 * (lines[:, 0] + lines[:, 1]))

    def distance(self, place: Array) -> Array:
        """Distance (n,) in m from the wall."""
        return self.size - np.hypot(place[:, 0], place[:, 1])

    def wall_shares(self, place: Array, sectors: int) -> Array:
        """Share (n, sectors) of each grain's wall force in the sectors, by the angle."""
        return _ring((np.arctan2(place[:, 1], place[:, 0]) / (2.0 * np.pi)) % 1.0, sectors)

    def volume_shares(self, place: Array, _radii: Array, sectors: int) -> Array:
        """The same for the grains' volumes, by the angle of the centre."""
        return self.wall_shares(place, sectors)


@dataclass(frozen=True)
class Slab:
    """Between the planes x = 0 (`left`) and x = `size` (`right`), periodic along y with the period `depth`; m. Methods as of Cylinder."""

    size: float
    depth: float
    names: tuple[str, ...] = ("left", "right")

    @property
    def area(self) -> float:
        """Cross-section in m2, a period of it."""
        return self.size * self.depth

    def sectors(self, diameter: float) -> int:
        """At least two on each wall, of less than four diameters each when the slab is thin."""
        return 2 * max(2, round(self.depth / (4.0 * diameter)))

    def inward(self, place: Array) -> Array:
        """Unit vectors away from the nearer plane."""
        return np.where(place[:, :1] > 0.5 * self.size, -1.0, 1.0) * [1.0, 0.0, 0.0]

    def pressing(self, lines: Array) -> Array:
        """That of x."""
        return lines[:, 0]

    def distance(self, place: Array) -> Array:
        """To the nearer plane."""
        return np.minimum(place[:, 0], self.size - place[:, 0])

    def _shares(self, place: Array, left: Array, sectors: int) -> Array:
        along = _ring((place[:, 1] / self.depth) % 1.0, sectors // 2)
        return np.hstack([left[:, None] * along, (1.0 - left[:, None]) * along])

    def wall_shares(self, place: Array, sectors: int) -> Array:
        """By y, the first half of the sectors on the left wall."""
        return self._shares(place, (place[:, 0] <= 0.5 * self.size).astype(float), sectors)

    def volume_shares(self, place: Array, radii: Array, sectors: int) -> Array:
        """By y, and by the part of the sphere in the wall's half of the silo."""
        return self._shares(place, volume_below(0.5 * self.size - place[:, 0], radii) / volume(radii), sectors)


Container = Cylinder | Slab


def overlap(sectors: int) -> float:
    """Variance among sums over sectors that share grains, over that of separate ones, for uncorrelated forces: the shares u and 1 - u of a
    grain, u even in [0, 1], have squares with the mean 2/3 and products with 1/3, a covariance of neighbours on the same wall."""
    return 2.0 / 3.0 - 1.0 / (3.0 * (sectors - 1))


def container(parameters: Mapping[str, Any]) -> Container:
    """The vessel of a run: a plane silo has a `silo_width`, a cylindrical one a `cylinder_radius`."""
    if "silo_width" in parameters:
        return Slab(float(parameters["silo_width"]), float(parameters["slab_depth"]))
    return Cylinder(float(parameters["cylinder_radius"]))
