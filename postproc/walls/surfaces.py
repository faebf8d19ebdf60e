"""Planes, cylinders and triangle meshes that grains press on, and where grains touch them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError

from .mesh import PRECISION, nearest, read_stl, surface_of

if TYPE_CHECKING:
    import pyvista

Array = NDArray[np.float64]
Vector = Sequence[float] | Array


@dataclass(frozen=True)
class Places:
    """k contacts on a wall: `points` (k, 3) in m, `basis` (k, 3, 3) with rows normal, shear_1, shear_2, and `coordinates` (k, 2) on the
    wall, by which its patches are found."""

    points: Array
    basis: Array
    coordinates: Array


def _unit(vector: Vector, what: str) -> Array:
    values = np.asarray(vector, float)
    length = float(np.linalg.norm(values)) if values.shape == (3,) else 0.0
    if not 0.0 < length < np.inf:
        raise DembarkError(f"{what} {np.ravel(values).tolist()} is not a direction", "", "give three finite numbers, not all zero")
    return values / length


def _across(normal: Array, preferred: Sequence[Vector]) -> Array:
    """The first of the `preferred` directions that is not along `normal`, made perpendicular to it and of length one."""
    for direction in preferred:
        part = np.asarray(direction, float) - np.dot(direction, normal) * normal
        if np.linalg.norm(part) > 1e-6:
            return part / np.linalg.norm(part)
    raise AssertionError("two of three axes cannot both be along the normal")


@dataclass(frozen=True)
class Motion:
    """Steady motion of a wall: `velocity` (3,) in m/s from the time `since` (s) on; before it the wall is where it was given."""

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    since: float = 0.0

    def shift(self, time: float) -> Array:
        """Displacement (3,) in m at `time` (s)."""
        return np.asarray(self.velocity, float) * max(0.0, time - self.since)


_REST = Motion()
_UP: tuple[Vector, ...] = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))


@dataclass(frozen=True)
class PlaneWall:
    """A plane through `origin` (m); `normal` points to the grains.

    Coordinates on it are (u, v) in m from `origin`: v along z, or along y where the plane is horizontal, made perpendicular to the
    normal; u, v and the normal are right-handed. shear_1 is along v, shear_2 along u.
    """

    name: str
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    motion: Motion = _REST

    def __post_init__(self) -> None:
        _unit(self.normal, f"wall {self.name}: normal")

    @cached_property
    def axes(self) -> Array:
        """Rows: directions of the normal, of v and of u."""
        normal = _unit(self.normal, f"wall {self.name}: normal")
        along = _across(normal, _UP)
        return np.array([normal, along, np.cross(along, normal)])

    def at(self, time: float) -> PlaneWall:
        """The wall at `time` (s)."""
        return replace(self, origin=tuple(self.origin + self.motion.shift(time)), motion=_REST)

    def places(self, centres: Array) -> Places:
        """Feet of the perpendiculars from `centres` (k, 3)."""
        normal, along, across = self.axes
        offset = centres - np.asarray(self.origin, float)
        points = centres - (offset @ normal)[:, None] * normal
        return Places(points, np.broadcast_to(self.axes, (len(centres), 3, 3)), np.column_stack([offset @ across, offset @ along]))

    def points(self, u: Array, v: Array) -> Array:
        """Points (..., 3) at the coordinates `u`, `v` (m)."""
        return np.asarray(self.origin, float) + u[..., None] * self.axes[2] + v[..., None] * self.axes[1]


@dataclass(frozen=True)
class CylinderWall:
    """A cylinder of `radius` (m) about the line through `origin` (m) along `axis`; `inward`: the grains are inside, else outside.

    Coordinates are (angle in rad from 0 to 2 pi, height in m along the axis from `origin`); the angle counts from x, or from y where the
    axis is along x, and is right-handed about the axis. shear_1 is along the axis, shear_2 along the rising angle.
    """

    name: str
    radius: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inward: bool = True
    motion: Motion = _REST

    def __post_init__(self) -> None:
        if not 0.0 < self.radius < np.inf:
            raise DembarkError(f"wall {self.name}: a radius of {self.radius} m", "", "it must be positive and finite")
        _unit(self.axis, f"wall {self.name}: axis")

    @cached_property
    def axes(self) -> Array:
        """Rows: the axis, and the directions at the angles 0 and pi/2."""
        axis = _unit(self.axis, f"wall {self.name}: axis")
        start = _across(axis, ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
        return np.array([axis, start, np.cross(axis, start)])

    def at(self, time: float) -> CylinderWall:
        """The wall at `time` (s)."""
        return replace(self, origin=tuple(self.origin + self.motion.shift(time)), motion=_REST)

    def places(self, centres: Array) -> Places:
        """Nearest points of the cylinder; a grain exactly on the axis counts for the angle 0."""
        axis, first, second = self.axes
        offset = centres - np.asarray(self.origin, float)
        height = offset @ axis
        angle = np.arctan2(offset @ second, offset @ first) % (2.0 * np.pi)
        outward = self.outward(angle)
        points = np.asarray(self.origin, float) + height[:, None] * axis + self.radius * outward
        normal = -outward if self.inward else outward
        basis = np.stack([normal, np.broadcast_to(axis, normal.shape), np.cross(axis, outward)], axis=1)
        return Places(points, basis, np.column_stack([angle, height]))

    def outward(self, angle: Array) -> Array:
        """Directions (..., 3) away from the axis at `angle` (rad)."""
        return np.cos(angle)[..., None] * self.axes[1] + np.sin(angle)[..., None] * self.axes[2]

    def points(self, angle: Array, height: Array) -> Array:
        """Points (..., 3) at the coordinates `angle` (rad), `height` (m)."""
        return np.asarray(self.origin, float) + height[..., None] * self.axes[0] + self.radius * self.outward(angle)


@dataclass(frozen=True, eq=False)
class MeshWall:
    """Triangles (t, 3, 3) in m; `groups` (t,) numbers the part of each, for stresses per part, and `group_names` names the parts.

    Grains may be on either side: the normal is that of the triangle, turned to the side of the grain. shear_1 is the steepest way up
    the triangle, shear_2 is horizontal. The first coordinate of a contact is the number of its triangle.
    """

    name: str
    triangles: Array
    groups: NDArray[np.int64] | None = None
    group_names: tuple[str, ...] = ()
    motion: Motion = _REST
    displacement: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.triangles.ndim != 3 or self.triangles.shape[1:] != (3, 3) or not len(self.triangles):
            raise DembarkError(f"wall {self.name}: triangles of shape {self.triangles.shape}", "", "it must be (t, 3, 3), t at least 1")
        if self.groups is not None and self.groups.shape != (len(self.triangles),):
            raise DembarkError(f"wall {self.name}: groups of shape {self.groups.shape}", "",
                               f"give one number for each of the {len(self.triangles)} triangles")

    @classmethod
    def from_stl(cls, name: str, path: str | Path, *, scale: float = 1.0, motion: Motion = _REST) -> MeshWall:
        """Mesh of an STL file, text or binary, whose unit is `scale` (m): 1e-3 for a file in mm; its solids are the groups."""
        surface = read_stl(path, PRECISION / scale)
        return cls(name, surface.triangles * scale, surface.solids, surface.names, motion)

    @cached_property
    def axes(self) -> Array:
        """(t, 3, 3): normal, shear_1 and shear_2 of each triangle."""
        normal = np.cross(self.triangles[:, 1] - self.triangles[:, 0], self.triangles[:, 2] - self.triangles[:, 0])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        flat = np.hypot(normal[:, 0], normal[:, 1]) < 1e-6
        up = np.where(flat[:, None], _UP[1], _UP[0])
        along = up - np.einsum("ta,ta->t", up, normal)[:, None] * normal
        along /= np.linalg.norm(along, axis=1)[:, None]
        return np.stack([normal, along, np.cross(along, normal)], axis=1)

    @cached_property
    def _surface(self) -> pyvista.PolyData:
        return surface_of(self.triangles)

    def at(self, time: float) -> MeshWall:
        """The wall at `time` (s)."""
        moved = replace(self, motion=_REST, displacement=tuple(self.motion.shift(time)))
        # The surface as it was given serves all times.
        moved.__dict__.update(axes=self.axes, _surface=self._surface)
        return moved

    def places(self, centres: Array) -> Places:
        """Nearest points of the mesh."""
        shift = np.asarray(self.displacement, float)
        points, triangle = nearest(self._surface, centres - shift)
        points = points + shift
        basis = self.axes[triangle]
        side = np.where(np.einsum("ka,ka->k", centres - points, basis[:, 0]) < 0.0, -1.0, 1.0)
        basis[:, 0] *= side[:, None]
        return Places(points, basis, np.column_stack([triangle, np.zeros(len(triangle))]))


Wall = PlaneWall | CylinderWall | MeshWall
