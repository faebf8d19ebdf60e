"""Figures show what the fields hold."""

from __future__ import annotations

import numpy as np
import pytest
from packings import contacts_of, frame_of
from PIL import Image

from dembark.common.errors import DembarkError, RunError
from dembark.postproc import plots
from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.grid import Grid
from dembark.postproc.walls import CylinderWall, MeshWall, PlaneWall
from dembark.postproc.walls.patches import box_patches, mesh_patches
from dembark.postproc.walls.stress import wall_stress


@pytest.fixture(scope="module")
def packing():
    """A cube of grains on a floor, each carrying those above it, and its fields."""
    i, j, k = (index.ravel() for index in np.meshgrid(range(4), range(4), range(4), indexing="ij"))
    place = np.column_stack([i, j, k]) + 0.5
    up = (4.0 - k)[:, None] * [0.0, 0.0, 1.0]
    frame = frame_of(place, 0.5, {"floor": up * (k == 0)[:, None]}, low=(0.0,) * 3, high=(4.0, 4.0, 5.0))
    upper = np.nonzero(k)[0]
    contacts = contacts_of(frame, upper + 1, upper, up[upper])
    return frame, coarse_grain(frame, contacts, Grid.around(frame, 0.5, 1.5), kernel="gaussian", width=0.5).fields()


def test_scalars_are_what_their_names_say(packing):
    _, fields = packing
    stress = fields.stress
    np.testing.assert_array_equal(plots.scalar(fields, "stress:xz")[0], stress[..., 0, 2])
    np.testing.assert_allclose(plots.scalar(fields, "pressure")[0], np.trace(stress, axis1=-2, axis2=-1) / 3.0)
    # Uniaxial: the largest shear stress is half of the only principal one.
    np.testing.assert_allclose(plots.scalar(fields, "deviator")[0], 0.5 * stress[..., 2, 2], atol=1e-12)
    assert plots.scalar(fields, "velocity:magnitude")[1:] == ("m s-1", "speed")


@pytest.mark.parametrize(("name", "words"), [("stres", "there is no field"), ("stress", "stress:xy"), ("stress:q", "stress:xy"),
                                             ("velocity:xy", "velocity:x"), ("density:x", "write density")])
def test_wrong_names_say_what_is_right(packing, name, words):
    with pytest.raises(DembarkError, match=words):
        plots.scalar(packing[1], name)


def test_slice_shows_the_layer_at_its_place(packing):
    _, fields = packing
    figure = plots.slice_figure(fields, ["stress:zz"], "y", 1.0)
    layer = int((1.0 - fields.grid.low[1]) / fields.grid.spacing[1])
    drawn = figure.axes[0].collections[0]
    np.testing.assert_allclose(drawn.get_array().filled(np.nan), fields.stress[:, layer, :, 2, 2].T)
    assert np.ptp(figure.axes[0].get_xlim()) == pytest.approx(1e3 * (fields.grid.high[0] - fields.grid.low[0]))
    with pytest.raises(DembarkError, match="outside the grid"):
        plots.slice_figure(fields, ["density"], "x", 99.0)


def test_profile_is_the_mean_over_filled_cells(packing):
    _, fields = packing
    line = plots.profile_figure(fields, ["density"]).axes[0].lines[0]
    filled = fields.density > 0.1 * fields.density.max()
    layer = int(np.argmax(filled.any(axis=(0, 1))) + 4)
    assert line.get_xdata()[layer] == pytest.approx(fields.density[:, :, layer][filled[:, :, layer]].mean())


def test_a_closed_mesh_is_seen_from_two_opposite_sides(packing):
    frame, _ = packing
    low, high = np.array([0.0, 0.0, 0.0]), np.array([4.0, 4.0, 4.0])
    tetrahedron = np.array([low, [high[0], 0.0, 0.0], [0.0, high[1], 0.0], [0.0, 0.0, high[2]]])
    mesh = MeshWall("floor", tetrahedron[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]])
    figure = plots.wall_figure(wall_stress([frame] * 3, mesh, mesh_patches(mesh)))
    views = [axes for axes in figure.axes if hasattr(axes, "get_zlim")]
    assert len(views) == 6 and all(axes.collections[0].get_array().size == 4 for axes in views)
    sights = {(axes.elev, axes.azim) for axes in views}
    toward = [np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]) for e, a in np.radians(sorted(sights))]
    assert len(toward) == 2 and np.abs(toward[0] + toward[1]).max() < 1e-12
    # Titles would be covered by the colour bars: these carry the names.
    assert [axes.get_xlabel() for axes in figure.axes if axes.get_label() == "<colorbar>"] == [
        "normal stress / Pa", "shear upwards / Pa", "shear sideways / Pa"]


def test_all_figures_can_be_saved(packing, tmp_path):
    frame, fields = packing
    floor = PlaneWall("floor")
    corner = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]])
    mesh = MeshWall("floor", corner[[[0, 1, 2], [0, 2, 3]]])
    assert set(plots.field_figures(fields)) == {"slice_x", "slice_y", "profile_z"}
    figures = {"slice": plots.slice_figure(fields, ["density", "velocity:magnitude"])}
    for name, wall, patches in (("plane", floor, box_patches(floor, frame, 1.0)), ("mesh", mesh, mesh_patches(mesh))):
        load = wall_stress([frame] * 3, wall, patches)
        figures |= {name: plots.wall_figure(load)}
    figures |= {"force": plots.force_figure(load)}
    empty = CylinderWall("side", 1.0)
    bare = frame_of([[0.0, 0.0, 0.0]], walls={"side": np.zeros((1, 3))})
    figures |= {"nothing": plots.wall_figures(wall_stress([bare], empty, box_patches(empty, bare, 1.0)))["wall_side_peaks"]}
    paths = plots.save(tmp_path / "new" / "plots", figures)
    assert len(paths) == len(figures) == 5
    for path in paths:
        assert Image.open(path).width > 500
    (tmp_path / "file").touch()
    with pytest.raises((DembarkError, RunError)):
        plots.save(tmp_path / "file", figures)
