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


class TriangleTree:
    """Finds the nearest point of t triangles (t, 3, 3), by VTK's cell locator."""

    def __init__(self, triangles: Array) -> None:
        # Slow to import, and only meshes need it.
        from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkStaticCellLocator

        corners, cells, mesh = vtkPoints(), vtkCellArray(), vtkPolyData()
        corners.SetData(numpy_to_vtk(np.ascontiguousarray(triangles.reshape(-1, 3), float), deep=True))
        count = 3 * len(triangles)
        cells.SetData(numpy_to_vtkIdTypeArray(np.arange(0, count + 1, 3), deep=True), numpy_to_vtkIdTypeArray(np.arange(count), deep=True))
        mesh.SetPoints(corners)
        mesh.SetPolys(cells)
        self._locator = vtkStaticCellLocator()
        self._locator.SetDataSet(mesh)
        self._locator.BuildLocator()

    def nearest(self, points: Array) -> tuple[Array, Integers]:
        """Nearest points (k, 3) of the mesh and their triangles (k,) for `points` (k, 3); of equally near triangles any one."""
        from vtkmodules.vtkCommonCore import reference
        from vtkmodules.vtkCommonDataModel import vtkGenericCell

        found, which = np.empty((len(points), 3)), np.empty(len(points), np.int64)
        cell, triangle, part, distance, place = vtkGenericCell(), reference(0), reference(0), reference(0.0), [0.0, 0.0, 0.0]
        for number, point in enumerate(points.tolist()):
            self._locator.FindClosestPoint(point, place, cell, triangle, part, distance)
            found[number], which[number] = place, triangle
        return found, which
