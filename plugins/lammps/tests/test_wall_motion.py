"""fix wall/dembark ... motion ..., or on regions that move: walls are where they are to be, contacts see their velocity, forces balance."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig import late_motion, vessel
from rig.lammps_driver import coefficients, head, run_deck, settings
from rig.liggghts_driver import Run, read_dump
from rig.meshes import patch
from rig.scenarios import Material
from rig.vessel import STEP
from rig.wall_balance import ELASTIC, Told, assert_begins_where_it_stands, assert_walls_move_the_grains
from rig.walls import stl

from dembark.physics import effective_youngs_modulus

DRY = Material(static_friction=0.5, kinetic_friction=0.4, restitution=0.6, youngs_modulus=vessel.MODULUS)
SMOOTH = replace(DRY, static_friction=0.0, kinetic_friction=0.0)
SHAKE = "harmonic amplitude 1e-3 0 2e-3 frequency 50 ramp 2"


def deck(folder: Path, motion: str, run: str, *, grains=None, material=DRY, gravity=(0.0, 0.0, -9.81), step=STEP, triangles=None,
         every=10, held=False, create=None, boundary="f f f", start="", half=vessel.MARGIN):
    """Grains in the box, which moves; `held`: the grains do not."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "vessel.stl").write_text(stl(vessel.box() if triangles is None else triangles))
    lines = []
    for n, (place, radius, speed) in enumerate(vessel.grains() if grains is None else grains, start=1):
        lines.append("create_atoms 1 single " + " ".join(map(repr, place)) + " units box")
        lines.append(f"set atom {n} diameter {2 * radius!r} density {vessel.DENSITY!r} vx {speed[0]!r} vy {speed[1]!r} vz {speed[2]!r}")
    strength = math.sqrt(sum(g * g for g in gravity))
    low, high = -half, half + vessel.WIDTH
    box = f"region domain block {low} {high} {low} {high} {low} {high} units box\ncreate_box 2 domain\n"
    weight = f"fix weight all gravity {strength!r} vector " + " ".join(repr(g / strength) for g in gravity) if strength else ""
    return f"""\
{head(boundary=boundary)}
{start}
{box if create is None else create}
neighbor 0.002 bin
neigh_modify delay 0
timestep {step!r}
pair_style dembark/granular {settings(material)}
pair_coeff * * {coefficients(material)}
{chr(10).join(lines) if create is None else ""}
fix move all wall/dembark stl vessel.stl type 2 {"motion " + motion if motion else ""}
{weight}
{"" if held else "fix motion all nve/sphere"}
dump grains all custom {every} grains.dump id x y z vx vy vz fx fy fz radius
dump_modify grains sort id format float %.17g
{run}
"""


def rows(every: int) -> str:
    """A table of the fix's vector."""
    columns = " ".join(f"f_move[{k}]" for k in range(1, 26))
    return f'fix out all ave/time {every} 1 {every} {columns} file wall.txt format " %.17g"\nthermo 1000\n'


def history(done: Run) -> np.ndarray:
    """Rows of step and the global vector of the fix."""
    assert done.code == 0, done.error or done.output[-2000:]
    return np.loadtxt(done.folder / "wall.txt")


def frames(folder: Path) -> np.ndarray:
    """(frame, grain, column) of the dump."""
    return np.array(read_dump(folder / "grains.dump")[1])


def test_wall_is_where_it_is_prescribed_to_be(tmp_path):
    """The place of the surface, from the elastic force on a held grain, after 100 periods."""
    amplitude, frequency, step, radius, height = 1e-3, 50.0, 1e-4, 0.004, 0.0005
    elastic = replace(SMOOTH, restitution=1.0)
    done = run_deck(tmp_path, deck(tmp_path, f"harmonic amplitude 0 0 {amplitude} frequency {frequency}", "thermo 10000\nrun 21000",
                                   grains=[((0.01, 0.01, height), radius, (0, 0, 0))], material=elastic, step=step, held=True, every=1000,
                                   gravity=(0, 0, 0)))
    assert done.code == 0, done.error or done.output[-2000:]
    late = [(n * step, table[0]) for n, table in zip(*read_dump(tmp_path / "grains.dump"), strict=True) if n * step >= 10 / frequency]
    assert len(late) >= 20 and late[-1][0] * frequency > 100.0
    modulus = effective_youngs_modulus(elastic.youngs_modulus, elastic.poisson_ratio, elastic.youngs_modulus, elastic.poisson_ratio)
    for t, row in late:
        overlap = (abs(row[9]) / (4.0 / 3.0 * modulus * math.sqrt(radius))) ** (2.0 / 3.0)
        place = height - math.copysign(radius - overlap, row[9])
        assert abs(place - amplitude * math.sin(2 * math.pi * frequency * t)) < 1e-9 * amplitude


@pytest.mark.parametrize("accelerated", [False, True])
def test_moving_vessel_is_one_at_rest_in_its_frame(tmp_path, accelerated):
    """At constant speed nothing changes, at constant acceleration gravity is tilted: the same forces over 1000 steps."""
    motion, grains, tilted = vessel.moving_and_resting(accelerated)
    contacts, gravity = [], (0.0, 0.0, -9.81)
    for folder, words, its, weight in ((tmp_path / "moves", motion, grains, gravity), (tmp_path / "rests", "", vessel.grains(), tilted)):
        done = run_deck(folder, deck(folder, words, "run 1000", grains=its, gravity=weight))
        assert done.code == 0, done.error or done.output[-2000:]
        table = frames(folder)
        mass = vessel.DENSITY * 4.0 / 3.0 * math.pi * table[..., 10] ** 3
        contacts.append(table[..., 7:10] - mass[..., np.newaxis] * np.array(weight))
    found, expected = contacts
    assert np.abs(expected).max() > 0.05
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


def test_forces_of_the_walls_are_what_moves_the_grains(tmp_path):
    table = history(run_deck(tmp_path, deck(tmp_path, SHAKE, rows(50) + "run 4000", every=50)))[1:]
    assert (table[:, 0] == 50 * np.arange(1, 81)).all()
    told = Told(table[:, 0], force=table[:, 1:4], impulse=table[:, 23:26], velocity=table[:, 13:16], power=table[:, 21])
    assert_walls_move_the_grains(told, frames(tmp_path), SHAKE)


def test_grain_on_a_shaken_plate_lands_when_it_must(tmp_path):
    """Five landings, e = 0.5, within the time of a contact of an event-driven solution."""
    material = replace(SMOOTH, restitution=vessel.BOUNCE_RESTITUTION, youngs_modulus=vessel.BOUNCE_MODULUS)
    step, expected, radius = vessel.BOUNCE_STEP, vessel.landings(5), vessel.RADIUS
    steps = math.ceil((expected[-1] + 0.01) / step)
    motion = f"harmonic amplitude 0 0 {vessel.BOUNCE_AMPLITUDE} frequency {vessel.BOUNCE_FREQUENCY} ramp 0"
    table = history(run_deck(tmp_path, deck(tmp_path, motion, f"{rows(5)}run {steps}", step=step, every=steps, material=material,
                                            grains=[((0.01, 0.01, radius + vessel.BOUNCE_GAP), radius, (0, 0, 0))])))
    touches = table[:, 3] > 0.0
    begun = step * table[1:, 0][touches[1:] & ~touches[:-1]]
    assert len(begun) >= 5
    assert np.abs(begun[:5] - expected).max() < vessel.contact_time(0.3), (begun[:5], expected)


def test_a_floor_of_triangles_is_the_plane_also_across_periods(tmp_path):
    """Grains roll over its edges and through a periodic boundary, and on two ranks: forces as on a region."""
    grains = [((-0.0085 + 0.006 * k, -0.002 * k, 0.00248), 0.0025, (0.4, 0.25, 0.0)) for k in range(3)]
    half = 0.0093
    strips = [((x, y, 0.0), (x + 0.0062, y, 0.0), (x + 0.0062, y + 0.0186, 0.0), (x, y + 0.0186, 0.0))
              for x, y in ((-half, -half), (-half + 0.0062, -half), (-half + 0.0124, -half))]
    tiles = [three for a, b, c, d in strips for three in ((a, b, c), (a, c, d))]
    found = {}
    for name, triangles, ranks in (("plane", tiles, 1), ("tiles", tiles, 1), ("ranks", tiles, 2)):
        folder = tmp_path / name
        text = deck(folder, "", "thermo 1000\nrun 2500", grains=grains, triangles=triangles, boundary="p p f", every=25,
                    start="processors 2 1 1" if ranks == 2 else "")
        text = text.replace(f"block {-vessel.MARGIN} {vessel.MARGIN + vessel.WIDTH} {-vessel.MARGIN} {vessel.MARGIN + vessel.WIDTH}",
                            f"block {-half} {half} {-half} {half}")
        if name == "plane":
            text = text.replace("fix move all wall/dembark stl vessel.stl",
                                "region floor plane 0 0 0 0 0 1 units box\nfix move all wall/dembark region floor")
        done = run_deck(folder, text, ranks=ranks)
        assert done.code == 0, done.error or done.output[-1500:]
        found[name] = frames(folder)
    assert np.abs(found["plane"][-1, :, 1:3] - found["plane"][0, :, 1:3]).max() > 0.005
    for name in ("tiles", "ranks"):
        assert np.abs(found[name][..., 7:10] - found["plane"][..., 7:10]).max() < 1e-9 * np.abs(found["plane"][..., 7:10]).max(), name


def test_a_history_goes_over_edges(tmp_path):
    """A grain that slides and rolls over triangles of all shapes has the forces that it has on two large ones."""
    large = [((-0.04, -0.04, 0.0), (0.04, -0.04, 0.0), (0.04, 0.04, 0.0)), ((-0.04, -0.04, 0.0), (0.04, 0.04, 0.0), (-0.04, 0.04, 0.0))]
    motions = []
    for name, triangles in (("large", large), ("patch", patch())):
        folder = tmp_path / name
        done = run_deck(folder, deck(folder, "", "run 3000", grains=[((-0.004, -0.003, 0.00248), 0.0025, (0.3, 0.2, 0.0))],
                                     triangles=triangles, every=10))
        assert done.code == 0, done.error or done.output[-1500:]
        motions.append(frames(folder))
    one, many = motions
    assert many[-1, 0, 1] > 0.001
    assert np.abs(many[..., 7:10] - one[..., 7:10]).max() < 1e-9 * np.abs(one[..., 7:10]).max()


@pytest.mark.parametrize(("motion", "line"), [
    ("harmonic amplitude 0 0 1e-3 frequency 20000", "below ten time steps"),
    ("harmonic amplitude 0 0 1e-3 frequency 0", "frequency 0 must be > 0"),
    ("table file vessel.stl", "line 1: it must have four numbers"),
    ("table file back.csv", "line 3: the times do not ascend"),
    ("jolts shape half_sine acceleration 1 0 0 duration 2e-5", "below ten time steps"),
    ("shake amplitude 1", "there is no motion 'shake'")])
def test_wrong_motions_are_told_in_one_line(tmp_path, motion, line):
    (tmp_path / "back.csv").write_text("0,0,0,0\n0.1,1e-3,0,0\n0.1,2e-3,0,0\n")
    done = run_deck(tmp_path, deck(tmp_path, motion, "run 10"))
    assert done.code != 0
    assert line in done.error, done.error or done.output[-500:]


@pytest.mark.parametrize(("motion", "line"), [
    ("harmonic amplitude 0 0 0.08 frequency 5", "out of the box along z"), ("uniform velocity 1000 0 0", "out of the box along x"),
    ("rotation point 0.05 0 0 axis 0 1 0 rate 3e4", "out of the box along x"), ("rotation point 0.05 0 0 axis 0 1 0 rate 1000", ""),
    (SHAKE, ""), ("boundary f f fs uniform velocity 0 0 1000", ""), ("boundary f f sf uniform velocity 0 0 1000", "along z")])
def test_a_wall_that_leaves_the_box_is_warned_of(tmp_path, motion, line):
    """LAMMPS loses grains beyond the box, but not walls: a gate may leave. A face that shrinks is none to leave by."""
    words = motion.split()
    boundary = " ".join(words[1:4]) if words[0] == "boundary" else "f f f"
    text = deck(tmp_path, motion.removeprefix(f"boundary {boundary} "), "run 10", boundary=boundary)
    warnings = [one for one in run_deck(tmp_path, text).output.splitlines() if "takes its surface" in one]
    assert [line in one for one in warnings] == [True] * bool(line), warnings


@pytest.mark.parametrize(("old", "new", "line"), [
    ("stl vessel.stl", "stl vessel.obj", "file 'vessel.obj' cannot be read"),
    ("stl vessel.stl", "stl case.in", "holds no triangles"),
    ("type 2", "type 2 moves", "'motion TERM ...'")])
def test_wrong_surfaces_are_told_in_one_line(tmp_path, old, new, line):
    done = run_deck(tmp_path, deck(tmp_path, "", "run 10").replace(old, new))
    assert done.code != 0
    assert "fix move wall/dembark" in done.error and line in done.error, done.error or done.output[-500:]


ROUGH = replace(DRY, restitution=1.0)
MOVING = """\
variable angle equal 0.5*time
variable shift equal 0.01*time
variable wide equal 0.0505+0.01*time
region floor plane 0 0 0 0 0 1 rotate v_angle 0.05 0 0 {axis} units box
region bowl cylinder z 0.05 0 0.0505 -0.05 0.05 rotate v_angle 0.05 0 0 {axis} units box
region lid plane 0 0 0.01 0 0 -1 move NULL NULL v_shift units box
region tube cylinder z 0 0 v_wide -0.01 0.01 units box
region still plane 0 0 -0.01 0 0 1 units box
region both union 2 floor still units box
region cut intersect 2 still lid units box
region pulse union 2 tube still units box
"""


def on_regions(wall: str, axis: str = "0 0 1") -> str:
    """A grain at rest in touch with a floor and, 0.05 m from their axis, with a cylinder around it."""
    return f"""\
{head()}
region domain block -0.02 0.12 -0.07 0.07 -0.06 0.06 units box
create_box 2 domain
create_atoms 1 single 0.1 0 0.0009 units box
set group all diameter 0.002 density 2500.0
neighbor 0.002 bin
pair_style dembark/granular {settings(ROUGH)}
pair_coeff * * {coefficients(ROUGH)}
{MOVING.format(axis=axis)}
fix wall all wall/dembark {wall} type 2
variable fx equal fx[1]
variable fy equal fy[1]
variable fz equal fz[1]
thermo_style custom step v_fx v_fy v_fz
timestep 1e-6
thermo 1000
run 20
print "force $(v_fx:%.17g) $(v_fy:%.17g) $(v_fz:%.17g)"
"""


@pytest.mark.parametrize("region", ["floor", "bowl"])
def test_the_length_of_the_axis_of_a_region_does_not_matter(tmp_path, region):
    """The region turns about the direction of its axis, and its surface has the speed of that."""
    forces = []
    for k, axis in enumerate(("0 0 1", "0 0 3", "0 0 -0.25")):
        done = run_deck(tmp_path / str(k), on_regions(f"region {region}", axis))
        assert done.code == 0, done.error or done.output[-2000:]
        forces.append(np.array(next(line for line in done.output.splitlines() if line.startswith("force ")).split()[1:], float))
    assert forces[0][1] > 1e-4 * np.abs(forces[0]).max()
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(forces[2][1], -forces[0][1], rtol=1e-6)


@pytest.mark.parametrize("region", ["both", "cut", "pulse"])
def test_regions_of_moving_parts_are_refused_in_one_line(tmp_path, region):
    done = run_deck(tmp_path, on_regions(f"region {region}"))
    style = "intersect" if region == "cut" else "union"
    assert done.code != 0 and f"region {region} ({style}) has moving parts, of whose velocity LAMMPS says nothing" in done.error, done.error
    assert len(done.error.strip().splitlines()) == 1


def late_deck(then: str, *, create: str = "", motions: list[str] = late_motion.MOTIONS) -> str:
    """Plates that get motions late, all of one place, below one held grain; `create`: how a state is read again."""
    late = late_motion
    place = " ".join(map(repr, late.GRAIN))
    walls = "".join(f"fix w{k} all wall/dembark stl plate.stl type 2 motion {words}\n" for k, words in enumerate(motions))
    before = "" if create else (f"timestep {late.STEPS[0]!r}\nrun {late.COUNTS[0]}\ntimestep {late.STEPS[1]!r}\nrun {late.COUNTS[1]}\n")
    columns = " ".join(f"f_w{k}[{n}]" for k in range(len(motions)) for n in (9, 10, 11, 12, 3))
    return f"""\
{head()}
{create or "region domain block -0.02 0.02 -0.02 0.02 -0.02 0.02 units box"}
{"" if create else f"create_box 2 domain{chr(10)}create_atoms 1 single {place} units box"}
{"" if create else f"set group all diameter {2 * late.RADIUS!r} density 2500.0"}
neighbor 0.002 bin
pair_style dembark/granular {settings(ELASTIC)}
pair_coeff * * {coefficients(ELASTIC)}
thermo 100000
{before}timestep {late.STEPS[1]!r}
{walls}variable now equal time
fix out all ave/time {late.EVERY} 1 {late.EVERY} v_now {columns} file {"again" if create else "wall"}.txt format " %.17g"
{then}
"""


def test_motions_that_are_given_late_begin_where_the_wall_stands(tmp_path):
    """After steps of two lengths, `run 0` first, over several runs and a restart: no jump, and the same to the bit."""
    late = late_motion
    (tmp_path / "plate.stl").write_text(stl(late.PLATE))
    (tmp_path / "late.csv").write_text(late.TABLE)
    done = run_deck(tmp_path, late_deck(f"run 0\nrun {late.PART}\nwrite_restart half.state\nrun {late.PART}"))
    assert done.code == 0, done.error or done.output[-2000:]
    table = np.unique(np.loadtxt(tmp_path / "wall.txt"), axis=0)
    assert len(table) == 2 * late.PART // late.EVERY + 1
    for k, words in enumerate(late.MOTIONS):
        mine = table[:, 2 + 5 * k:7 + 5 * k]
        assert_begins_where_it_stands(tmp_path, words, table[:, 1], mine[:, :3], mine[:, 3], mine[:, 4])
    again = run_deck(tmp_path, late_deck(f"run {late.PART}", create="read_restart half.state"), name="again.in")
    assert again.code == 0, again.error or again.output[-2000:]
    # The first row is that of a set-up, whose velocities it takes; places are the same.
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "again.txt")[1:], table[late.PART // late.EVERY + 1:])


@pytest.mark.parametrize(("change", "line"), [
    (("0 0 1e-4 frequency 50", "0 0 2e-4 frequency 50"), "in the restart file its motion is 'harmonic amplitude 0 0 1e-4"),
    (("frequency 50 ramp 0", "frequency 50 ramp 0 until 0.009"), "until 0.009 s must be later than start 0.01 s")])
def test_motions_that_cannot_begin_are_refused_in_one_line(tmp_path, change, line):
    late = late_motion
    (tmp_path / "plate.stl").write_text(stl(late.PLATE))
    text = late_deck("run 1\nwrite_restart half.state", motions=late.MOTIONS[:1])
    if "until" in change[1]:
        done = run_deck(tmp_path, text.replace(*change))
    else:
        assert run_deck(tmp_path, text).code == 0
        other = late_deck("run 1", create="read_restart half.state", motions=late.MOTIONS[:1])
        done = run_deck(tmp_path, other.replace(*change), name="again.in")
    assert done.code != 0 and line in done.error, done.error or done.output[-500:]
    assert len(done.error.strip().splitlines()) <= 2
