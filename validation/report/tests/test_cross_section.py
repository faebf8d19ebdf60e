"""Pictures and animations of logs show the logs where they are."""

import json

import numpy as np
import pytest
from dembark.validation.report import cross_section
from dembark.validation.report.figures import svg
from dumps import grains_text
from PIL import Image


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


def test_picture_of_engines_side_by_side(folder):
    one = cross_section.scene(folder, "xz", 1.0, 2.0)
    figure, reasons = cross_section.picture({"liggghts": one, "yade": one, "other": "it is gone"})
    assert reasons == ["No picture of other: it is gone."]
    assert [axes.get_title() for axes in figure.axes[:2]] == ["LIGGGHTS", "YADE"]
    assert svg(figure).startswith(b"<?xml")
    assert cross_section.picture({"yade": "it is gone"})[0] is None


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
