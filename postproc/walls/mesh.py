"""Triangle meshes as walls: STL files, and the nearest point of a mesh for many points at once."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.dumptext import DumpError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_VERTEX = re.compile(rf"\bvertex\s+({_NUMBER})\s+({_NUMBER})\s+({_NUMBER})")
_LEAF = 8
_CHUNK = 20_000


@dataclass(frozen=True)
class Surface:
    """Triangles of a file: corners (t, 3, 3) in the file's unit, number of the solid of each (t,), and the solids' names."""

    triangles: Array
    solids: Integers
    names: tuple[str, ...]


def read_stl(path: str | Path) -> Surface:
    """Triangles of an STL file, text or binary; DumpError when it is neither, cut off, or empty.

    Every `solid` of a text file is a part of its own; a binary file is one. Triangles without area, which exporters leave behind, are
    dropped: their neighbours cover their edges.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DumpError(f"{path} cannot be read: {error.strerror}") from None
    count = int.from_bytes(data[80:_HEADER], "little") if len(data) >= _HEADER else -1
    # Some binary files begin with the word `solid`, so the size decides first.
    if len(data) == _HEADER + count * _FACET.itemsize:
        surface = Surface(np.frombuffer(data, _FACET, offset=_HEADER)["corners"].astype(float), np.zeros(count, np.int64), (path.stem,))
    elif data.lstrip()[:5].lower() == b"solid" and b"facet" in data:
        surface = _text(path, data)
    else:
        wanted = _HEADER + count * _FACET.itemsize
        said = f"; a binary one of {count} triangles has {wanted} bytes, this has {len(data)}" if count >= 0 else ""
        raise DumpError(f"{path} is no whole STL file, text or binary{said}")
    if not np.isfinite(surface.triangles).all():
        raise DumpError(f"{path} holds a corner that is not finite")
    whole = _areas(surface.triangles) > 0.0
    if not whole.any():
        raise DumpError(f"{path} holds no triangle with an area")
    return Surface(surface.triangles[whole], surface.solids[whole], surface.names)


def _text(path: Path, data: bytes) -> Surface:
    triangles, solids, names = [], [], []
    for number, part in enumerate(re.split(r"(?m)^\s*solid\b", data.decode("ascii", errors="replace"))[1:]):
        head, _, body = part.partition("\n")
        corners = np.array(_VERTEX.findall(body), float).reshape(-1, 3)
        facets = len(re.findall(r"\bendfacet\b", body))
        if "endsolid" not in body or len(corners) != 3 * facets or body.count("vertex") != len(corners):
            raise DumpError(f"{path}, solid {number + 1}: cut off or not made of triangles, {len(corners)} corners in {facets} facets")
        triangles.append(corners.reshape(-1, 3, 3))
        solids.append(np.full(facets, number))
        names.append(head.strip() or f"solid {number + 1}")
    return Surface(np.concatenate(triangles), np.concatenate(solids), tuple(names))


def cut(triangles: Array, place: float = 0.0) -> Array:
    """Segments (k, 2, 2), of x and z, in which `triangles` (n, 3, 3) meet the plane y = `place`; those that only touch it count not."""
    found = []
    for corners in triangles - np.array([0.0, place, 0.0]):
        above = corners[:, 1] > 0.0
        if above.all() or not above.any():
            continue
        found.append([(a + a[1] / (a[1] - b[1]) * (b - a))[[0, 2]] for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
                      if (a[1] > 0.0) != (b[1] > 0.0)])
    return np.array(found, float).reshape(-1, 2, 2)


def _areas(triangles: Array) -> Array:
    area = 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    longest = np.max(np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2), axis=1, initial=0.0)
    # Round-off of the corners in single precision leaves slivers an area of this size.
    return np.where(area > 1e-7 * longest**2, area, 0.0)


def nearest_on_triangles(points: Array, triangles: Array) -> Array:
    """For each of k `points` (k, 3) the nearest point (k, 3) of the triangle in the same row of `triangles` (k, 3, 3).

    It is the foot of the perpendicular where that lies inside, else the nearest of the nearest points of the three edges.
    """
    origin, first, second = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(first, second)
    square = np.einsum("ka,ka->k", normal, normal)
    offset = points - origin
    share_second = np.einsum("ka,ka->k", np.cross(first, offset), normal) / square
    share_first = np.einsum("ka,ka->k", np.cross(offset, second), normal) / square
    inside = (share_first >= 0.0) & (share_second >= 0.0) & (share_first + share_second <= 1.0)
    found = np.where(inside[:, None], origin + share_first[:, None] * first + share_second[:, None] * second, 0.0)
    best = np.where(inside, 0.0, np.inf)
    for corner in range(3):
        start, edge = triangles[:, corner], triangles[:, (corner + 1) % 3] - triangles[:, corner]
        along = np.einsum("ka,ka->k", points - start, edge) / np.einsum("ka,ka->k", edge, edge)
        candidate = start + np.clip(along, 0.0, 1.0)[:, None] * edge
        distance = np.linalg.norm(points - candidate, axis=1)
        nearer = distance < best
        found[nearer], best[nearer] = candidate[nearer], distance[nearer]
    return found


def _gap(points: Array, low: Array, high: Array) -> Array:
    """Distances (p,) of points from boxes, 0 inside."""
    gap = np.maximum(np.maximum(low - points, points - high), 0.0)
    return np.sqrt(np.einsum("pa,pa->p", gap, gap))


class TriangleTree:
    """Finds the nearest point of t triangles (t, 3, 3): a binary tree of boxes, searched for many points at once; exact."""

    def __init__(self, triangles: Array) -> None:
        self._triangles = triangles
        from scipy.spatial import cKDTree  # slow to import, and only meshes need it

        self._centroids = cKDTree(triangles.mean(axis=1))
        low, high, centre = triangles.min(axis=1), triangles.max(axis=1), triangles.mean(axis=1)
        self._boxes = low, high
        # Nodes in the order in which they are made; children of an inner node are two that follow each other.
        order = np.arange(len(triangles))
        spans, child, boxes = [(0, len(triangles))], [], []
        node = 0
        while node < len(spans):
            begin, end = spans[node]
            members = order[begin:end]
            boxes.append((low[members].min(axis=0), high[members].max(axis=0)))
            if end - begin <= _LEAF:
                child.append(-1)
            else:
                axis = int(np.argmax(np.ptp(centre[members], axis=0)))
                middle = (end - begin) // 2
                order[begin:end] = members[np.argpartition(centre[members, axis], middle)]
                child.append(len(spans))
                spans += [(begin, begin + middle), (begin + middle, end)]
            node += 1
        self._order, self._spans, self._child = order, np.array(spans), np.array(child)
        self._low, self._high = (np.array(corner) for corner in zip(*boxes, strict=True))

    def nearest(self, points: Array) -> tuple[Array, Integers]:
        """Nearest points (k, 3) of the mesh and their triangles (k,) for `points` (k, 3); of equally near ones the first triangle."""
        parts = [self._search(points[start : start + _CHUNK]) for start in range(0, len(points), _CHUNK)]
        if not parts:
            return np.zeros((0, 3)), np.zeros(0, np.int64)
        return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])

    def _search(self, points: Array) -> tuple[Array, Integers]:
        # A triangle's centroid belongs to it, so this bounds the distance from above; a hair more, for round-off.
        bound = self._centroids.query(points)[0] * (1.0 + 1e-6)
        which, node = np.arange(len(points)), np.zeros(len(points), np.int64)
        pairs: list[tuple[Integers, Integers]] = []
        while len(which):
            near = _gap(points[which], self._low[node], self._high[node]) <= bound[which]
            which, node = which[near], node[near]
            leaf = self._child[node] < 0
            pairs.append(self._members(which[leaf], node[leaf]))
            which, node = np.repeat(which[~leaf], 2), (self._child[node[~leaf]][:, None] + [0, 1]).ravel()
        which, triangle = (np.concatenate(column) for column in zip(*pairs, strict=True))
        near = _gap(points[which], self._boxes[0][triangle], self._boxes[1][triangle]) <= bound[which]
        which, triangle = which[near], triangle[near]
        place = nearest_on_triangles(points[which], self._triangles[triangle])
        distance = np.linalg.norm(points[which] - place, axis=1)
        ranking = np.lexsort((triangle, distance, which))
        first = ranking[np.r_[True, np.diff(which[ranking]) > 0]] if len(ranking) else ranking
        return place[first], triangle[first]

    def _members(self, which: Integers, node: Integers) -> tuple[Integers, Integers]:
        begin, end = self._spans[node].T
        count = end - begin
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        return np.repeat(which, count), self._order[np.repeat(begin, count) + within]
