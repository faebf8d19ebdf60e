"""Pictures and animations of logs show the logs where they are."""

import io
import json
import shutil

import numpy as np
import pytest
from dumps import grains_text
from matplotlib.figure import Figure
from PIL import Image

from dembark.postproc import pictures
from dembark.postproc.pictures import sections as cross_section


@pytest.fixture
def folder(tmp_path):
    """Two logs in a drum of 1 m; the second moves to the right, from frame to frame by 0.1 m."""
    frames = [grains_text(100 * k, [[-0.5, 0.0, -0.5], [0.1 * k, 0.0, 0.0]], [0.2, 0.1], velocities=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
              for k in range(4)]
    (tmp_path / "grains.dump").write_text("".join(frames))
    (tmp_path / "run.json").write_text(json.dumps({"time_step": 1e-3}))
    return tmp_path


def test_scene(folder):
    one = cross_section.scene(folder, "xz", 1.0, 2.0)
    np.testing.assert_allclose(one.places[-1], [[-0.5, -0.5], [0.3, 0.0]])
    np.testing.assert_allclose(one.speeds[-1], [0.0, 0.5])
    np.testing.assert_allclose(one.times, [0.0, 0.1, 0.2, 0.3])
    assert one.label == "speed / speed of the rim"
    assert cross_section.scene(folder, "xz", speed=4.0).view == pytest.approx((-0.7, 0.4, -0.7, 0.1))


def test_picture_shows_the_last_frame(folder):
    section = cross_section.scene(folder, "xz", 1.0, 2.0)
    image = np.asarray(Image.open(io.BytesIO(cross_section.picture(section))).convert("L"))
    assert image.min() < 120 and image.max() == 255
    axes = Figure().subplots()
    cross_section.draw(axes, section, 1.0)
    np.testing.assert_allclose(axes.collections[0].get_offsets(), [[-0.5, -0.5], [0.3, 0.0]])


def test_a_series_has_its_picture_and_animation_beside_it(folder, tmp_path):
    series = tmp_path / "series"
    series.mkdir()
    (series / "picture.png").write_text("an older one")
    assert pictures.draw(series, {"cross_section": "xz"}) == ["No picture: the run's grains.dump is no longer there."]
    assert not (series / "picture.png").exists() and pictures.draw(series, None) == []
    shutil.copytree(folder, series / "replica-1", ignore=lambda *_: ["series"])
    assert pictures.draw(series, {"cross_section": "xz", "drum_radius": 1.0, "drum_speed": 2.0}) == []
    assert (series / "picture.png").read_bytes().startswith(b"\x89PNG") and (series / "animation.gif").is_file()
    (series / "replica-1" / "grains.dump").write_text("gone")
    assert pictures.draw(series, {"colour_by": "velocity", "scale": 1.0, "cut": False})[0].startswith("No picture: ")


def test_animation(folder, tmp_path):
    path = cross_section.animate(cross_section.scene(folder, "xz", 1.0, 2.0), tmp_path / "drum.gif")
    with Image.open(path) as image:
        assert image.n_frames == 4
        size = image.size[0]

        def pixel(x, y):
            return np.array(image.convert("RGB"))[round((1.04 - y) / 2.08 * size), round((x + 1.04) / 2.08 * size)]

        assert (pixel(-0.5, -0.5) < 120).any() and (pixel(0.6, 0.6) == 255).all()
        assert (pixel(0.0, 0.0) < 255).any()
        image.seek(3)
        assert (pixel(0.3, 0.0) < 255).any() and (pixel(0.0, 0.0) == 255).all()


def test_moving_meshes_are_drawn_where_they_are(folder, tmp_path):
    """A strip that stands at x = 0.9 and moves by 0.1 m from frame to frame; the last two frames alone."""
    corners = [[(0.9, -1, -0.5), (0.9, 1, -0.5), (0.9, 1, 0.5)], [(0.9, -1, -0.5), (0.9, 1, 0.5), (0.9, -1, 0.5)]]
    facets = "".join("facet normal 1 0 0\nouter loop\n" + "".join("vertex {} {} {}\n".format(*one) for one in three) + "endloop\nendfacet\n"
                     for three in corners)
    (folder / "side.stl").write_text(f"solid side\n{facets}endsolid side\n")
    rows = "".join(f"{100 * k},{0.1 * k},0,{0.1 * k},0,0,0\n" for k in range(4))
    (folder / "time.csv").write_text("step,time,kinetic_energy,motion_x,motion_y,motion_z,motion_angle\n" + rows)
    one = cross_section.scene(folder, "xz", speed=1.0, last=2, pixels=200)
    assert one.times.tolist() == pytest.approx([0.2, 0.3])
    np.testing.assert_allclose(one.walls[..., 0], [[[1.1, 1.1]] * 2, [[1.2, 1.2]] * 2])
    assert sorted({round(z, 9) for z in one.walls[0, ..., 1].ravel()}) == [-0.5, 0.0, 0.5]
    with Image.open(cross_section.animate(one, tmp_path / "side.gif")) as image:
        assert image.n_frames == 2 and max(image.size) == 200
