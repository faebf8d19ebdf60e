"""Surfaces come back through the reader of VTK that ParaView has."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista
from vtkmodules.vtkIOHDF import vtkHDFReader

from dembark.postproc.output.vtkhdf import Surface, write_surface

CORNERS = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 3.0], [0.0, 0.0, 3.0]])
CELLS = np.array([[0, 1, 2, 3], [0, 3, 4, 5]])
VALUES = {"wear": (np.array([1.5, -2.0]), "m s-1"), "force": (np.arange(6.0).reshape(2, 3), "N")}


def test_a_surface_comes_back(tmp_path: Path) -> None:
    path = write_surface(tmp_path / "part.vtkhdf", Surface(CORNERS, CELLS, VALUES))
    reader = vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.Update()
    found = pyvista.wrap(reader.GetOutput())
    np.testing.assert_array_equal(found.points, CORNERS)
    np.testing.assert_array_equal(found.regular_faces, CELLS)
    for name, (values, _) in VALUES.items():
        np.testing.assert_array_equal(found.cell_data[name], values)
    assert list(found.field_data["units"]) == ["wear: m s-1", "force: N"]
    assert found.compute_cell_sizes()["Area"] == pytest.approx(Surface(CORNERS, CELLS, VALUES).areas) == [2.0, 3.0]
    with h5py.File(path) as file:
        assert tuple(file["VTKHDF"].attrs["Version"]) == (2, 0)


def test_an_array_of_another_length_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="wear has 3 rows, the surface 2 cells"):
        write_surface(tmp_path / "part.vtkhdf", Surface(CORNERS, CELLS, {"wear": (np.zeros(3), "m")}))
