"""fix energy/account: works of all parts of the forces balance the kinetic energy to round-off, in impacts and in a column that collapses."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dembark.physics import Body, collide, effective_youngs_modulus
from rig import liggghts_driver
from rig.liggghts_driver import Run, models, properties, run_deck
from rig.packing import CREATE, STATE, packing
from rig.python_driver import contact
from rig.scenarios import Grain, Material, Scenario

NAMES = ("kinetic", "start", "gravity", "normal_spring", "normal_damping", "tangential_spring", "tangential_damping", "bridges", "viscous",
         "walls", "other", "imposed", "balance", "normal_stored", "tangential_stored", "step_error", "scale")
WORKS = NAMES[2:12]
LOSSES = ("normal_damping", "tangential_damping", "viscous")
FIX = "fix energy all energy/account"
THERMO = f"""\
compute linear all ke
compute angular all erotate/sphere
thermo_style custom step atoms c_linear c_angular {" ".join(f"f_energy[{k}]" for k in range(1, len(NAMES) + 1))}
thermo_modify lost ignore norm no format float %.17g
"""
DRY = Material(static_friction=0.5, kinetic_friction=0.4, restitution=0.6, youngs_modulus=5e6)
WET = replace(DRY, bridge_volume=5e-11, viscosity=0.01, capillary_model="willett")


class Account:
    """What the fix returned, line by line, by name (J); `full`: kinetic energy of all atoms as the engine's computes have it."""

    def __init__(self, done: Run) -> None:
        assert done.code == 0, done.output[-2000:]
        lines = re.findall(rf"^ *\d+ +\d+(?: +[-+.\de]+){{{2 + len(NAMES)}}} *$", done.output, re.MULTILINE)
        rows = np.array([line.split() for line in lines], dtype=float)
        assert len(rows) > 1 and np.isfinite(rows).all()
        self.rows, self.step, self.atoms, self.full = rows[:, 4:], rows[:, 0], rows[:, 1], rows[:, 2] + rows[:, 3]

    def __getattr__(self, name: str) -> np.ndarray:
        return self.rows[:, NAMES.index(name)]

    @property
    def turnover(self) -> float:
        """J, of the last line: what all works are made of."""
        return float(self.scale[-1])

    def assert_balanced(self, *, other: bool = True, within: float = 1e-12) -> None:
        """The works add up to the kinetic energy, and (`other`) all of the force is in a known part."""
        total = self.start + sum(getattr(self, name) for name in WORKS)
        assert np.abs(self.balance).max() <= within * self.turnover
        np.testing.assert_allclose(self.kinetic - total, self.balance, atol=1e-15 * self.turnover * len(WORKS))
        if other:
            assert np.abs(self.other).max() <= within * self.turnover
        for name in LOSSES:
            assert (getattr(self, name) <= 1e-15 * self.turnover).all(), name


# --- single contacts ---

def grains() -> tuple[Grain, ...]:
    return (Grain(position=(1e-3, 5e-4, 9e-3), velocity=(-0.3, 0.2, -0.8), angular_velocity=(40.0, -25.0, 60.0)),
            Grain(radius=3e-3, position=(0.0, 0.0, 7.4e-4), velocity=(0.1, -0.1, 0.2), angular_velocity=(-10.0, 30.0, 15.0)))


def account_of(folder: Path, case: Scenario) -> Account:
    return Account(run_deck(folder, liggghts_driver.deck(case, start=f"{FIX}\n{THERMO}").replace(f"thermo {case.steps}", f"thermo {case.stride}")))


def works_in_python(case: Scenario) -> dict[str, float]:
    """J, of the same impact in Python alone: forces as the laws give them, times the velocity of the full step."""
    m, dt = case.material, case.time_step
    bodies = [Body(radius=g.radius, mass=g.mass, position=g.position, velocity=g.velocity, angular_velocity=g.angular_velocity) for g in case.grains]
    out = collide(contact(m), *bodies, time_step=dt, steps=case.steps)
    elastic = effective_youngs_modulus(m.youngs_modulus, m.poisson_ratio, m.youngs_modulus, m.poisson_ratio)
    one, two = (g.radius for g in case.grains)
    works = dict.fromkeys(("normal_spring", "normal_damping", "tangential", "bridges", "viscous"), 0.0)
    for x, v, spin, c in zip(out.position, out.velocity, out.angular_velocity, out.contacts, strict=True):
        normal = (x[0] - x[1]) / np.linalg.norm(x[0] - x[1])
        moved = v[0] - v[1]
        parting = moved @ normal
        sliding = moved - parting * normal - np.cross((one - c.overlap / 2) * spin[0] + (two - c.overlap / 2) * spin[1], normal)
        spring = 4.0 / 3.0 * elastic * np.sqrt(one * two / (one + two)) * max(c.overlap, 0.0) ** 1.5
        works["normal_spring"] += spring * parting * dt
        works["normal_damping"] += (c.normal_force - spring) * parting * dt
        works["tangential"] += np.dot(c.tangential, sliding) * dt
        works["bridges"] -= c.capillary_force * parting * dt
        works["viscous"] += (c.viscous_normal * parting + np.dot(c.viscous_tangential, sliding)) * dt
    return works


@pytest.mark.parametrize("material", [DRY, replace(DRY, restitution=1.0), replace(WET, kinetic_friction=0.2)], ids=["dry", "elastic", "wet"])
def test_parts_of_an_oblique_impact_are_those_of_the_laws(tmp_path, material):
    case = Scenario(name="impact", material=material, grains=grains(), time_step=1e-6, steps=2500, stride=100)
    account = account_of(tmp_path, case)
    account.assert_balanced()
    np.testing.assert_allclose(account.kinetic, account.full, rtol=1e-14)
    for name, expected in works_in_python(case).items():
        found = account.tangential_spring + account.tangential_damping if name == "tangential" else getattr(account, name)
        assert found[-1] == pytest.approx(expected, rel=1e-9, abs=1e-13 * account.turnover), name
        assert material is not WET or abs(expected) > 1e-6 * account.turnover
    assert (account.tangential_damping[-1] == 0.0) == (material.restitution == 1.0)
    assert account.normal_stored[-1] == account.tangential_stored[-1] == 0.0


def step_errors(folder: Path, time_step: float) -> np.ndarray:
    """J, while a grain without damping and friction bounces on the floor, at the same times for all steps."""
    smooth = replace(DRY, restitution=1.0, static_friction=0.0, kinetic_friction=0.0)
    case = Scenario(name="drop", material=smooth, grains=(Grain(position=(0.0, 0.0, 5.01e-3), velocity=(0.1, 0.0, -0.5)),), wall=True,
                    gravity=(0.0, 0.0, -9.81), time_step=time_step, steps=round(1.6e-3 / time_step), stride=round(8e-5 / time_step))
    account = account_of(folder, case)
    account.assert_balanced()
    # Gravity and the spring are all there is: energy that comes or goes is the step's.
    np.testing.assert_allclose(account.step_error, account.kinetic - account.start - account.gravity + account.normal_stored, atol=1e-14 * account.turnover)
    return account.step_error


def test_error_of_the_step_is_of_second_order(tmp_path):
    coarse, fine, finest = (np.abs(step_errors(tmp_path / str(n), 8e-6 / n)).max() for n in (1, 2, 4))
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.2)
    assert np.log2(fine / finest) == pytest.approx(2.0, abs=0.2)


# --- a column that collapses ---

COLUMN = "\n".join(f"create_atoms 1 single {0.0026 + 0.0052 * i} {0.0026 + 0.0052 * j} {0.0026 + 0.0052 * k} units box"
                   for i in range(5) for j in range(5) for k in range(12))
GATE = """\
solid gate
facet normal 1 0 0
outer loop
vertex 0.0262 -0.001 -0.0005
vertex 0.0262 0.027 -0.0005
vertex 0.0262 0.027 0.08
endloop
endfacet
facet normal 1 0 0
outer loop
vertex 0.0262 -0.001 -0.0005
vertex 0.0262 0.027 0.08
vertex 0.0262 -0.001 0.08
endloop
endfacet
endsolid gate
"""


def column(folder: Path, m: Material, run: str, *, ranks: int = 1) -> Account:
    """300 grains of many sizes between four walls, let loose by a gate that is drawn aside and up."""
    walls = "\n".join(f"fix {name} all wall/gran {models(m, wall=f'primitive type 2 {axis}plane {at}')}"
                      for name, axis, at in (("floor", "z", 0.0), ("left", "x", 0.0), ("front", "y", 0.0), ("back", "y", 0.026)))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "gate.stl").write_text(GATE)
    return Account(run_deck(folder, f"""\
units si
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
processors {({1: "1 1 1", 2: "1 1 2", 4: "2 1 2"})[ranks]}
region domain block -0.001 0.1 -0.002 0.028 -0.001 0.1 units box
create_box 2 domain
{COLUMN}
neighbor 0.002 bin
neigh_modify delay 0
timestep 1e-5
{properties(m)}
pair_style gran {models(m)}
pair_coeff * *
variable size atom 0.005*(1+0.05*sin(37*id))
variable push_x atom 0.1*sin(91*id)
variable push_y atom 0.1*sin(53*id)
set group all density 2500 diameter v_size density 2500
set group all vx v_push_x vy v_push_y
fix gate all mesh/surface file gate.stl type 2
fix guard all wall/gran {models(m, wall="mesh n_meshes 1 meshes gate")}
{walls}
fix weight all gravity 9.81 vector 0 0 -1
fix motion all nve/sphere
fix lift all move/mesh mesh gate linear 0.03 0 0.05
{FIX}
{THERMO}
thermo 250
{run}
""", ranks=ranks))


@pytest.mark.parametrize(("material", "steps"), [(DRY, 5000), (WET, 3000)], ids=["dry", "wet"])
def test_collapse_balances(tmp_path, material, steps):
    account = column(tmp_path, material, f"run {steps}")
    account.assert_balanced()
    assert (account.atoms == 300).all() and (account.imposed == 0.0).all()
    np.testing.assert_allclose(account.kinetic, account.full, rtol=1e-14)
    # All of it happens: the column falls, everything that can be lost is, and the gate takes up what the grains push.
    assert account.gravity[-1] > account.start[0] and account.walls[-1] < -1e-3 * account.turnover
    present = ("normal_damping", "tangential_spring", "tangential_damping") + (("bridges", "viscous") if material is WET else ())
    for name in present:
        assert getattr(account, name)[-1] < -1e-3 * account.turnover, name
    if material is DRY:
        assert (account.bridges == 0.0).all() and (account.viscous == 0.0).all()
    assert 0.0 < abs(account.step_error[-1]) < 1e-3 * account.turnover
    assert account.normal_stored[-1] > 10.0 * account.tangential_stored[-1] > 0.0


def test_ranks_account_alike(tmp_path):
    one, two, four = (column(tmp_path / str(ranks), WET, "run 500", ranks=ranks) for ranks in (1, 2, 4))
    for other in (two, four):
        other.assert_balanced()
        assert (other.imposed == 0.0).all()
        np.testing.assert_allclose(other.rows, one.rows, atol=1e-11 * one.turnover)


# --- what else may happen in a run ---

def bed(run: str, *, material: Material = DRY, ranks: int = 1, create: str = CREATE, state: str = STATE, fixes: str = "", every: int = 100) -> str:
    """64 grains that fall on a floor, periodic along it."""
    text = packing(material, f"{fixes}\n{FIX}\n{THERMO}thermo {every}\n{run}", create=create, state=state)
    return text.replace("processors 2 1 1\n", "") if ranks == 1 else text


def account_bed(folder: Path, text: str, *, ranks: int = 1) -> Account:
    return Account(run_deck(folder, text, ranks=ranks))


def test_several_runs_and_velocities_set_between(tmp_path):
    text = bed("run 1500\nvelocity all set 0.05 NULL NULL sum yes\nrun 500\nrun 200 pre no\ntimestep 5e-6\nrun 300")
    account = account_bed(tmp_path, text, ranks=1)
    account.assert_balanced()
    before, after = np.flatnonzero(account.step == 1500)
    assert account.imposed[before] == 0.0 and (account.imposed[after:] == account.imposed[after]).all()
    assert account.imposed[after] == pytest.approx(account.full[after] - account.full[before], rel=1e-12)


@pytest.mark.parametrize("place", ["before", "after"])
def test_velocities_set_by_another_fix_are_imposed(tmp_path, place):
    momentum = "fix still all momentum 10 linear 1 1 0"
    text = bed("run 800", fixes=momentum) if place == "before" else bed(f"{momentum}\nrun 800")
    account = account_bed(tmp_path, text)
    account.assert_balanced()
    assert account.imposed[-1] < -1e-6 * account.turnover


def test_moving_wall_and_an_output_of_contacts(tmp_path):
    """The plane gives energy by friction; forces that are computed for output only do not count."""
    plane = models(DRY, wall="primitive type 2 zplane 0")
    output = "compute pairs all pair/gran/local pos force\ndump pairs all local 50 pairs.dump c_pairs[1] c_pairs[7]\nrun 1500"
    account = account_bed(tmp_path, bed(output).replace(plane, plane.replace("zplane 0", "zplane 0 shear x 0.2")))
    account.assert_balanced()
    assert account.walls[-1] > 0.01 * account.turnover


def test_carried_liquid(tmp_path):
    text = bed("run 1000", material=WET, fixes="fix liquid all capillary/liquid content 0.01").replace("viscous on", "viscous on carried_liquid on")
    account = account_bed(tmp_path, re.sub(r"fix p_bridgeVolume.*\n", "", text))
    account.assert_balanced()
    assert max(account.bridges[-1], account.viscous[-1]) < -1e-3 * account.turnover


def test_grains_that_come_and_go(tmp_path):
    """Grains are inserted above, and others leave through an open side."""
    insertion = """\
fix kind all particletemplate/sphere 15485863 atom_type 1 density constant 2500 radius constant 0.002
fix kinds all particledistribution/discrete 32452843 1 kind 1.0
region top block 0.002 0.022 0.002 0.022 0.045 0.055 units box
fix more all insert/pack seed 49979687 distributiontemplate kinds vel constant 0. 0. -0.5 omega constant 10. 0. 0. insert_every 300 &
    overlapcheck yes all_in yes particles_in_region 6 region top"""
    account = account_bed(tmp_path, bed("run 1500", fixes=insertion).replace("boundary p p f", "boundary f p f"))
    account.assert_balanced()
    assert np.diff(account.atoms).max() > 1 and np.diff(account.atoms).min() < 0
    assert np.ptp(account.imposed) > 1e-3 * account.turnover
    np.testing.assert_allclose(account.kinetic, account.full, rtol=1e-14)


def test_driven_and_frozen_grains_are_walls(tmp_path):
    groups = "group stuck id 1 5 9\ngroup pushed id 17 33\ngroup free subtract all stuck pushed\nvelocity stuck set 0 0 0\n"
    drive = "fix free free nve/sphere\nfix hold stuck freeze\nfix push pushed move wiggle 0.0005 0 0.0005 0.02"
    account = account_bed(tmp_path, bed("run 2500", fixes=groups + drive).replace("fix motion all nve/sphere\n", ""))
    account.assert_balanced()
    assert abs(account.walls[-1]) > 0.01 * account.turnover and abs(account.step_error[-1]) < 1e-3 * account.turnover
    assert account.kinetic[0] < account.full[0]


def test_forces_that_are_no_part_are_other(tmp_path):
    roll = "fix roll all property/global coefficientRollingFriction peratomtypepair 2 0.1 0.1 0.1 0.1\n"
    words = models(DRY)
    text = bed("run 2500").replace(words, words.replace("finnie_rabinowicz", "finnie_rabinowicz rolling_friction cdt"))
    wall = models(DRY, wall="primitive type 2 zplane 0")
    text = text.replace(wall, wall.replace("finnie_rabinowicz", "finnie_rabinowicz rolling_friction cdt")).replace("pair_style", f"{roll}pair_style")
    account = account_bed(tmp_path, text)
    account.assert_balanced(other=False)
    assert account.other[-1] < -1e-4 * account.turnover


def test_linear_spring_and_limited_force(tmp_path):
    linear = replace(WET, viscosity=0.0, normal_law="hooke", presliding="exponential")
    text = bed("run 2000", material=linear)
    account = account_bed(tmp_path, text.replace("presliding exponential", "presliding exponential limitForce on"))
    account.assert_balanced()
    assert abs(account.tangential_damping[-1]) < 1e-15 * account.turnover and account.tangential_spring[-1] < -0.01 * account.turnover
    assert abs(account.step_error[-1]) < 1e-3 * account.turnover


@pytest.mark.parametrize("ranks", [1, 2])
def test_resumed_account_is_the_same_to_the_bit(tmp_path, ranks):
    whole = account_bed(tmp_path / "whole", bed("fix state all resume/exact 600 bed\nrun 1500", material=WET, ranks=ranks), ranks=ranks)
    account_bed(tmp_path / "broken", bed("fix state all resume/exact 600 bed\nrun 900", material=WET, ranks=ranks), ranks=ranks)
    again = bed("fix state all resume/exact 600 bed\nrun 1500 upto", material=WET, ranks=ranks, create="resume_state bed", state="")
    resumed = account_bed(tmp_path / "broken", again, ranks=ranks)
    assert resumed.step[0] == 600
    np.testing.assert_array_equal(resumed.rows[1:], whole.rows[7:])


def test_restart_on_other_ranks_goes_on(tmp_path):
    first = account_bed(tmp_path, bed("restart 1000 bed.*.restart\nrun 1200", ranks=2), ranks=2)
    second = account_bed(tmp_path, bed("run 500", create="read_restart bed.1000.restart", state=""))
    second.assert_balanced()
    # But for the tangential springs, which a stock restart file has from before the step.
    known = [k for k, name in enumerate(NAMES) if name != "tangential_stored"]
    np.testing.assert_allclose(second.rows[0, known], first.rows[10, known], atol=1e-14 * first.turnover)
    np.testing.assert_allclose(second.rows[2], first.rows[12], atol=1e-3 * first.turnover)  # the set-up has other forces


def test_without_the_fix_motion_is_the_same(tmp_path):
    """To round-off: with the fix the engine's own loop computes the pairs."""
    frames = []
    for name, words in (("with", bed("run 500")), ("without", packing(DRY, "run 500").replace("processors 2 1 1\n", ""))):
        assert run_deck(tmp_path / name, words.replace("all custom 1500", "all custom 500")).code == 0
        frames.append(liggghts_driver.read_dump(tmp_path / name / "grains.dump")[1][-1])
    np.testing.assert_allclose(frames[0][:, 1:7], frames[1][:, 1:7], atol=1e-10)


STOCK = "model hertz tangential history"


@pytest.mark.parametrize(("change", "told"), [
    (lambda t: t.replace(FIX, f"{FIX} every 5"), ("no keywords", "every")),
    (lambda t: t.replace(FIX, f"group some id 1\n{FIX.replace(' all ', ' some ')}"), ("group must be 'all'",)),
    (lambda t: t.replace(FIX, f"{FIX}\n{FIX.replace(' energy ', ' second ')}"), ("one such fix only", "fix energy")),
    (lambda t: t.replace(models(DRY, wall="primitive type 2 zplane 0"), f"{STOCK} primitive type 2 zplane 0"), ("tangential finnie_rabinowicz", "fix floor")),
    (lambda t: t.replace(models(DRY), STOCK).replace("tangential finnie_rabinowicz primitive", "tangential history primitive").replace(" presliding linear", ""),
     ("tangential finnie_rabinowicz", "pair style")),
    (lambda t: t.replace("fix motion all nve/sphere", ""), ("no grain follows its forces", "nve/sphere")),
    (lambda t: t.replace(FIX, f"{FIX}\nfix late all nve/sphere"), ("must come after fix late",)),
    (lambda t: t.replace("nve/sphere", "nve/limit radius_ratio 0.1"), ("fix motion (nve/limit)", "only fix nve/sphere")),
    (lambda t: t.replace(FIX, f"group one id 7\nfix push one move linear 0.1 0 0\n{FIX}"), ("atom 7", "fix motion and fix push", "disjoint")),
    (lambda t: t.replace("timestep", "run_style respa 2 2\ntimestep"), ("run_style verlet",)),
])
def test_what_it_cannot_account_for_is_told(tmp_path, change, told):
    done = run_deck(tmp_path, change(bed("run 10")))
    assert done.code != 0
    assert "energy/account" in done.error, done.output[-1500:]
    for words in told:
        assert words in done.error, done.error


def test_unfix(tmp_path):
    done = run_deck(tmp_path, bed(f"run 100\nthermo_style one\nunfix energy\nrun 100\n{FIX}\n{THERMO.splitlines()[2]}\nrun 100"))
    assert done.code == 0, done.output[-2000:]
