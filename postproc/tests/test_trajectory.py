"""Grains in MDAnalysis: registered, double-checked against it, and able to do what its users expect."""

import warnings

import MDAnalysis
import numpy as np
import pytest
from dumps import grains_text
from MDAnalysis import transformations

from dembark.postproc import DumpError, DumpWarning, GrainsDump, universe

BOX = ((0.0, 1.0), (-1.0, 1.0), (0.0, 3.0))
PLACES = np.array([[0.1, -0.2, 0.5], [0.5, 0.5, 1.5], [0.9, 0.9, 2.5]])
RADII = np.array([0.01, 0.02, 0.03])


@pytest.fixture
def drift(tmp_path):
    """Three grains that go through a periodic border, with image flags; lines out of order."""
    path = tmp_path / "grains.dump"
    text = ""
    for step in range(5):
        moved = PLACES + step * np.array([0.3, 0.0, 0.0])
        images = np.zeros((3, 3))
        images[:, 0] = np.floor(moved[:, 0])
        text += grains_text(100 * step, moved - images, RADII, images=images, box=BOX, flags="pp ff ff", order=[2, 0, 1])
    path.write_text(text)
    return path


def test_registered_format_needs_no_more_than_its_name(drift):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*the box is not periodic", DumpWarning)
        world = MDAnalysis.Universe(str(drift), format="DEMGRAINS", time_step=1e-3)
        assert len(world.trajectory) == 5
        assert (world.trajectory[3].time, world.trajectory.dt) == (pytest.approx(0.3), pytest.approx(0.1))
    np.testing.assert_allclose(world.atoms.masses, GrainsDump(drift)[0].masses)
    np.testing.assert_allclose(world.dimensions, [1.0, 2.0, 3.0, 90.0, 90.0, 90.0])
    np.testing.assert_allclose(world.copy().trajectory[4].positions, PLACES + np.array([1.2, 0.0, 0.0]), atol=1e-6)


def test_mdanalysis_finds_no_neighbours_across_walls_without_a_word(tmp_path):
    """It takes every axis of a box for periodic."""
    path = tmp_path / "grains.dump"
    places, box = np.array([[0.02, 0.5, 0.5], [0.98, 0.5, 0.5], [0.5, 0.5, 0.5]]), ((0.0, 1.0),) * 3

    def neighbours(flags):
        path.write_text(grains_text(0, places, [0.02] * 3, box=box, flags=flags))
        return universe(path).select_atoms("around 0.05 id 1").ids.tolist()

    with warnings.catch_warnings():
        warnings.simplefilter("error", DumpWarning)
        assert (neighbours("pp pp pp"), neighbours("ff ff ff"), neighbours("ss mm ff")) == ([2], [], [])
    with pytest.warns(DumpWarning, match="the box is not periodic along x and z, but MDAnalysis takes it for periodic there"):
        neighbours("ff pp ss")


def test_the_same_positions_as_mdanalysis_reads(drift):
    theirs = MDAnalysis.Universe.empty(3, trajectory=False)
    theirs.load_new(str(drift), format="LAMMPSDUMP", lammps_coordinate_convention="unscaled", dt=1.0)
    ours = universe(drift, wrapped=True)
    for one, other in zip(ours.trajectory, theirs.trajectory, strict=True):
        np.testing.assert_allclose(one.positions - [0.0, -1.0, 0.0], other.positions, atol=1e-6)
        np.testing.assert_allclose(one.dimensions, other.dimensions)


def test_transformations_unwrap_and_wrap(drift):
    world = universe(drift, wrapped=True)
    world.trajectory.add_transformations(transformations.NoJump())
    for number, step in enumerate(world.trajectory):
        np.testing.assert_allclose(step.positions, PLACES + number * np.array([0.3, 0.0, 0.0]), atol=1e-6)
    world = universe(drift)
    world.trajectory.add_transformations(transformations.wrap(world.atoms))
    assert (world.trajectory[4].positions[:, 0] < 1.0).all()


def test_grains_that_are_replaced_in_equal_number(tmp_path):
    path = tmp_path / "grains.dump"
    first, second = grains_text(0, PLACES, RADII), grains_text(10, PLACES, RADII)
    path.write_text(first + second.replace("\n3 1 ", "\n8 1 "))
    world = universe(path)
    with pytest.raises(DumpError, match="step 10: holds grains that the first frame does not; open it with varying=True"):
        world.trajectory[1]
    world = universe(path, varying=True)
    assert world.atoms.ids.tolist() == [1, 2, 3, 8]
    assert world.trajectory[1].data["present"].tolist() == [True, True, False, True]
    np.testing.assert_allclose(world.atoms.positions[[0, 1, 3]], PLACES, atol=1e-6)


def test_a_series_that_grows(tmp_path):
    """A pattern is looked at anew: by refresh(), and by another universe."""
    pattern = tmp_path / "dump*.grains"

    def write(step):
        (tmp_path / f"dump{step}.grains").write_text(grains_text(step, PLACES, RADII))

    write(0)
    write(10)
    dump, first = GrainsDump(pattern), universe(pattern)
    write(20)
    dump.refresh()
    assert len(dump) == 3 and dump[2].step == 20
    assert first.trajectory.n_frames == 2 and universe(pattern).trajectory.n_frames == 3


def test_columns_that_are_not_there(tmp_path):
    path = tmp_path / "grains.dump"
    head = "ITEM: TIMESTEP\n5\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS "
    path.write_text(head + "id x y z radius c_wet\n2 0.1 0.2 0.3 0.01 7\n1 0.4 0.5 0.6 0.02 8\n")
    with pytest.raises(DumpError, match=r"column mass is missing; give density="):
        GrainsDump(path)[0]
    frame = GrainsDump(path, density=3.0)[0]
    np.testing.assert_allclose(frame.masses, 4.0 * np.pi * np.array([0.02, 0.01]) ** 3)
    assert frame.extra["c_wet"].tolist() == [8.0, 7.0]
    assert frame.tilt.tolist() == [0.0, 0.0, 0.0]
    for name in ("velocities", "omegas", "forces", "types"):
        assert not frame.has(name)
        with pytest.raises(DumpError, match=f"step 5: {name} are not known"):
            getattr(frame, name)
    world = universe(path, density=3.0)
    assert not world.trajectory.ts.has_velocities
    assert frame.select(frame.ids == 2).extra["c_wet"].tolist() == [7.0]


@pytest.mark.parametrize(
    ("lines", "message"),
    [("1 0 0 0 1 1\n1 1 1 1 1 1\n", "grain 1 appears twice"), ("1 0 0 0 1 1\n1e17 1 1 1 1 1\n", "column id holds numbers beyond 2")],
)
def test_ids_that_tell_no_grains_apart(tmp_path, lines, message):
    path = tmp_path / "grains.dump"
    head = "ITEM: TIMESTEP\n5\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS id x y z radius mass\n"
    path.write_text(head + lines)
    with pytest.raises(DumpError, match=message):
        GrainsDump(path)[0]
