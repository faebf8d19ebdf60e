"""Patches of a wall: where a contact falls, their areas and normals, and the polygons that show them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.memory import check_memory

from ..dumps.frames import cell
from ..grains import GrainFrame
from . import CylinderWall, Inclusion, MeshWall, PlaneWall, Wall

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_OfTwo = Callable[[Array, Array], Array]
_TURN = 2.0 * np.pi
# Curved patches are drawn as flat polygons of at most this angle.
_FACET = np.radians(7.5)
_MOST = 1e7  # patches along one coordinate
_BYTES = 2000.0  # of a patch and the load on it


@dataclass(frozen=True, eq=False)
class Patches:
    """p patches of a wall where it was given; a wall that moves takes them along.

    `areas` (p,) in m2, `centres` and `normals` (p, 3); `vertices` (v, 3) in m and `cells` (c, 3 or 4) are polygons that show them, cell c
    belonging to patch `owners[c]`. Rectangular patches have `names`, `units` and `edges` of their two coordinates and lie in the order
    of `shape` (C); patches of a mesh have the patch of each triangle, `of_triangle` (t,), and `labels`.
    """

    areas: Array
    centres: Array
    normals: Array
    vertices: Array
    cells: Integers
    owners: Integers
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    edges: tuple[Array, ...] = ()
    of_triangle: Integers | None = None
    labels: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.areas)

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of patches along the coordinates; (p,) of a mesh."""
        return tuple(len(edges) - 1 for edges in self.edges) or (len(self.areas),)

    def middles(self, axis: int) -> Array:
        """Middles of the patches along coordinate `axis`."""
        return 0.5 * (self.edges[axis][1:] + self.edges[axis][:-1])

    def locate(self, coordinates: Array) -> Integers:
        """Patch (k,) of contacts at `coordinates` (k, 2) on the wall; -1 outside all patches."""
        if self.of_triangle is not None:
            return self.of_triangle[coordinates[:, 0].astype(np.int64)]
        index, inside = np.zeros(len(coordinates), np.int64), np.ones(len(coordinates), bool)
        for edges, place in zip(self.edges, coordinates.T, strict=True):
            # The last border belongs to the last patch: round-off makes an angle a full turn.
            bin_of = np.where(place == edges[-1], len(edges) - 2, np.searchsorted(edges, place, side="right") - 1)
            inside &= (bin_of >= 0) & (bin_of < len(edges) - 1)
            index = index * (len(edges) - 1) + bin_of
        return np.where(inside, index, -1)


def _rising(edges: Array, what: str) -> Array:
    edges = np.asarray(edges, float)
    if edges.ndim != 1 or len(edges) < 2 or not np.isfinite(edges).all() or not (np.diff(edges) > 0.0).all():
        raise DembarkError(f"the borders of the patches along {what} are wrong", "", "give at least two rising finite numbers")
    return edges


def _finer(edges: Array, most: float) -> tuple[Array, Integers]:
    """`edges` with enough more between them that none are further apart than `most`, and the old interval of each new one."""
    parts = np.maximum(1, np.ceil(np.diff(edges) / most - 1e-9)).astype(int)
    pieces = [np.linspace(low, high, count, endpoint=False) for low, high, count in zip(edges[:-1], edges[1:], parts, strict=True)]
    return np.append(np.concatenate(pieces), edges[-1]), np.repeat(np.arange(len(parts)), parts)


def count_of(extent: float, size: float) -> int:
    """How many patches of about `size` (m) cover `extent` (m); DembarkError when these are too many."""
    return _affordable(max(1.0, float(np.round(extent / size))) if size > extent / _MOST else np.inf)


def _affordable(count: float) -> int:
    if not count <= _MOST:
        raise DembarkError(f"more than {_MOST:.0f} patches along one coordinate", "", "take larger ones")
    return int(count)


def borders(low: float, high: float, count: int) -> Array:
    """Equidistant borders of `count` patches from `low` to `high`; DembarkError when these are too many."""
    return np.linspace(low, high, _affordable(count) + 1)


def _rectangular(edges: tuple[Array, Array], area: _OfTwo, surface: _OfTwo, normal: _OfTwo, names: tuple[str, str], units: tuple[str, str],
                 facets: tuple[float, float]) -> Patches:
    edges = _rising(edges[0], names[0]), _rising(edges[1], names[1])
    count = (len(edges[0]) - 1) * (len(edges[1]) - 1)
    check_memory(_BYTES * count, f"{count} patches", "take larger ones")
    middle = np.meshgrid(*(0.5 * (one[1:] + one[:-1]) for one in edges), indexing="ij")
    (first, of_first), (second, of_second) = (_finer(one, most) for one, most in zip(edges, facets, strict=True))
    vertices = surface(*np.meshgrid(first, second, indexing="ij")).reshape(-1, 3)
    corner = np.arange(len(first) * len(second)).reshape(len(first), len(second))
    cells = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1).reshape(-1, 4)
    owners = (of_first[:, None] * (len(edges[1]) - 1) + of_second[None, :]).ravel()
    return Patches(area(*edges).ravel(), surface(*middle).reshape(-1, 3), normal(*middle).reshape(-1, 3), vertices, cells, owners,
                   names, units, edges)


def plane_patches(wall: PlaneWall, u: Array, v: Array) -> Patches:
    """Rectangles of a plane between the borders `u` and `v` (m, rising)."""
    return _rectangular((u, v), lambda a, b: np.outer(np.diff(a), np.diff(b)), wall.points,
                        lambda a, _: np.broadcast_to(wall.axes[0], (*a.shape, 3)), ("u", "v"), ("m", "m"), (np.inf, np.inf))


def cylinder_patches(wall: CylinderWall, around: int, height: Array) -> Patches:
    """`around` sectors of a cylinder by borders `height` along its axis (m, rising)."""
    if around < 1:
        raise DembarkError(f"wall {wall.name} cannot have {around} patches around", "", "give at least one")
    sign = -1.0 if wall.inward else 1.0
    return _rectangular((borders(0.0, _TURN, around), height), lambda a, b: wall.radius * np.outer(np.diff(a), np.diff(b)),
                        wall.points, lambda a, _: sign * wall.outward(a), ("angle", "height"), ("rad", "m"), (_FACET, np.inf))


def mesh_patches(wall: MeshWall, by: str = "triangle") -> Patches:
    """A patch for each triangle (`by` "triangle") or for each group of triangles ("group")."""
    corner = wall.triangles
    area = 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    cells = np.arange(3 * len(corner)).reshape(-1, 3)
    labels: tuple[str, ...] = ()
    if by == "triangle":
        number = np.arange(len(corner))
    elif by == "group":
        groups = np.zeros(len(corner), np.int64) if wall.groups is None else wall.groups
        kinds, number = np.unique(groups, return_inverse=True)
        labels = tuple(wall.group_names[kind] if 0 <= kind < len(wall.group_names) else f"group {kind}" for kind in kinds)
    else:
        raise DembarkError(f"wall {wall.name} has no patches by {by!r}", "", "those of a mesh are by 'triangle' or 'group'")
    total = np.bincount(number, area).astype(float, copy=False)
    centres, normals = (np.column_stack([np.bincount(number, area * column) for column in values.T]) / total[:, None]
                        for values in (corner.mean(axis=1), wall.axes[:, 0]))
    return Patches(total, centres, normals, corner.reshape(-1, 3), cells, number, of_triangle=number, labels=labels)


def inclusion_patches(inclusion: Inclusion, radius: float, around: int, along: int | Array) -> Patches:
    """Patches of an inclusion of `radius` (m), about its centre: `around` sectors by `along` bands.

    On a sphere `along` is the number of bands of equal area (or borders of the angle from the axis, rad); on a cylinder the borders of
    the height from the centre (m), or a number of bands between -radius and radius.
    """
    turn = borders(0.0, _TURN, around)
    body = CylinderWall(inclusion.name, radius, inclusion.axis, inward=False)
    if inclusion.surface == "cylinder":
        return cylinder_patches(body, around, borders(-radius, radius, along) if isinstance(along, int) else along)
    polar = np.arccos(borders(1.0, -1.0, along)) if isinstance(along, int) else along

    def radial(angle: Array, tilt: Array) -> Array:
        return np.sin(tilt)[..., None] * body.outward(angle) + np.cos(tilt)[..., None] * body.axes[0]

    return _rectangular((turn, polar), lambda a, b: radius**2 * np.outer(np.diff(a), -np.diff(np.cos(b))),
                        lambda a, b: radius * radial(a, b), radial, ("angle", "polar_angle"), ("rad", "rad"), (_FACET, _FACET))


def box_patches(wall: Wall | Inclusion, frame: GrainFrame, size: float) -> Patches:
    """Patches of about `size` (m) on all of the wall that lies in the box of `frame`; those of a mesh are its triangles."""
    if not 0.0 < size < np.inf:
        raise DembarkError(f"wall {wall.name} cannot have patches of {size} m", "", "their size must be positive and finite")
    if isinstance(wall, MeshWall):
        return mesh_patches(wall)
    if isinstance(wall, Inclusion):
        radius = wall.size(frame)
        around = count_of(_TURN * radius, size)
        return inclusion_patches(wall, radius, around, count_of((np.pi if wall.surface == "sphere" else 2.0) * radius, size))
    coordinates = wall.places(_corners(frame)).coordinates
    spans = [_steps(low, high, size) for low, high in zip(coordinates.min(axis=0), coordinates.max(axis=0), strict=True)]
    if isinstance(wall, PlaneWall):
        return plane_patches(wall, *spans)
    return cylinder_patches(wall, count_of(_TURN * wall.radius, size), spans[1])


def _corners(frame: GrainFrame) -> Array:
    return frame.low + np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) @ cell(frame.low, frame.high, frame.tilt)


def _steps(low: float, high: float, size: float) -> Array:
    return borders(low, high, count_of(high - low, size))
