"""Files come back through the readers that users have: xarray, and VTK's reader, which is ParaView's."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import xarray
from scenes import frame_of
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from dembark.common.errors import DembarkError, RunError
from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.grid import Grid
from dembark.postproc.output import (
    FieldsNetcdf,
    FieldsVtkhdf,
    GrainsVtkhdf,
    dataset,
    wall_dataset,
    write_netcdf,
    write_vtkhdf,
    write_vtkhdf_grains,
    write_vtkhdf_wall,
    write_wall_netcdf,
)
from dembark.postproc.walls import CylinderWall, MeshWall, Motion, PlaneWall
from dembark.postproc.walls.patches import cylinder_patches, mesh_patches, plane_patches
from dembark.postproc.walls.stress import wall_stress

GRID = Grid((-1.0, 0.0, 2.0), (1.0, 3.0, 6.0), (2, 3, 4), (False, True, False))


def fields_of(number=0, grid=GRID):
    """Fields that tell cell, component and time by their values."""
    cells = np.arange(grid.cells, dtype=float).reshape(grid.shape) + 1000.0 * number
    arrays = {"density": cells, "velocity": cells[..., None] + [0.1, 0.2, 0.3],
              "stress": cells[..., None, None] + np.arange(9.0).reshape(3, 3) / 10.0}
    arrays["density"][0, 0, 0] = np.nan
    return SimpleNamespace(grid=grid, arrays=lambda: arrays, units={"density": "kg m-3", "velocity": "m s-1", "stress": "Pa"},
                           long_names={"density": "bulk density", "velocity": "mean velocity", "stress": "total stress"})


def read_vtk(path):
    """VTK's own reader on `path`, and its time values."""
    reader = vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    return reader, reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())


def cell_data(reader, time, name):
    """An array of the reader's cells at `time`."""
    reader.UpdateTimeStep(time)
    return vtk_to_numpy(reader.GetOutput().GetCellData().GetArray(name))


def texts(reader, name):
    """A text array of the field data."""
    array = reader.GetOutput().GetFieldData().GetAbstractArray(name)
    return [array.GetValue(number) for number in range(array.GetNumberOfValues())]


def load(count=3, motion=None):
    """A cylinder wall with uniform pressure that grows with time."""
    wall = CylinderWall("side", 2.0) if motion is None else CylinderWall("side", 2.0, motion=motion)
    angle, height = (grid.ravel() for grid in np.meshgrid((np.arange(16) + 0.5) * np.pi / 8.0, [0.25, 0.75]))
    shift = wall.motion.shift(1.0)
    frames = [frame_of(0.95 * wall.points(angle, height) * [1, 1, 0] + height[:, None] * [0, 0, 1] + shift * k, step=k,
                       walls={"side": -(k + 1.0) * wall.outward(angle)}) for k in range(count)]
    return wall_stress(frames, wall, cylinder_patches(wall, 4, np.array([0.0, 0.5, 1.0])))


def test_netcdf_holds_numbers_coordinates_units_and_times(tmp_path):
    path = write_netcdf(tmp_path / "f.nc", ((0.5 * k, fields_of(k)) for k in range(3)), {"kernel": "gaussian", "width": 0.25})
    with xarray.open_dataset(path) as found:
        assert found.attrs["Conventions"] == "CF-1.11" and found.attrs["kernel"] == "gaussian" and found.attrs["width"] == 0.25
        assert found.time.values.tolist() == [0.0, 0.5, 1.0] and found.time.units == "s"
        assert found.density.dims == ("time", "x", "y", "z") and found.stress.dims[-2:] == ("i", "j")
        assert found.density.units == "kg m-3" and found.stress.long_name == "total stress"
        np.testing.assert_allclose(found.z, [2.5, 3.5, 4.5, 5.5])
        np.testing.assert_allclose(found.x_bounds, [[-1.0, 0.0], [0.0, 1.0]])
        for k in range(3):
            for name, values in fields_of(k).arrays().items():
                np.testing.assert_array_equal(found[name][k], values)
        assert float(found.stress.isel(time=1).sel(x=0.5, y=1.5, z=2.5, i="x", j="z")) == fields_of(1).arrays()["stress"][1, 1, 0, 0, 2]
        assert not np.isnan(found.velocity).any() and int(np.isnan(found.density).sum()) == 3


def test_dataset_in_memory_is_that_of_the_file(tmp_path):
    write_netcdf(tmp_path / "f.nc", [(2.0, fields_of())], {"kernel": "lucy"})
    with xarray.open_dataset(tmp_path / "f.nc") as found:
        xarray.testing.assert_identical(found.load(), dataset(fields_of(), 2.0, attributes={"kernel": "lucy"}))


def test_coarse_grained_fields_are_written_with_all_their_names(tmp_path):
    grid = Grid((-1.0,) * 3, (1.0,) * 3, (4, 4, 4))
    fields = coarse_grain(frame_of([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]), None, grid, kernel="lucy", width=0.5).fields()
    with xarray.open_dataset(write_netcdf(tmp_path / "f.nc", fields)) as found:
        assert set(fields.arrays()) <= set(found) and all(found[name].units for name in fields.arrays())
        assert float(found.density.sum()) * grid.cell_volume == pytest.approx(2.0)
    reader, _ = read_vtk(write_vtkhdf(tmp_path / "f.vtkhdf", fields))
    reader.Update()
    assert {reader.GetOutput().GetCellData().GetArrayName(number) for number in range(len(fields.arrays()))} == set(fields.arrays())


def test_paraviews_reader_sees_fields_times_and_units(tmp_path):
    path = write_vtkhdf(tmp_path / "f.vtkhdf", ((0.25 * k, fields_of(k)) for k in range(3)), {"kernel": "gaussian", "width": 0.25})
    reader, times = read_vtk(path)
    assert times == (0.0, 0.25, 0.5)
    for k in (2, 0, 1):
        reader.UpdateTimeStep(times[k])
        image = reader.GetOutput()
        assert image.GetDimensions() == (3, 4, 5) and image.GetSpacing() == (1.0, 1.0, 1.0) and image.GetOrigin() == (-1.0, 0.0, 2.0)
        for name, values in fields_of(k).arrays().items():
            expected = values.transpose(2, 1, 0, *range(3, values.ndim)).reshape(GRID.cells, -1)
            np.testing.assert_array_equal(cell_data(reader, times[k], name).reshape(GRID.cells, -1), expected)
    assert "density: kg m-3, bulk density" in texts(reader, "units") and texts(reader, "kernel") == ["gaussian"]
    assert reader.GetOutput().GetFieldData().GetArray("width").GetValue(0) == 0.25


def test_paraviews_reader_sees_grains_whose_number_changes(tmp_path):
    counts = [3, 5, 0, 2]
    frames = [frame_of(np.arange(3.0 * count).reshape(count, 3) + 100.0 * k, np.arange(count) + 1.0, {"side": np.full((count, 3), k)},
                       step=10 * k) for k, count in enumerate(counts)]
    reader, times = read_vtk(write_vtkhdf_grains(tmp_path / "g.vtkhdf", iter(frames), 0.1))
    assert times == (0.0, 1.0, 2.0, 3.0)
    for k in (3, 1, 0, 2):
        reader.UpdateTimeStep(times[k])
        cloud = reader.GetOutput()
        assert cloud.GetNumberOfPoints() == counts[k]
        if counts[k]:
            assert cloud.GetNumberOfVerts() == counts[k]
            np.testing.assert_array_equal(vtk_to_numpy(cloud.GetPoints().GetData()), frames[k].positions)
            data = cloud.GetPointData()
            for name, expected in (("radius", frames[k].radii), ("id", frames[k].ids), ("force_of_side", np.full((counts[k], 3), k))):
                np.testing.assert_array_equal(vtk_to_numpy(data.GetArray(name)), expected)
            corners = [cloud.GetCell(number).GetPointId(0) for number in range(counts[k])]
            assert corners == list(range(counts[k]))
    assert "velocity: m s-1" in texts(reader, "units")


@pytest.mark.parametrize("motion", [None, Motion((0.0, 0.0, 0.5))])
def test_paraviews_reader_sees_the_patches_of_a_wall(tmp_path, motion):
    stress = load(motion=motion)
    reader, times = read_vtk(write_vtkhdf_wall(tmp_path / "w.vtkhdf", stress))
    assert times == (0.0, 1.0, 2.0)
    owners = stress.patches.owners
    for k in (1, 2, 0):
        np.testing.assert_array_equal(cell_data(reader, times[k], "stress_normal"), stress.series[k, owners, 0])
        np.testing.assert_array_equal(cell_data(reader, times[k], "mean_stress_normal"), stress.mean[owners, 0])
        surface = reader.GetOutput()
        low = surface.GetBounds()[4]
        assert low == pytest.approx(stress.displacements[k, 2])
        assert surface.GetNumberOfPolys() == len(owners)
    assert "mean_stress_normal: Pa" in texts(reader, "units")
    # Flat polygons of a cylinder have nearly its area.
    import pyvista
    assert pyvista.wrap(reader.GetOutput()).area == pytest.approx(stress.patches.areas.sum(), rel=2e-3)


def test_wall_without_series_has_one_time(tmp_path):
    wall = MeshWall("floor", np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]))
    stress = wall_stress([frame_of([[0.2, 0.2, 0.1]], walls={"floor": [[0, 0, 3.0]]}, step=4)], wall, mesh_patches(wall), keep_series=False)
    reader, times = read_vtk(write_vtkhdf_wall(tmp_path / "w.vtkhdf", stress))
    assert times is None
    assert cell_data(reader, 4.0, "mean_stress_normal") == pytest.approx([6.0])
    assert reader.GetOutput().GetFieldData().GetArray("TimeValue").GetValue(0) == 4.0


def test_wall_loads_come_back_in_groups(tmp_path):
    side = load(20)
    floor = PlaneWall("floor")
    frame = frame_of([[0.2, 0.2, 0.1]], walls={"floor": [[0, 0, 3.0]]})
    bottom = wall_stress([frame], floor, plane_patches(floor, np.arange(3.0), np.arange(2.0)))
    path = write_wall_netcdf(tmp_path / "w.nc", [side, bottom], {"run": "a run"})
    with xarray.open_dataset(path, group="side") as found:
        assert found.stress.dims == ("angle", "height", "component") and found.stress.units == "Pa" and found.height.units == "m"
        np.testing.assert_allclose(found.stress.sel(component="normal"), side.on_grid(side.mean[:, 0]))
        np.testing.assert_allclose((found.stress_series.sel(component="normal") * found.area).sum(["angle", "height"]), found.normal_force)
        assert int(found.contact_force_histogram.sum()) == side.contact_force.number == 20 * 32
        assert found.attrs["kind"] == "CylinderWall"
    with xarray.open_dataset(path, group="floor") as found:
        assert found.u.values.tolist() == [0.5, 1.5] and float(found.force.sum()) == 3.0
    with xarray.open_dataset(path) as found:
        assert found.attrs["run"] == "a run"
    assert wall_dataset(side).sizes["time"] == 20


def test_a_wall_may_be_called_like_a_field(tmp_path):
    floor = PlaneWall("density")
    frame = frame_of([[0.2, 0.2, 0.1]], walls={"density": [[0, 0, 3.0]]})
    with FieldsNetcdf(tmp_path / "f.nc") as file:
        file.add(fields_of(), 0.0)
        file.add_walls([wall_stress([frame], floor, plane_patches(floor, np.arange(2.0), np.arange(2.0)))])
    with xarray.open_dataset(tmp_path / "f.nc", group="wall_density") as found:
        assert float(found.force[0, 2]) == 3.0


@pytest.mark.parametrize(("make", "suffix"), [(FieldsNetcdf, "nc"), (FieldsVtkhdf, "vtkhdf")])
def test_a_file_is_whole_or_not_there(tmp_path, make, suffix):
    path = tmp_path / f"f.{suffix}"
    path.write_text("before")

    def interrupted():
        with make(path) as file:
            file.add(fields_of(), 0.0)
            raise KeyboardInterrupt

    def on_two_grids():
        with make(path) as file:
            file.add(fields_of(), 0.0)
            file.add(fields_of(grid=Grid((0.0,) * 3, (1.0,) * 3, (2, 3, 4))), 1.0)

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_text() == "before" and list(tmp_path.iterdir()) == [path]
    with pytest.raises(DembarkError, match="another grid"):
        on_two_grids()
    with pytest.raises(DembarkError, match="nothing to write"), make(path):
        pass
    with pytest.raises(DembarkError, match="folder"):
        make(tmp_path / "nowhere" / f"f.{suffix}")
    with pytest.raises(DembarkError, match="is a folder"):
        make(tmp_path)
    assert path.read_text() == "before" and list(tmp_path.iterdir()) == [path]
    with make(path) as file:
        file.add(fields_of(), 0.0)
    assert path.stat().st_size > 1000


def test_full_disk_is_told_in_one_line(tmp_path, monkeypatch):
    import errno
    import os
    import pathlib

    def refuse(self, target):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    monkeypatch.setattr(pathlib.Path, "replace", refuse)
    with pytest.raises(RunError, match="the disk is full"):
        write_vtkhdf(tmp_path / "f.vtkhdf", fields_of())
    assert list(tmp_path.iterdir()) == []


def test_grains_with_other_columns_are_refused(tmp_path):
    def with_and_without():
        with GrainsVtkhdf(tmp_path / "g.vtkhdf") as file:
            file.add(frame_of([[0.0, 0.0, 0.0]], walls={"side": np.zeros((1, 3))}), 0.0)
            file.add(frame_of([[0.0, 0.0, 0.0]]), 1.0)

    with pytest.raises(DembarkError, match="force_of_side"):
        with_and_without()
