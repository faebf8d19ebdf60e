"""The engine LcpImpact inside YADE: impacts, rest, walls, friction, what it puts out."""

import math

import numpy as np
import pytest

from dembark.physics import ImpactSystem, Plane


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes("pairs", "wall", "cradle", "rest", "oblique", "records", "drum", script="log_scenes.py")


def restitution(case, speed=1.0):
    first, second = case["velocity"]
    return (second - first) / speed


def test_two_logs_part_with_the_restitution_of_the_scheme(found):
    case = found["pairs"]["plain"]
    assert restitution(case) == pytest.approx(math.exp(-math.pi * 0.01 / 2), abs=5e-5)
    assert case["outputs"]["highestForce"] / case["peak"] == pytest.approx(0.9922, abs=1e-4)
    assert sum(case["velocity"]) == pytest.approx(1.0, abs=1e-13)
    assert case["end"] < case["begin"]


def test_unequal_logs(found):
    case = found["pairs"]["unequal"]
    assert case["outputs"]["highestForce"] == pytest.approx(16418.8, abs=0.1)
    assert case["velocity"] == pytest.approx([-0.898, 0.5995], abs=5e-4)
    assert case["stiffness"] == {"0": 3e7, "1": 1e7}


def test_without_numerical_loss_energy_converges_with_the_square_of_the_step(found):
    """What is left, of either sign, depends on where in a step the logs touch."""
    for turn in (0.04, 0.02, 0.01):
        case = found["pairs"][f"half {turn}"]
        loss = 1.0 - case["end"] / case["begin"]
        assert abs(loss) < 0.2 * turn**2
        assert case["outputs"]["dissipatedEnergy"] == pytest.approx(case["begin"] - case["end"], abs=1e-9)


def test_contact_damping_gives_the_restitution_of_a_damped_spring(found):
    """c on the deformation of a spring s is a spring and a dash-pot side by side: e of the damped oscillator until the force ends."""
    case = found["pairs"]["damped"]
    k, m, c = 1e7, case["reduced"], 2000.0
    zeta = c / (2 * math.sqrt(k * m))
    root = math.sqrt(1 - zeta**2)
    # The contact ends when its force is zero, which is before its deformation is.
    phase = math.pi - math.atan2(2 * zeta * root, 1 - 2 * zeta**2)
    expected = math.exp(-zeta / root * phase)
    assert restitution(case) == pytest.approx(expected * math.exp(-math.pi * 1e-3 / 2), abs=1e-3)


def test_methods_give_the_same_motion(found):
    for method in ("energy", "block", "murty"):
        assert found["pairs"][method] == pytest.approx(found["pairs"]["plain"]["velocity"], rel=1e-12)


@pytest.mark.parametrize("kind", ["wall", "two sides", "facets", "drum"])
def test_wall_of_local_stiffness(found, kind):
    case = found["wall"][kind]
    e = math.exp(-math.pi * 1e-3 / 2)
    assert case["velocity"] == pytest.approx(2.0 * e, abs=2e-5)
    assert case["outputs"]["highestForce"] == pytest.approx(case["peak"], rel=1e-3)
    # The wall's body gets the opposite force.
    assert -case["force"] == pytest.approx(case["outputs"]["highestForce"], rel=1e-12)
    assert case["outputs"]["impactsBegun"] == 1


def test_kinds_of_walls_agree(found):
    velocities = [found["wall"][kind]["velocity"] for kind in ("wall", "two sides", "facets", "drum")]
    assert velocities == pytest.approx([velocities[0]] * 4, rel=1e-11)
    assert found["wall"]["from below"] == pytest.approx(-velocities[0], rel=1e-11)


def test_moving_wall_and_moving_held_log_give_twice_their_speed(found):
    for kind in ("moving", "held log"):
        assert found["wall"][kind] == pytest.approx(2.0 + 2.0 * math.exp(-math.pi * 1e-3 / 2), abs=2e-3)


def test_cradle(found):
    case = found["cradle"]
    assert case["velocity"] == pytest.approx([-0.132, -0.075, -0.031, 0.296, 0.941], abs=1e-3)
    assert case["momentum"] < 1e-12
    assert case["outputs"]["impactsBegun"] >= 4


def test_log_at_rest_feels_its_weight_and_nothing_moves(found):
    """Gravity, which NewtonIntegrator adds, is in the predicted motion: otherwise the log would sink."""
    case = found["rest"]
    assert case["fastest"] < 1e-12
    (a, b, normal, gap, force, tangential, place), = case["contacts"]
    assert (a, b) == (1, -1)
    assert normal == [0, 1, 0]
    assert force == pytest.approx(case["weight"], rel=1e-9)
    assert gap == pytest.approx(-case["weight"] * (1e-7 + 0.5e-7), rel=1e-9)
    assert tangential == [0, 0, 0]
    # The place lies on the undeformed circle, moved by the log's own share of the overlap.
    assert place[1] == pytest.approx(gap / 3, abs=1e-7)


def test_start_from_the_velocity_of_the_positions(found):
    """Leapfrog follows the parabola exactly when its first velocity is that of half a step earlier."""
    x, y, z, spin = found["rest"]["thrown True"]
    t = 100 * 1e-3
    assert (x, y, z, spin) == pytest.approx((t, 2 * t - 0.5 * 9.81 * t * t, 0, 3.0), abs=1e-12)
    assert found["rest"]["thrown False"][1] == pytest.approx(y - 0.5 * 9.81 * 1e-3 * t, abs=1e-12)


def test_oblique_impact_keeps_momentum_and_angular_momentum_and_the_plane(found):
    case = found["oblique"]
    assert case["outputs"]["impactsBegun"] == 1
    assert case["end"][:2] == pytest.approx(case["begin"][:2], abs=1e-11)
    assert case["end"][2] == pytest.approx(case["begin"][2], abs=1e-9)
    begin, end = case["energy"]
    assert end < begin
    assert begin - end == pytest.approx(case["outputs"]["dissipatedEnergy"], rel=2e-3)
    assert case["spins"][0] != 5.0
    assert case["flat"] == 0.0


def test_records_of_impacts(found):
    lines = found["records"]["text"].splitlines()
    assert lines[0] == "# impacts that have ended, SI units; id_b < 0 is a wall: -1 = wall 1"
    assert lines[1] == ("# id_a id_b time duration peak_force impulse relative_speed dissipated x y z friction_loss nx ny nz "
                        "turn_a turn_b")
    rows = [[float(word) for word in line.split()] for line in lines[2:]]
    assert len(rows) == 2 == found["records"]["outputs"]["impactsBegun"]
    pair, = (row for row in rows if row[1] >= 0)
    wall, = (row for row in rows if row[1] < 0)
    k, m = 1e7, 25.0
    assert pair[:2] == [1, 2]
    assert pair[2] == pytest.approx(0.05, abs=5e-6)
    assert pair[3] == pytest.approx(math.pi * math.sqrt(m / k), rel=2e-3)
    assert pair[4] == pytest.approx(math.sqrt(k * m), rel=2e-3)
    assert pair[5] == pytest.approx(2 * m, rel=2e-3)
    assert pair[6] == pytest.approx(1.0, rel=1e-9)
    assert pair[8:] == pytest.approx([0.15, 0, 0, 0, -1, 0, 0, 0, 0], abs=1e-5)
    assert wall[:2] == [3, -1]
    assert wall[5] == pytest.approx(40.0 * 3.0 * 2, rel=2e-3)
    assert wall[6] == pytest.approx(3.0, rel=1e-9)


def test_totals_belong_to_the_records(found):
    rows = [[float(word) for word in line.split()] for line in found["records"]["text"].splitlines()[2:]]
    totals = found["records"]["outputs"]
    assert totals["impulseSum"] == pytest.approx(sum(row[5] for row in rows), rel=1e-9)
    assert totals["highestForce"] == pytest.approx(max(row[4] for row in rows), rel=1e-9)
    assert totals["dissipatedEnergy"] == pytest.approx(sum(row[7] for row in rows), rel=1e-9)
    assert totals["worstCertificate"] >= totals["certificate"]
    assert totals["worstCertificate"] < 1e-12
    assert totals["pivotsTotal"] > 0


def test_turning_drum_carries_a_log_up(found):
    """A log that cannot roll is a pendulum with friction: a'' = -g/l sin a + mu (g/l cos a + a'^2), up to its first return."""
    case = found["drum"]["zXYZ"]
    angle, speed, dt, highest = 0.0, 0.0, 1e-5, 0.0
    while speed >= 0.0:
        speed += dt * (-9.81 / 0.4 * math.sin(angle) + 0.3 * (9.81 / 0.4 * math.cos(angle) + speed**2))
        angle += dt * speed
        highest = max(highest, angle)
    assert case["highest"] == pytest.approx(highest, rel=0.01)
    assert highest > math.atan(0.3)
    force = case["contact"][4]
    assert np.linalg.norm(case["contact"][5]) == pytest.approx(0.3 * force, rel=1e-9)
    # The shell feels it: the log hangs on its way up, so it brakes.
    assert case["torque"] == pytest.approx(-0.3 * force * 0.5, rel=1e-3)
    assert case["force"][1] < 0.0


def test_log_that_can_turn_rolls_with_the_shell(found):
    """It is carried up at first and then rolls: its surface moves with that of the shell."""
    case = found["drum"]["zXY"]
    assert case["highest"] > 0.05
    assert case["spin"] * 0.1 + case["along"] == pytest.approx(2.0 * 0.5, rel=1e-3)
    assert case["spin"] > 5.0
    assert np.linalg.norm(case["contact"][5]) < 0.3 * case["contact"][4]
    assert case["outputs"]["dissipatedEnergy"] > 0.0


@pytest.fixture(scope="module")
def pile(yade):
    return yade.scenes("pile", script="log_scenes.py")["pile"]


def test_pile_at_rest_weighs_what_its_logs_weigh(pile):
    assert pile["fastest"] < 1e-5
    assert pile["forces"]["floor"][1] + pile["forces"]["left"][1] + pile["forces"]["right"][1] == pytest.approx(-pile["weight"], rel=2e-5)
    assert sum(pile["forces"][name][0] for name in pile["forces"]) == pytest.approx(0.0, abs=2e-5 * pile["weight"])
    # Each log: contacts carry its weight, which NewtonIntegrator adds afterwards.
    for force in pile["net"].values():
        assert force == pytest.approx(pile["weight"] / 10, rel=1e-4)
    assert pile["outputs"]["certificate"] < 1e-12
    assert pile["outputs"]["activeCount"] == sum(row[4] > 0 for row in pile["contacts"])
    for _, _, normal, gap, force, tangential, _ in pile["contacts"]:
        assert force >= 0.0
        assert force == 0.0 or gap < 0.0
        assert np.linalg.norm(tangential) <= 0.4 * force * (1 + 1e-9) + 1e-9
        assert abs(np.dot(tangential, normal)) <= 1e-9 * (1 + force)


def test_first_impacts_of_a_falling_pile_are_those_of_the_model_alone(yade):
    """The engine adds nothing of its own: the same headers outside of YADE give the same motion."""
    case = yade.scenes("first_impacts", script="log_scenes.py")["first_impacts"]
    system = ImpactSystem(case["masses"], case["radii"], case["places"], [[0.3 - 0.2 * i, -0.5] for i in range(4)],
                          spin=[0.0, 1.0, 2.0, 3.0],
                          stiffness=1.5e7, gravity=(0.0, -9.81), friction=0.4,
                          walls=[Plane(point=(0.0, 0.0), normal=(0.0, 1.0), stiffness=4e7, friction=0.4)])
    motion = system.run(8000 * 1e-5, 1e-5)
    rows = np.array(case["rows"])
    assert case["outputs"]["impactsBegun"] == motion.report["impacts_begun"][-2] >= 5
    assert np.abs(rows[:, :, :2] - motion.position[200::200]).max() < 1e-9 * 0.1
    for mine, theirs in (("impulseSum", "impulse_sum"), ("dissipatedEnergy", "dissipated_energy"), ("highestForce", "peak_force_so_far")):
        assert case["outputs"][mine] == pytest.approx(motion.report[theirs][-2], rel=1e-8)
