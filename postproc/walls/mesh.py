"""Triangle meshes as walls: STL files, the nearest points of a mesh, and its cut by a plane."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dembark import _dumps

from ..dumps import DumpError

if TYPE_CHECKING:
    import pyvista

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
    if not path.exists():
        raise DumpError(f"{path} does not exist")
    try:
        triangles, solids, names, _, _ = _dumps.read_stl(str(path), precision)
    except ValueError as error:
        raise DumpError(str(error)) from None
    named = tuple(name or f"solid {number}" for number, name in enumerate(names, start=1)) or (path.stem,)
    return Surface(triangles, np.asarray(solids, np.int64), named)


def cut(triangles: Array, place: float = 0.0) -> Array:
    """Segments (k, 2, 2), of x and z, in which `triangles` (n, 3, 3) cross the plane y = `place`; those that only touch it do not count."""
    found = []
    for corners in triangles - np.array([0.0, place, 0.0]):
        above = corners[:, 1] > 0.0
        if above.all() or not above.any():
            continue
        found.append([(a + a[1] / (a[1] - b[1]) * (b - a))[[0, 2]] for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
                      if (a[1] > 0.0) != (b[1] > 0.0)])
    return np.array(found, float).reshape(-1, 2, 2)


def surface_of(triangles: Array) -> pyvista.PolyData:
    """`triangles` (t, 3, 3) as cells, each with corners of its own."""
    corners = np.ascontiguousarray(triangles.reshape(-1, 3), float)
    import pyvista

    return pyvista.PolyData.from_regular_faces(corners, np.arange(len(corners), dtype=int).reshape(-1, 3).tolist())


def nearest(surface: pyvista.PolyData, points: Array) -> tuple[Array, Integers]:
    """Nearest points (k, 3) of the surface and their triangles (k,) for `points` (k, 3); of equally near triangles any one."""
    if not len(points):
        return np.empty((0, 3)), np.empty(0, np.int64)
    # The types of PyVista miss that these are two.
    which, found = surface.find_closest_cell(points.reshape(-1, 3), return_closest_point=True)  # type: ignore[misc]
    return np.asarray(found, float), np.asarray(which, np.int64)
