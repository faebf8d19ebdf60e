"""Facets that a FacetSurface joins act as one wall; what the stock functor does beside it."""

import json
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
FORCE, SLIP, VOLUME, LOST, REAL, TOUCH = slice(0, 3), 6, 7, 8, 9, 10


@pytest.fixture(scope="module")
def found(yade):
    out = yade.folder / "surface.json"
    done = yade(HERE / "surface_scenes.py", str(out), "flat", "bends", "corner", "moving", "periodic", "changes", "messages",
                "files", "refused", "entering")
    assert "scenes: finished" in done.stdout, (done.stdout + done.stderr)[-3000:]
    return json.loads(out.read_text()) | {"stderr": done.stderr}


def rows(run):
    return np.array(run["rows"])


def assert_same(run, reference, tolerance=1e-9):
    """Force, torque, slip, volume, energy and elastic displacement of all contacts, each relative to its largest value; of vectors, to
    the largest of all components."""
    one, other = rows(run), rows(reference)
    vectors = (slice(0, 3), slice(3, 6), slice(TOUCH + 1, one.shape[1]))
    for part in (*vectors, *(slice(k, k + 1) for k in range(6, TOUCH + 1))):
        scale = np.abs(other[:, part]).max(initial=0.0)
        assert np.abs(one[:, part] - other[:, part]).max(initial=0.0) <= tolerance * scale, part


@pytest.mark.parametrize("name", ["patch", "fine", "reloaded"])
def test_a_flat_patch_is_a_plane(found, name):
    """Sticking, slipping, in touch and held by a bridge over many borders; also when saved and loaded on the way."""
    flat = found["flat"]
    assert_same(flat[name], flat["plane"])
    assert flat[name]["handed"] > 5
    assert flat[name]["lost"] == pytest.approx(flat["plane"]["lost"], rel=1e-9)
    table = rows(flat["plane"])
    assert 0.2 < (table[:, TOUCH] == 0).mean() < 0.8 and (table[:, VOLUME] > 0.0).all() and table[:, SLIP].max() > 1e-5


def test_stock_facets_double_forces_and_bridges(found):
    """What is mended: with Ig2_Facet_Sphere_ScGeom each facet at a border has a contact of its own."""
    stock, plane = rows(found["flat"]["stock"]), rows(found["flat"]["plane"])
    assert stock[:, REAL].max() >= 3
    assert np.abs(stock[:, 2]).max() > 1.5 * np.abs(plane[:, 2]).max()
    assert stock[:, VOLUME].max() > 1.9 * plane[:, VOLUME].max()


@pytest.mark.parametrize(("name", "limit"), [("convex", 0.02), ("concave", 0.08), ("convex, not smooth", 0.02)])
def test_force_has_no_jump_over_an_edge(found, name, limit):
    """A groove turns the normal by 2 degrees in one step, a ridge bit by bit; friction and bridge go over both."""
    table, flat = rows(found["bends"][name]), rows(found["bends"]["flat"])
    scale = np.linalg.norm(flat[100, FORCE])
    assert np.linalg.norm(np.diff(table[20:, FORCE], axis=0), axis=1).max() < limit * scale
    assert table[:, REAL].max() == 1
    assert (table[:, VOLUME] == table[0, VOLUME]).all()
    assert found["bends"][name]["handed"] == 1
    if name != "concave":
        assert np.linalg.norm(table[100:, FORCE], axis=1).max() < 1.01 * scale


def test_a_corner_of_facets_is_one_of_planes(found):
    assert_same(found["corner"]["facets"], found["corner"]["planes"])
    assert (rows(found["corner"]["facets"])[:, REAL] == 3).all()


def test_moving_facets_and_periodic_images(found):
    assert_same(found["moving"]["moving"], found["moving"]["rest"])
    assert_same(found["periodic"]["images"], found["periodic"]["free"])
    assert found["moving"]["moving"]["handed"] > 0 and found["periodic"]["images"]["handed"] > 0


def test_facets_may_come_and_go(found):
    """A facet across the patch is a contact of its own, one below it is none; where the owner was erased, what is below carries."""
    (alone, one), (both, two), (after, _) = found["changes"]
    assert one == 1 and two == 2 and both == pytest.approx(alone, rel=1e-9) and after > 0.0


def test_wrong_numbers_are_told(found):
    for message, name in zip(found["messages"], ("smoothAngle", "precision", "smoothAngle"), strict=True):
        assert message.startswith("dembark: FacetSurface.") and name in message


def test_every_file_of_a_floor_is_the_floor(found):
    forces = {name: np.array(rows) for name, rows in found["files"].items()}
    plane = forces["plane"]
    assert plane[2:, :, 2] == pytest.approx(5.7917e-3, rel=1e-4)
    for name, force in forces.items():
        assert np.abs(force - plane).max() < 2e-3 * plane.max(), name
        if "um" not in name:
            assert np.abs(force - plane).max() < 3e-5 * plane.max(), name


def test_what_a_file_has_twice_is_named(found):
    line = "WARNING: dembark: file 'floor.stl': left out"
    assert f"{line} 2 triangles without area and 0 given again" in found["stderr"]
    assert f"{line} 0 triangles without area and 8 given again" in found["stderr"]


def test_other_files_are_refused_in_one_line(found):
    for line, said in found["refused"].items():
        assert said.startswith("dembark: file 'floor.stl'") and line in said and "\n" not in said


def test_grains_that_enter_feel_the_facets(found):
    small, large = found["entering"]
    assert small > 0.0 and large == pytest.approx(small, rel=1e-9)
