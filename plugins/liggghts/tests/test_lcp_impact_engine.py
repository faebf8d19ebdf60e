"""fix lcp/impact in the engine: meshes, other pair forces, mistakes; the rest is in plugins/tests."""

import itertools
import math

import pytest
from rig.impact_decks import Case, Log, assert_same, pile, run, start
from rig.liggghts_driver import run_deck


def floor(folder, *, across=0.0, lift=0.0, squares=7):
    """A floor of triangles in the plane y = lift, in x from -2 to 2; `across` shifts the diagonals."""
    folder.mkdir(parents=True, exist_ok=True)
    facets = []
    edges = [-2.0 + 4.0 * i / squares + (across if 0 < i < squares else 0.0) for i in range(squares + 1)]
    for a, b in itertools.pairwise(edges):
        for triangle in ([(a, -0.45), (a, 0.45), (b, 0.45)], [(a, -0.45), (b, 0.45), (b, -0.45)]):
            corners = "\n".join(f"   vertex {x:.17g} {lift:.17g} {z:.17g}" for x, z in triangle)
            facets.append(f" facet normal 0 1 0\n  outer loop\n{corners}\n  endloop\n endfacet")
    (folder / "floor.stl").write_text("solid floor\n" + "\n".join(facets) + "\nendsolid floor\n")


ROLLING = [Log((-0.8, 0.1 + 2e-3), (2.0, -0.3)), Log((0.1, 0.0793), (-1.0, 0.0), radius=0.08, mass=30.0, z=0.03)]
WORDS = "stiffness 1e7 contact_damping 800 friction 0.3 impacts impacts.txt"


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_floor_of_triangles_is_a_plane(tmp_path, ranks):
    """Bouncing, sliding and rolling over edges and diagonals: motion, records and totals are those of a plane."""
    plane = Case(ROLLING, f"{WORDS} wall plane floor y 0 lo stiffness 4e7 friction 0.25", 2e-5, "run 15000", gravity=9.81, every=3000)
    floor(tmp_path / "mesh", across=0.013)
    mesh = Case(ROLLING, f"{WORDS} wall mesh floor stl stiffness 4e7 friction 0.25", 2e-5, "run 15000", gravity=9.81, every=3000,
                before="fix stl all mesh/surface file floor.stl type 1")
    expected, found = run(tmp_path / "plane", plane), run(tmp_path / "mesh", mesh, ranks=ranks)
    for a, b in zip(expected.frames, found.frames, strict=True):
        assert b[:, 1:10] == pytest.approx(a[:, 1:10], abs=1e-9)
    assert abs(found.last[0, 1] - ROLLING[0].position[0]) > 0.3  # over some edges
    assert found.vector("impacts") == expected.vector("impacts")
    assert found.vector("dissipated") == pytest.approx(expected.vector("dissipated"), rel=1e-8)
    assert found.impacts() == pytest.approx(expected.impacts(), rel=1e-6, abs=1e-9)


def test_a_moving_mesh_carries_its_logs(tmp_path):
    """A floor that moves up and sideways: a log at rest relative to it stays at rest relative to it."""
    floor(tmp_path / "moving", squares=2)
    static = 50.0 * 9.81 * (1e-7 + 1.0 / 4e7)
    log = Log((-0.5, 0.1 - static), (0.5, 0.2))
    case = Case([log], "stiffness 1e7 wall mesh floor stl stiffness 4e7 friction 0.5", 2e-5, "run 5000", gravity=9.81,
                every=1000, before="fix stl all mesh/surface file floor.stl type 1\nfix move all move/mesh mesh stl linear 0.5 0.2 0.0")
    found = run(tmp_path / "moving", case)
    assert found.velocity()[0] == pytest.approx([0.5, 0.2, 0.0], abs=2e-4)
    assert abs(found.spin()[0, 2]) < 2e-3
    assert found.last[0, 2] == pytest.approx(0.1 - static + 0.2 * 0.1, abs=1e-6)
    # A conveyor: the floor stands, its surface moves.
    floor(tmp_path / "belt", squares=2)
    belt = Case([Log((-0.5, 0.1 - static))], case.words, 2e-5, "run 5000", gravity=9.81, every=1000,
                before="fix stl all mesh/surface file floor.stl type 1 surface_vel 0.6 0.0 0.0")
    found = run(tmp_path / "belt", belt)
    # Without a torque about the contact the log turns on the spot as it is taken along: v + w r = belt, m v r = I w.
    assert found.velocity()[0, 0] == pytest.approx(0.6 / 3.0, rel=1e-2)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_moving_mesh_crosses_a_periodic_boundary(tmp_path, ranks):
    """The engine takes triangles that leave the box to its other end, which is no velocity of theirs: a log on the floor goes with it."""
    floor(tmp_path, squares=8)
    static = 50.0 * 9.81 * (1e-7 + 1.0 / 4e7)
    case = Case([Log((1.2, 0.1 - static), (5.0, 0.0))], "stiffness 1e7 wall mesh floor stl stiffness 4e7 friction 0.5", 1e-4, "run 600",
                gravity=9.81, every=200, box=(-2.0, 2.0, -1.0, 1.0, -0.5, 0.5), boundary="p f f",
                before="fix stl all mesh/surface file floor.stl type 1\nfix move all move/mesh mesh stl linear 5.0 0.0 0.0")
    found = run(tmp_path, case, ranks=ranks)
    assert found.velocity()[0] == pytest.approx([5.0, 0.0, 0.0], abs=1e-9)
    assert found.last[0, 1:3] == pytest.approx([1.2 + 0.3, 0.1 - static], abs=1e-9)


def test_a_drum_of_triangles(tmp_path):
    """A polygon of many sides that turns with fix move/mesh is nearly the cylinder."""
    sides, radius = 180, 1.0
    tmp_path.mkdir(exist_ok=True)
    (tmp_path / "mesh").mkdir()
    corner = [(radius * math.cos(2.0 * math.pi * i / sides), radius * math.sin(2.0 * math.pi * i / sides)) for i in range(sides)]
    facets = []
    for (ax, ay), (bx, by) in zip(corner, corner[1:] + corner[:1], strict=True):
        for triangle in ([(ax, ay, -0.4), (bx, by, -0.4), (bx, by, 0.4)], [(ax, ay, -0.4), (bx, by, 0.4), (ax, ay, 0.4)]):
            corners = "\n".join(f"   vertex {x:.17g} {y:.17g} {z:.17g}" for x, y, z in triangle)
            facets.append(f" facet normal 0 0 1\n  outer loop\n{corners}\n  endloop\n endfacet")
    (tmp_path / "mesh" / "drum.stl").write_text("solid drum\n" + "\n".join(facets) + "\nendsolid drum\n")
    log = Log((0.0, -0.9 + 2e-4), mass=60.0)
    words = "stiffness 1e7 contact_damping 4000"
    round_drum = Case([log], f"{words} wall cylinder drum z 0 0 1.0 stiffness 5e7 friction 0.4 omega 1.0", 5e-5, "run 3000", gravity=9.81,
                      every=300)
    mesh = Case([log], f"{words} wall mesh drum stl stiffness 5e7 friction 0.4", 5e-5, "run 3000", gravity=9.81, every=300,
                before=f"fix stl all mesh/surface file drum.stl type 1\nfix turn all move/mesh mesh stl rotate origin 0 0 0 axis 0 0 1 "
                       f"period {2.0 * math.pi!r}")
    expected, found = run(tmp_path / "round", round_drum), run(tmp_path / "mesh", mesh)
    assert found.last[0, 1:3] == pytest.approx(expected.last[0, 1:3], abs=2e-3)
    assert expected.last[0, 1] > 0.02
    # Triangles change their rank while the drum turns, and so does the log.
    (tmp_path / "ranks").mkdir()
    (tmp_path / "ranks" / "drum.stl").write_bytes((tmp_path / "mesh" / "drum.stl").read_bytes())
    mesh.logs = [Log((-0.01, -0.9 + 2e-4), mass=60.0)]
    one, two = run(tmp_path / "mesh", mesh, dump="one.dump"), run(tmp_path / "ranks", mesh, ranks=2)
    assert one.frames[0][0, 1] < 0.0 < one.last[0, 1]
    assert_same(one.last, two.last, 1e-9)


def test_beside_pair_forces(tmp_path):
    """A pair style for other atoms: excluded from each other's neighbour lists, the logs feel nothing of it."""
    pair = """fix m1 all property/global youngsModulus peratomtype 5e6
fix m2 all property/global poissonsRatio peratomtype 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.5
fix m4 all property/global coefficientFriction peratomtypepair 1 0.5
pair_style gran model hertz tangential history
pair_coeff * *
neigh_modify exclude group all all"""
    alone, beside = run(tmp_path / "alone", pile()), run(tmp_path / "beside", pile(before=pair))
    assert_same(alone.last, beside.last, 0.0)


def refused(folder, words="stiffness 1e7", **settings):
    done = start(folder, Case([Log((0.0, 0.0)), Log((0.5, 0.0))], words, 1e-5, "run 1", **settings))
    assert done.code != 0, done.output[-2000:]
    errors = [line for line in done.output.splitlines() if "ERROR" in line]
    assert len(errors) == 1, done.output[-2000:]
    return errors[0]


@pytest.mark.parametrize(("words", "says"), [
    ("", "stiffness is missing: one value (N/m) for each atom type"),
    ("stiffness 1e7 2e7", "stiffness: one value (N/m) for each of the 1 atom types, not 2"),
    ("stiffness -1", "stiffness: the value (N/m) of type 1 must be > 0, not -1"),
    ("stiffness 1e7 damping -2", "damping: the value (N s/m) of type 1 must be >= 0, not -2"),
    ("stiffness 1e7 contact_damping high", "contact_damping: the value (N s/m) must be a number, not 'high'"),
    ("stiffness 1e7 theta 0.4", "theta: the value lies in 0.5...1, not 0.4"),
    ("stiffness 1e7 friction 0.2 0.3 1e-5", "kinetic friction 0.3 must not exceed static friction 0.2"),
    ("stiffness 1e7 friction 0.3 0.2", "critical slip distance"),
    ("stiffness 1e7 frction 0.3", "'frction' is no keyword; there is stiffness, damping"),
    ("stiffness 1e7 method newton", "method: the solver can be auto, energy, block, murty or pgs, not 'newton'"),
    ("stiffness 1e7 sweeps 0", "sweeps: the number must be >= 1, not 0"),
    ("stiffness 1e7 sweeps 1.5", "sweeps: a whole number from 1 to 100, not 1.5"),
    ("stiffness 1e7 inertia disc", "inertia: the shape can be cylinder or sphere, not 'disc'"),
    ("stiffness 1e7 wall sphere s", "wall: the shape can be plane, cylinder or mesh, not 'sphere'"),
    ("stiffness 1e7 wall plane floor y 0 lo", "wall floor: stiffness (N/m) is missing"),
    ("stiffness 1e7 wall plane floor y 0 up stiffness 1e7", "wall floor: the side can be lo or hi, not 'up'"),
    ("stiffness 1e7 wall plane floor w 0 lo stiffness 1e7", "wall floor: the axis can be x, y or z, not 'w'"),
    ("stiffness 1e7 wall cylinder drum z 0 0 -1 stiffness 1e7", "wall drum: the radius (m) must be > 0, not -1"),
    ("stiffness 1e7 wall plane a y 0 lo stiffness 1e7 omega 3", "wall a: omega: the first coordinate (m) of the axis is missing"),
    ("stiffness 1e7 wall plane a y 0 lo stiffness 1e7 wall plane a x 0 lo stiffness 1e7", "wall a: there is a wall of this name already"),
    ("stiffness 1e7 wall mesh floor stl stiffness 1e7", "wall floor: there is no fix mesh/surface with the ID stl"),
    ("stiffness 1e7 impacts no/such/folder/file.txt", "impacts: file no/such/folder/file.txt cannot be written"),
])
def test_bad_words(tmp_path, words, says):
    line = refused(tmp_path, words)
    assert says in line and "lcp/impact" in line


def test_forces_after_the_contact_forces_are_refused(tmp_path):
    line = refused(tmp_path, after="fix push all addforce 1.0 0.0 0.0")
    assert "fix push (addforce) may add forces after the contact forces are known; define it before this fix" in line


def test_bodies_of_several_grains_are_refused(tmp_path):
    """Their forces would move the grains one by one."""
    line = refused(tmp_path, after="fix stiff all multisphere")
    assert "it knows single grains, and fix stiff (multisphere) moves bodies made of several" in line


def test_restart_files_that_do_not_fit(tmp_path):
    run(tmp_path, pile(steps=200), run="run 200\nwrite_restart here.restart")
    case = pile(steps=200)
    case.words = case.words.replace("wall plane ground", "wall plane floor")
    done = start(tmp_path, case, head="read_restart here.restart")
    assert done.code != 0 and "wall 1 is ground in the restart file and floor in the command" in done.error
    (tmp_path / "impacts.txt").write_text("# short\n")
    done = start(tmp_path, pile(steps=200), head="read_restart here.restart")
    assert done.code != 0 and "impacts.txt has 8 bytes, the saved run goes on after" in done.output


def test_other_atom_styles_are_refused(tmp_path):
    text = pile(count=2, steps=1).text().replace("atom_style granular", "atom_style atomic")
    text = "\n".join(line for line in text.splitlines() if not line.startswith(("set atom", "fix weight")))
    done = run_deck(tmp_path, text)
    assert done.code != 0 and "use atom_style granular (or sphere)" in done.error
