"""LcpImpact inside YADE with capsules: against Python, closed solutions and the cross-section, conservation laws, saved scenes."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from dembark import _physics
from dembark.physics import CapsuleSystem, Drum, Plane

FLOOR = Plane(point=(0, 0, 0), normal=(0, 1, 0), stiffness=5e7)


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes("drum", "cluster", "falling", "ends", "parallel", "top", "inertia", "lying", "leaning", "writer", "mistake",
                       script="capsule_scenes.py")


def moments(*logs):
    """Of solid logs, about the axis and across it (kg m^2)."""
    return np.asarray(_physics.capsule_inertia(*(np.array([log[name] for log in logs], dtype=float)
                                                 for name in ("mass", "radius", "length"))))


def in_python(case, gravity=0.0, stiffness=1e7, **options):
    logs = case["logs"]
    words = {name: [log[name] for log in logs] for name in ("mass", "radius", "length", "position", "velocity", "axis", "spin")}
    system = CapsuleSystem(**words, stiffness=stiffness, gravity=(0, -gravity, 0), **options)
    return system.run(case["steps"] * case["dt"], case["dt"], every=case["every"])


def assert_motion(case, motion, tolerance=1e-8):
    frames = np.array(case["frames"])
    assert len(frames) == len(motion.position) > 1
    for columns, name in ((slice(0, 3), "position"), (slice(3, 6), "velocity"), (slice(6, 9), "spin"), (slice(9, 13), "orientation")):
        expected = getattr(motion, name)
        np.testing.assert_allclose(frames[..., columns], expected, rtol=0, atol=tolerance * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_a_load_in_a_drum_is_that_of_python(found, theta):
    """Tilted logs and balls in a turning drum with plates and friction."""
    case = found["drum"][str(theta)]
    walls = [Drum(radius=0.65, omega=2.0, stiffness=5e7), Plane(point=(0, 0, -0.9), normal=(0, 0, 1), stiffness=5e7, omega=2.0),
             Plane(point=(0, 0, 0.9), normal=(0, 0, -1), stiffness=5e7, omega=-2.0)]
    motion = in_python(case, 9.81, theta=theta, contact_damping=500.0, friction=0.4, walls=walls)
    assert_motion(case, motion)
    said = case["outputs"]
    assert said["impactsBegun"] == motion.report["impacts_begun"][-1] > 20
    assert {-1, -2, -3} <= {i.b for i in motion.impacts}
    assert said["dissipatedEnergy"] == pytest.approx(motion.dissipated_energy[-1], rel=1e-8)
    assert said["worstCertificate"] <= 1e-10


def test_momenta_and_energy(found):
    """Of logs that fly apart again: momentum, angular momentum, and the energy with what friction, damping and scheme took."""
    case = found["cluster"]
    said, mass = case["outputs"], np.array([log["mass"] for log in case["logs"]])
    axial, across = moments(*case["logs"]).T
    assert said["impactsBegun"] > 5
    assert said["activeCount"] == 0
    sums = []
    for frame in np.array(case["frames"]):
        x, v, w, (a, b, c, d) = frame[:, :3], frame[:, 3:6], frame[:, 6:9], frame[:, 9:].T
        u = np.column_stack([2 * (b * d + a * c), 2 * (c * d - a * b), 1 - 2 * (b * b + c * c)])
        along = (w * u).sum(axis=1)
        own = across[:, None] * w + ((axial - across) * along)[:, None] * u
        energy = 0.5 * (mass @ (v**2).sum(axis=1) + across @ (w**2).sum(axis=1) + (axial - across) @ along**2)
        sums.append(np.array([*mass @ v, *(np.cross(x, mass[:, None] * v) + own).sum(axis=0), energy]))
    start, end = sums
    assert said["dissipatedEnergy"] > 0.1 * start[6]
    np.testing.assert_allclose(end[:6], start[:6], rtol=0, atol=1e-12 * np.abs(start[:6]).max())
    assert end[6] + said["dissipatedEnergy"] + said["elasticEnergy"] == pytest.approx(start[6], rel=1e-12)
    assert said["worstCertificate"] <= 1e-10


def test_two_impacts_of_a_falling_log(found):
    """Python to 1e-8, and the rigid body to the softness of the log."""
    case = found["falling"]
    log, = case["logs"]
    mass, r, half, angle = log["mass"], log["radius"], 0.5 * log["length"], math.asin(log["axis"][1])
    motion = in_python(case, stiffness=1e11, theta=0.5, walls=[Plane(point=(0, 0, 0), normal=(0, 1, 0), stiffness=1e15)])
    assert_motion(case, motion)
    across = moments(log)[0, 1]
    lever = half * math.cos(angle)
    reduced = 1 / (1 / mass + lever**2 / across)
    lowest = r + half * math.sin(angle)
    v, w = -1 + 2 * reduced / mass, 2 * lever * reduced / across  # after the first impact, about -z
    second = brentq(lambda t: lowest + v * t + half * math.sin(angle - w * t) - r, 0.02, 0.5)
    arm = half * math.cos(angle - w * second)
    closing = w * arm - v
    reduced_2 = 1 / (1 / mass + arm**2 / across)
    rows = np.array([line.split() for line in case["impacts"].splitlines()[2:]], dtype=float)
    assert rows[:, 8] == pytest.approx([-lever, arm], abs=1e-3)
    assert rows[1, 6] == pytest.approx(closing, rel=1e-3)
    last = case["frames"][-1][0]
    assert last[4] == pytest.approx(v + 2 * reduced_2 * closing / mass, abs=2e-3)
    assert last[8] == pytest.approx(-w + 2 * arm * reduced_2 * closing / across, abs=4e-3)


def test_ends_hit_each_other_as_balls_do_and_an_end_hits_a_side(found):
    ends, balls, side = (found["ends"][name] for name in ("end", "balls", "side"))
    np.testing.assert_allclose(np.array(ends["frames"])[..., 3:6], np.array(balls["frames"])[..., 3:6], atol=1e-12)
    assert ends["outputs"]["highestForce"] == pytest.approx(balls["outputs"]["highestForce"], rel=1e-12)
    assert ends["frames"][-1][1][5] > 0.0 > ends["frames"][-1][0][5]
    for case in (ends, side):
        assert case["outputs"]["impactsBegun"] == 1
        assert_motion(case, in_python(case))
    assert np.abs(np.array(side["frames"])[-1, 0, 6:9]).max() > 0.5


@pytest.mark.parametrize("kind", ["drum", "floor"])
def test_parallel_logs_are_the_cross_section(found, kind):
    """Of the same engine, from impact to impact; each contact has two points."""
    discs, logs = (found["parallel"][kind][name] for name in ("discs", "logs"))
    assert discs["outputs"]["impactsBegun"] > 10
    assert logs["outputs"]["impactsBegun"] == 2 * discs["outputs"]["impactsBegun"]
    np.testing.assert_allclose(np.array(logs["frames"])[..., :3], np.array(discs["frames"])[..., :3], rtol=0, atol=1e-8)
    assert logs["outputs"]["dissipatedEnergy"] == pytest.approx(discs["outputs"]["dissipatedEnergy"], rel=1e-7)


def test_a_free_log_turns_as_a_symmetric_top(found):
    """Whatever the step; NewtonIntegrator alone would keep the spin."""
    case = found["top"]["free"]
    assert_motion(case, in_python(case), 1e-11)
    axial, across = moments(*case["logs"])[0]
    momentum = np.array([across * 3.0, -across * 2.0, axial * 20.0])
    direction = momentum / np.linalg.norm(momentum)
    along, cross = direction[2] * direction, np.cross(direction, [0, 0, 1])
    for k, frame in enumerate(case["frames"]):
        angle = np.linalg.norm(momentum) / across * case["dt"] * case["every"] * k
        axis = along + math.cos(angle) * (np.array([0, 0, 1]) - along) + math.sin(angle) * cross
        a, b, c, d = frame[0][9:]
        u = np.array([2 * (b * d + a * c), 2 * (c * d - a * b), 1 - 2 * (b * b + c * c)])
        assert u == pytest.approx(axis, abs=1e-11)
        w = np.array(frame[0][6:9])
        assert across * w + (axial - across) * (w @ u) * u == pytest.approx(momentum, rel=1e-11)


def test_a_log_that_is_held_turns_with_its_spin_and_pushes_others(found):
    axis, place = found["top"]["held"]
    assert axis == pytest.approx([math.cos(0.4), math.sin(0.4), 0.0], abs=1e-12)
    assert place == [0, 0, 0]
    assert found["top"]["impacts"] == 1
    assert found["top"]["pushed"][1] > 0.3


def test_the_engine_sets_the_inertia_and_torques_of_others_act_with_it(found):
    """Across and along the axis, which lies along y at the start; 0.1 s of 2 and 3 N m."""
    case = found["inertia"]
    axial, across = moments({"mass": 40.0, "radius": 0.1, "length": 1.0})[0]
    assert case["inertia"] == pytest.approx([across, across, axial], rel=1e-14)
    assert case["aspherical"] is True
    assert case["blocked"] == "XYZ"
    assert case["momentum"] == pytest.approx([2.0 * 0.0995, 3.0 * 0.0995, 0.0], rel=1e-12)  # of n - 1/2: the first half of a step
    # YADE's own sum takes the mean spin of the step.
    assert case["energy"] == pytest.approx(0.5 * (0.199**2 / across + 0.2985**2 / axial), rel=0.02)


def test_what_is_set_while_it_runs_counts(found):
    case = found["inertia"]
    assert case["new step"] == [0, 0, 0]
    assert case["set momentum"] == [1, 0, 0]
    momentum, expected, axis, before = case["set spin"]
    assert momentum == pytest.approx(expected, rel=1e-12)
    assert axis == pytest.approx(before, abs=1e-13)


def test_a_side_on_a_floor_has_two_points(found):
    case = found["lying"]
    assert case["fastest"] < 1e-12
    first, second = case["contacts"]
    assert first[:3] == second[:3] == [1, -1, [0, 1, 0]]
    assert first[4] == pytest.approx(0.5 * case["weight"], rel=1e-9)
    assert sorted(row[6][2] for row in case["contacts"]) == pytest.approx([-0.5, 0.5], abs=1e-12)
    assert case["force"] == case["on"] == pytest.approx([0, -case["weight"], 0], abs=1e-9)


def test_a_plate_that_turns_carries_a_log_along(found):
    """The friction on the log points the way the plate turns; the plate feels the torque."""
    case = found["leaning"]
    row, = case["contacts"]
    assert row[5] == pytest.approx([0, 0.2 * row[4], 0], rel=0.05, abs=1.0)
    assert case["force"] == pytest.approx([-row[5][0], -row[5][1], -row[4]])
    assert case["torque"][2] == pytest.approx(-row[6][0] * row[5][1] + row[6][1] * row[5][0])


def test_files_of_log_writer_have_the_spin_and_the_energy_of_capsules(found):
    case = found["writer"]
    frames = [part.splitlines() for part in case["grains.dump"].split("ITEM: TIMESTEP\n")[1:]]
    columns = frames[0][7].split()[2:]
    rows = np.array([[line.split() for line in frame[8:]] for frame in frames], dtype=float)
    mass, y = (rows[..., columns.index(name)] for name in ("mass", "y"))
    v, w = (rows[..., columns.index(name):columns.index(name) + 3] for name in ("vx", "omegax"))
    axial, across = moments(*case["logs"]).T
    u = np.array([log["axis"] for log in case["logs"]])
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    np.testing.assert_allclose(w[0], np.tile([1.0, 2.0, 3.0], (4, 1)), rtol=1e-13)
    turning = 0.5 * (across @ (w[0] ** 2).sum(axis=1) + (axial - across) @ (w[0] * u).sum(axis=1) ** 2)
    header, *lines = case["time.csv"].splitlines()
    kinetic = np.array([line.split(",") for line in lines], dtype=float)[:, header.split(",").index("kinetic_energy")]
    # They fall freely through the first hundred steps.
    assert kinetic[0] == pytest.approx(0.5 * (mass[1] * (v[1] ** 2).sum(axis=1)).sum() + turning, rel=1e-12)
    fallen = 9.81 * (mass[0] * (y[0] - y[1])).sum()
    assert kinetic[0] == pytest.approx(0.5 * (mass[0] * (v[0] ** 2).sum(axis=1)).sum() + turning + fallen, rel=1e-12)


def test_a_first_step_that_failed_is_done_again(found):
    line, again, straight = found["mistake"]
    assert "cannot be written" in line
    assert again == straight


@pytest.fixture(scope="module")
def saved(yade):
    return yade.scenes("save_load", script="capsule_scenes.py")["save_load"]


@pytest.mark.parametrize("ending", ["xml", "yade.gz", "bin"])
def test_a_saved_scene_goes_on_bit_for_bit(saved, ending):
    case = saved[ending]
    assert case["straight"] == case["resumed"] == case["again"]
    assert case["twice"] == case["lines"]
    assert case["lines"].count("\n") > 20
    assert case["lengths"] == [log["length"] for log in case["logs"]]


@pytest.mark.parametrize("step", [0, 900])
def test_a_scene_saved_in_the_middle_of_a_step_does_that_step_once(saved, step):
    case = saved[f"middle {step}"]
    assert case["begin"] == step
    assert case["straight"] == case["resumed"]
