"""The surface of water is where its particles end; drops and bodies are where they are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.postproc.pictures import water
from dembark.postproc.tests.dumps import write_times
from dembark.postproc.tests.packings import frame_of

SPACING = 0.02


def block(counts, low=(0.0, 0.0, 0.0)):
    """Centres (n, 3) of particles that fill a block from the corner `low`."""
    return np.asarray(low) + SPACING * (np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3) + 0.5)


def volume(triangles):
    """Volume within closed triangles that are seen from outside counter-clockwise."""
    return float(np.einsum("ta,ta->t", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6.0)


@settings(max_examples=12, deadline=None)
@given(counts=st.tuples(*[st.integers(6, 14)] * 3), shift=st.floats(-0.5, 0.5))
def test_a_block_of_water_ends_where_its_cells_do(counts, shift):
    place = block(counts, (0.0, 0.0, shift))
    triangles, drops = water.surface(frame_of(place, 0.5 * SPACING))
    middle = np.abs(triangles.reshape(-1, 3)[:, :2] - 0.5 * SPACING * np.array(counts[:2])).max(axis=1) < SPACING
    heights = triangles.reshape(-1, 3)[middle, 2] - shift
    top, bottom = heights[heights > 0.5 * SPACING * counts[2]], heights[heights < 0.5 * SPACING * counts[2]]
    np.testing.assert_allclose(top, SPACING * counts[2], atol=0.01 * SPACING)
    np.testing.assert_allclose(bottom, 0.0, atol=0.01 * SPACING)
    # Its edges are rounded, by a quarter of a cell for each.
    assert 0.0 < np.prod(counts) - volume(triangles) / SPACING**3 < 0.3 * 4 * sum(counts)
    assert not drops.any()


def test_particles_far_from_the_others_are_drops():
    place = np.concatenate([block((8, 8, 8)), [[0.5, 0.0, 0.0], [0.5, 0.0, 0.3], [0.52, 0.0, 0.3]]])
    triangles, drops = water.surface(frame_of(place, 0.5 * SPACING))
    assert np.flatnonzero(drops).tolist() == [512, 513, 514] and triangles[..., 0].max() < 0.2
    triangles, drops = water.surface(frame_of(place[512:], 0.5 * SPACING))
    assert triangles.shape == (0, 3, 3) and drops.all()


def test_water_goes_on_through_a_periodic_side():
    place = block((8, 8, 8))
    frame = frame_of(place, 0.5 * SPACING, low=(0.0, 0.0, -1.0), high=(0.16, 0.16, 1.0), periodic=(True, True, False))
    corners = water.surface(frame)[0].reshape(-1, 3)
    # There are two faces only, above and below.
    assert set(np.round(corners[:, 2] / 0.16, 1)) == {0.0, 1.0}


def test_bodies_are_where_the_history_has_them(tmp_path):
    half = np.sqrt(0.5)
    rows = {"step": [0.0, 100.0], "time": [0.0, 1.0], "kinetic_energy": [0.0, 0.0]}
    for name, x in (("cube1", 1.0), ("cube2", 5.0)):
        poses = zip("x y z qw qx qy qz".split(), (x, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0), (x + 1.0, 0.0, 0.1, half, 0.0, 0.0, half), strict=True)
        rows |= {f"{name}_{part}": [value, later] for part, value, later in poses}
    write_times(tmp_path / "time.csv", rows)
    found = water.boxes(tmp_path, {"cube*": {"kind": "box", "size": [0.4, 0.2, 0.1]}, "floor": {"kind": "plane"}}, np.array([0, 98]))
    assert list(found) == ["cube1", "cube2"] and found["cube1"].shape == (2, 12, 3, 3)
    first, second = found["cube1"].reshape(2, -1, 3)
    np.testing.assert_allclose([first.min(axis=0), first.max(axis=0)], [[0.8, -0.1, 0.05], [1.2, 0.1, 0.15]])
    # A quarter turn about z changes length and width.
    np.testing.assert_allclose([second.min(axis=0), second.max(axis=0)], [[1.9, -0.2, 0.05], [2.1, 0.2, 0.15]])
    assert volume(found["cube2"][1]) == pytest.approx(0.4 * 0.2 * 0.1)
    assert water.boxes(tmp_path, {"floor": {"kind": "plane"}}, np.array([0])) == {}


def test_a_quaternion_turns_about_its_axis():
    angle = 0.3
    turn = water.rotation(np.array([[np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]]))[0]
    np.testing.assert_allclose(turn @ [0.0, 0.0, 1.0], [np.sin(angle), 0.0, np.cos(angle)])
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
