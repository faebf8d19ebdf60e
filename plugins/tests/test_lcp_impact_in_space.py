"""fix lcp/impact with logs that have a length: against the cross-section and Python, conservation laws, ranks, restarts, mistakes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from rig import impact_decks
from rig.impact_decks import Case, Log, assert_same
from rig.liggghts_driver import read_dump
from scipy.optimize import brentq

from dembark import _physics
from dembark.physics import CapsuleSystem, Drum, ImpactSystem, Plane

SHELL = "wall cylinder shell z 0 0 0.65 stiffness 5e7 omega 2.0"
PLATES = "wall plane back z -0.9 lo stiffness 5e7 omega 2.0 0 0 wall plane front z 0.9 hi stiffness 5e7 omega 2.0 0 0"


def moments(logs: Sequence[Log]) -> NDArray[np.float64]:
    """Of solid logs, about the axis and across it (kg m^2)."""
    return np.array(_physics.capsule_inertia(*(np.array(x) for x in zip(*((g.mass, g.radius, g.length) for g in logs), strict=True))))


def cluster(count: int = 8, seed: int = 3) -> list[Log]:
    """Logs in any direction that close in on each other and turn."""
    random = np.random.default_rng(seed)
    logs = []
    for i in range(count):
        x = 1.2 * np.array([i % 2, i // 2 % 2, i // 4]) - 0.6 + random.uniform(-0.05, 0.05, 3)
        v, w, u = -2.0 * x + random.normal(0, 0.5, 3), random.normal(0, 3, 3), random.normal(size=3)
        logs.append(Log((float(x[0]), float(x[1])), tuple(v.tolist()), radius=random.uniform(0.06, 0.12), mass=random.uniform(10, 60),
                        z=float(x[2]), spin=tuple(w.tolist()), length=random.uniform(0, 0.8), axis=tuple(u.tolist())))
    return logs


def load(count: int = 18, seed: int = 4) -> list[Log]:
    """Logs in a closed drum of 1.8 m: tilted, of unequal length, and balls among them."""
    random = np.random.default_rng(seed)
    logs = []
    for i in range(count):
        u = random.normal((0, 0, 9), 1, 3)
        logs.append(Log((0.26 * (i % 3 - 1), 0.26 * (i // 3 % 3 - 1)), (random.uniform(-1, 1), -1.0, (i // 9 - 0.5) * random.uniform(1, 4)),
                        radius=random.uniform(0.08, 0.1), mass=random.uniform(20, 50), z=0.8 * (i // 9) - 0.4,
                        length=0.0 if i % 7 == 0 else random.uniform(0.2, 0.5), axis=tuple(u.tolist())))
    return logs


def in_drum(steps: int = 1500, *, words: str = "theta 0.5", **settings) -> Case:
    return Case(load(), f"stiffness 1e7 {words} contact_damping 500 friction 0.4 impacts impacts.txt logs logs.txt {SHELL} {PLATES}", 2e-4,
                f"run {steps}", gravity=9.81, **{"every": steps // 10, "box": (-1.0, 1.0, -1.0, 1.0, -1.5, 1.5), **settings})


def in_python(case: Case, **options) -> CapsuleSystem:
    logs = case.logs
    return CapsuleSystem([g.mass for g in logs], [g.radius for g in logs], [g.length for g in logs], [(*g.position, g.z) for g in logs],
                         [g.velocity for g in logs], axis=[g.axis for g in logs], spin=[g.spins for g in logs], stiffness=1e7,
                         gravity=(0, -case.gravity, 0), **options)


def assert_motion(found, motion, tolerance):
    for k, frame in enumerate(found.frames):
        np.testing.assert_allclose(frame[:, 1:4], motion.position[k], rtol=0, atol=tolerance)
        np.testing.assert_allclose(frame[:, 4:7], motion.velocity[k], rtol=0, atol=tolerance * np.abs(motion.velocity).max())
        np.testing.assert_allclose(frame[:, 7:10], motion.spin[k], rtol=0, atol=tolerance * np.abs(motion.spin).max())
        np.testing.assert_allclose(frame[:, 17:20], motion.axis[k], rtol=0, atol=tolerance)
        np.testing.assert_allclose(frame[:, 20:24], motion.orientation[k], rtol=0, atol=tolerance)


def test_parallel_logs_are_the_cross_section(run, tmp_path):
    """Without friction the discs of the same engine, from impact to impact; each contact has two points."""
    random = np.random.default_rng(3)
    logs = [Log((0.26 * (i % 3 - 1) + random.uniform(-0.004, 0.004), 0.26 * (i // 3 - 1)), (random.uniform(-1, 1), 0.0),
                radius=random.uniform(0.06, 0.12), mass=random.uniform(20, 60)) for i in range(9)]
    case = Case(logs, f"stiffness 1e7 contact_damping 500 {SHELL}", 2e-4, "run 2000", gravity=9.81, every=200)
    discs, capsules = run(tmp_path / "discs", case), run(tmp_path / "logs", replace(case, words=f"length 1.2 axis 0 0 -1 {case.words}"))
    assert discs.vector("impacts") > 10
    assert capsules.vector("impacts") == 2 * discs.vector("impacts")
    for one, two in zip(discs.frames, capsules.frames, strict=True):
        np.testing.assert_allclose(two[:, 1:4], one[:, 1:4], rtol=0, atol=1e-8)
    assert (capsules.last[:, 16] == 1.2).all()
    np.testing.assert_allclose(capsules.axis(), np.tile([0, 0, -1.0], (9, 1)), atol=1e-12)
    assert capsules.vector("dissipated") == pytest.approx(discs.vector("dissipated"), rel=1e-7)


def test_parallel_logs_with_friction_are_discs_of_their_inertia(run, tmp_path):
    logs = [Log((0.24 * (i % 3 - 1), 0.24 * (i // 3) - 0.3), (0.3 * i, -1.0), mass=30.0 + i, length=1.0, spin=2.0 * i) for i in range(6)]
    walls = "wall plane floor y -0.45 lo stiffness 4e7"
    case = Case(logs, f"stiffness 1e7 contact_damping 500 friction 0.4 sweeps 100 length 1.0 axis 0 0 1 {walls}", 2e-4, "run 1000",
                gravity=9.81, every=100)
    found = run(tmp_path, case)
    discs = ImpactSystem([g.mass for g in logs], 0.1, [g.position for g in logs], [g.velocity for g in logs], spin=[g.spin for g in logs],
                         inertia=moments(logs)[:, 0], stiffness=1e7, contact_damping=500.0, friction=0.4, friction_sweeps=300,
                         gravity=(0, -9.81), walls=[Plane(point=(0, -0.45), normal=(0, 1), stiffness=4e7)]).run(0.2, 2e-4, every=100)
    assert discs.report["impacts_begun"][-1] > 5
    for k, frame in enumerate(found.frames):
        np.testing.assert_allclose(frame[:, 1:3], discs.position[k], atol=1e-8)
        np.testing.assert_allclose(frame[:, 9], discs.spin[k], atol=1e-6)


def test_two_impacts_of_a_falling_log(run, tmp_path):
    """A tilted log falls on its lower end, and the other end follows: Python to 1e-8, the rigid body to the softness of the log."""
    mass, r, length, angle, half, stiffness = 40.0, 0.1, 1.5, 0.15, 0.75, 1e11
    across = moments([Log((0, 0), mass=mass, radius=r, length=length)])[0, 1]
    lever = half * math.cos(angle)
    reduced = 1 / (1 / mass + lever**2 / across)
    lowest = r + half * math.sin(angle)
    dt = 0.05 * math.sqrt(reduced / stiffness)
    v, w = -1 + 2 * reduced / mass, 2 * lever * reduced / across  # after the first impact, about -z
    second = brentq(lambda t: lowest + v * t + half * math.sin(angle - w * t) - r, 0.02, 0.5)
    arm = half * math.cos(angle - w * second)
    closing = w * arm - v
    reduced_2 = 1 / (1 / mass + arm**2 / across)
    steps = math.ceil((1e-5 + second + 1e-4) / dt)
    log = Log((0.0, lowest + 1e-5), (0.0, -1.0, 0.0), mass=mass, length=length, axis=(math.cos(angle), math.sin(angle), 0.0))
    # The wall of Python may be rigid, that of the engine has a stiffness.
    case = Case([log], f"stiffness {stiffness!r} theta 0.5 impacts impacts.txt logs logs.txt wall plane floor y 0 lo stiffness 1e15", dt,
                f"run {steps}", every=steps)
    found = run(tmp_path, case)
    python = CapsuleSystem(mass, r, length, [(*log.position, 0.0)], [log.velocity], axis=log.axis, stiffness=stiffness, theta=0.5,
                           walls=[Plane(point=(0, 0, 0), normal=(0, 1, 0), stiffness=1e15)])
    assert_motion(found, python.run(steps * dt, dt, every=steps), 1e-8)
    assert found.impacts()[:, 8] == pytest.approx([-lever, arm], abs=1e-3)
    assert found.impacts()[1, 6] == pytest.approx(closing, rel=1e-3)
    assert found.velocity()[0, 1] == pytest.approx(v + 2 * reduced_2 * closing / mass, abs=2e-3)
    assert found.spin()[0, 2] == pytest.approx(-w + 2 * arm * reduced_2 * closing / across, abs=4e-3)


@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_the_engine_and_python_agree(run, tmp_path, theta):
    """A load of tilted logs and balls in a turning drum with plates and friction."""
    case = in_drum(words=f"theta {theta!r}")
    found = run(tmp_path, case)
    walls = [Drum(radius=0.65, omega=2.0, stiffness=5e7), Plane(point=(0, 0, -0.9), normal=(0, 0, 1), stiffness=5e7, omega=2.0),
             Plane(point=(0, 0, 0.9), normal=(0, 0, -1), stiffness=5e7, omega=-2.0)]
    motion = in_python(case, theta=theta, contact_damping=500.0, friction=0.4, walls=walls).run(0.3, 2e-4, every=150)
    assert_motion(found, motion, 1e-8)
    assert len(motion.impacts) == len(found.impacts()) > 20 and {-1, -2, -3} <= {i.b for i in motion.impacts}
    assert found.vector("dissipated") == pytest.approx(motion.dissipated_energy[-1], rel=1e-8)
    assert found.vector("worst_certificate") <= 1e-10


def test_momenta_and_energy(run, tmp_path):
    """Of a cluster that flies apart again: momentum, angular momentum, and the energy with what friction, damping and scheme took."""
    logs = cluster()
    found = run(tmp_path, Case(logs, "stiffness 1e7 contact_damping 300 friction 0.3 logs logs.txt", 2e-4, "run 5000", every=5000,
                               box=(-9.0, 9.0, -9.0, 9.0, -9.0, 9.0)))
    assert found.vector("impacts") > 5 and found.vector("active") == 0
    mass, (axial, across) = found.mass, moments(logs).T
    sums = []
    for k in (0, -1):
        x, v, w, u = (found.frames[k][:, c : c + 3] for c in (1, 4, 7, 17))
        along = (w * u).sum(axis=1)
        own = across[:, None] * w + ((axial - across) * along)[:, None] * u
        energy = 0.5 * (mass @ (v**2).sum(axis=1) + across @ (w**2).sum(axis=1) + (axial - across) @ along**2)
        sums.append(np.array([*mass @ v, *(np.cross(x, mass[:, None] * v) + own).sum(axis=0), energy]))
    start, end = sums
    assert found.vector("dissipated") > 0.1 * start[6]
    np.testing.assert_allclose(end[:6], start[:6], rtol=0, atol=1e-12 * np.abs(start[:6]).max())
    assert end[6] + found.vector("dissipated") + found.vector("elastic") == pytest.approx(start[6], rel=1e-12)
    assert found.vector("worst_certificate") <= 1e-10


def test_a_free_log_turns_as_a_symmetric_top(run, tmp_path):
    """Whatever the step; spheres of the engine would keep their spin."""
    log = Log((0.0, 0.0), (0.0, 0.0, 0.0), spin=(3.0, -2.0, 20.0), length=1.5, axis=(0.0, 0.0, 1.0))
    found = run(tmp_path, Case([log], "stiffness 1e7 logs logs.txt", 1e-2, "run 200", every=20))
    axial, across = moments([log])[0]
    momentum = np.array([across * 3.0, -across * 2.0, axial * 20.0])
    direction = momentum / np.linalg.norm(momentum)
    along, cross = direction[2] * direction, np.cross(direction, [0, 0, 1])
    for k, step in enumerate(found.steps):
        angle = np.linalg.norm(momentum) / across * 1e-2 * step
        axis = along + math.cos(angle) * (np.array([0, 0, 1]) - along) + math.sin(angle) * cross
        assert found.axis(k)[0] == pytest.approx(axis, abs=1e-11)
        w, u = found.spin(k)[0], found.axis(k)[0]
        assert across * w + (axial - across) * (w @ u) * u == pytest.approx(momentum, rel=1e-11)


def test_ranks_agree(engine, run, tmp_path):
    """Logs change their rank and hit logs of the other."""
    one, two = (run(tmp_path / str(ranks), in_drum(), ranks=ranks) for ranks in (1, 2))
    assert one.vector("impacts") > 20
    assert (np.sign(one.last[:, 1]) != np.sign(one.frames[0][:, 1])).any()
    assert_same(one.last, two.last, 0.0)
    assert (one.last == two.last).all()
    assert two.vectors[-1] == pytest.approx(one.vectors[-1], rel=1e-9, abs=1e-12)
    assert (tmp_path / "1" / "impacts.txt").read_bytes() == (tmp_path / "2" / "impacts.txt").read_bytes()


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_a_restart_goes_on_bit_for_bit(run, tmp_path, ranks):
    """In the middle of impacts, and without the list of logs as it was: lengths and attitudes are in the restart file."""
    through = run(tmp_path / "through", in_drum(), ranks=ranks)
    folder = tmp_path / "stopped"
    run(folder, in_drum(extra=["restart 750 half.restart last.restart"]), ranks=ranks, run="run 1100", dump="first.dump")
    case = in_drum()
    case.logs = [replace(log, length=3.0, axis=(1.0, 0.0, 0.0)) for log in case.logs]
    again = run(folder, case, ranks=ranks, head="read_restart half.restart", run="run 750", dump="again.dump")
    assert again.steps[0] == 750
    for k in range(len(again.steps)):
        assert (again.frames[k] == through.frames[5 + k]).all()
    assert (again.vectors[0] == through.vectors[5]).all() and (again.vectors[-1] == through.vectors[-1]).all()
    assert (folder / "impacts.txt").read_bytes() == (tmp_path / "through" / "impacts.txt").read_bytes()


def test_two_runs_are_one(run, tmp_path):
    through = run(tmp_path / "through", in_drum(600))
    parts = run(tmp_path / "parts", in_drum(600, every=600), run="run 250\nrun 0\nrun 350")
    assert (parts.last == through.last).all() and (parts.vectors[-1] == through.vectors[-1]).all()


def test_a_spin_that_was_set_between_two_runs_counts(engine, run, tmp_path):
    log = Log((0.0, 0.0), (0.0, 0.0, 0.0), spin=(0.0, 0.0, 1.0), length=1.0, axis=(1.0, 0.0, 0.0))
    change = f"set atom 1 {impact_decks.SPIN[engine].format(0.0, 0.0, -3.0)}"
    found = run(tmp_path, Case([log], "stiffness 1e7 logs logs.txt", 1e-3, f"run 500\n{change}\nrun 500", every=500))
    assert found.axis(1)[0] == pytest.approx([math.cos(0.5), math.sin(0.5), 0.0], abs=1e-12)
    assert found.spin()[0] == pytest.approx([0.0, 0.0, -3.0], abs=1e-12)
    assert found.axis()[0] == pytest.approx([math.cos(1.0), -math.sin(1.0), 0.0], abs=1e-12)


def test_a_torque_of_another_fix_turns_a_log_with_its_own_inertia(lammps_is_there, tmp_path):
    """LIGGGHTS has no fix that adds a torque to each atom."""
    log = Log((0.0, 0.0), (0.0, 0.0, 0.0), length=1.0, axis=(1.0, 0.0, 0.0), spin=(0.0, 0.0, 1.0))
    case = Case([log], "stiffness 1e7 logs logs.txt", 1e-3, "run 100", every=100, before="fix drag all viscous/sphere 20")
    found = impact_decks.run(tmp_path, case, engine="lammps")
    assert found.spin()[0, 2] == pytest.approx(math.exp(-20 * 0.1 / moments([log])[0, 1]), rel=1e-2)


def test_across_a_periodic_boundary(run, tmp_path):
    """The end of a log reaches through the boundary; the same impact in the middle is the same."""
    words, box = "stiffness 1e7 logs logs.txt impacts impacts.txt", (-2.0, 2.0, -1.0, 1.0, -1.0, 1.0)

    def case(shift, boundary):
        place = [((x + shift + 2.0) % 4.0) - 2.0 for x in (-0.72, 0.72)]
        logs = [Log((place[0], 0.0), (1.0, 0.0, 0.0), length=1.2, axis=(1.0, 0.0, 0.0)),
                Log((place[1], 0.05), (0.0, 0.0, 0.0), length=1.2, axis=(1.0, 0.0, 0.0))]
        return Case(logs, words, 1e-4, "run 600", every=600, box=box, boundary=boundary)

    middle, across = run(tmp_path / "middle", case(0.0, "f f f")), run(tmp_path / "across", case(2.0, "p f f"))
    assert middle.vector("impacts") == across.vector("impacts") == 1
    np.testing.assert_allclose(across.last[:, 4:10], middle.last[:, 4:10], atol=1e-9)
    assert np.abs(middle.spin()).max() > 0.1


def test_a_box_that_is_too_short_for_the_logs_is_refused(engine, tmp_path):
    logs = [Log((0.0, 0.0), length=1.2, axis=(1.0, 0.0, 0.0))]
    case = Case(logs, "stiffness 1e7 logs logs.txt", 1e-4, "run 1", box=(-0.65, 0.65, -1.0, 1.0, -1.0, 1.0), boundary="p f f")
    done = impact_decks.start(tmp_path, case, engine=engine)
    assert done.code != 0 and "the periodic box is too short along x: 1.3" in done.error and "it needs 2.9" in done.error


def test_the_local_array_has_both_points_of_a_side(run, tmp_path):
    log = Log((0.0, 0.1 - 1e-4), (0.0, 0.0, 0.0), length=1.0, axis=(0.0, 0.0, 1.0))
    run(tmp_path, Case([log], "stiffness 1e7 logs logs.txt wall plane floor y 0 lo stiffness 4e7", 1e-5, "run 1", gravity=9.81, every=1,
                       local="local.dump", box=(-1.0, 1.0, -1.0, 1.0, -1.0, 1.0)))
    rows = read_dump(tmp_path / "local.dump")[1][-1]
    assert rows[:, :2].tolist() == [[1, -1], [1, -1]]
    assert sorted(rows[:, 12]) == pytest.approx([-0.5, 0.5], abs=1e-9)


def test_a_step_that_resolves_no_impact_of_an_end_is_warned_of(run, tmp_path):
    """An end feels 1 / m + (L / 2)^2 / I, so the limit is less than half of that of a disc."""
    log = Log((0.0, 0.5), (0.0, 0.0, 0.0), mass=20.0, length=1.0)
    across = moments([log])[0, 1]
    limit = math.sqrt(1.0 / (1 / 20.0 + 0.25 / across) / 8e6)
    words = "stiffness 1e7 logs logs.txt wall plane floor y 0 lo stiffness 4e7"
    found = [run(tmp_path / str(part), Case([log], words, part * limit, "run 1")).output for part in (0.99, 1.01)]
    assert ["impacts are resolved up to 1 / omega" in text for text in found] == [False, True]


FINE = [Log((0.0, 0.5), length=1.0), Log((0.5, 0.5), length=1.0)]


@pytest.mark.parametrize(("words", "settings", "line"), [
    ("length -1 axis 0 0 1", {}, "length: the value (m) of type 1 must be >= 0, not -1"),
    ("length 1 2 axis 0 0 1", {}, "length: one value (m) for each of the 1 atom types, not 2"),
    ("length 1", {}, "length: axis is missing, the direction X Y Z of the logs at the start"),
    ("axis 0 0 1", {}, "axis: length is missing, one value (m) for each atom type"),
    ("length 1 axis 0 0 0", {}, "axis: the direction must not be zero"),
    ("length 1 axis 0 1", {}, "axis: the direction X Y Z is missing"),
    ("length 1 axis 0 0 1 inertia cylinder", {}, "inertia is that of logs in cross-section; with length or logs"),
    ("length 1 axis 0 0 1", {"dimension": 2, "boundary": "f f p"}, "logs with a length move in space; use dimension 3"),
    ("logs none.txt", {}, "logs: file none.txt cannot be read"),
    ("logs logs.txt", {"logs": [FINE[0], Log((0.5, 0.5))]}, "logs: file logs.txt has no line for atom 2"),
    ("logs logs.txt", {"logs": [FINE[0], replace(FINE[1], length=-1.0)]}, "logs.txt, line 3: the length (m) must be >= 0, not -1"),
    ("logs logs.txt", {"logs": [FINE[0], replace(FINE[1], axis=(0, 0, 0))]}, "line 3: the direction of the log must not be zero"),
    ("logs logs.txt", {"logs": [FINE[0], replace(FINE[1], length="long")]}, "line 3: it must have five numbers"),
    ("length 1 axis 1 0 0", {}, "atom 1 and atom 2 overlap at the start by 2 of the radius; at most 0.05 is allowed"),
    ("length 1 axis 0 1 0 wall plane floor y 0 lo stiffness 1e7", {}, "atom 1 and wall floor overlap at the start by 1 of the radius"),
    ("length 1 axis 0 0 1 wall plane floor y 0 lo stiffness 1e7 omega 2", {}, "wall floor: omega: the first coordinate (m) of the axis"),
])
def test_one_clear_line(engine, tmp_path, words, settings, line):
    case = replace(Case(FINE, f"stiffness 1e7 {words}", 1e-5, "run 1"), **settings)
    for ranks in (1, 2) if "logs" in words else (1,):
        done = impact_decks.start(tmp_path / str(ranks), case, engine=engine, ranks=ranks)
        assert done.code != 0 and line in done.error, done.output[-1500:]


def test_a_mesh_is_refused(liggghts_is_there, tmp_path):
    case = Case(FINE, "stiffness 1e7 length 1 axis 0 0 1 wall mesh shell stl stiffness 1e7", 1e-5, "run 1")
    done = impact_decks.start(tmp_path, case)
    assert "wall shell: a mesh is for logs in cross-section; with length or logs use planes and cylinders" in done.error


@pytest.mark.parametrize("lengths", [True, False])
def test_a_restart_file_of_the_other_model_is_refused(engine, run, tmp_path, lengths):
    words = ["stiffness 1e7", "stiffness 1e7 length 1 axis 0 0 1"]
    run(tmp_path, Case(FINE, words[lengths], 1e-5, "run 1\nwrite_restart here.restart"))
    done = impact_decks.start(tmp_path, Case(FINE, words[not lengths], 1e-5, "run 1"), engine=engine, head="read_restart here.restart")
    says = ("a", "none") if lengths else ("no", "one")
    assert f"the logs of the restart file have {says[0]} length, those of the command {says[1]}" in done.error
