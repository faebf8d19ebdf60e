"""Rigid bodies of spheres from a closed surface of triangles: its exact mass properties, and spheres that fill it.

The mass properties are those of the surface's inside, never those of the spheres: overlaps and gaps of these do not change them.

Sources: Eberly, Polyhedral mass properties (revisited), Geometric Tools (2002), for the integrals; Li, Xu and Meng, Powder Technol. 286
(2015) 478, the body-covering scheme, for spheres of different sizes.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from dembark.common.errors import DembarkError
from dembark.postproc.dumps import DumpError
from dembark.postproc.walls.mesh import read_stl

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Corners are those of single precision, which is what binary files have: nearer ones, over the largest coordinate, are the same.
SINGLE = 2e-7
# Points in a body at which spheres of different sizes are looked for.
POINTS = 20_000
# Points on a surface, and cells in a body, at which the spheres are compared with it.
SEEN, CELLS = 5_000, 200_000
# Cells of the box around a body, at most: a slender body that lies askew fills little of it.
MOST_CELLS = 20_000_000


@dataclass(frozen=True)
class MassProperties:
    """Volume (m³), centre of mass (m, (3,)), and second moments about it along the axes of the file, of unit density (m⁵, (3, 3))."""

    volume: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class Spheres:
    """Centres (m, (n, 3)) and radii (m, (n,))."""

    centres: Array
    radii: Array


@dataclass(frozen=True)
class Fit:
    """How spheres fit a body: volume of their union over the body's, how far (m) parts of its surface are outside of all spheres, at most
    and root mean square, and how far spheres reach out of it, at most."""

    volume_ratio: float
    short: float
    rms: float
    beyond: float


def mass_properties(triangles: Array) -> MassProperties:
    """Of what a closed surface of `triangles` (m, (t, 3, 3)) encloses, by the divergence theorem: exact up to round-off. Corners of each
    triangle are counter-clockwise seen from outside."""
    # Cones from a point amid the surface to its triangles: far from it, their volumes would cancel.
    middle = triangles.reshape(-1, 3).mean(axis=0)
    corners = triangles - middle
    six = np.linalg.det(corners)
    total = corners.sum(axis=1)
    volume = six.sum() / 6.0
    if not volume > 0.0:
        return MassProperties(float(volume), middle, np.zeros((3, 3)))
    centre = six @ total / 24.0 / volume
    second = (np.einsum("t,tki,tkj->ij", six, corners, corners) + np.einsum("t,ti,tj->ij", six, total, total)) / 120.0
    second -= volume * np.outer(centre, centre)
    return MassProperties(float(volume), middle + centre, np.trace(second) * np.eye(3) - second)


@dataclass(frozen=True)
class Mesh:
    """A closed surface without seams: `points` (m, (p, 3)), and the three corners of each triangle by number (t, 3)."""

    points: Array
    faces: Integers

    @cached_property
    def triangles(self) -> Array:
        """Corners (m, (t, 3, 3))."""
        return self.points[self.faces]

    @cached_property
    def mass(self) -> MassProperties:
        """Of the inside."""
        return mass_properties(self.triangles)

    @cached_property
    def of_part(self) -> Integers:
        """The part of the surface, by number, that each triangle (t,) belongs to: parts have no corner in common."""
        count, (a, b, c) = len(self.points), self.faces.T
        joined = coo_matrix((np.ones(2 * len(a)), (np.append(a, b), np.append(b, c))), shape=(count, count))
        return np.asarray(connected_components(joined, directed=False)[1][a], np.int64)

    @property
    def pieces(self) -> int:
        """How many bodies it encloses that are apart from each other; cavities are none."""
        return sum(mass_properties(self.triangles[self.of_part == k]).volume > 0.0 for k in range(self.of_part.max() + 1))

    def turned(self) -> Mesh:
        """With the centre of mass at the origin and the principal axes along x, y and z, in ascending order of the moments. A body whose
        axes are along them already is turned by right angles only."""
        inertia = self.mass.inertia
        axes = (np.eye(3)[:, np.argsort(np.diag(inertia), kind="stable")] if is_principal(inertia)
                else np.linalg.eigh(inertia)[1])
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        return replace(self, points=(self.points - self.mass.centre) @ axes)

    def distance(self, points: Array) -> Array:
        """Distances (m, (k,)) of `points` (m, (k, 3)) from the surface, negative inside."""
        import pyvista

        surface = pyvista.PolyData.from_regular_faces(self.points, self.faces.tolist())
        return np.asarray(pyvista.PolyData(points).compute_implicit_distance(surface)["implicit_distance"], float)


def is_principal(inertia: Array) -> bool:
    """Whether the axes of the tensor (3, 3) are along x, y and z, up to the precision of STL files."""
    return bool(np.abs(inertia - np.diag(np.diag(inertia))).max() <= 1e-6 * np.diag(inertia).max())


def read_body(path: str | Path, unit: float = 1.0) -> Mesh:
    """The closed surface of an STL file, lengths in `unit` (m); DembarkError when it is none, with the reason."""
    try:
        triangles = np.asarray(read_stl(path).triangles, float) * unit
    except DumpError as error:
        raise DembarkError(str(error)) from None
    return closed(triangles, str(path))


def closed(triangles: Array, name: str) -> Mesh:
    """`triangles` (m, (t, 3, 3)) as a closed surface; DembarkError, with `name`, when they are none: an edge without a second triangle or
    with a third one, normals that disagree or point inwards, parts that cut or touch others."""
    points, faces = _joined(triangles)
    if (same := (faces == np.roll(faces, 1, axis=1)).any(axis=1)).any():
        raise _refusal(name, f"{same.sum()} of its triangles have corners in one place", "mend it")
    edges = np.sort(np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    along = np.concatenate([faces[:, k] < faces[:, (k + 1) % 3] for k in range(3)])
    unique, place, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    if (open_ := count == 1).any():
        raise _refusal(name, f"the surface is open: {open_.sum()} edges belong to one triangle only", "close it")
    if (many := count > 2).any():
        raise _refusal(name, f"{many.sum()} edges belong to more than two triangles", "part the bodies that share them")
    if (same_way := np.bincount(place.ravel(), along) != 1.0).any():
        raise _refusal(name, f"triangles at {same_way.sum()} edges are turned against their neighbours", "let all normals point outwards")
    mesh = Mesh(points, faces)
    _check_parts(mesh, name)
    if (crossing := _crossings(mesh, unique)):
        raise _refusal(name, f"the surface cuts or touches itself at {crossing} edges", "unite its parts")
    return mesh


def _refusal(name: str, what: str, remedy: str) -> DembarkError:
    return DembarkError(f"{name} is no closed body", what, remedy)


def _joined(triangles: Array) -> tuple[Array, Integers]:
    """Points and faces of triangles whose corners are the same where they are nearer than single precision."""
    points, places = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    near = cKDTree(points).query_pairs(SINGLE * float(np.abs(points).max()), output_type="ndarray")
    count = len(points)
    number, group = connected_components(coo_matrix((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(count, count)), directed=False)
    kept = np.zeros((number, 3))
    kept[group] = points
    return kept, np.asarray(group[places.ravel()].reshape(-1, 3), np.int64)


def _check_parts(mesh: Mesh, name: str) -> None:
    """DembarkError when a part that is not joined to others has normals that do not fit to where it lies: outwards around material,
    inwards around a cavity in it."""
    for k in range(mesh.of_part.max() + 1):
        own = mesh.triangles[mesh.of_part == k]
        turns = round(_turns(mesh.triangles[mesh.of_part != k], own[0, 0]))
        volume = mass_properties(own).volume
        if turns == 0 and not volume > 0.0:
            raise _refusal(name, "it is inside out", "let all normals point outwards")
        if turns not in (0, 1) or (turns == 1 and volume > 0.0):
            raise _refusal(name, "a part of it lies in another one with both normals outwards", "turn that of a cavity, or unite them")


def _turns(triangles: Array, point: Array) -> float:
    """How often the surface goes round the `point` (m, (3,)): its solid angle (van Oosterom & Strackee 1983) over 4π; 1 inside."""
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    below = x * y * z + (a * b).sum(1) * z + (b * c).sum(1) * x + (c * a).sum(1) * y
    return float(np.arctan2(np.linalg.det(triangles - point), below).sum() / (2.0 * np.pi))


def _crossings(mesh: Mesh, edges: Integers) -> int:
    """How many `edges` (e, 2) meet a triangle that has none of their ends. Faces that lie on each other are seen by the edges round them
    only where these go through a face."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
    from vtkmodules.vtkFiltersGeneral import vtkOBBTree

    size = float(np.ptp(mesh.points, axis=0).max())
    places = (mesh.points - mesh.points.min(axis=0)) / size
    tree, met, numbers = vtkOBBTree(), vtkPoints(), vtkIdList()
    tree.SetDataSet(pyvista.PolyData.from_regular_faces(places, mesh.faces.tolist()))
    tree.BuildLocator()
    found = 0
    for edge in edges.tolist():
        tree.IntersectWithLine(places[edge[0]], places[edge[1]], met, numbers)
        cut = mesh.faces[[numbers.GetId(k) for k in range(numbers.GetNumberOfIds())]]
        found += bool(len(cut)) and not np.isin(cut, edge).any(axis=1).all()
    return found


def voxels(mesh: Mesh, spacing: float) -> Spheres:
    """Equal spheres on a cubic lattice of `spacing` (m), which touch: all whose centres are in the body."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    numbers = np.maximum(1, np.rint((high - low) / spacing)).astype(int)
    if not np.prod(numbers, dtype=float) < 1e7:
        raise DembarkError(f"a spacing of {spacing:g} m gives {np.prod(numbers, dtype=float):.0e} spheres", "", "take a larger one")
    points = _lattice(0.5 * (low + high), spacing, numbers)
    inside = mesh.distance(points) < 0.0
    if not inside.any():
        raise DembarkError(f"no sphere of a lattice of {spacing:g} m has its centre in the body", "", "take a smaller spacing")
    return Spheres(points[inside], np.full(inside.sum(), 0.5 * spacing))


def _lattice(middle: Array, spacing: float, numbers: Integers) -> Array:
    """Points (k, 3) of a cubic lattice around `middle`, `numbers` (3,) along x, y and z."""
    along = [spacing * (np.arange(n) - 0.5 * (n - 1)) for n in numbers]
    return middle + np.stack(np.meshgrid(*along, indexing="ij"), axis=-1).reshape(-1, 3)


def covering(mesh: Mesh, number: int) -> Spheres:
    """At most `number` spheres of different sizes that touch the surface from inside and may overlap.

    The body-covering scheme of Li, Xu and Meng (2015): at each point of a lattice in the body the largest sphere within it; of these, one
    after the other, the one that covers most points not yet covered. It ends early when all are covered. The lattice has 20 000
    points, one of them in the middle of the body's extent; spheres are at least as large as its cells.
    """
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    spacing = float(np.cbrt(mesh.mass.volume / POINTS))
    _require_few(high - low, spacing)
    points = _lattice(0.5 * (low + high), spacing, 2 * np.floor(0.5 * (high - low) / spacing).astype(int) + 1)
    depths = -mesh.distance(points)
    # Smaller ones would be there for one point only.
    large = depths > 0.5 * spacing
    points, radii = points[large], depths[large]
    if not len(points):
        raise DembarkError("the body is too thin for spheres in it", "", "take a lattice")
    tree, bare = cKDTree(points), np.ones(len(points), bool)

    def gain(k: int) -> int:
        return int(bare[tree.query_ball_point(points[k], radii[k])].sum())

    # How many points a sphere would add only falls while others are taken: what is on top after a new count is the best of all.
    waiting = [(-4.19 * (radius / spacing + 1.0) ** 3, -radius, k) for k, radius in enumerate(radii.tolist())]
    heapq.heapify(waiting)
    taken: list[int] = []
    while waiting and bare.any() and len(taken) < number:
        _, radius, k = heapq.heappop(waiting)
        if not (more := gain(k)):
            continue
        if waiting and (-more, radius, k) > waiting[0]:
            heapq.heappush(waiting, (-more, radius, k))
            continue
        bare[tree.query_ball_point(points[k], radii[k])] = False
        taken.append(k)
    return Spheres(points[taken], radii[taken])


def fit(mesh: Mesh, spheres: Spheres) -> Fit:
    """How the spheres fit the body, on 200 000 cells as large as it, and at the corners of its surface and 5 000 points on it."""
    reach = spheres.radii[:, None]
    low, high = (spheres.centres - reach).min(axis=0), (spheres.centres + reach).max(axis=0)
    spacing = float(np.cbrt(mesh.mass.volume / CELLS))
    _require_few(high - low, spacing)
    cells = _lattice(0.5 * (low + high), spacing, np.ceil((high - low) / spacing).astype(int))
    covered = np.zeros(len(cells), bool)
    tree = cKDTree(cells)
    for centre, radius in zip(spheres.centres, spheres.radii, strict=True):
        covered[tree.query_ball_point(centre, radius)] = True
    outside = _outside(spheres, np.concatenate([mesh.points, _on_surface(mesh.triangles)]))
    beyond = spheres.radii + mesh.distance(spheres.centres)
    return Fit(float(covered.sum() * spacing**3 / mesh.mass.volume), float(outside.max()),
               float(np.sqrt(np.mean(outside[len(mesh.points):] ** 2))), max(0.0, float(beyond.max())))


def _require_few(extent: Array, spacing: float) -> None:
    """DembarkError where a box of the `extent` (3,) has too many cells of the `spacing` (m)."""
    if (cells := float(np.prod(extent / spacing))) > MOST_CELLS:
        raise DembarkError("the body is too slender for the box around it", f"that has {cells:.1g} cells, at most {MOST_CELLS:.0e} fit",
                           "turn the body along x, y and z (--principal)")


def _on_surface(triangles: Array) -> Array:
    """SEEN points (k, 3), equally likely everywhere; the same each time."""
    random = np.random.default_rng(1)
    areas = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    a, b, c = np.moveaxis(triangles[random.choice(len(triangles), SEEN, p=areas / areas.sum())], 1, 0)
    u, v = random.random((2, SEEN, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    return np.asarray(a + u * (b - a) + v * (c - a))


def _outside(spheres: Spheres, points: Array) -> Array:
    """How far (m, (k,)) points are outside of all spheres, 0 within one."""
    nearest = np.full(len(points), np.inf)
    for centre, radius in zip(spheres.centres, spheres.radii, strict=True):
        np.minimum(nearest, np.linalg.norm(points - centre, axis=1) - radius, out=nearest)
    return np.maximum(nearest, 0.0)
