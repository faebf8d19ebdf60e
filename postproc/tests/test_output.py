"""Files come back through the readers that users have: xarray, and PyVista's reader of ParaView's collections."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import pyvista
import xarray
from packings import frame_of

from dembark.common.errors import DembarkError, RunError
from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.grid import Grid
from dembark.postproc.output.netcdf import dataset, joined, wall_dataset, write_netcdf
from dembark.postproc.output.paraview import TimeSeries, write_fields, write_grains, write_wall
from dembark.postproc.walls import CylinderWall, MeshWall, Motion, PlaneWall
from dembark.postproc.walls.patches import cylinder_patches, mesh_patches, plane_patches
from dembark.postproc.walls.stress import wall_stress

GRID = Grid((-1.0, 0.0, 2.0), (1.0, 3.0, 6.0), (2, 3, 4), (False, True, False))


def fields_of(number=0, grid=GRID):
    """Fields whose values say cell, component and time."""
    cells = np.arange(grid.cells, dtype=float).reshape(grid.shape) + 1000.0 * number
    arrays = {"density": cells, "velocity": cells[..., None] + [0.1, 0.2, 0.3],
              "stress": cells[..., None, None] + np.arange(9.0).reshape(3, 3) / 10.0}
    arrays["density"][0, 0, 0] = np.nan
    return SimpleNamespace(grid=grid, arrays=lambda: arrays, units={"density": "kg m-3", "velocity": "m s-1", "stress": "Pa"},
                           long_names={"density": "bulk density", "velocity": "mean velocity", "stress": "total stress"})


def times_of(path):
    """The times of a collection, and a function that reads the data set of one of them."""
    reader = pyvista.get_reader(path)

    def at(time):
        reader.set_active_time_value(time)
        return reader.read()[0]

    return reader.time_values, at


def floor_load(name="floor"):
    """A floor of two patches that carries a grain."""
    floor = PlaneWall(name)
    frame = frame_of([[0.2, 0.2, 0.1]], walls={name: [[0, 0, 3.0]]})
    return wall_stress([frame], floor, plane_patches(floor, np.arange(3.0), np.arange(2.0)))


def test_names_and_texts_beyond_ascii_are_written_with_escapes(tmp_path):
    """PyVista refuses such texts, and a path or the name of a column may have them."""
    path = tmp_path / "grüße.pvd"
    frame = frame_of([[0.2, 0.2, 0.1]], extra={"c_µ": np.array([2.0])})
    write_grains(path, [frame], attributes={"source": "/home/jürgen/run"})
    grains = times_of(path)[1](0.0)
    assert grains.field_data["source"][0] == "/home/j\\xfcrgen/run" and grains["c_µ"][0] == 2.0
    assert "c_\\xb5: as in the dump" in list(grains.field_data["units"])
    write_wall(tmp_path / "w.pvd", floor_load("böden"))
    write_fields(tmp_path / "f.pvd", dataset(fields_of(), attributes={"history": "…", "wide": 1.5}))
    assert times_of(tmp_path / "f.pvd")[1](0.0).field_data["wide"][0] == 1.5


def load(count=3, motion=None):
    """A cylinder wall with uniform pressure that grows with time."""
    wall = CylinderWall("side", 2.0) if motion is None else CylinderWall("side", 2.0, motion=motion)
    angle, height = (grid.ravel() for grid in np.meshgrid((np.arange(16) + 0.5) * np.pi / 8.0, [0.25, 0.75]))
    shift = wall.motion.shift(1.0)
    frames = [frame_of(0.95 * wall.points(angle, height) * [1, 1, 0] + height[:, None] * [0, 0, 1] + shift * k, step=k,
                       walls={"side": -(k + 1.0) * wall.outward(angle)}) for k in range(count)]
    return wall_stress(frames, wall, cylinder_patches(wall, 4, np.array([0.0, 0.5, 1.0])))


def three_times():
    return joined([dataset(fields_of(k), 0.5 * k, attributes={"kernel": "gaussian", "width": 0.25}) for k in range(3)])


def test_netcdf_holds_numbers_coordinates_units_and_times(tmp_path):
    data = three_times()
    with xarray.open_dataset(write_netcdf(tmp_path / "f.nc", data)) as found:
        xarray.testing.assert_identical(found.load(), data)
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


def test_coarse_grained_fields_are_written_with_all_their_names(tmp_path):
    grid = Grid((-1.0,) * 3, (1.0,) * 3, (4, 4, 4))
    fields = coarse_grain(frame_of([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]), None, grid, kernel="lucy", width=0.5).fields()
    with xarray.open_dataset(write_netcdf(tmp_path / "f.nc", dataset(fields))) as found:
        assert set(fields.arrays()) <= set(found) and all(found[name].units for name in fields.arrays())
        assert float(found.density.sum()) * grid.cell_volume == pytest.approx(2.0)
    _, at = times_of(write_fields(tmp_path / "f.pvd", dataset(fields)))
    assert set(at(0.0).cell_data.keys()) == set(fields.arrays())


def test_paraview_sees_fields_times_and_units(tmp_path):
    times, at = times_of(write_fields(tmp_path / "f.pvd", three_times()))
    assert times == [0.0, 0.5, 1.0]
    for k in (2, 0, 1):
        image = at(times[k])
        assert image.dimensions == (3, 4, 5) and image.spacing == (1.0, 1.0, 1.0) and image.origin == (-1.0, 0.0, 2.0)
        for name, values in fields_of(k).arrays().items():
            expected = values.transpose(2, 1, 0, *range(3, values.ndim)).reshape(GRID.cells, -1)
            np.testing.assert_array_equal(np.reshape(image.cell_data[name], (GRID.cells, -1)), expected)
    assert "density: kg m-3, bulk density" in image.field_data["units"] and list(image.field_data["kernel"]) == ["gaussian"]
    assert image.field_data["width"][0] == 0.25


def test_paraview_sees_grains_whose_number_changes(tmp_path):
    counts = [3, 5, 0, 2]
    frames = [frame_of(np.arange(3.0 * count).reshape(count, 3) + 100.0 * k, np.arange(count) + 1.0, {"side": np.full((count, 3), k)},
                       step=10 * k) for k, count in enumerate(counts)]
    times, at = times_of(write_grains(tmp_path / "g.pvd", iter(frames), 0.1))
    assert times == [0.0, 1.0, 2.0, 3.0]
    for k in (3, 1, 0, 2):
        cloud = at(times[k])
        assert cloud.n_points == cloud.n_verts == counts[k]
        if not counts[k]:
            continue
        np.testing.assert_array_equal(cloud.points, frames[k].positions)
        for name, expected in (("radius", frames[k].radii), ("id", frames[k].ids), ("force_of_side", np.full((counts[k], 3), k))):
            np.testing.assert_array_equal(cloud.point_data[name], expected)
    assert "velocity: m s-1" in cloud.field_data["units"]


@pytest.mark.parametrize("motion", [None, Motion((0.0, 0.0, 0.5))])
def test_paraview_sees_the_patches_of_a_wall(tmp_path, motion):
    stress = load(motion=motion)
    times, at = times_of(write_wall(tmp_path / "w.pvd", stress))
    assert times == [0.0, 1.0, 2.0]
    owners = stress.patches.owners
    for k in (1, 2, 0):
        surface = at(times[k])
        np.testing.assert_array_equal(surface.cell_data["stress_normal"], stress.series[k, owners, 0])
        np.testing.assert_array_equal(surface.cell_data["mean_stress_normal"], stress.mean[owners, 0])
        assert surface.bounds[4] == pytest.approx(stress.displacements[k, 2]) and surface.n_cells == len(owners)
    assert "mean_stress_normal: Pa" in surface.field_data["units"]
    # Flat polygons of a cylinder have nearly its area.
    assert surface.area == pytest.approx(stress.patches.areas.sum(), rel=2e-3)


def test_wall_without_series_has_one_time(tmp_path):
    wall = MeshWall("floor", np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]))
    stress = wall_stress([frame_of([[0.2, 0.2, 0.1]], walls={"floor": [[0, 0, 3.0]]}, step=4)], wall, mesh_patches(wall), keep_series=False)
    times, at = times_of(write_wall(tmp_path / "w.pvd", stress))
    assert times == [4.0] and at(4.0).cell_data["mean_stress_normal"] == pytest.approx([6.0])


def test_wall_loads_come_back_in_groups(tmp_path):
    side, bottom = load(20), floor_load()
    path = write_netcdf(tmp_path / "w.nc", xarray.Dataset(attrs={"run": "a run"}), [side, bottom])
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
    path = write_netcdf(tmp_path / "f.nc", dataset(fields_of()), [floor_load("density")])
    with xarray.open_dataset(path, group="wall_density") as found:
        assert float(found.force[0, 2]) == 3.0


def test_fields_of_several_times_fit_together():
    other = fields_of(grid=Grid((0.0,) * 3, (1.0,) * 3, (2, 3, 4)))
    with pytest.raises(DembarkError, match="same grid"):
        joined([dataset(fields_of()), dataset(other, 1.0)])
    with pytest.raises(DembarkError, match="density"):
        joined([dataset(fields_of()), dataset(fields_of(), 1.0).drop_vars("density")])
    with pytest.raises(DembarkError, match="no field"):
        joined([])


def test_a_collection_is_complete_or_not_there(tmp_path):
    path = write_fields(tmp_path / "f.pvd", dataset(fields_of()))
    before = {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()}

    def interrupted():
        with TimeSeries(path) as file:
            file.add(pyvista.PolyData([[0.0, 0.0, 0.0]]), 0.0, {})
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    with pytest.raises(DembarkError, match="nothing to write"), TimeSeries(path):
        pass
    assert {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()} == before
    write_grains(path, [frame_of([[0.0, 0.0, 0.0]])])
    assert sorted(one.name for one in tmp_path.rglob("*")) == ["000000.vtp", "f.pvd", "f_pvd", "f_pvd.py"]


def test_a_collection_takes_no_place_of_other_files(tmp_path):
    (tmp_path / "f_pvd").mkdir()
    (tmp_path / "f_pvd" / "notes.txt").touch()
    with pytest.raises(DembarkError, match=r"notes\.txt"):
        TimeSeries(tmp_path / "f.pvd")
    with pytest.raises(DembarkError, match=r"\.pvd"):
        TimeSeries(tmp_path / "f.vtk")


@pytest.mark.parametrize("write", [lambda folder: write_netcdf(folder / "f.nc", dataset(fields_of())),
                                   lambda folder: write_fields(folder / "f.pvd", dataset(fields_of()))], ids=["netcdf", "paraview"])
def test_full_disk_is_one_line(tmp_path, monkeypatch, write):
    import errno
    import os
    import pathlib

    def refuse(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    monkeypatch.setattr(pathlib.Path, "replace", refuse)
    monkeypatch.setattr(pathlib.Path, "write_text", refuse)
    with pytest.raises(RunError, match="the disk is full"):
        write(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_paraview_is_told_to_show_spheres_of_their_size(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_grains("grains.pvd", [frame_of([[0.0, 0.0, 0.0]], 0.25)])
    asked = {}

    class Anything:
        def __init__(self, name):
            self.__dict__["name"] = name

        def __getattr__(self, name):
            return Anything(f"{self.name}.{name}")

        def __setattr__(self, name, value):
            asked[f"{self.name}.{name}"] = value

        def __call__(self, *args, **words):
            asked[self.name] = (args, words)
            return Anything(self.name)

    simple = ModuleType("paraview.simple")
    names = "PVDReader Glyph GetActiveViewOrCreate Show ColorBy GetAnimationScene Render".split()
    simple.__dict__.update({name: Anything(name) for name in names})
    monkeypatch.setitem(sys.modules, "paraview", ModuleType("paraview"))
    monkeypatch.setitem(sys.modules, "paraview.simple", simple)
    exec(compile(Path("grains_pvd.py").read_text(encoding="utf-8"), "script", "exec"), {})
    assert asked["PVDReader"][1]["FileName"] == str(Path("grains.pvd").resolve())
    assert asked["Glyph"][1]["GlyphType"] == "Sphere" and asked["Glyph.ScaleArray"] == ["POINTS", "radius"]
    # ParaView's sphere has the radius 0.5.
    assert 0.5 * asked["Glyph.ScaleFactor"] == 1.0 and asked["Glyph.GlyphMode"] == "All Points"
    assert asked["ColorBy"][0][1][:2] == ("POINTS", "velocity")
