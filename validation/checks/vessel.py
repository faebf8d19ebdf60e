"""Silos' geometries: where the walls are, which way they press, and how places along them divide into sectors.

In both the walls have the area 2 / size for each volume, so Janssen's law is the same: lambda = size / (2 K mu_mob).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from dembark.postproc.spheres import volume, volume_below
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Vessel(Protocol):
    """A silo of constant cross-section along z; places are (n, 3) in m."""

    @property
    def size(self) -> float:
        """The length (m) in Janssen's law: radius R or distance W of the walls."""

    @property
    def area(self) -> float:
        """Cross-section in m2."""

    @property
    def names(self) -> tuple[str, ...]:
        """The walls beside `base`."""

    def sectors(self, diameter: float) -> int:
        """Number of sectors of the walls, about four diameters each: further than forces at the wall know of each other."""

    def inward(self, place: Array) -> Array:
        """Unit vectors (n, 3) away from the nearest wall."""

    def distance(self, place: Array) -> Array:
        """Distance (n,) in m from the nearest wall."""

    def wall_shares(self, place: Array, sectors: int) -> Array:
        """Share (n, sectors) of each grain's wall force in the sectors: linear between the middles of the two it lies between.

        With sharp borders the chance on which side a grain's centre lies would pass for disorder of the packing.
        """

    def volume_shares(self, place: Array, radii: Array, sectors: int) -> Array:
        """The same for the grains' volumes."""


def _ring(turn: Array, sectors: int) -> Array:
    """Shares (n, sectors) of places `turn` (n,) in [0, 1) once around."""
    distance = np.abs(turn[:, None] * sectors - np.arange(sectors))
    return np.clip(1.0 - np.minimum(distance, sectors - distance), 0.0, None)


@dataclass(frozen=True)
class Cylinder:
    """Inside of a cylinder of `radius` (m) about the z axis; one wall, `side`."""

    radius: float
    names: tuple[str, ...] = ("side",)

    @property
    def size(self) -> float:
        """R."""
        return self.radius

    @property
    def area(self) -> float:
        """pi R^2."""
        return np.pi * self.radius**2

    def sectors(self, diameter: float) -> int:
        """6 to 24 around."""
        return int(np.clip(round(2.0 * np.pi * self.radius / (4.0 * diameter)), 6, 24))

    def inward(self, place: Array) -> Array:
        """Towards the axis."""
        return -place * [1.0, 1.0, 0.0] / np.maximum(np.hypot(place[:, 0], place[:, 1]), 1e-300)[:, None]

    def distance(self, place: Array) -> Array:
        """R - r."""
        return self.radius - np.hypot(place[:, 0], place[:, 1])

    def wall_shares(self, place: Array, sectors: int) -> Array:
        """By the angle."""
        return _ring((np.arctan2(place[:, 1], place[:, 0]) / (2.0 * np.pi)) % 1.0, sectors)

    def volume_shares(self, place: Array, radii: Array, sectors: int) -> Array:
        """By the angle of the centre."""
        del radii
        return self.wall_shares(place, sectors)


@dataclass(frozen=True)
class Slab:
    """Between the planes x = 0 (`left`) and x = `width` (`right`), periodic along y with the period `depth`; m."""

    width: float
    depth: float
    names: tuple[str, ...] = ("left", "right")

    @property
    def size(self) -> float:
        """W."""
        return self.width

    @property
    def area(self) -> float:
        """W times the period."""
        return self.width * self.depth

    def sectors(self, diameter: float) -> int:
        """At least two on each wall, of less than four diameters each when the slab is thin."""
        return 2 * max(2, round(self.depth / (4.0 * diameter)))

    def _right(self, place: Array) -> NDArray[np.bool_]:
        return place[:, 0] > 0.5 * self.width

    def inward(self, place: Array) -> Array:
        """Towards the middle plane."""
        result = np.zeros_like(place)
        result[:, 0] = np.where(self._right(place), -1.0, 1.0)
        return result

    def distance(self, place: Array) -> Array:
        """To the nearer plane."""
        return np.minimum(place[:, 0], self.width - place[:, 0])

    def wall_shares(self, place: Array, sectors: int) -> Array:
        """By y, the first half of the sectors on the left wall."""
        along = _ring((place[:, 1] / self.depth) % 1.0, sectors // 2)
        right = self._right(place)[:, None]
        return np.hstack([np.where(right, 0.0, along), np.where(right, along, 0.0)])

    def volume_shares(self, place: Array, radii: Array, sectors: int) -> Array:
        """By y, and by the part of the sphere in the wall's half of the silo."""
        along = _ring((place[:, 1] / self.depth) % 1.0, sectors // 2)
        left = (volume_below(0.5 * self.width - place[:, 0], radii) / volume(radii))[:, None]
        return np.hstack([left * along, (1.0 - left) * along])


def overlap(sectors: int) -> float:
    """Variance among the sums over sectors that share grains in this way, over that of separate ones, for uncorrelated forces.

    Of each grain's share u and 1 - u, u even in [0, 1], the squares have the mean 2/3 and the products 1/3, the latter as covariance
    with neighbours on the same wall.
    """
    return 2.0 / 3.0 - 1.0 / (3.0 * (sectors - 1))


def of(parameters: Mapping[str, Any]) -> Vessel:
    """The vessel of a run: a plane silo has a `silo_width`, a cylindrical one a `cylinder_radius`."""
    if "silo_width" in parameters:
        return Slab(float(parameters["silo_width"]), float(parameters["slab_depth"]))
    return Cylinder(float(parameters["cylinder_radius"]))
