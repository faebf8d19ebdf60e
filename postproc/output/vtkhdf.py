"""Values on a surface for ParaView, in the format VTKHDF (version 2.0, PolyData). It has no place for units: they are text in the field
data, `units`, a line for each array."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.common.files import write_atomic

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """`vertices` (v, 3) in m, `cells` (c, k): the corners of each polygon by number; `values`: arrays (c,) or (c, n) of the cells, with
    their units, by name."""

    vertices: Array
    cells: NDArray[np.int64]
    values: Mapping[str, tuple[Array, str]]

    @property
    def areas(self) -> Array:
        """Areas (c,) in m^2 of flat cells."""
        corners = self.vertices[self.cells]
        along = corners[:, 1:] - corners[:, :1]
        return np.asarray(0.5 * np.linalg.norm(np.cross(along[:, :-1], along[:, 1:]).sum(axis=1), axis=1))


def write_surface(path: str | Path, surface: Surface) -> Path:
    """Write `surface`; returns the path. ValueError when an array has not one row a cell."""
    import h5py

    count, corners = surface.cells.shape
    if wrong := next((name for name, (column, _) in surface.values.items() if len(column) != count), ""):
        raise ValueError(f"{wrong} has {len(surface.values[wrong][0])} rows, the surface {count} cells")
    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 0)
        root.attrs.create("Type", b"PolyData", dtype=h5py.string_dtype("ascii", len(b"PolyData")))
        root["NumberOfPoints"] = [len(surface.vertices)]
        root["Points"] = np.asarray(surface.vertices, float)
        for kind in ("Vertices", "Lines", "Polygons", "Strips"):
            here = count if kind == "Polygons" else 0
            group = root.create_group(kind)
            group["NumberOfCells"], group["NumberOfConnectivityIds"] = [here], [here * corners]
            group["Offsets"] = corners * np.arange(here + 1, dtype=np.int64)
            group["Connectivity"] = surface.cells.astype(np.int64).ravel()[: here * corners]
        for name, (column, _) in surface.values.items():
            root[f"CellData/{name}"] = column
        # The reader of VTK takes no text in UTF-8.
        units = [f"{name}: {unit}" for name, (_, unit) in surface.values.items()]
        root.create_dataset("FieldData/units", data=units, dtype=h5py.string_dtype("ascii"))
    return write_atomic(Path(path), memory.getvalue())
