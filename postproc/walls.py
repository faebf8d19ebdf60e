"""Walls that grains press on: planes, cylinders, triangle meshes, and the surface of an inclusion (a group of grains).

A dump holds the force of each wall on each grain, not where it acts: that is taken as the point of the wall nearest to the grain's
centre, which is exact for spheres on a plane or a cylinder. A grain that touches several triangles of a mesh counts for the nearest.

Everywhere a force is that of the wall on the grains. It is taken apart along a basis that belongs to the contact point: `normal` from
the wall to the grains (a wall that is pressed has a positive normal stress), `shear_1` and `shear_2` along the wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from dembark.postproc.coarse_graining import WallContacts, rows_of
from dembark.postproc.contacts import ContactFrame
from dembark.postproc.dumptext import DumpError
from dembark.postproc.grains import GrainFrame, cell
from dembark.postproc.wall_mesh import TriangleTree, read_stl
from dembark.validation.errors import DembarkError
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = Sequence[float] | Array


@dataclass(frozen=True)
class Places:
    """k contacts on a wall: `points` (k, 3) in m, `basis` (k, 3, 3) with rows normal, shear_1, shear_2, and `coordinates` (k, 2) on the
    wall, by which its patches are found."""

    points: Array
    basis: Array
    coordinates: Array


class Wall(Protocol):
    """What the functions here need of a wall."""

    name: str

    def at(self, time: float) -> Wall:
        """The wall where it is at `time` (s)."""

    def places(self, centres: Array) -> Places:
        """Where grains with these `centres` (k, 3) in m touch it."""


def _unit(vector: Vector, what: str) -> Array:
    values = np.asarray(vector, float)
    length = float(np.linalg.norm(values)) if values.shape == (3,) else 0.0
    if not 0.0 < length < np.inf:
        raise DembarkError(f"{what} {np.ravel(values).tolist()} is no direction", "", "give three finite numbers, not all zero")
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
        surface = read_stl(path)
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
    def _tree(self) -> TriangleTree:
        return TriangleTree(self.triangles)

    def at(self, time: float) -> MeshWall:
        """The wall at `time` (s)."""
        moved = replace(self, motion=_REST, displacement=tuple(self.motion.shift(time)))
        # The search tree of the mesh as it was given serves all times.
        moved.__dict__.update(axes=self.axes, _tree=self._tree)
        return moved

    def places(self, centres: Array) -> Places:
        """Nearest points of the mesh."""
        shift = np.asarray(self.displacement, float)
        points, triangle = self._tree.nearest(centres - shift)
        points = points + shift
        basis = self.axes[triangle]
        side = np.where(np.einsum("ka,ka->k", centres - points, basis[:, 0]) < 0.0, -1.0, 1.0)
        basis[:, 0] *= side[:, None]
        return Places(points, basis, np.column_stack([triangle, np.zeros(len(triangle))]))


@dataclass(frozen=True)
class Inclusion:
    """The surface of a group of grains, such as one large grain or grains that are glued into a body; contacts load it.

    Stresses refer to the sphere (`surface` "sphere") or the cylinder ("cylinder") of `radius` (m) about the group's centre of mass;
    without `radius` it is that of the single grain, or of the sphere (cylinder) about the centres that holds the group. Coordinates are
    (angle about `axis` in rad, angle from `axis` in rad) on the sphere and (angle, height in m) on the cylinder. The normal is radial;
    shear_1 is along the meridian towards `axis` or along the axis, shear_2 along the rising angle.
    """

    name: str
    ids: tuple[int, ...]
    surface: str = "sphere"
    radius: float | None = None
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        if not self.ids:
            raise DembarkError(f"inclusion {self.name}: no ids", "", "it needs at least one grain")
        if self.surface not in ("sphere", "cylinder"):
            raise DembarkError(f"inclusion {self.name}: surface {self.surface!r}", "", "it must be 'sphere' or 'cylinder'")

    def _cylinder(self, radius: float) -> CylinderWall:
        return CylinderWall(self.name, radius, self.axis, inward=False)

    def size(self, frame: GrainFrame) -> float:
        """Radius (m) of the surface that stresses refer to."""
        if self.radius is not None:
            return self.radius
        members, relative = self.members(frame)
        if self.surface == "cylinder":
            axis = self._cylinder(1.0).axes[0]
            relative = relative - (relative @ axis)[:, None] * axis
        return float(np.max(np.linalg.norm(relative, axis=1) + members.radii))

    def members(self, frame: GrainFrame) -> tuple[GrainFrame, Array]:
        """The group's grains and their places (m, 3) about its centre of mass; DumpError when one is not there."""
        wanted = np.unique(np.asarray(self.ids, np.int64))
        found = np.isin(frame.ids, wanted)
        if found.sum() != len(wanted):
            lost = np.setdiff1d(wanted, frame.ids)
            raise DumpError(f"inclusion {self.name}: grain {lost[0]} is not in the frame of step {frame.step}")
        members = frame.select(found)
        return members, members.positions - np.average(members.positions, axis=0, weights=members.masses)

    def loads(self, frame: GrainFrame, contacts: ContactFrame) -> tuple[Places, Array]:
        """Places of its k contacts with other grains, relative to its centre, and the forces (k, 3) of the inclusion on those, N.

        A contact lies on the line of the centres, in the middle of the overlap or of the gap.
        """
        members, relative = self.members(frame)
        ours = np.isin(contacts.ids, members.ids)
        rows = np.nonzero(ours[:, 0] != ours[:, 1])[0]
        first = ours[rows, 0]
        branch = np.where(first[:, None], contacts.branch[rows], -contacts.branch[rows])
        forces = np.where(first[:, None], -contacts.forces[rows], contacts.forces[rows])
        member, other = (np.where(first, *pair) for pair in (contacts.ids[rows].T, contacts.ids[rows, ::-1].T))
        index = rows_of(frame.ids, other, contacts.step)
        own = np.searchsorted(members.ids, member)
        length = np.maximum(np.linalg.norm(branch, axis=1), 1e-300)
        share = 0.5 * (length + members.radii[own] - frame.radii[index]) / length
        return self._places(relative[own] + share[:, None] * branch), forces

    def _places(self, points: Array) -> Places:
        cylinder = self._cylinder(1.0).places(points)
        if self.surface == "cylinder":
            return replace(cylinder, points=points)
        radial = points / np.maximum(np.linalg.norm(points, axis=1), 1e-300)[:, None]
        around = cylinder.basis[:, 2]
        axis = self._cylinder(1.0).axes[0]
        polar = np.arctan2(np.linalg.norm(np.cross(axis, radial), axis=1), radial @ axis)
        basis = np.stack([radial, np.cross(radial, around), around], axis=1)
        return Places(points, basis, np.column_stack([cylinder.coordinates[:, 0], polar]))


def into_box(frame: GrainFrame) -> Array:
    """Positions (n, 3) in m inside the box on periodic axes: engines let grains drift a little out of it between neighbour lists."""
    if not frame.periodic.any():
        return frame.wrapped
    edges = cell(frame.low, frame.high, frame.tilt)
    share = np.linalg.solve(edges.T, (frame.wrapped - frame.low).T).T
    return frame.wrapped - np.where(frame.periodic, np.floor(share), 0.0) @ edges


def touching(frame: GrainFrame, name: str) -> tuple[NDArray[np.bool_], Array]:
    """Which grains (n,) the wall `name` pushes or pulls, and its forces on those (k, 3); DumpError when the dump has no such wall."""
    if name not in frame.wall_forces:
        known = ", ".join(frame.wall_forces) or "none"
        raise DumpError(f"wall {name!r} has no columns f_force_{name}[1..3] in the dump; there are: {known}")
    forces = frame.wall_forces[name]
    mask = np.any(forces != 0.0, axis=1)
    return mask, forces[mask]


def wall_contacts(frame: GrainFrame, wall: Wall, time: float = 0.0) -> WallContacts:
    """Where `wall` touches the grains of `frame` and with what force, for `coarse_grain(walls=...)`; `time` (s) places a moving wall."""
    mask, forces = touching(frame, wall.name)
    centres = into_box(frame)[mask]
    return WallContacts(wall.at(time).places(centres).points, centres, forces)
