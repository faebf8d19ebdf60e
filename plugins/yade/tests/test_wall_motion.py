"""WallMotion: walls are where they are prescribed to be, contacts see their velocity, and forces, momenta and energies balance."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

from rig import late_motion, vessel
from rig.wall_balance import assert_begins_where_it_stands

from dembark.physics import WallMotion


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes("place", "velocity", "frames", "shaken", "pushed", "other_ids", "bounce", "reloaded", "messages", "late", "again",
                       script="motion_scenes.py")


def test_wall_is_where_it_is_prescribed_to_be(found):
    """After 100 periods within 1e-9 of the amplitude; one that turns, too."""
    centre = np.array([0.01, 0.01, 0.01])
    for name, rows in found["place"].items():
        start, late = np.array(rows[0][1:]), [row for row in rows if row[0] >= 0.2]
        assert late[-1][0] * 50.0 > 100.0
        for t, *corner in late:
            wave, arm = math.sin(2.0 * math.pi * 50.0 * t), start - centre
            c, s = math.cos(0.2 * wave), math.sin(0.2 * wave)
            turned = centre + np.array([c * arm[0] + s * arm[2], arm[1], c * arm[2] - s * arm[0]])
            shifted = start + np.array([0.0, 0.0, 1e-3 * wave])
            assert np.abs(corner - (shifted if name == "harmonic" else turned)).max() < 1e-12


def test_contact_velocity_is_that_of_a_turning_moving_strip(found):
    """v + w x r at the place of contact, the same force whatever the triangles."""
    for strip in found["velocity"]:
        t = strip["time"]
        centre = np.array([0.004 + 0.3 * t, 0.006 - 0.2 * t, 0.0])
        expected = np.array([0.3, -0.2, 0.0]) + np.cross([0.0, 0.0, -40.0], [0.012, 0.011, 0.0] - centre)
        assert np.abs(np.array(strip["velocities"]) - expected).max() < 1e-12 * np.abs(expected).max()
    one, many = (np.array(strip["rows"])[:, 1:4] for strip in found["velocity"])
    assert np.linalg.norm(one[1:, :2], axis=1).min() > 0.0
    assert np.abs(many - one).max() < 1e-9 * np.abs(one).max()


@pytest.mark.parametrize(("moves", "rests"), [("speed", "rest"), ("push", "tilt")])
def test_moving_vessel_is_one_at_rest_in_its_frame(found, moves, rests):
    """At constant speed nothing changes, at constant acceleration gravity is tilted: the same forces over 1000 steps."""
    one, other = (np.array(found["frames"][name]) for name in (moves, rests))
    assert np.abs(other).max() > 0.05
    assert np.abs(one - other).max() < 1e-8 * np.abs(other).max()


def test_forces_of_the_walls_are_what_moves_the_grains(found):
    """Impulse of the walls = change of momentum and of what gravity gave, 1e-9 of the weight; and power is force times velocity."""
    for run in found["shaken"]:
        rows = np.array(run["rows"])
        t, momentum, impulse = rows[:, 0], rows[:, 1:4], rows[:, 4:7]
        assert np.abs(impulse - momentum).max() < 1e-9 * run["weight"] * t[-1]
        force, velocity, load = rows[:, 9:12], rows[:, 12:15], rows[:, 15:18]
        assert np.abs(force - load).max() < 1e-12 * np.abs(load).max()
        if "rocking" in run["motion"]:
            continue
        np.testing.assert_allclose(velocity, WallMotion(run["motion"]).velocity(t), atol=1e-12)
        np.testing.assert_allclose(rows[:, 8], np.einsum("nk,nk->n", force, velocity), rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("motion", [0, 2], ids=["shaken", "rocked, without friction"])
def test_energies_balance_and_the_work_of_the_wall_is_of_second_order(found, motion):
    """Work by the account (mean velocities of steps) less that by force times exact velocity falls with the square of the step."""
    apart = []
    for run in found["shaken"][motion:motion + 2]:
        rows = np.array(run["rows"])
        walls, balance, scale = rows[:, 18:21].T
        assert np.abs(balance).max() < 1e-12 * scale[-1]
        assert walls[-1] > 0.05 * scale[-1]
        # The account is half a step ahead.
        apart.append(np.abs(walls - 0.5 * run["step"] * rows[:, 8] - rows[:, 7]).max() / scale[-1])
    assert apart[0] < 2e-3
    assert 2.5 < apart[0] / apart[1] < 6.0


def test_spring_work_of_a_pushed_grain_is_of_second_order(found):
    coarse, fine = found["pushed"]
    assert 3.0 < coarse / fine < 5.5


def test_energies_are_those_of_the_bodies_that_moved(found):
    first, *others = found["other_ids"]
    assert first["kinetic"] > 0.0 and all(other == first for other in others)


def test_grain_on_a_shaken_plate_lands_when_it_must(found):
    """Five landings, e = 0.5, within the time of a contact of an event-driven solution."""
    assert np.abs(np.array(found["bounce"]) - vessel.landings(5)).max() < vessel.contact_time(0.3)


def test_a_saved_scene_goes_on(found):
    """Walls to the bit; grains to round-off, for a scene that was loaded adds up forces in another order."""
    one, other = found["reloaded"]
    assert one["walls"] == other["walls"]
    np.testing.assert_allclose(other["sums"], one["sums"], rtol=1e-7)
    np.testing.assert_allclose(other["grains"], one["grains"], atol=1e-9)


def test_motions_that_are_given_late_begin_where_the_wall_stands(found, tmp_path):
    """After steps of two lengths, over a saved scene."""
    late = late_motion
    (tmp_path / "late.csv").write_text(late.TABLE)
    times = late.BEGUN + late.STEPS[1] * late.EVERY * np.arange(1, 2 * late.PART // late.EVERY + 1)
    for words, rows in zip(late.MOTIONS, np.array(found["late"]), strict=True):
        np.testing.assert_allclose(rows[:, 5], late.BEGUN, rtol=1e-12)
        assert_begins_where_it_stands(tmp_path, words, times, rows[:, :3], rows[:, 3], rows[:, 4])


def test_another_motion_begins_where_the_wall_stands(found):
    height, before = 0.0, 0.0
    for words, (time, begun, now) in zip(("uniform velocity 0 0 0.1", "uniform velocity 0 0 -0.2",
                                          "harmonic amplitude 0 0 1e-3 frequency 50 ramp 0"), found["again"]["heights"], strict=True):
        assert begun == pytest.approx(before, abs=1e-15)
        height += WallMotion(words, begin=begun).displacement(time)[2]
        assert now == pytest.approx(height, abs=1e-15)
        before = time


def test_a_motion_that_was_left_out_for_steps_ends_the_run(found):
    for said, (last, now) in zip(found["again"]["said"], ((149, 153), (4, 0)), strict=True):
        assert said.startswith(f"dembark: WallMotion moved its bodies last in step {last} and is now in step {now}:")


@pytest.mark.parametrize(("name", "line"), [
    ("word", "there is no motion 'shake'"), ("fast", "below ten time steps"), ("short", "below ten time steps"),
    ("zero", "frequency 0 must be > 0"), ("back", "file 'back.csv', line 3: the times do not ascend"),
    ("order", "must stand in O.engines after InteractionLoop"),
    ("step", "must stand in O.engines after GlobalStiffnessTimeStepper"),
    ("free", "follows its forces"), ("empty", "ids is empty")])
def test_wrong_motions_are_told_in_one_line(found, name, line):
    assert found["messages"][name].startswith("dembark: ") and line in found["messages"][name]


def test_bodies_that_do_not_exist_are_told(found):
    for body, said in zip((-1, 77, 10**6), found["messages"]["strangers"], strict=True):
        assert said.startswith("dembark: ") and f"WallMotion: there is no body {body}" in said
