"""fix wall/motion: walls are where they are prescribed to be, contacts see their velocity, and forces, momenta and energies balance."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig import late_motion, vessel
from rig.energy_account import FIX, THERMO, Account
from rig.liggghts_driver import Run, head, models, properties, read_dump, run_deck
from rig.scenarios import Material
from rig.vessel import STEP, rectangle
from rig.wall_balance import ELASTIC, Told, assert_begins_where_it_stands, assert_walls_move_the_grains
from rig.walls import stl

DRY = Material(static_friction=0.5, kinetic_friction=0.4, restitution=0.6, youngs_modulus=vessel.MODULUS)
SHAKE = "harmonic amplitude 1e-3 0 2e-3 frequency 50 ramp 2"


def deck(folder: Path, motion: str, run: str, *, grains=None, material=DRY, gravity=(0.0, 0.0, -9.81), step=STEP, triangles=None,
         every=10, more="", held=False, create=None, boundary="f f f", half=vessel.MARGIN):
    """Grains in the box, which moves; `held`: the grains do not."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "vessel.stl").write_text(stl(vessel.box() if triangles is None else triangles))
    lines = []
    for n, (place, radius, speed) in enumerate(vessel.grains() if grains is None else grains, start=1):
        lines.append("create_atoms 1 single " + " ".join(map(repr, place)) + " units box")
        lines.append(f"set atom {n} diameter {2 * radius!r} density {vessel.DENSITY!r} vx {speed[0]!r} vy {speed[1]!r} vz {speed[2]!r}")
    strength = math.sqrt(sum(g * g for g in gravity))
    low, high = -half, half + vessel.WIDTH
    start = f"region domain block {low} {high} {low} {high} {low} {high} units box\ncreate_box 2 domain\n" + "\n".join(lines)
    weight = f"fix weight all gravity {strength!r} vector " + " ".join(repr(g / strength) for g in gravity) if strength else ""
    return f"""\
{head(boundary=boundary)}
{start if create is None else create}
neighbor 0.002 bin
neigh_modify delay 0
timestep {step!r}
{properties(material)}
pair_style gran {models(material)}
pair_coeff * *
fix stl all mesh/surface file vessel.stl type 2
fix move all wall/motion mesh stl {motion}
fix wall all wall/gran {models(material, wall='mesh n_meshes 1 meshes stl store_force yes')}
{weight}
{"fix motion all nve/noforce" if held else "fix motion all nve/sphere"}
{more}
dump grains all custom {every} grains.dump id x y z vx vy vz fx fy fz radius
dump_modify grains sort id format "%d{" %.17g" * 10}"
{run}
"""


def history(done: Run) -> np.ndarray:
    """Rows of step and the global vector of the fix."""
    assert done.code == 0, done.error or done.output[-2000:]
    return np.loadtxt(done.folder / "wall.txt")


def rows(every: int) -> str:
    """A table of the fix's vector."""
    given = "".join(f"variable w{k} equal f_move[{k}]\n" for k in range(1, 24))
    shown = " ".join(f"${{w{k}}}" for k in range(1, 24))
    return f'thermo 1000\nvariable n equal step\n{given}fix out all print {every} "${{n}} {shown}" file wall.txt screen no title "#"\n'


def frames(folder: Path) -> np.ndarray:
    """(frame, grain, column) of the dump."""
    return np.array(read_dump(folder / "grains.dump")[1])


def contact_force(folder: Path, gravity) -> np.ndarray:
    """Forces on the grains but their weight."""
    table = frames(folder)
    mass = vessel.DENSITY * 4.0 / 3.0 * math.pi * table[..., 10] ** 3
    return table[..., 7:10] - mass[..., np.newaxis] * np.array(gravity)


def test_wall_is_where_it_is_prescribed_to_be(tmp_path):
    """The place of the mesh, from the points at which a held grain touches it, after 100 periods."""
    amplitude, frequency, step = 1e-3, 50.0, 1e-4
    grains = [((0.01, 0.01, 0.0005), 0.004, (0, 0, 0))]
    local = ("compute touch all wall/gran/local pos vel\ndump touch all local 1000 touch.dump c_touch[1] c_touch[2] c_touch[3] c_touch[9]\n"
             'dump_modify touch format "%.17g %.17g %.17g %.17g"')
    done = run_deck(tmp_path, deck(tmp_path, f"harmonic amplitude 0 0 {amplitude} frequency {frequency}", "run 21000", grains=grains,
                                   step=step, held=True, more=local, every=21000, gravity=(0, 0, 0)))
    assert done.code == 0, done.error or done.output[-2000:]
    steps, tables = read_dump(tmp_path / "touch.dump")
    late = [(n * step, table[0]) for n, table in zip(steps, tables, strict=True) if n * step >= 10 / frequency]
    assert len(late) >= 20 and late[-1][0] * frequency > 100.0
    for t, row in late:
        assert abs(row[2] - amplitude * math.sin(2 * math.pi * frequency * t)) < 1e-9 * amplitude


@pytest.mark.parametrize("spin", [-40.0])
def test_contact_velocity_is_that_of_a_turning_moving_strip(tmp_path, spin):
    """v + w x r at the place of contact, whatever the triangles."""
    motion = f"rotation point 0.004 0.006 0 axis 0 0 1 rate {spin} uniform velocity 0.3 -0.2 0"
    grains = [((0.012, 0.011, 0.0048), 0.005, (0, 0, 0))]
    columns = " ".join(f"c_touch[{k}]" for k in (1, 2, 3, 7, 8, 9))
    local = (f"compute touch all wall/gran/local pos vel\ndump touch all local 25 touch.dump {columns}\n"
             f'dump_modify touch format "{" ".join(["%.17g"] * 6)}"')
    strip = {parts: rectangle((-0.03, -0.03, 0), (0.07, 0, 0), (0, 0.07, 0), parts) for parts in (1, 7)}
    forces = []
    for parts, triangles in strip.items():
        folder = tmp_path / str(parts)
        text = deck(folder, motion, "run 500", grains=grains, held=True, more=local, triangles=triangles, gravity=(0, 0, 0), every=25)
        done = run_deck(folder, text)
        assert done.code == 0, done.error or done.output[-2000:]
        steps, tables = read_dump(folder / "touch.dump")
        for n, table in zip(steps, tables, strict=True):
            t, row = n * STEP, table[0]
            centre = np.array([0.004 + 0.3 * t, 0.006 - 0.2 * t, 0.0])
            expected = np.array([0.3, -0.2, 0.0]) + np.cross([0.0, 0.0, spin], row[:3] - centre)
            assert np.abs(row[3:] - expected).max() < 1e-12 * np.abs(expected).max(), n
        forces.append(frames(folder)[:, 0, 7:10])
    one, many = forces
    assert np.linalg.norm(one[1:, :2], axis=1).min() > 0.0
    assert np.abs(many - one).max() < 1e-9 * np.abs(one).max()


@pytest.mark.parametrize("accelerated", [False, True])
def test_moving_vessel_is_one_at_rest_in_its_frame(tmp_path, accelerated):
    """At constant speed nothing changes, at constant acceleration gravity is tilted: the same forces over 1000 steps."""
    motion, grains, tilted = vessel.moving_and_resting(accelerated)
    gravity = (0.0, 0.0, -9.81)
    done = run_deck(tmp_path / "moves", deck(tmp_path / "moves", motion, "run 1000", grains=grains, gravity=gravity))
    rests = run_deck(tmp_path / "rests", deck(tmp_path / "rests", "uniform velocity 0 0 0", "run 1000", gravity=tilted))
    assert done.code == 0 and rests.code == 0, (done.error or done.output[-2000:], rests.error)
    found, expected = contact_force(tmp_path / "moves", gravity), contact_force(tmp_path / "rests", tilted)
    assert np.abs(expected).max() > 0.05
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


def test_forces_of_the_walls_are_what_moves_the_grains(tmp_path):
    table = history(run_deck(tmp_path, deck(tmp_path, SHAKE, rows(50) + "run 4000", every=50)))
    assert (table[:, 0] == 50 * np.arange(1, 81)).all()
    told = Told(table[:, 0], force=table[:, 13:16], impulse=table[:, 21:24], velocity=table[:, 5:8], power=table[:, 19])
    assert_walls_move_the_grains(told, frames(tmp_path), SHAKE)


SMOOTH = Material(static_friction=0.0, kinetic_friction=0.0, restitution=0.6, youngs_modulus=vessel.MODULUS)
ROCK = "rocking point 0.01 0.01 0.01 axis 0 1 0 angle 0.2 frequency 40 ramp 1"


def shaken(folder: Path, step: float, motion: str, material: Material) -> tuple[Account, np.ndarray]:
    every = round(2e-3 / step)
    run = f"{rows(every)}{THERMO}\nthermo {every}\nrun {20 * every}"
    done = run_deck(folder, deck(folder, motion, run, step=step, more=FIX, every=every, material=material))
    return Account(done), history(done)


@pytest.mark.parametrize(("motion", "material"), [(SHAKE, DRY), (ROCK, SMOOTH)], ids=["shaken", "rocked, without friction"])
def test_energies_balance_and_the_work_of_the_wall_is_of_second_order(tmp_path, motion, material):
    """Work by the account (mean velocities of steps) less that by force times exact velocity falls with the square of the step."""
    apart = []
    for step in (2e-5, 1e-5):
        account, table = shaken(tmp_path / f"{step}", step, motion, material)
        account.assert_balanced()
        assert account.walls[-1] > 0.05 * account.turnover
        apart.append(np.abs(account.walls[1:] - table[:, 20]).max() / account.turnover)
    assert apart[0] < 2e-3
    assert 2.5 < apart[0] / apart[1] < 6.0


def test_friction_on_a_wall_that_turns_acts_in_the_middle_of_the_overlap(tmp_path):
    """The law's surface velocity is that of the wall's surface: the account and torque times angular velocity differ by half an overlap."""
    account, table = shaken(tmp_path, 1e-5, ROCK, DRY)
    account.assert_balanced()
    assert np.abs(account.walls[1:] - table[:, 20]).max() < 1e-3 * account.turnover


def test_spring_work_of_a_pushed_grain_is_of_second_order(tmp_path):
    """A plate accelerates into an elastic grain at rest: the account's error of the step falls with the square, as without a wall that
    speeds up."""
    material = replace(SMOOTH, restitution=1.0)
    errors = []
    for step in (2e-5, 1e-5):
        folder, every = tmp_path / f"{step}", round(1e-4 / step)
        text = deck(folder, "uniform velocity 0 0 0 acceleration 0 0 60", f"{THERMO}\nthermo {every}\nrun {200 * every}", step=step,
                    grains=[((0.01, 0.01, 0.00252), 0.0025, (0, 0, 0))], material=material, gravity=(0, 0, 0), more=FIX)
        account = Account(run_deck(folder, text))
        account.assert_balanced()
        errors.append(np.abs(account.step_error).max() / account.turnover)
    assert 3.0 < errors[0] / errors[1] < 5.5


def test_grain_on_a_shaken_plate_lands_when_it_must(tmp_path):
    """Five landings, e = 0.5, within the time of a contact of an event-driven solution."""
    material = replace(SMOOTH, restitution=vessel.BOUNCE_RESTITUTION, youngs_modulus=vessel.BOUNCE_MODULUS)
    step, expected, radius = vessel.BOUNCE_STEP, vessel.landings(5), vessel.RADIUS
    steps = math.ceil((expected[-1] + 0.01) / step)
    motion = f"harmonic amplitude 0 0 {vessel.BOUNCE_AMPLITUDE} frequency {vessel.BOUNCE_FREQUENCY} ramp 0"
    done = run_deck(tmp_path, deck(tmp_path, motion, f"{rows(5)}run {steps}", step=step, every=steps, material=material,
                                   grains=[((0.01, 0.01, radius + vessel.BOUNCE_GAP), radius, (0, 0, 0))]))
    table = history(done)
    touches = table[:, 15] > 0.0
    begun = step * table[1:, 0][touches[1:] & ~touches[:-1]]
    assert len(begun) >= 5
    assert np.abs(begun[:5] - expected).max() < vessel.contact_time(0.3), (begun[:5], expected)


def test_ranks_and_resumed_runs_move_alike(tmp_path):
    state = "fix state all resume/exact 300 bed cut grains.dump wall.txt\n"
    one, two, broken = tmp_path / "one", tmp_path / "two", tmp_path / "broken"
    text = {folder: deck(folder, SHAKE, rows(100) + state + "run 1500") for folder in (one, two, broken)}
    assert run_deck(one, text[one]).code == 0
    done = run_deck(two, text[two].replace("region domain", "processors 2 1 1\nregion domain", 1), ranks=2)
    assert done.code == 0, done.error or done.output[-1500:]
    np.testing.assert_allclose(np.loadtxt(two / "wall.txt"), np.loadtxt(one / "wall.txt"), rtol=1e-7, atol=1e-12)
    assert run_deck(broken, text[broken].replace("run 1500", "run 700")).code == 0
    rest = (rows(100) + state + "run 1500 upto").replace("file wall.txt", "append wall.txt")
    again = deck(broken, SHAKE, rest, create="resume_state bed")
    done = run_deck(broken, again.replace("dump_modify grains", "dump_modify grains append yes"))
    assert done.code == 0, done.error
    assert "dembark: resumed at step 600 exactly" in done.output
    assert (broken / "grains.dump").read_bytes() == (one / "grains.dump").read_bytes()
    np.testing.assert_array_equal(np.loadtxt(broken / "wall.txt"), np.loadtxt(one / "wall.txt"))


@pytest.mark.parametrize(("motion", "line"), [
    ("harmonic amplitude 0 0 0.08 frequency 5", "out of the box along z"),
    ("harmonic amplitude 0 0 1e-3 frequency 20000", "below ten time steps"),
    ("harmonic amplitude 0 0 1e-3 frequency 0", "frequency 0 must be > 0"),
    ("table file vessel.stl", "line 1: it must have four numbers"),
    ("table file back.csv", "line 3: the times do not ascend"),
    ("table file far.csv", "out of the box along x"),
    ("rotation point 0.05 0 0 axis 0 1 0 rate 3e4", "out of the box along x"),
    ("rocking point 0 0 -0.055 axis 0 1 0 angle 1.5 frequency 100 ramp 0", "out of the box along x"),
    ("table file none.csv", "file 'none.csv' cannot be read"),
    ("jolts shape half_sine acceleration 1 0 0 duration 2e-5", "below ten time steps"),
    ("shake amplitude 1", "there is no motion 'shake'")])
def test_wrong_motions_are_told_in_one_line(tmp_path, motion, line):
    (tmp_path / "back.csv").write_text("0,0,0,0\n0.1,1e-3,0,0\n0.1,2e-3,0,0\n")
    (tmp_path / "far.csv").write_text("0,0,0,0\n1e-5,0.09,0,0\n")
    done = run_deck(tmp_path, deck(tmp_path, motion, "run 10"))
    assert done.code != 0
    assert line in done.error, done.error or done.output[-500:]
    assert len(done.error.strip().splitlines()) <= 2 and "Traceback" not in done.error


@pytest.mark.parametrize(("boundary", "motion", "line"), [
    ("f f fs", "uniform velocity 0 0 1000", ""), ("f f sf", "uniform velocity 0 0 1000", "out of the box along z"),
    ("f f f", "rotation point 0.05 0 0 axis 0 1 0 rate 1000", ""),
    ("f f f", "rocking point 0 0 0 axis 0 1 0 angle 0.1 frequency 100 ramp 0", "")])
def test_each_face_of_the_box_and_each_arc_counts_by_itself(tmp_path, boundary, motion, line):
    """A face that shrinks goes along with the mesh, and an arc may end before the mesh leaves."""
    done = run_deck(tmp_path, deck(tmp_path, motion, "run 10", boundary=boundary))
    assert line in done.error if line else "out of the box" not in done.error, done.error or done.output[-500:]


def test_a_mesh_whose_fix_is_gone_adds_to_no_other_load(tmp_path):
    """The grain rests on the first mesh, which no longer moves; the second, far away, touches nothing."""
    far = [tuple((x, y, z + 0.03) for x, y, z in three) for three in rectangle((0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.0, 0.01, 0.0))]
    (tmp_path / "far.stl").write_text(stl(far))
    still = "uniform velocity 1e-6 0 0"
    text = deck(tmp_path, still, "run 100\nunfix move\nfix other all wall/motion mesh far " + still + "\nvariable f equal f_other[15]\n"
                'fix out all print 10 "load ${f}"\nrun 100', grains=[((0.01, 0.01, 0.00248), 0.0025, (0, 0, 0))], held=True)
    wall = models(DRY, wall="mesh n_meshes 1 meshes stl store_force yes")
    assert wall in text
    text = text.replace(wall, wall.replace("n_meshes 1 meshes stl", "n_meshes 2 meshes stl far"))
    text = text.replace("fix wall all", "fix far all mesh/surface file far.stl type 2\nfix wall all")
    done = run_deck(tmp_path, text)
    assert done.code == 0, done.error or done.output[-1500:]
    loads = [line for line in done.output.splitlines() if line.startswith("load ")]
    assert loads and all(float(line.split()[1]) == 0.0 for line in loads), loads


def test_a_mesh_that_another_fix_moves_too_is_refused_in_either_order(tmp_path):
    other = "fix other all move/mesh mesh stl linear 0.0 0.0 0.1"
    text = deck(tmp_path, SHAKE, "run 10")
    for where in ("fix move all", "fix wall all"):
        assert where in text
        done = run_deck(tmp_path, text.replace(where, f"{other}\n{where}"))
        assert done.code != 0 and "is moved by" in done.error, done.error or done.output[-500:]
        assert "give all terms of a motion to one fix" in done.error


@pytest.mark.parametrize(("boundary", "axis", "line"), [
    ("f p f", "1 0 0", "out of the periodic direction y, in which it reaches the border"), ("f p f", "0 1 0", ""), ("p p f", "0 1 0", "")])
def test_a_mesh_that_reaches_a_periodic_border_turns_about_an_axis_along_it(tmp_path, boundary, axis, line):
    """A strip from border to border along y, and well inside along x."""
    strip = rectangle((0.02, -vessel.MARGIN, 0.02), (0.0, vessel.WIDTH + 2.0 * vessel.MARGIN, 0.0), (0.02, 0.0, 0.0))
    motion = f"rotation point 0.03 0 0.02 axis {axis} rate 1"
    done = run_deck(tmp_path, deck(tmp_path, motion, "run 10", boundary=boundary, triangles=strip, gravity=(0.0, 0.0, 0.0)))
    assert (done.code != 0 and line in done.error) if line else done.code == 0, done.error or done.output[-500:]


def late_deck(then: str, *, create: str = "", motions: list[str] = late_motion.MOTIONS) -> str:
    """Plates that get motions late, all of one place, below one held grain; `create`: how a state is read again."""
    late = late_motion
    meshes = [f"m{k}" for k in range(len(motions))]
    box = (f"region domain block -0.02 0.02 -0.02 0.02 -0.02 0.02 units box\ncreate_box 2 domain\n"
           f"create_atoms 1 single {' '.join(map(repr, late.GRAIN))} units box\nset group all diameter {2 * late.RADIUS!r} density 2500.0")
    walls = "".join(f"fix {mesh} all mesh/surface file plate.stl type 2\n" for mesh in meshes)
    moves = "".join(f"fix w{k} all wall/motion mesh m{k} {words}\n" for k, words in enumerate(motions))
    before = "" if create else f"timestep {late.STEPS[0]!r}\nrun {late.COUNTS[0]}\ntimestep {late.STEPS[1]!r}\nrun {late.COUNTS[1]}\n"
    numbers = [f"f_w{k}[{n}]" for k in range(len(motions)) for n in (1, 2, 3, 4, 15)]
    given = "".join(f"variable v{k} equal {number}\n" for k, number in enumerate(numbers))
    shown = " ".join(f"${{v{k}}}" for k in range(len(numbers)))
    return f"""\
{head()}
{create or box}
neighbor 0.002 bin
neigh_modify delay 0
{properties(ELASTIC)}
pair_style gran {models(ELASTIC)}
pair_coeff * *
{walls}fix wall all wall/gran {models(ELASTIC, wall=f"mesh n_meshes {len(meshes)} meshes {' '.join(meshes)}")}
fix held all nve/noforce
thermo 100000
{before}timestep {late.STEPS[1]!r}
{moves}variable now equal time
{given}fix out all print {late.EVERY} "${{now}} {shown}" file {"again" if create else "wall"}.txt screen no title "#"
{then}
"""


def test_motions_that_are_given_late_begin_where_the_wall_stands(tmp_path):
    """After steps of two lengths, `run 0` first, over several runs and a restart: the meshes are where the fixes have them."""
    late = late_motion
    (tmp_path / "plate.stl").write_text(stl(late.PLATE))
    (tmp_path / "late.csv").write_text(late.TABLE)
    done = run_deck(tmp_path, late_deck(f"run 0\nrun {late.PART}\nwrite_restart half.state\nrun {late.PART}"))
    assert done.code == 0, done.error or done.output[-2000:]
    table = np.loadtxt(tmp_path / "wall.txt")
    times = late.BEGUN + late.STEPS[1] * late.EVERY * np.arange(1, 2 * late.PART // late.EVERY + 1)
    for k, words in enumerate(late.MOTIONS):
        mine = table[:, 1 + 5 * k:6 + 5 * k]
        assert_begins_where_it_stands(tmp_path, words, times, mine[:, :3], mine[:, 3], mine[:, 4])
    again = run_deck(tmp_path, late_deck(f"run {late.PART}", create="read_restart half.state"), name="again.in")
    assert again.code == 0, again.error or again.output[-2000:]
    # The engine's own time begins anew with a restart.
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "again.txt")[:, 1:], table[late.PART // late.EVERY:, 1:])
