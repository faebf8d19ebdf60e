"""fix lcp/impact in the engines that have it: ranks, restarts, periodic boxes, output; and what Python computes."""

import math
import subprocess
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rig import impact_decks
from rig.impact_decks import Case, Log, assert_same, pile
from rig.liggghts_driver import read_dump

from dembark.physics import Drum, FinnieRabinowicz, ImpactSystem, Plane

# Few steps: ranks that wait for each other take long on a busy machine.
FALLING = replace(pile(steps=1750, every=125, local="local.dump"), time_step=4e-5)


@pytest.fixture(scope="module")
def piles(tmp_path_factory):
    """The same falling logs on one rank and on two, in an engine."""
    @cache
    def found(engine):
        folder = tmp_path_factory.mktemp("piles")
        return [impact_decks.run(folder / str(ranks), FALLING, engine=engine, ranks=ranks) for ranks in (1, 2)]

    return found


def test_ranks_agree(engine, piles):
    """Impacts between logs of different ranks and logs that change their rank."""
    one, two = piles(engine)
    assert one.vector("impacts") > 10
    assert_same(one.last, two.last, 1e-9)
    assert two.vectors[-1] == pytest.approx(one.vectors[-1], rel=1e-9, abs=1e-12)
    assert two.impacts() == pytest.approx(one.impacts(), rel=1e-8)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_a_restart_goes_on_bit_for_bit(run, tmp_path, ranks):
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


def test_two_runs_are_one(run, tmp_path):
    """A second `run` takes the forces of the first one's last step; a restart file written between the runs holds the same."""
    through = run(tmp_path / "through", pile(steps=1200))
    parts = run(tmp_path / "parts", pile(steps=1200, every=600), run="run 500\nrun 0\nwrite_restart here.restart\nrun 700")
    assert_same(parts.last, through.last, 0.0)
    assert (parts.vectors[-1] == through.vectors[-1]).all()
    after = run(tmp_path / "parts", pile(steps=1200), head="read_restart here.restart", run="run 700", dump="after.dump")
    assert_same(after.last, through.last, 0.0)


def test_logs_that_were_moved_get_new_forces(run, tmp_path):
    """What a user changes between two runs counts."""
    case = Case([Log((0.0, 0.0), (1.0, 0.0)), Log((0.2, 0.0))], "stiffness 1e7", 1e-5,
                "run 200\nset atom 1 x -0.5\nset atom 1 vx 0\nset atom 2 vx 0\nrun 10", every=10)
    found = run(tmp_path, case)
    assert found.vector("active") == 0
    assert np.abs(found.last[:, 10:13]).max() == 0.0


@pytest.mark.parametrize(("change", "mass", "gravity"), [("", 50.0, 9.81), ("unfix weight", 50.0, 0.0), ("set atom 1 mass 80", 80.0, 9.81)])
def test_forces_of_a_second_run_are_those_of_the_present_masses_and_forces(run, tmp_path, change, mass, gravity):
    """At rest on a floor: N of equation (2) for the set-up's half kick, with what is true now and not what was true a step before."""
    s, step = 1e7, 5e-3
    overlap = 50.0 * 9.81 * 2.0 / s
    case = Case([Log((0.0, 0.1 - overlap))], f"stiffness {s!r} wall plane floor y 0 lo stiffness {s!r}", step,
                f"run 20\n{change}\nrun 0", gravity=9.81, every=20)
    response = 0.5 * step**2
    assert run(tmp_path, case).vector("peak") == pytest.approx((overlap + response * gravity) / (2.0 / s + response / mass), rel=1e-9)


IN_SPACE = " length 0.5 axis 0 0 1"


@pytest.mark.parametrize("space", ["", IN_SPACE])
@pytest.mark.parametrize("hold", ["", "fix hold one freeze"])
def test_a_log_that_follows_no_forces_is_held(run, tmp_path, hold, space):
    """A log bounces off another one of infinite mass: v sqrt(m k) with k = s/2, in space in two halves; nothing is lost."""
    sides = 2 if space else 1
    motion = "nve/sphere" if hold else "nve/sphere\nunfix motion\nfix motion two nve/sphere"
    case = Case([Log((0.0, 0.0)), Log((0.0, 0.2002), (0.0, -1.0))], f"stiffness 1e7 theta 0.5{space}", 1e-5, "run 1500",
                before=f"group one id 1\ngroup two id 2\n{hold}", motion=motion, every=1500)
    found = run(tmp_path, case)
    assert found.last[0, 1:7] == pytest.approx(0.0, abs=1e-12)
    assert found.velocity()[1] == pytest.approx([0.0, 1.0, 0.0], abs=2e-3)
    assert found.vector("peak_so_far") == pytest.approx(math.sqrt(50.0 * 0.5e7) / sides, rel=1e-3)
    assert abs(found.vector("dissipated")) < 0.05 and found.vector("impacts") == sides


@pytest.mark.parametrize("space", ["", IN_SPACE])
def test_a_log_that_is_driven_pushes_as_a_wall(run, tmp_path, space):
    """An elastic impact: the free log leaves with twice the speed of the driven one."""
    case = Case([Log((0.0, 0.0)), Log((0.2002, 0.0))], f"stiffness 1e7 theta 0.5{space}", 1e-5, "run 2000", every=2000,
                before="group one id 1\ngroup two id 2\nfix drive one move linear 0.5 0 0 units box",
                motion="nve/sphere\nunfix motion\nfix motion two nve/sphere")
    found = run(tmp_path, case)
    assert found.velocity()[:, 0] == pytest.approx([0.5, 1.0], abs=2e-3)
    assert found.last[0, 1] == pytest.approx(0.01, rel=1e-9)


@pytest.mark.parametrize(("change", "words"), [
    ({"motion": "nve"}, ("fix motion (nve) moves logs", "fix nve/sphere moves those that follow their forces")),
    ({"boundary": "p f f", "extra": ["fix squeeze all deform 1 x erate -0.1"]}, ("constant size and shape", "fix squeeze (deform)")),
    ({"run": "run 1\ngroup gone id 2\ndelete_atoms group gone compress no\ncreate_atoms 1 single 0.5 0 0 units box\nrun 1"},
     ("atom 2 has the number of one that was deleted", "write 'run 0'")),
    ({"run": "run 1\ngroup gone id 1\ndelete_atoms group gone"}, ("delete_atoms", "other numbers", "add 'compress no'")),
])
def test_what_would_be_wrong_without_a_word_is_refused(engine, tmp_path, change, words):
    case = replace(Case([Log((0.0, 0.0)), Log((0.5, 0.0))], "stiffness 1e7", 1e-5, "run 1"), **change)
    done = impact_decks.start(tmp_path, case, engine=engine)
    assert done.code != 0 and all(word in done.error for word in words), done.error or done.output[-2000:]


def test_deleted_logs_leave_the_others_as_they_are(run, tmp_path):
    """Those that stay keep their attitudes; before the first run numbers may change."""
    logs = [Log((-0.9, 0.0)), Log((0.0, 0.0), spin=(3.0, 0.0, 0.0)), Log((0.9, 0.0))]
    case = Case(logs, f"stiffness 1e7{IN_SPACE}", 1e-4,
                "group first id 3\ndelete_atoms group first\nrun 500\ngroup second id 1\n"
                "delete_atoms group second compress no\nrun 500", every=500, before="")
    found = run(tmp_path, case)
    assert len(found.last) == 1 and found.axis()[0] == pytest.approx([0.0, -math.sin(0.3), math.cos(0.3)], abs=1e-6)


def test_another_time_step_goes_on(run, tmp_path):
    case = Case([Log((0.0, 0.0), (1.0, 0.0)), Log((0.2 + 1e-5, 0.0))], "stiffness 1e7 theta 0.5 impacts impacts.txt", 1e-6,
                "run 2000\ntimestep 2e-6\nrun 3000", every=1000)
    found = run(tmp_path, case)
    assert found.velocity()[:, 0] == pytest.approx([0.0, 1.0], abs=2e-3)
    (impact,) = found.impacts()
    time, duration = impact[2:4]
    assert time == pytest.approx(1e-5, abs=2e-6)
    assert duration == pytest.approx(math.pi / math.sqrt(0.5 * 1e7 / 25.0), rel=5e-3)


FLOOR = "stiffness 1e7 theta 0.5 wall plane floor y 0 lo stiffness 4e7"


@pytest.mark.parametrize(("logs", "line"), [
    ([Log((0.0, 0.5)), Log((0.19, 0.5))], "atom 1 and atom 2 overlap at the start by 0.1 of the radius; at most 0.05 is allowed"),
    ([Log((0.0, 0.09)), Log((0.5, 0.5))], "atom 1 and wall floor overlap at the start by 0.1 of the radius; at most 0.05 is allowed")])
def test_overlaps_at_the_start_are_refused(engine, tmp_path, logs, line):
    for ranks in (1, 2):
        done = impact_decks.start(tmp_path / str(ranks), Case(logs, FLOOR, 1e-5, "run 1"), engine=engine, ranks=ranks)
        assert done.code != 0 and line in done.error


def test_a_run_that_goes_on_may_overlap(run, tmp_path):
    """A soft floor gives way by a tenth of the radius; the next run and one from a restart file begin with that."""
    words = "stiffness 1e5 wall plane floor y 0 lo stiffness 1e5"
    case = Case([Log((0.0, 0.1), (0.0, -1.0))], words, 1e-5, "run 1500\nwrite_restart deep.restart\nrun 10", every=1500)
    through = run(tmp_path, case)
    assert through.last[0, 2] < 0.095
    after = run(tmp_path, case, head="read_restart deep.restart", run="run 10", dump="after.dump")
    assert_same(after.last, through.last, 0.0)


def test_a_step_that_resolves_no_impact_is_warned_of(run, tmp_path):
    """The lightest log on the stiff floor has omega = sqrt(8e6 / 20): the limit of omega tau = 1 is 1.58 ms. One line for each step."""
    logs = [Log((0.0, 0.5), mass=20.0), Log((0.5, 0.5), mass=60.0)]
    long = run(tmp_path / "long", Case(logs, FLOOR, 1.6e-3, "run 1\nrun 1\ntimestep 1.5e-3\nrun 1\ntimestep 3e-3\nrun 1"))
    lines = [line for line in long.output.splitlines() if "WARNING" in line and "impacts are resolved up to 1 / omega, 0.00158 s" in line]
    assert ["is 1.01 / omega" in line for line in lines] == [True, False] and "is 1.9 / omega" in lines[1]


def test_periodic_box(engine, run, tmp_path):
    """Two logs meet across the boundary; the same impact in the middle of the box is the same."""
    words = "stiffness 1e7 impacts impacts.txt"
    box = (-1.0, 1.0, -1.0, 1.0, -0.5, 0.5)
    middle = Case([Log((-0.105, 0.0), (1.0, 0.0)), Log((0.105, 0.0))], words, 1e-5, "run 2500", every=2500, box=box)
    across = Case([Log((0.895, 0.0), (1.0, 0.0)), Log((-0.895, 0.0))], words, 1e-5, "run 2500", every=2500, box=box, boundary="p f f")
    expected, found = run(tmp_path / "middle", middle), run(tmp_path / "across", across)
    assert expected.vector("impacts") == found.vector("impacts") == 1
    assert found.velocity() == pytest.approx(expected.velocity(), abs=1e-9)
    two = run(tmp_path / "two", across, ranks=2)
    assert two.velocity() == pytest.approx(found.velocity(), abs=1e-12)
    short = Case([Log((-0.15, 0.0)), Log((0.15, 0.0))], words, 1e-5, "run 1", box=(-0.2, 0.2, -1.0, 1.0, -0.5, 0.5), boundary="p f f")
    done = impact_decks.start(tmp_path / "short", short, engine=engine)
    assert done.code != 0 and "periodic box is too short along x" in done.error


def test_local_array_and_vector(engine, piles):
    """dump local: one row for each contact with a force; their sum is the force on the logs."""
    for found in piles(engine):
        frame = max(range(len(found.frames)), key=lambda k: found.vector("active", k))
        rows = read_dump(found.folder / "local.dump")[1][frame]
        assert len(rows) == found.vector("active", frame) > 1
        assert rows[:, 6].max() == pytest.approx(found.vector("peak", frame), rel=1e-12)
        assert np.linalg.norm(rows[:, 2:5], axis=1) == pytest.approx(1.0, abs=1e-12)
        force = np.zeros((len(found.mass), 3))
        for id_a, id_b, *numbers in rows:
            normal, load, friction = np.array(numbers[:3]), numbers[4], np.array(numbers[5:8])
            force[int(id_a) - 1] += load * normal + friction
            if id_b > 0:
                force[int(id_b) - 1] -= load * normal + friction
            else:
                assert id_b in (-1.0, -2.0, -3.0)
        weight = np.outer(found.mass, [0.0, -9.81, 0.0])
        assert found.frames[frame][:, 10:13] == pytest.approx(force + weight, abs=1e-6 * np.abs(force).max())


def test_the_local_array_is_that_of_the_step_for_whoever_reads_it(engine, run, tmp_path):
    """compute reduce in every step, with no dump in between: the sum over the one contact is the largest force of the step."""
    case = Case([Log((0.0, 0.0), (1.0, 0.0)), Log((0.2, 0.0))], "stiffness 1e7", 1e-4, "run 40", every=40,
                extra=[f"compute load all reduce sum f_hits[7]{' inputs local' if engine == 'lammps' else ''}",
                       "fix series all ave/time 1 1 1 c_load f_hits[4] file load.txt"])
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
    const char *open_mpi = getenv("OMPI_COMM_WORLD_RANK"), *rank = open_mpi ? open_mpi : getenv("PMI_RANK");
    if (rank && atoi(rank) > 0) factor = 1.0 + 1e-6;
    *(void**)&real = dlsym(RTLD_NEXT, "exp");
  }
  return factor * real(x);
}
"""


def test_ranks_that_compute_differently_agree(engine, piles, run, tmp_path, monkeypatch):
    """Another mathematical library on the second rank, as in a cluster of unlike machines: the motion is that of one rank, to the bit."""
    (tmp_path / "perturbed.c").write_text(PERTURBED)
    subprocess.run(["cc", "-shared", "-fPIC", "-fno-builtin", "perturbed.c", "-o", "perturbed.so", "-ldl"], cwd=tmp_path, check=True)
    # The sums of the engine's own output differ with the number of ranks; the frames do not.
    monkeypatch.setenv("LD_PRELOAD", str(tmp_path / "perturbed.so"))
    assert_same(run(tmp_path, FALLING, ranks=2).last, piles(engine)[0].last, 0.0)


@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_the_engine_and_python_agree(run, tmp_path, theta):
    """A small pile of unequal logs in a turning drum that a plane divides: friction, damping, more than ten impacts."""
    rows = [(0.11 + 0.02 * math.sin(37.0 * i), -0.45 + 0.3 * (i % 4) + 0.01 * math.sin(91.0 * i), -0.55 + 0.32 * (i // 4))
            for i in range(8)]
    logs = [Log((x, y), (2.0 * math.sin(53.0 * i), -2.0), radius=r, mass=2500.0 * r * r, spin=2.0 * math.sin(17.0 * i))
            for i, (r, x, y) in enumerate(rows)]
    step, steps, every = 2e-5, 7500, 1250
    case = Case(logs, f"stiffness 1e7 theta {theta!r} contact_damping 1500 friction 0.4 0.3 1e-4 impacts impacts.txt "
                      "wall plane side x 0.75 hi stiffness 4e7 friction 0.2 "
                      "wall cylinder drum z 0 0 0.95 stiffness 5e7 friction 0.5 omega 1.5",
                step, f"run {steps}", gravity=9.81, every=every)
    found = run(tmp_path, case)
    law = FinnieRabinowicz(static_friction=0.4, kinetic_friction=0.3, critical_slip_distance=1e-4)
    walls = [Plane(point=(0.75, 0.0), normal=(-1.0, 0.0), stiffness=4e7, friction=0.2),
             Drum(radius=0.95, omega=1.5, stiffness=5e7, friction=0.5)]
    system = ImpactSystem([log.mass for log in logs], [log.radius for log in logs], [log.position for log in logs],
                          [log.velocity for log in logs], spin=[log.spin for log in logs], stiffness=1e7, gravity=(0.0, -9.81),
                          friction=law,
                          walls=walls, theta=theta, contact_damping=1500.0)
    motion = system.run(steps * step, step, every=every)
    assert len(motion.impacts) > 10
    for k, frame in enumerate(found.frames):
        assert frame[:, 1:3] == pytest.approx(motion.position[k], abs=1e-9)
        assert frame[:, 4:6] == pytest.approx(motion.velocity[k], abs=1e-9 * np.abs(motion.velocity[k]).max())
        assert frame[:, 9] == pytest.approx(motion.spin[k], abs=1e-9 * np.abs(motion.spin[k]).max())
    assert len(found.impacts()) == len(motion.impacts)
    assert found.vector("dissipated") == pytest.approx(motion.dissipated_energy[-1], rel=1e-9)
    assert found.vector("impacts") == motion.report["impacts_begun"][-1]
