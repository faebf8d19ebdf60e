"""fix lcp/impact in the engine: ranks, restarts, meshes, periodic boxes, output, mistakes."""

import itertools
import math
import subprocess

import numpy as np
import pytest
from rig.impact_decks import Case, Log, run, start
from rig.liggghts_driver import read_dump, run_deck

GROUND = ("wall plane ground y 0 lo stiffness 5e7 friction 0.3 wall plane left x -0.9 lo stiffness 5e7 "
          "wall plane right x 0.9 hi stiffness 5e7")


def pile(count=30, *, steps=2000, **settings):
    """Logs of unequal diameter that fall between two walls, on both sides of x = 0."""
    logs = []
    for i in range(count):
        radius = 0.1 * (1.0 + 0.2 * math.sin(37.0 * i))
        logs.append(Log((-0.72 + 0.25 * (i % 6) + 0.02 * math.sin(91.0 * i), 0.15 + 0.26 * (i // 6)),
                        (0.5 * math.sin(53.0 * i), -1.0 + 0.5 * math.sin(17.0 * i)), radius=radius, mass=2500.0 * radius**2))
    settings = {"every": steps, **settings}
    return Case(logs, f"stiffness 1e7 contact_damping 20000 friction 0.4 0.3 1e-4 impacts impacts.txt {GROUND}", 2e-5, f"run {steps}",
                gravity=9.81, box=(-1.0, 1.0, -0.5, 2.5, -0.5, 0.5), **settings)


def assert_same(a, b, tolerance):
    """Two frames: each quantity, three columns, relative to its largest value."""
    assert (a[:, 0] == b[:, 0]).all()
    found = {name: np.abs(a[:, k : k + 3] - b[:, k : k + 3]).max() / max(np.abs(a[:, k : k + 3]).max(), 1e-300)
             for k, name in ((1, "position"), (4, "velocity"), (7, "spin"), (10, "force"), (13, "torque"))}
    assert max(found.values()) <= tolerance, found


def test_ranks_agree(tmp_path):
    """Impacts between logs of different ranks and logs that change their rank."""
    one = run(tmp_path / "1", pile(steps=12000))
    two = run(tmp_path / "2", pile(steps=12000), ranks=2)
    assert one.vector("impacts") > 30
    assert_same(one.last, two.last, 1e-9)
    assert two.vectors[-1] == pytest.approx(one.vectors[-1], rel=1e-9, abs=1e-12)
    assert two.impacts() == pytest.approx(one.impacts(), rel=1e-8)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_restart_goes_on_bit_for_bit(tmp_path, ranks):
    """Restart files in the middle of impacts: positions, forces, totals and the file of impacts are those of the run that went through."""
    through = run(tmp_path / "through", pile(steps=3000, every=500), ranks=ranks)
    folder = tmp_path / "stopped"
    # It is killed after some time; its last restart file is older than its last record.
    case = pile(steps=3000, every=500, extra=["restart 1500 half.restart last.restart"])
    stopped = run(folder, case, ranks=ranks, run="run 2400", dump="first.dump")
    records = (folder / "impacts.txt").read_bytes()
    assert len(records) > len((tmp_path / "through" / "impacts.txt").read_bytes()) / 2
    again = run(folder, pile(steps=3000, every=500), ranks=ranks, head="read_restart half.restart", run="run 1500", dump="again.dump")
    assert again.steps[0] == 1500
    assert (again.vectors[0] == through.vectors[3]).all(), (again.vectors[0], through.vectors[3])
    for k in range(len(again.steps)):
        assert_same(again.frames[k], through.frames[3 + k], 0.0)
    assert (again.vectors[-1] == through.vectors[-1]).all()
    assert (folder / "impacts.txt").read_bytes() == (tmp_path / "through" / "impacts.txt").read_bytes()
    assert stopped.vector("impacts") > again.vector("impacts", 0)


def test_two_runs_are_one(tmp_path):
    """A second `run` takes the forces of the first one's last step; a restart file written between the runs holds the same."""
    through = run(tmp_path / "through", pile(steps=1200))
    parts = run(tmp_path / "parts", pile(steps=1200, every=600), run="run 500\nrun 0\nwrite_restart here.restart\nrun 700")
    assert_same(parts.last, through.last, 0.0)
    assert (parts.vectors[-1] == through.vectors[-1]).all()
    after = run(tmp_path / "parts", pile(steps=1200), head="read_restart here.restart", run="run 700", dump="after.dump")
    assert_same(after.last, through.last, 0.0)


def test_logs_that_were_moved_get_new_forces(tmp_path):
    """What a user changes between two runs counts."""
    case = Case([Log((0.0, 0.0), (1.0, 0.0)), Log((0.2, 0.0))], "stiffness 1e7", 1e-5,
                "run 200\nset atom 1 x -0.5\nset atom 1 vx 0\nset atom 2 vx 0\nrun 10", every=10)
    found = run(tmp_path, case)
    assert found.vector("active") == 0
    assert np.abs(found.last[:, 10:13]).max() == 0.0


@pytest.mark.parametrize(("change", "mass", "gravity"), [("", 50.0, 9.81), ("unfix weight", 50.0, 0.0), ("set atom 1 mass 80", 80.0, 9.81)])
def test_forces_of_a_second_run_are_those_of_the_present_masses_and_forces(tmp_path, change, mass, gravity):
    """At rest on a floor: N of equation (2) for the set-up's half kick, with what is true now and not what was true a step before."""
    s, step = 1e7, 5e-3
    overlap = 50.0 * 9.81 * 2.0 / s
    case = Case([Log((0.0, 0.1 - overlap))], f"stiffness {s!r} wall plane floor y 0 lo stiffness {s!r}", step,
                f"run 20\n{change}\nrun 0", gravity=9.81, every=20)
    response = 0.5 * step**2
    assert run(tmp_path, case).vector("peak") == pytest.approx((overlap + response * gravity) / (2.0 / s + response / mass), rel=1e-9)


def test_another_time_step_goes_on(tmp_path):
    case = Case([Log((0.0, 0.0), (1.0, 0.0)), Log((0.2 + 1e-5, 0.0))], "stiffness 1e7 theta 0.5 impacts impacts.txt", 1e-6,
                "run 2000\ntimestep 2e-6\nrun 3000", every=1000)
    found = run(tmp_path, case)
    assert found.velocity()[:, 0] == pytest.approx([0.0, 1.0], abs=2e-3)
    (impact,) = found.impacts()
    time, duration = impact[-9:-7]
    assert time == pytest.approx(1e-5, abs=2e-6)
    assert duration == pytest.approx(math.pi / math.sqrt(0.5 * 1e7 / 25.0), rel=5e-3)


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


ROLLING = [Log((-0.8, 0.1 + 2e-3), (2.0, -0.3)), Log((0.1, 0.0791), (-1.0, 0.0), radius=0.08, mass=30.0, z=0.03)]
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


def test_periodic_box(tmp_path):
    """Two logs meet across the boundary; the same impact in the middle of the box is the same."""
    words = "stiffness 1e7 impacts impacts.txt"
    box = (-1.0, 1.0, -1.0, 1.0, -0.5, 0.5)
    middle = Case([Log((-0.15, 0.0), (1.0, 0.0)), Log((0.15, 0.0))], words, 1e-5, "run 20000", every=20000, box=box)
    across = Case([Log((0.85, 0.0), (1.0, 0.0)), Log((-0.85, 0.0))], words, 1e-5, "run 20000", every=20000, box=box, boundary="p f f")
    expected, found = run(tmp_path / "middle", middle), run(tmp_path / "across", across)
    assert expected.vector("impacts") == found.vector("impacts") == 1
    assert found.velocity() == pytest.approx(expected.velocity(), abs=1e-9)
    two = run(tmp_path / "two", across, ranks=2)
    assert two.velocity() == pytest.approx(found.velocity(), abs=1e-12)
    short = Case([Log((-0.15, 0.0)), Log((0.15, 0.0))], words, 1e-5, "run 1", box=(-0.2, 0.2, -1.0, 1.0, -0.5, 0.5), boundary="p f f")
    done = start(tmp_path / "short", short)
    assert done.code != 0 and "periodic box is too short along x" in done.error


def test_local_array_and_vector(tmp_path):
    """dump local: one row for each contact with a force; their sum is the force on the logs."""
    case = pile(steps=12000, extra=["dump here all local 12000 local.dump " + " ".join(f"f_hits[{i}]" for i in range(1, 14)),
                                     f'dump_modify here format "{" ".join(["%.17g"] * 13)}"'])
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        found = run(folder, case, ranks=ranks)
        rows = read_dump(folder / "local.dump")[1][-1]
        assert len(rows) == found.vector("active") > 1
        assert rows[:, 6].max() == pytest.approx(found.vector("peak"), rel=1e-12)
        assert np.linalg.norm(rows[:, 2:5], axis=1) == pytest.approx(1.0, abs=1e-12)
        force = np.zeros((len(case.logs), 3))
        for id_a, id_b, *numbers in rows:
            normal, load, friction = np.array(numbers[:3]), numbers[4], np.array(numbers[5:8])
            force[int(id_a) - 1] += load * normal + friction
            if id_b > 0:
                force[int(id_b) - 1] -= load * normal + friction
            else:
                assert id_b in (-1.0, -2.0, -3.0)
        weight = np.outer(found.mass, [0.0, -9.81, 0.0])
        assert found.last[:, 10:13] == pytest.approx(force + weight, abs=1e-6 * np.abs(force).max())


def test_the_local_array_is_that_of_the_step_for_whoever_reads_it(tmp_path):
    """compute reduce in every step, with no dump in between: the sum over the one contact is the largest force of the step."""
    case = Case([Log((0.0, 0.0), (1.0, 0.0)), Log((0.2, 0.0))], "stiffness 1e7", 1e-4, "run 40", every=40,
                extra=["compute load all reduce sum f_hits[7]", "fix series all ave/time 1 1 1 c_load f_hits[4] file load.txt"])
    for ranks in (1, 2):
        run(tmp_path / str(ranks), case, ranks=ranks)
        load, peak = np.loadtxt(tmp_path / str(ranks) / "load.txt")[:, 1:].T
        assert len(set(peak)) > 20
        assert load == pytest.approx(peak, rel=1e-5)


PERTURBED = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
double exp(double x) {
  static double (*real)(double), factor = 1.0;
  if (!real) {
    const char* rank = getenv("OMPI_COMM_WORLD_RANK");
    if (rank && atoi(rank) > 0) factor = 1.0 + 1e-6;
    *(void**)&real = dlsym(RTLD_NEXT, "exp");
  }
  return factor * real(x);
}
"""


def test_ranks_that_compute_differently_agree(tmp_path, monkeypatch):
    """Another mathematical library on the second rank, as in a cluster of unlike machines: the motion is that of one rank, to the bit."""
    (tmp_path / "perturbed.c").write_text(PERTURBED)
    subprocess.run(["cc", "-shared", "-fPIC", "-fno-builtin", "perturbed.c", "-o", "perturbed.so", "-ldl"], cwd=tmp_path, check=True)
    # The sums of the engine's own output differ with the number of ranks; the frames do not.
    alone = run(tmp_path / "1", pile(steps=4000))
    assert alone.vector("impacts") > 10
    monkeypatch.setenv("LD_PRELOAD", str(tmp_path / "perturbed.so"))
    assert_same(run(tmp_path / "2", pile(steps=4000), ranks=2).last, alone.last, 0.0)


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
    ("stiffness 1e7 contact_damping high", "contact_damping: 'high' is no number"),
    ("stiffness 1e7 theta 0.4", "theta: the value lies in 0.5...1, not 0.4"),
    ("stiffness 1e7 friction 0.2 0.3 1e-5", "kinetic friction 0.3 must not exceed static friction 0.2"),
    ("stiffness 1e7 friction 0.3 0.2", "critical slip distance"),
    ("stiffness 1e7 frction 0.3", "'frction' is no keyword; there is stiffness, damping"),
    ("stiffness 1e7 method newton", "method: the solver is one of auto, energy, block, murty, pgs, not 'newton'"),
    ("stiffness 1e7 sweeps 0", "sweeps: the number must be >= 1, not 0"),
    ("stiffness 1e7 sweeps 1.5", "sweeps: a whole number from 1 to 100, not 1.5"),
    ("stiffness 1e7 inertia disc", "inertia: the shape is one of cylinder, sphere, not 'disc'"),
    ("stiffness 1e7 wall sphere s", "wall: the shape is one of plane, cylinder, mesh, not 'sphere'"),
    ("stiffness 1e7 wall plane floor y 0 lo", "wall floor: stiffness (N/m) is missing"),
    ("stiffness 1e7 wall plane floor y 0 up stiffness 1e7", "wall floor: the side is one of lo, hi, not 'up'"),
    ("stiffness 1e7 wall plane floor w 0 lo stiffness 1e7", "wall floor: the axis is one of x, y, z, not 'w'"),
    ("stiffness 1e7 wall cylinder drum z 0 0 -1 stiffness 1e7", "wall drum: the radius (m) must be > 0, not -1"),
    ("stiffness 1e7 wall plane a y 0 lo stiffness 1e7 omega 3", "wall a: omega is for cylinders"),
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
