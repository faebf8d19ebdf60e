"""Every kind of wall of the engines carries the same contact: impact, slip with reversals, drag, and a bridge, against Python."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rig import lammps_driver, liggghts_driver, walls, yade_driver
from rig.motion import deviation
from rig.scenarios import ALL_OF_IT, CONSTANT, SCENARIOS, SPRING, Grain, Path, Scenario
from rig.walls import CYLINDER, FLOOR, Surface

TOLERANCE = 1e-9


def _shorter(name: str, steps: int) -> Scenario:
    return replace(SCENARIOS[name], name=name, material=ALL_OF_IT, steps=steps, stride=5)


# Impact, a bridge that forms and breaks; loops with slip and reversals on two axes; and a drag across the axis of the cylinder.
CASES = {
    "approach": _shorter("approach, bridge, wall", 1200),
    "cycles": _shorter("cycles, wall", 2200),
    "exponential": replace(_shorter("cycles, wall", 1500), material=replace(ALL_OF_IT, presliding="exponential")),
    "elastic limit": replace(_shorter("cycles, wall", 1500), material=replace(ALL_OF_IT, friction_limit="elastic", restitution=0.4)),
    "rolling spring": replace(_shorter("cycles, wall", 1500), material=replace(ALL_OF_IT, **SPRING)),
    "constant torque": replace(_shorter("cycles, wall", 1500), material=replace(ALL_OF_IT, **CONSTANT)),
    "sliding": _shorter("sliding, slow weakening", 1000),
    "around": Scenario(
        name="around", material=ALL_OF_IT, wall=True, time_step=1e-5, steps=1500,
        grains=(Grain(position=(0.0, 0.0, 5.05e-3), angular_velocity=(3.0, 2.0, 1.0), path=Path(
            displacement=("0.02*t", "0.045*sin(20*t)", "0.045*(1-cos(20*t))-0.0000400*(1-cos(2*PI*70*t))"),
            velocity=("0.02", "0.045*20*cos(20*t)", "0.045*20*sin(20*t)-0.0000400*2*PI*70*sin(2*PI*70*t)"))),)),
}
DRIFT, TURN = (0.03, -0.02, 0.05), (0.0, 0.0, 6.0)
ROLL = (7.0, 0.0, 0.0)  # of a cylinder about its axis
# Kind: surface, what LIGGGHTS calls it, what YADE calls it; None: it has no such wall.
SURFACES = {
    "plane": (Surface(), "plane", {"kind": "wall"}),
    "mesh": (Surface(), "mesh", {"kind": "facet"}),
    "joined facet": (Surface(), None, {"kind": "joined facet"}),
    "box": (Surface(), None, {"kind": "box"}),
    "drifting": (Surface(velocity=DRIFT), "mesh linear", {"kind": "joined facet", "velocity": DRIFT}),
    "drifting wall": (Surface(velocity=DRIFT), None, {"kind": "wall", "velocity": DRIFT}),
    "turning": (Surface(spin=TURN), "mesh rotate", {"kind": "joined facet", "spin": TURN}),
    "turning surface": (Surface(spin=TURN), "mesh surface", None),
    "turning box": (Surface(spin=TURN), None, {"kind": "box", "spin": TURN}),
    "cylinder": (Surface(shape="cylinder"), "cylinder", {"kind": "cylinder", "radius": CYLINDER}),
    "rolling cylinder": (Surface(shape="cylinder", spin=ROLL), None, {"kind": "cylinder", "radius": CYLINDER, "spin": ROLL}),
}
# Walls of LAMMPS. Regions that move by themselves: ux, uy, uz are the drift and angle the turn at a time.
REGIONS = {
    "plane": "plane 0 0 0 0 0 1",
    "drifting": "plane 0 0 0 0 0 1 side in move v_ux v_uy v_uz",
    "turning": "plane 0 0 0 0 0 1 side in rotate v_angle 0 0 0 0 0 1",
    "cylinder": f"cylinder x 0 {CYLINDER} {CYLINDER} INF INF side in",
    "rolling cylinder": f"cylinder x 0 {CYLINDER} {CYLINDER} INF INF side in rotate v_angle 0 0 {CYLINDER} 1 0 0",
}
# STL surfaces, and a region, that the fix moves.
MOTIONS = {
    "mesh": "stl floor.stl type 2",
    "drifting wall": "stl floor.stl type 2 motion uniform velocity {} {} {}".format(*DRIFT),
    "turning box": f"stl floor.stl type 2 motion rotation point 0 0 0 axis 0 0 1 rate {TURN[2]}",
    "rolling cylinder, moved": f"region floor type 2 motion rotation point 0 0 {CYLINDER} axis 1 0 0 rate {ROLL[0]}",
}


# A law knows of a wall's kind nothing but place and velocity: these are tried on one wall of each engine, and on its meshes.
OF_THE_LAW = {"exponential", "elastic limit", "constant torque"}


def parts():
    """(kind, case) of all, with the case in the frame of its surface; `around` is for cylinders only."""
    for kind, (surface, _, _) in SURFACES.items():
        for name, case in CASES.items():
            if (name == "around") <= (surface.shape == "cylinder") and (name in OF_THE_LAW) <= (kind in ("plane", "mesh")):
                yield kind, name, replace(walls.moved_with(case, surface.velocity), name=f"{kind}, {name}")


def _deck(case: Scenario, word: str, folder, name: str) -> str:
    text = liggghts_driver.deck(case)
    if word == "cylinder":
        return text.replace("primitive type 2 zplane 0", f"primitive type 2 xcylinder {CYLINDER} 0 {CYLINDER}")
    if word == "plane":
        return text
    words = f"surface_ang_vel origin 0 0 0 axis 0 0 1 omega {TURN[2]!r}" if word == "mesh surface" else ""
    move = {"mesh": "", "mesh surface": "", "mesh linear": "linear {} {} {}".format(*DRIFT),
            "mesh rotate": f"rotate origin 0 0 0 axis 0 0 1 period {2.0 * np.pi / TURN[2]!r}"}[word]
    return walls.on_mesh(text, folder, FLOOR, move, words, name=name)


@pytest.fixture(scope="module")
def liggghts(liggghts_is_there, tmp_path_factory):
    folder, decks, cases = tmp_path_factory.mktemp("walls"), {}, {}
    for kind, name, case in parts():
        word = SURFACES[kind][1]
        if word:
            decks[kind, name] = _deck(case, word, folder, f"{len(decks)}.stl")
            cases[kind, name] = case
    return walls.motions(folder, decks, cases)


@pytest.fixture(scope="module")
def yade(yade_is_there, tmp_path_factory):
    cases = {(kind, name): case for kind, name, case in parts() if SURFACES[kind][2]}
    found = yade_driver.run_all(cases.values(), tmp_path_factory.mktemp("walls"),
                                {case.name: SURFACES[kind][2] for (kind, _), case in cases.items()})
    return {key: found[case.name] for key, case in cases.items()}


@pytest.fixture(scope="module")
def lammps(lammps_is_there, tmp_path_factory):
    decks, cases = {}, {}
    folder = tmp_path_factory.mktemp("walls")
    (folder / "floor.stl").write_text(walls.stl(FLOOR))
    for kind, name, case in parts():
        deck = lammps_driver.deck(case)
        for moved in (key for key in MOTIONS if key.partition(",")[0] == kind):
            text = deck.replace("region floor type 2", MOTIONS[moved])
            decks[moved, name] = text.replace("region floor plane 0 0 0 0 0 1", f"region floor {REGIONS['cylinder']}")
            cases[moved, name] = case
        if kind in REGIONS:
            rate = max(SURFACES[kind][0].spin)
            rates = zip(("ux", "uy", "uz", "angle"), (*DRIFT, rate), strict=True)
            lines = [f'variable {word} equal "{speed!r}*v_t"' for word, speed in rates] + [f"region floor {REGIONS[kind]}"]
            decks[kind, name] = deck.replace("region floor plane 0 0 0 0 0 1", "\n".join(lines))
            cases[kind, name] = case
    return lammps_driver.motions(folder, decks, cases)


PARTS = {(kind, name): case for kind, name, case in parts()}


@cache
def python(kind, name):
    motion = walls.follow(PARTS[kind, name], SURFACES[kind][0])
    assert np.abs(motion.force).max() > 0.02
    return motion


@pytest.mark.parametrize(("kind", "name"), [key for key in PARTS if SURFACES[key[0]][1]])
def test_wall_of_liggghts_is_that_of_python(liggghts, kind, name):
    found = deviation(python(kind, name), liggghts[kind, name])
    assert max(found.values()) < TOLERANCE, found


@pytest.mark.parametrize(("kind", "name"), [key for key in PARTS if SURFACES[key[0]][2]])
def test_wall_of_yade_is_that_of_python(yade, kind, name):
    found = deviation(python(kind, name), yade[kind, name])
    assert max(found.values()) < TOLERANCE, found


@pytest.mark.parametrize(("kind", "name"), [key for key in PARTS if key[0] in REGIONS])
def test_region_of_lammps_is_the_wall_of_python(lammps, kind, name):
    found = deviation(python(kind, name), lammps[kind, name])
    assert max(found.values()) < TOLERANCE, found


@pytest.mark.parametrize(("kind", "name"), [(moved, name) for moved in MOTIONS for kind, name in PARTS if kind == moved.partition(",")[0]])
def test_surface_that_lammps_moves_is_the_wall_of_python(lammps, kind, name):
    found = deviation(python(kind.partition(",")[0], name), lammps[kind, name])
    assert max(found.values()) < TOLERANCE, found


def test_curvature_enters_through_the_nearest_point_only():
    """A grain that stays above the line where the cylinder touches the plane has the same force on both."""
    for name in ("approach", "sliding"):
        flat, curved = (walls.follow(CASES[name], Surface(shape=shape)) for shape in ("plane", "cylinder"))
        assert max(deviation(flat, curved).values()) < 1e-12
