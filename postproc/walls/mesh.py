"""Triangle meshes as walls: STL files, and the nearest point of a mesh for many points at once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark import _dumps

from ..dumptext import DumpError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# m: corners nearer to each other than this are the same, as in the engines.
PRECISION = 1e-8


@dataclass(frozen=True)
class Surface:
    """Triangles of a file: corners (t, 3, 3) in the file's unit, number of the solid of each (t,), and the solids' names."""

    triangles: Array
    solids: Integers
    names: tuple[str, ...]


def read_stl(path: str | Path, precision: float = 0.0) -> Surface:
    """Triangles of an STL file, text or binary, by the reader of the engines; DumpError when it is neither, cut off, or empty.

    Every `solid` of a text file is a part of its own; a binary file is one. Triangles without area, and those given again with corners
    that differ by no more than `precision` (in the file's unit), are left out.
    """
    path = Path(path)
    try:
        triangles, solids, names, _, _ = _dumps.read_stl(str(path), precision)
    except ValueError as error:
        raise DumpError(str(error)) from None
    named = tuple(name or f"solid {number}" for number, name in enumerate(names, start=1)) or (path.stem,)
    return Surface(triangles, np.asarray(solids, np.int64), named)


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
