"""`dembark render` as users type it: what is in its pictures, what it writes, and one line for each mistake."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from dumps import contacts_text, grains_text, write_times
from PIL import Image

from dembark.common.errors import DembarkError
from dembark.postproc import read_times, render
from dembark.postproc.pictures import PICTURE, draw
from dembark.postproc.pictures.scenes import Album, Look
from dembark.postproc.sources import frames_at, open_source
from dembark.postproc.tests.packings import frame_of
from dembark.postproc.walls import MeshWall
from dembark.validation.cli import main

STEPS, STEP = (100, 200, 300, 400), 1e-3
PLACE, RADII = np.array([[0.0, 0.0, 0.1], [0.1, 0.0, 0.2], [0.0, 0.1, 0.3], [0.5, 0.5, 5.0]]), np.array([0.02, 0.03, 0.04, 0.02])
LID = """solid lid
facet normal 0 0 1
outer loop
vertex -0.1 -0.1 0.4
vertex 0.2 -0.1 0.4
vertex 0.2 0.2 0.4
endloop
endfacet
endsolid lid
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A run of three grains that rise, a glued one far away, a cylinder, a floor that sinks, and a lid that moves."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "run"
    folder.mkdir()
    grains = contacts = ""
    for number, step in enumerate(STEPS):
        speed = np.outer([1.0, 2.0, 3.0, 9.0], [0.0, 0.0, 0.1 * (number + 1)])
        grains += grains_text(step, PLACE + np.array([0.0, 0.0, 0.01 * number]), RADII, velocities=speed, types=np.array([1, 1, 1, 2]))
        contacts += contacts_text(step, PLACE[:1], PLACE[1:2], np.array([[1, 2]]), np.array([[1.0, 0.0, 1.0]]))
    (folder / "grains.dump").write_text(grains)
    (folder / "contacts.dump").write_text(contacts)
    (folder / "lid.stl").write_text(LID)
    walls = {"side": {"kind": "cylinder", "radius": 0.2}, "floor": {"kind": "plane", "velocity": [0.0, 0.0, -0.1], "since": 0.2}}
    (folder / "run.json").write_text(json.dumps({"case": "any", "time_step": STEP, "walls": walls}))
    zero = np.zeros(4)
    write_times(folder / "time.csv", {"step": STEPS, "time": STEP * np.array(STEPS), "kinetic_energy": zero, "motion_x": zero,
                                      "motion_y": zero, "motion_z": 1e-3 * np.array(STEPS), "motion_angle": zero})
    return folder


def album(folder: Path, numbers=(0, 1, 2, 3), walls=(), **look) -> Album:
    return Album(open_source(folder), list(numbers), Look(**look), walls)


def scenes(found: Album):
    return [found.scene(row, *found._read(number)) for row, number in enumerate(found.numbers)]


def test_scenes_have_the_grains_walls_and_times_of_their_frames(run):
    found = album(run)
    first, *_, last = scenes(found)
    # The glued grain is too far away.
    np.testing.assert_allclose(last.positions, PLACE[:3] + np.array([0.0, 0.0, 0.03]))
    assert (first.time, last.time) == pytest.approx((0.1, 0.4))
    lid, side, floor = last.surfaces
    np.testing.assert_allclose(lid.triangles[0, :, 2], 0.8)
    np.testing.assert_allclose(np.linalg.norm(side.triangles[..., :2], axis=-1), 0.2)
    np.testing.assert_allclose(floor.triangles[..., 2], -0.02)
    np.testing.assert_allclose(first.surfaces[2].triangles[..., 2], 0.0)
    # Planes and cylinders reach as far as all else in all frames.
    np.testing.assert_allclose([side.triangles[..., 2].min(), side.triangles[..., 2].max()], [-0.02, 0.8])
    np.testing.assert_allclose(floor.triangles.reshape(-1, 3)[:, :2].min(axis=0), -0.1)
    assert all(surface.opacity < 0.5 for surface in last.surfaces)
    bare = Album(open_source(run), [0], Look(walls=False))
    assert scenes(bare)[0].surfaces == () and bare.notes == []


@pytest.mark.parametrize(("works", "height"), [({"lid": 0.0, "cup": 1.0}, 0.4), ({"lid": 1.0, "cup": 0.0}, 0.8),
                                               ({"lid": 0.0, "cup": 0.0}, 0.8), ({"cup": 1.0}, 0.8)])
def test_a_mesh_that_does_no_work_while_another_does_is_at_rest(run, works, height):
    rows = read_times(run / "time.csv")
    write_times(run / "time.csv", rows | {f"{name}_work": np.linspace(0.0, work, 4) for name, work in works.items()})
    np.testing.assert_allclose(scenes(album(run))[-1].surfaces[0].triangles[0, :, 2], height)


def test_all_frames_have_one_scale_and_one_camera(run):
    found = album(run, colours="gray")
    scale = found.sheet.colours
    # 2 % off the ends of 0.1, 0.2, 0.3 and of 0.4, 0.8, 1.2 m/s.
    assert scale.label == "speed / (m/s)" and (scale.low, scale.high) == pytest.approx((0.104, 1.184))
    first, *_, last = scenes(found)
    # The fastest of the last frame is brightest; of the first the slowest is darkest.
    assert last.colours[2].tolist() == [255] * 3 and first.colours[0].tolist() == [0] * 3
    assert 0 < first.colours[2, 0] < 128


def test_values_are_in_the_unit_and_range_of_the_user(run):
    found = album(run, [3], colour_by="velocity:z", unit="cm/s", span=(40.0, 120.0), colours="gray")
    assert found.sheet.colours.label == "velocity z / (cm/s)"
    assert scenes(found)[0].colours[:, 0].tolist() == [0, 128, 255]
    assert album(run, [3], colour_by="velocity", scale=0.4).sheet.colours.label == "speed / (0.4 m/s)"
    assert album(run, [3], colour_by="diameter").sheet.colours.label == "diameter / mm"
    assert album(run, [3], colour_by="contact_count").sheet.colours.label == "contact count"


def test_types_are_kinds_and_glued_grains_grey(run):
    found = album(run, [0], colour_by="type")
    # The glued one is too far away to be shown.
    assert found.sheet.colours.kinds == (1,)
    near = album(run, [0], colour_by="id")
    assert near.sheet.colours.kinds == ()
    glued = frame_of(PLACE[:2], 0.02)
    glued.types[1] = 2
    values = near._quantity(glued, None, 0).values
    assert values[0] == 1.0 and np.isnan(values[1])


def test_a_grain_that_has_flown_away_does_not_make_all_else_small(tmp_path):
    place = np.random.default_rng(1).uniform(0.0, 1.0, (3000, 3))
    place[7] = [40.0, 0.0, 0.0]
    (tmp_path / "stray.dump").write_text(grains_text(0, place, np.full(3000, 0.01)))
    found = album(tmp_path / "stray.dump", [0], view="front")
    assert np.ptp(found.sheet.extent[:, 0]) < 1.3 and len(scenes(found)[0].radii) == 3000
    (tmp_path / "few.dump").write_text(grains_text(0, place[:20], np.full(20, 0.01)))
    assert np.ptp(album(tmp_path / "few.dump", [0], view="front").sheet.extent[:, 0]) > 39.0


def test_a_cut_leaves_out_what_is_nearer(run):
    shown = scenes(album(run, [0], view="front", cut=True))[0]
    # The middle of what is shown is at y = 0.05; the cylinder is not what is cut.
    np.testing.assert_allclose(shown.positions, PLACE[2:3])
    assert len(shown.surfaces) == 3


def test_walls_of_the_user_are_drawn_too(run):
    mesh = MeshWall("own", np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 7.0]]]))
    found = album(run, [0], [mesh], view="front")
    assert len(scenes(found)[0].surfaces) == 4
    assert found.sheet.extent[1, 1] == pytest.approx(7.0)


def test_walls_that_turn_are_not_drawn_but_named(run):
    rows = np.genfromtxt(run / "time.csv", delimiter=",", names=True)
    write_times(run / "time.csv", {name: rows[name] + (0.1 if name == "motion_angle" else 0.0) for name in rows.dtype.names})
    found = album(run, [0])
    assert len(scenes(found)[0].surfaces) == 2 and found.notes == ["the walls lid turn; they are not drawn"]


@pytest.mark.parametrize(("flat", "view"), [(1, "front"), (2, "top"), (0, "side"), (None, "iso")])
def test_a_layer_is_seen_from_its_face(tmp_path, flat, view):
    place = PLACE.copy()
    if flat is not None:
        place[:, flat] = 0.3
    (tmp_path / "layer.dump").write_text(grains_text(0, place, RADII))
    np.testing.assert_allclose(album(tmp_path / "layer.dump", [0]).view.axes, render.View.named(view).axes)


def test_frames_are_the_nearest_to_times(run):
    source = open_source(run)
    assert frames_at(source, [0.1, 0.26, 0.31, 0.44]) == [0, 2, 3]
    for time in (0.0, 0.5):
        with pytest.raises(DembarkError, match=r"no frame at .* s, in --at.* from 0.1 to 0.4 s"):
            frames_at(source, [time])


def test_pictures_and_films_are_written(run, capsys):
    assert main(["render", "run", "--at", "0.2", "--at", "290 ms", "--size", "200x150", "--out", "one.jpg"]) == 0
    said = capsys.readouterr().out
    assert "written: one-0.2s.jpg" in said and "written: one-0.3s.jpg" in said
    with Image.open("one-0.2s.jpg") as found:
        assert found.size == (200, 150) and np.asarray(found).std() > 5.0
    assert main(["render", "run/grains.dump", "--film", "--frames", "::2", "--rate", "4", "--no-walls", "--size", "160x120"]) == 0
    with Image.open("grains.webp") as film:
        assert film.n_frames == 2
        film.load()
        assert film.info["duration"] == 250


def test_the_report_draws_by_the_same_code(run):
    series = run.parent
    run.rename(series / "replica-1")
    assert draw(series, {"colour_by": "contact_force", "cut": False, "view": "front"}) == []
    assert Image.open(series / PICTURE).width >= 400
    assert "unknown quantity" in draw(series, {"colour_by": "colour"})[0] and not (series / PICTURE).exists()


@pytest.mark.parametrize(("words", "said"), [
    (["--at", "9"], "there is no frame at 9 s, in --at, the frames are from 0.1 to 0.4 s"),
    (["--at", "soon"], "--at"),
    (["--colour-by", "velocty"], "unknown quantity 'velocty'"),
    (["--colour-by", "velocity", "--unit", "kg"], "--unit"),
    (["--view", "fornt"], "unknown view 'fornt', in --view, did you mean front"),
    (["--size", "10x10"], "'10x10' is not the size of a picture"),
    (["--range", "3,1"], "'3,1' is not a range"),
    (["--colours", "virids"], "unknown colours 'virids'"),
    (["--out", "a.bmp"], "a.bmp does not end in .png or .jpg or .webp"),
    (["--film", "--out", "a.mp4"], "a.mp4 does not end in .webp or .gif"),
    (["--film", "--at", "0.1"], "--at is for pictures of single times"),
    (["--frames", "9"], "no frame in '9'"),
    (["--out", "none/a.png"], "there is no folder none"),
    (["--wall", "stone:inclusion:ids=1"], "stone is an inclusion"),
])
def test_mistakes_are_one_line(run, capsys, words, said):
    assert main(["render", "run", *words]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("dembark: ") and said in lines[0]


def test_files_without_grains_or_times_are_one_line(run, capsys):
    assert main(["render", "nothing.dump"]) == 2
    assert "nothing.dump" in capsys.readouterr().err
    assert main(["render", "run/grains.dump", "--at", "0.1"]) == 2
    assert "give --time-step" in capsys.readouterr().err
    Path("empty.dump").write_text(grains_text(0, np.zeros((0, 3)), np.zeros(0)), encoding="utf-8")
    assert main(["render", "empty.dump"]) == 2
    assert "no grains" in capsys.readouterr().err


def test_without_vtk_the_extra_is_named(run, capsys, monkeypatch):
    monkeypatch.setattr(render.importlib.util, "find_spec", lambda _: None)
    assert main(["render", "run"]) == 2
    assert "pyvista is not installed, pip install '.[fields]'" in capsys.readouterr().err
