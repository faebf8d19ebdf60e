"""A mesh is one surface: a grain that is dragged over its triangles, sticks, slips, and holds a bridge as on one plane."""

import math

import numpy as np
import pytest
from rig import liggghts_driver, walls
from rig.impact_decks import Case, Log, run
from rig.liggghts_driver import read_dump
from rig.meshes import bent, box_corner, patch
from rig.motion import deviation
from rig.scenarios import Grain, Material, Path, Scenario

from dembark.physics import capillary_force, effective_youngs_modulus

WET = Material(bridge_volume=2e-10)
RADIUS = 5e-3
LARGE = [((-0.04, -0.04, 0.0), (0.04, -0.04, 0.0), (0.04, 0.04, 0.0)), ((-0.04, -0.04, 0.0), (0.04, 0.04, 0.0), (-0.04, 0.04, 0.0))]


def drag(name: str, start, displacement, velocity, steps: int, spin=(1.0, 2.0, 3.0)) -> Scenario:
    return Scenario(name=name, material=WET, wall=True, time_step=1e-5, steps=steps, stride=1, grains=(
        Grain(position=start, angular_velocity=spin, path=Path(displacement=displacement, velocity=velocity)),))


# To and fro over a border by less than the elastic limit; along and over many borders, now touching, now held by the bridge.
STICK = drag("stick", (0.0, 0.0005, RADIUS - 2e-5), ("0.000002*sin(900*t)", "0", "0"), ("0.0018*cos(900*t)", "0", "0"), 1500,
             (0.0, 0.0, 0.0))
ALONG = drag("along", (-0.0041, -0.002, RADIUS - 2e-5), ("0.2*t", "0.115*t", "0.000075*(1-cos(300*t))"),
             ("0.2", "0.115", "0.0225*sin(300*t)"), 4000)
OVER = drag("over", (-0.0012, 0.0003, RADIUS - 3e-5), ("0.08*t", "0", "0"), ("0.08", "0", "0"), 3000, (0.0, 0.0, 0.0))
INTO = drag("into", (-0.02 + RADIUS - 2e-5, -0.02 + RADIUS - 3e-5, RADIUS - 1e-5), ("0", "0", "-0.001*t"), ("0", "0", "-0.001"), 20,
            (0.0, 0.0, 0.0))
HISTORY = ("compute hold all wall/gran/local history\ndump histories all local {} {}.hist " +
           " ".join(f"c_hold[{k}]" for k in range(1, 8)))
DEGREE = math.pi / 180.0
CASES = {  # case and mesh
    "stick, two": (STICK, LARGE), "stick, many": (STICK, patch()),
    "along, two": (ALONG, LARGE), "along, many": (ALONG, patch()),
    "bend 0": (OVER, bent(0.0)), "bend -2": (OVER, bent(-2 * DEGREE)), "bend 2": (OVER, bent(2 * DEGREE)),
    "bend -30": (OVER, bent(-30 * DEGREE)),
    "corner": (INTO, box_corner((-0.02, -0.02, 0.0))),
}


def run_all(folder, names, ranks=1):
    decks = {}
    for name in names:
        case, triangles = CASES[name]
        text = walls.on_mesh(liggghts_driver.deck(case, start=HISTORY.format(case.steps // 10, len(decks))), folder, triangles,
                             name=f"{len(decks)}.stl")
        decks[name] = text
    walls.batch(folder, decks, ranks)
    found = {}
    for number, name in enumerate(names):
        histories = [np.atleast_2d(table) if table.size else np.zeros((0, 7)) for table in read_dump(folder / f"{number}.hist")[1]]
        found[name] = walls.motion_of(CASES[name][0], folder / f"{number}.dump"), histories
    return found


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return run_all(tmp_path_factory.mktemp("mesh"), list(CASES))


@pytest.mark.parametrize("path", ["stick", "along"])
def test_many_triangles_are_one_plane(found, path):
    """Force and torque in every step, and all history values: displacement, slip, energy, volume and reach of the bridge."""
    (one, its), (many, theirs) = found[f"{path}, two"], found[f"{path}, many"]
    assert max(deviation(one, many).values()) < 1e-9
    assert len(its) == len(theirs) > 5
    for a, b in zip(its[1:], theirs[1:], strict=True):
        assert a.shape == b.shape == (1, 7)
        assert b == pytest.approx(a, rel=1e-7, abs=1e-18)
    assert (its[-1][0, :2] > 0.0).all() and any(table[0, 6] > 0.0 for table in its[1:])
    if path == "along":  # some of it in touch, some with a gap
        assert 0.2 < (one.normal_force < 0.0).mean() < 0.9


def test_ranks_agree_over_a_mesh(found, tmp_path):
    """The path crosses the border of the two ranks, with a bridge and under slip."""
    two = run_all(tmp_path, ["along, many"], ranks=2)["along, many"]
    assert max(deviation(found["along, many"][0], two[0]).values()) < 1e-9


@pytest.mark.parametrize("name", ["bend -2", "bend 2", "bend -30"])
def test_force_has_no_jump_over_an_edge(found, name):
    """No more than the turn of the normal in one step at a groove, none at all over a ridge; the edge counts once."""
    motion = found[name][0]
    flat = found["bend 0"][0]
    force, place = motion.force[:, 0], motion.position[:, 0, 0]
    scale = np.linalg.norm(flat.force[100, 0])
    settled = place > -0.001
    jump = np.linalg.norm(np.diff(force[settled], axis=0), axis=1).max() / scale
    assert jump < (2 * 2 * DEGREE if name == "bend 2" else 0.02)
    before = settled & (place < -2e-4)  # a sphere in a groove touches both sides at once a little before the edge
    assert force[before] == pytest.approx(np.broadcast_to(force[before][-1], force[before].shape), rel=0.02)
    top = np.linalg.norm(force[settled & (place < 0.0001)], axis=1).max()
    assert top < 1.02 * scale or name == "bend 2"


def test_friction_goes_over_an_edge(found):
    """Sliding has worn friction down before the edge, and it stays so: a contact that began anew would stick first."""
    for name in ("bend -2", "bend -30"):
        motion = found[name][0]
        force, place = motion.force[:, 0], motion.position[:, 0, 0]
        ratio = np.hypot(force[:, 0], force[:, 1]) / np.abs(force[:, 2])
        near = (place > -5e-5) & (place < 5e-5)
        assert np.ptp(ratio[near]) < 0.02, name
    assert found["bend -2"][1][-1][0, 0] > 0.0  # and the bridge, which holds when the second strip falls away


def test_a_corner_of_three_walls_is_three_contacts(found):
    """Each wall with its own overlap: Hertz, and its own bridge."""
    motion = found["corner"][0]
    m = WET
    stiffness = 4.0 / 3.0 * effective_youngs_modulus(m.youngs_modulus, m.poisson_ratio, m.youngs_modulus, m.poisson_ratio)
    pull = capillary_force(RADIUS, math.inf, 0.0, m.bridge_volume, m.surface_tension, m.contact_angle, model="exact")
    for axis, overlap in enumerate((2e-5, 3e-5)):
        repulsion = stiffness * math.sqrt(RADIUS) * overlap**1.5
        # Along x and y there is friction of the slow way down besides.
        assert motion.force[0, 0, axis] == pytest.approx(repulsion - pull, rel=0.02)


def test_a_floor_that_leaves_a_periodic_box_keeps_its_speed(tmp_path):
    """The engine takes triangles that leave to the other end, which is no motion: a log goes along with the floor, at rest on it."""
    strips = [-0.9 + 0.2 * k for k in range(9)]
    floor = [three for a in strips for b in [a + 0.2]
             for three in (((a, 0, -0.4), (b, 0, -0.4), (b, 0, 0.4)), ((a, 0, -0.4), (b, 0, 0.4), (a, 0, 0.4)))]
    (tmp_path / "floor.stl").write_text(walls.stl(floor))
    static = 50.0 * 9.81 * (1e-7 + 1.0 / 4e7)
    case = Case([Log((-0.5, 0.1 - static), (0.5, 0.0))], "stiffness 1e7 wall mesh floor stl stiffness 4e7 friction 0.5", 2e-5, "run 20000",
                gravity=9.81, box=(-1.0, 1.0, -1.0, 1.0, -0.5, 0.5), boundary="p f f",
                before="fix stl all mesh/surface file floor.stl type 1\nfix move all move/mesh mesh stl linear 0.5 0.0 0.0")
    found = run(tmp_path, case)
    assert found.velocity()[0] == pytest.approx([0.5, 0.0, 0.0], abs=1e-6)
    assert found.last[0, 1:3] == pytest.approx([-0.3, 0.1 - static], abs=1e-6)
