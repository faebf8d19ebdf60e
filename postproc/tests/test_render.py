"""Pictures: spheres and surfaces are at their pixels in their colours, with scales and time around them."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from dembark.common.errors import DembarkError, RunError
from dembark.postproc import render
from dembark.postproc.render import Camera, Colours, Renderer, Scene, Sheet, Surface, View

PLACES, RADII = np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.0, 0.0, 0.6]]), np.array([0.1, 0.05, 0.15])
PAINT = np.array([[220, 20, 20], [20, 200, 20], [20, 20, 220]], np.uint8)
SQUARE = np.array([[[-0.5, 0.3, -0.5], [1.0, 0.3, -0.5], [1.0, 0.3, 1.0]], [[-0.5, 0.3, -0.5], [1.0, 0.3, 1.0], [-0.5, 0.3, 1.0]]])


def camera(view: str, size: tuple[int, int] = (240, 200)) -> Camera:
    eye = View.named(view)
    return Camera.around(eye, eye.extent(PLACES, RADII), size)


@pytest.fixture(scope="module")
def drawn():
    """Views and images of three spheres; and of them before a wall."""
    bare = {view: _drawn(camera(view), Scene(PLACES, RADII, PAINT)) for view in ("front", "top")}
    walled = _drawn(camera("front"), Scene(PLACES, RADII, PAINT, (Surface(SQUARE, opacity=0.5),)))
    return bare, walled


def _drawn(seen: Camera, scene: Scene):
    with Renderer(seen) as renderer:
        return renderer.draw(scene)


def test_spheres_are_at_their_pixels_in_their_colours_and_sizes(drawn, monkeypatch):
    bare, _ = drawn
    image, seen = bare["front"], camera("front")
    assert image.shape == (200, 240, 3) and image.dtype == np.uint8
    for place, radius, paint in zip(seen.pixels(PLACES), RADII, PAINT, strict=True):
        column, row = np.round(place).astype(int)
        shown = image[row, column].astype(float)
        # Light makes colours darker or whiter; which of the three is the largest stays.
        assert shown.argmax() == paint.argmax() and shown.max() > 2.0 * np.sort(shown)[1]
        across = np.any(image[row] < 250, axis=1) & (np.abs(np.arange(240) - column) < 1.3 * radius / seen.pixel)
        assert across.sum() == pytest.approx(2.0 * radius / seen.pixel, abs=3.0)
        assert shown.max() == pytest.approx(0.93 * paint.max(), rel=0.05)
    assert (image[0] == 255).all() and (image[:, 0] == 255).all()
    # The uppermost is drawn above the others, the farther one to the right.
    assert seen.pixels(PLACES)[2, 1] < seen.pixels(PLACES)[0, 1] and seen.pixels(PLACES)[1, 0] > seen.pixels(PLACES)[0, 0]


def test_what_is_nearer_hides_the_other(drawn):
    # From above the blue sphere is over the red one.
    seen = camera("top")
    column, row = np.round(seen.pixels(PLACES[:1])[0]).astype(int)
    assert drawn[0]["top"][row, column].argmax() == 2


def test_a_wall_is_seen_through(drawn):
    bare, walled = drawn
    column, row = np.round(camera("front").pixels(PLACES[:1])[0]).astype(int)
    # It is behind the spheres, and makes the white around them grey.
    np.testing.assert_allclose(walled[row, column].astype(float), bare["front"][row, column], atol=12)
    empty = walled[np.all(bare["front"] == 255, axis=2)]
    assert (empty < 250).mean() > 0.5 and empty.min() > 60


@pytest.mark.parametrize(("name", "right", "up"), [
    ("front", [1, 0, 0], [0, 0, 1]), ("back", [-1, 0, 0], [0, 0, 1]), ("side", [0, 1, 0], [0, 0, 1]), ("top", [1, 0, 0], [0, 1, 0]),
    ("0,-2,0", [1, 0, 0], [0, 0, 1]), ("iso", np.array([1, 1, 0]) / 2**0.5, np.array([-1, 1, 2]) / 6**0.5)])
def test_views_have_their_axes(name, right, up):
    axes = View.named(name).axes
    np.testing.assert_allclose(axes[:2], [right, up], atol=1e-12)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


@pytest.mark.parametrize(("name", "words"), [("isoo", "unknown view 'isoo', in --view, did you mean iso"), ("0,0,0", "no direction"),
                                             ("1,2", "no direction"), ("1,nan,0", "no direction")])
def test_other_views_are_refused(name, words):
    with pytest.raises(DembarkError, match=words):
        View.named(name)


def test_everything_fits_with_its_margins():
    seen = camera("iso", (300, 500))
    across = View.named("iso").axes[:2] @ (PLACES.T)
    assert np.ptp(across, axis=1).min() > 0.0
    places = seen.pixels(PLACES)
    reach = (RADII / seen.pixel)[:, None]
    assert (places - reach).min() >= 0.04 * 300 - 1e-9 and (places + reach)[:, 0].max() <= 0.96 * 300 + 1e-9
    assert (places + reach)[:, 1].max() <= 0.92 * 500 + 1e-9


def test_colours_are_those_of_the_map():
    scale = Colours("speed", 1.0, 3.0, name="gray")
    np.testing.assert_array_equal(scale.rgb(np.array([0.0, 1.0, 2.0, 3.0, 9.0]))[:, 0], [0, 0, 128, 255, 255])
    assert scale.rgb(np.array([[np.nan]])).tolist() == [[[0xB9, 0xBE, 0xC5]]]
    kinds = Colours("type", kinds=(1, 2, 5))
    found = kinds.rgb(np.array([1.0, 2.0, 5.0, 1.0]))
    assert len({tuple(one) for one in found.tolist()}) == 3 and (found[0] == found[3]).all()
    assert found[0].tolist() == [0x00, 0x72, 0xB2]


def test_a_sheet_has_the_image_the_scale_the_time_and_a_length():
    eye = View.named("front")
    sheet = Sheet(eye, eye.extent(PLACES, RADII), Colours("speed / (m/s)"), (400, 300))
    width = sheet.camera.size[0]
    assert width < 400 and sheet.camera.size[1] == 300
    image = np.full((300, width, 3), (200, 210, 220), np.uint8)
    picture = sheet.compose(image, 0.25)
    assert picture.shape == (300, 400, 3)
    assert (picture[60:250, 20:width - 5] == image[0, 0]).all()
    # Letters: the time at the top, the length at the bottom; the scale on white.
    assert (picture[:24, :150] < 100).any() and (picture[276:, :150] < 100).any() and (picture[:, width:] == 255).mean() > 0.5
    assert (picture[40:260, width:] < 200).any()
    timeless = sheet.compose(image, np.nan)
    assert (timeless[:24, :150] == image[0, 0]).all()
    bare = Sheet(eye, eye.extent(PLACES, RADII))
    assert bare.camera.size == bare.size and max(bare.size) <= 1200


def test_the_length_is_read_where_its_bar_is_shorter_than_its_letters():
    eye = View.named("front")
    sheet = Sheet(eye, eye.extent(PLACES, RADII), None, (120, 900), letters=0.05)
    picture = sheet.compose(np.full((900, 120, 3), 255, np.uint8), np.nan)
    dark = np.nonzero((picture < 200).any(axis=(0, 2)))[0]
    assert dark[0] >= 2


@pytest.mark.parametrize(("most", "length", "text"), [
    (0.3, 0.2, "200 mm"), (1.0, 1.0, "1 m"), (0.0099, 0.005, "5 mm"), (7e-5, 5e-5, "50 µm")])
def test_lengths_are_round(most, length, text):
    found, written = render._round_length(most)
    assert found == pytest.approx(length) and written == text


@pytest.mark.parametrize("suffix", render.FILMS)
def test_films_have_all_their_pictures(suffix, tmp_path):
    pictures = [(0.1 * k, np.full((40, 60, 3), 50 * k, np.uint8)) for k in range(4)]
    with Image.open(render.write_film(tmp_path / f"film{suffix}", pictures, 100.0)) as film:
        assert film.n_frames == 4 and film.size == (60, 40) and film.info["loop"] == 0
        for k in range(4):
            film.seek(k)
            assert abs(int(np.asarray(film.convert("RGB"))[20, 30, 0]) - 50 * k) <= 3
            film.load()
            assert film.info["duration"] == 100


@pytest.mark.parametrize("suffix", render.STILLS)
def test_stills_are_what_their_suffix_says(suffix):
    found = Image.open(io.BytesIO(render.still(np.full((20, 30, 3), 90, np.uint8), suffix)))
    assert found.size == (30, 20) and found.format == {".png": "PNG", ".jpg": "JPEG", ".webp": "WEBP"}[suffix]


def test_a_renderer_that_fails_or_hangs_gives_one_line(monkeypatch):
    monkeypatch.setattr(render.sys, "executable", "/bin/false")
    with pytest.raises(RunError, match="ended with code 1"), Renderer(camera("front")) as renderer:
        renderer.draw(Scene(PLACES, RADII, PAINT))
    monkeypatch.setattr(render.sys, "executable", "/bin/cat")
    monkeypatch.setattr(render, "_COMMAND", ())
    monkeypatch.setattr(render, "_TIMEOUT", 0.2)
    monkeypatch.setattr(render, "_send", lambda *_: None)
    with pytest.raises(RunError, match="did not finish"), Renderer(camera("front")) as renderer:
        renderer.draw(Scene(PLACES, RADII, PAINT))


def test_without_vtk_there_is_no_renderer(monkeypatch):
    monkeypatch.setattr(render.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(ModuleNotFoundError, match="pyvista"):
        Renderer(camera("front"))
