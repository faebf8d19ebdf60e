"""The surface of a fluid of particles, and free bodies in it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from dembark.common.memory import check_memory

from ..fields.coarse_graining import interpolate
from ..fields.grid import Grid
from ..grains import GrainFrame
from ..history import read_times

Array = NDArray[np.float64]

# In spacings of the particles: standard deviation of the kernel, its reach, and the cells of the grid.
_WIDTH, _REACH, _CELL = 0.55, 2.2, 0.5


def surface(frame: GrainFrame) -> tuple[Array, NDArray[np.bool_]]:
    """Triangles (t, 3, 3) in m of the surface of a fluid, and its particles (n,) that are outside of it, as drops.

    Particles are a spacing apart, which is their diameter. The surface is where the share of the space that their cells fill, smoothed by a
    Gaussian, is a half: the face of a block of particles is where their outermost cells end.
    """
    import pyvista

    spacing = 2.0 * float(np.median(frame.radii))
    grid = Grid.around(frame, _CELL * spacing, _REACH * spacing)
    check_memory(50.0 * grid.cells, "cells of half a spacing", "draw the particles: leave --surface out")
    modes = ["wrap" if one else "constant" for one in grid.periodic]
    share = gaussian_filter(_deposited(frame.wrapped, grid), _WIDTH * spacing / grid.spacing, mode=modes) * spacing**3 / grid.cell_volume
    image = pyvista.ImageData(dimensions=grid.shape, spacing=tuple(grid.spacing), origin=tuple(grid.low + 0.5 * grid.spacing))
    image["share"] = share.ravel(order="F")
    found = image.contour([0.5], "share", method="flying_edges").triangulate()
    if found.n_cells:
        found = found.smooth_taubin(n_iter=20, pass_band=0.1)
    corners = np.asarray(found.points, float)[found.faces.reshape(-1, 4)[:, 1:]] if found.n_cells else np.zeros((0, 3, 3))
    return corners, interpolate(share[..., None], grid, frame.wrapped)[:, 0] < 0.5


def _deposited(points: Array, grid: Grid) -> Array:
    """How many of the points (n, 3) each cell has, shared linearly between the centres of cells around them."""
    at = (points - grid.low) / grid.spacing - 0.5
    first = np.floor(at).astype(int)
    total = np.zeros(grid.cells)
    for corner in np.ndindex(2, 2, 2):
        weight = np.abs(1.0 - np.array(corner) - (at - first)).prod(axis=1)
        cell = np.ravel_multi_index(tuple((first + corner).T), grid.shape, mode="wrap")
        total += np.bincount(cell, weight, grid.cells)
    return total.reshape(grid.shape)


def boxes(folder: Path, walls: Mapping[str, Mapping[str, Any]], steps: NDArray[np.int64]) -> dict[str, Array]:
    """Triangles (steps, 12, 3, 3) in m of the free boxes among the `walls` of a run's record, by the columns NAME_x to NAME_qz of its
    history in the rows nearest to `steps` (k,); a name that ends in * stands for all such columns."""
    known = {name: wall for name, wall in walls.items() if wall["kind"] == "box"}
    if not known:
        return {}
    rows, found = read_times(folder / "time.csv"), {}
    row = np.abs(rows["step"][:, None] - steps).argmin(axis=0)
    for name, wall in known.items():
        for one in (column.removesuffix("_qw") for column in rows if column.endswith("_qw")):
            if one == name or (name.endswith("*") and one.startswith(name[:-1])):
                centre = np.column_stack([rows[f"{one}_{part}"][row] for part in "xyz"])
                turn = np.column_stack([rows[f"{one}_q{part}"][row] for part in "wxyz"])
                corners = _CUBE * np.asarray(wall["size"], float)
                found[one] = np.einsum("kab,tcb->ktca", rotation(turn), corners) + centre[:, None, None, :]
    return found


def rotation(quaternion: Array) -> Array:
    """Matrices (k, 3, 3) that turn vectors as quaternions (k, 4), w first, do."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1)[:, None]).T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


def _cube() -> Array:
    """Triangles (12, 3, 3) of a cube of edge 1 around the origin, seen from outside counter-clockwise."""
    found = []
    for axis in range(3):
        for side in (-0.5, 0.5):
            square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])[:: 1 if side > 0 else -1]
            face = np.insert(square, 0, side, axis=1)[:, np.roll([0, 1, 2], axis)]
            found += [face[[0, 1, 2]], face[[0, 2, 3]]]
    return np.array(found)


_CUBE = _cube()
