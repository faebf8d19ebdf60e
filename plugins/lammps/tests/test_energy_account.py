"""fix energy/account: the works of all forces balance the kinetic energy to round-off, in impacts and in a packing that falls."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lammps_bed import CREATE, STATE, WET, bed
from rig import lammps_driver, liggghts_driver
from rig.energy_account import FIX, NAMES, THERMO, Account
from rig.lammps_driver import run_deck
from rig.scenarios import CONSTANT, SPRING, Grain, Material, Scenario

DRY = Material(static_friction=0.5, kinetic_friction=0.4, restitution=0.6, youngs_modulus=5e6)
VISCOUS = replace(DRY, bridge_volume=5e-11, viscosity=0.01, capillary_model="willett")
GRAINS = (Grain(position=(1e-3, 5e-4, 9e-3), velocity=(-0.3, 0.2, -0.8), angular_velocity=(40.0, -25.0, 60.0)),
          Grain(radius=3e-3, position=(0.0, 0.0, 7.4e-4), velocity=(0.1, -0.1, 0.2), angular_velocity=(-10.0, 30.0, 15.0)))
MATERIALS = {"dry": DRY, "wet": VISCOUS, "rolling spring": replace(DRY, **SPRING), "constant torque": replace(DRY, **CONSTANT)}


@pytest.mark.parametrize("material", MATERIALS.values(), ids=list(MATERIALS))
def test_account_of_an_oblique_impact_is_that_of_liggghts(tmp_path: Path, material: Material) -> None:
    case = Scenario(name="impact", material=material, grains=GRAINS, time_step=2e-6, steps=1250, stride=50)
    accounts = []
    for driver in (lammps_driver, liggghts_driver):
        text = liggghts_driver.deck(case, start=f"{FIX}\n{THERMO}") if driver is liggghts_driver else lammps_driver.deck(case).replace(
            "dump grains", f"{FIX}\n{THERMO}dump grains")
        accounts.append(Account(driver.run_deck(tmp_path / driver.__name__, text.replace(f"thermo {case.steps}", "thermo 50"))))
    account, other = accounts
    account.assert_balanced()
    np.testing.assert_allclose(account.kinetic, account.full, rtol=1e-14)
    for name in NAMES:
        np.testing.assert_allclose(getattr(account, name), getattr(other, name), rtol=0.0, atol=1e-9 * account.turnover, err_msg=name)
    assert account.normal_spring.min() < -0.1 * account.turnover


@pytest.mark.parametrize("shape", ["", "disc"])
def test_the_account_knows_with_which_inertia_grains_turn(tmp_path: Path, shape: str) -> None:
    """In the plane fix nve/sphere turns spheres, or with `disc` solid cylinders."""
    text = f"""\
{lammps_driver.head("off", "f f p")}
dimension 2
region domain block -0.05 0.05 -0.05 0.05 -0.005 0.005 units box
create_box 1 domain
neighbor 0.001 bin
timestep 2e-6
pair_style dembark/granular {lammps_driver.settings(DRY)}
pair_coeff * * {lammps_driver.coefficients(DRY)}
create_atoms 1 single 0.0 0.0 0.0 units box
create_atoms 1 single 0.004 0.003 0.0 units box
set group all diameter 0.006 density 2500
set atom 1 vx 0.4 vy 0.1
set atom 2 vx -0.3 vy -0.2 omega 0 0 500
fix motion all nve/sphere {shape}
{FIX}
{THERMO}thermo 100
run 2000
"""
    account = Account(run_deck(tmp_path, text))
    account.assert_balanced()
    assert abs(account.tangential_spring[-1]) > 1e-3 * account.turnover
    assert (account.imposed == 0.0).all()


def falling(run: str, *, material: Material = WET, ranks: int = 1, create: str = CREATE, state: str = STATE) -> str:
    """The floor sinks at 0.1 m/s."""
    text = bed(f"{FIX}\n{THERMO}thermo 50\n{run}", material=material, create=create, state=state,
               head="processors 2 1 1" if ranks == 2 and state else "")
    moving = "variable sunk equal -0.1*time\nregion floor plane 0 0 0 0 0 1 units box move NULL NULL v_sunk"
    return text.replace("region floor plane 0 0 0 0 0 1 units box", moving)


@pytest.mark.parametrize("material", [DRY, VISCOUS, WET], ids=["dry", "viscous", "rolling, partial slip"])
def test_fall_on_a_floor_that_moves_balances(tmp_path: Path, material: Material) -> None:
    account = Account(run_deck(tmp_path, falling("run 2000", material=material)))
    account.assert_balanced()
    assert (account.imposed == 0.0).all()
    np.testing.assert_allclose(account.kinetic, account.full, rtol=1e-14)
    present = ("normal_damping", "tangential_spring", "tangential_damping", "walls")
    present += {DRY: (), VISCOUS: ("bridges", "viscous"), WET: ("rolling_spring", "rolling_damping")}[material]
    for name in present:
        assert abs(getattr(account, name)[-1]) > 1e-4 * account.turnover, name
    assert account.gravity[-1] > 0.0 > account.walls[-1]
    assert 0.0 < abs(account.step_error[-1]) < 1e-2 * account.turnover


@pytest.mark.parametrize("material", [DRY, replace(VISCOUS, viscosity=0.0), WET], ids=["dry", "bridges", "rolling, partial slip"])
def test_a_run_is_the_same_to_the_bit_with_the_account_and_without(tmp_path: Path, material: Material) -> None:
    end = "write_dump all custom end.dump id x y z vx vy vz omegax omegay omegaz modify sort id format float %a"
    text = falling(f"run 1000\n{end}", material=material)
    found = []
    for name, script in (("with", text), ("without", text.replace(f"{FIX}\n{THERMO}", ""))):
        assert run_deck(tmp_path / name, script).code == 0
        found.append((tmp_path / name / "end.dump").read_text(encoding="utf-8"))
    assert "0x1." in found[0]
    assert found[0] == found[1]


def test_the_gravity_of_an_accelerator_is_gravity(tmp_path: Path) -> None:
    """`suffix omp` makes a fix gravity/omp where LAMMPS has the package OPENMP."""
    text = falling("run 200")
    weight = next(line for line in text.splitlines() if line.startswith("fix weight"))
    plain, other = (Account(run_deck(tmp_path / name, text.replace(weight, script)))
                    for name, script in (("plain", weight), ("omp", f"suffix omp\n{weight}\nsuffix off")))
    other.assert_balanced()
    assert other.gravity[-1] == plain.gravity[-1] > 0.0


@pytest.mark.parametrize("lanes", ["8", "1"])
def test_grains_held_in_each_other_have_no_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lanes: str) -> None:
    """In steps as in the set-ups of two runs, in packs and one by one."""
    monkeypatch.setenv("DEMBARK_LANES", lanes)
    rolling = replace(DRY, **SPRING)
    text = f"""\
{lammps_driver.head("off", "f f f")}
region domain block -0.05 0.05 -0.05 0.05 -0.05 0.05 units box
create_box 1 domain
neighbor 0.001 bin
timestep 2e-6
pair_style dembark/granular {lammps_driver.settings(rolling)}
pair_coeff * * {lammps_driver.coefficients(rolling)}
create_atoms 1 single 0.0 0.0 0.0 units box
create_atoms 1 single 0.005 0.0 0.0 units box
create_atoms 1 single 0.002 0.0 0.0058 units box
set group all diameter 0.006 density 2500
set atom 3 vx 0.1 vz -0.3
group floor id 1:2
fix motion all nve/sphere
fix held floor freeze
{FIX}
{THERMO}thermo 50
run 500
run 500
"""
    account = Account(run_deck(tmp_path, text))
    account.assert_balanced()
    assert (account.imposed == 0.0).all()
    assert account.rolling_damping[-1] < -1e-6 * account.turnover
    # Half of the kinetic energy is stored in springs at times, and little is left at the end; those of the floor would hold more for ever.
    assert account.normal_stored.min() < 1e-3 * account.turnover < account.normal_stored.max() < account.turnover
    assert np.abs(account.step_error).max() < 1e-2 * account.turnover


def test_ranks_account_alike(tmp_path: Path) -> None:
    one, two = (Account(run_deck(tmp_path / str(ranks), falling("run 400", ranks=ranks), ranks=ranks)) for ranks in (1, 2))
    two.assert_balanced()
    np.testing.assert_allclose(two.rows, one.rows, atol=1e-11 * one.turnover)


def test_second_run_goes_on(tmp_path: Path) -> None:
    """What a set-up changes, and velocities that the script sets, are told apart from works."""
    account = Account(run_deck(tmp_path, falling("run 300\nvelocity all set 0 0 -0.5 sum yes units box\nrun 300")))
    account.assert_balanced()
    assert account.imposed[-1] > 0.1 * account.start[0]


def test_resumed_account_is_the_same_to_the_bit(tmp_path: Path) -> None:
    table = "thermo_modify norm no\nvariable step equal step\n" + "\n".join(
        f"variable e{k} equal f_energy[{k}]" for k in range(1, len(NAMES) + 1))
    columns = ",".join(f"${{e{k}}}" for k in range(1, len(NAMES) + 1))

    def text(run: str, how: str = "file", **words: str) -> str:
        return falling(f'{table}\nfix table all print 20 "${{step}},{columns}" {how} table.csv screen no title "step"\n'
                       f"fix state all resume/exact 200 bed cut table.csv\n{run}", **words)

    for name, steps in (("whole", 700), ("broken", 510)):
        assert run_deck(tmp_path / name, text(f"run {steps}")).code == 0
    done = run_deck(tmp_path / "broken", text("run 700 upto", "append", create="resume_state bed", state=""))
    assert done.code == 0 and "at step 400 exactly" in done.output, done.output[-1500:]
    assert (tmp_path / "whole/table.csv").read_bytes() == (tmp_path / "broken/table.csv").read_bytes()


@pytest.mark.parametrize(("old", "new", "told"), [
    (FIX, f"{FIX} now", "fix energy energy/account: it has no keywords, and there is 'now'"),
    (FIX, f"{FIX}\nfix second all energy/account", "there can be one such fix only, and there is fix energy"),
    (FIX, f"group few id 1\n{FIX.replace('all', 'few')}", "the group must be 'all'"),
    ("newton off", "newton on", "newton must be off"),
    ("fix motion all nve/sphere", "", "no grain follows its forces"),
    (FIX, f"unfix motion\n{FIX}\nfix motion all nve/sphere", "must come after fix motion (nve/sphere)"),
    (FIX, f"fix other all nve\n{FIX}", "atom 1 is moved by both fix motion and fix other"),
    ("fix motion all nve/sphere", "fix motion all nve/limit 0.1", "fix motion (nve/limit) moves atoms"),
    (FIX, f"fix squeeze all deform 1 x erate -0.1 remap v\n{FIX}", "a box of constant size and shape, and fix squeeze (deform) changes it"),
    (FIX, f"fix wall all wall/gran hooke/history 1e4 NULL 10 NULL 0.5 0 zplane 0 NULL\n{FIX}", "there is fix wall (wall/gran)"),
])
def test_mistakes(tmp_path: Path, old: str, new: str, told: str) -> None:
    text = falling("run 10")
    assert old in text
    done = run_deck(tmp_path, text.replace(old, new, 1))
    errors = [line for line in done.output.splitlines() if line.startswith("ERROR")]
    assert done.code != 0 and len(errors) == 1 and told in errors[0], done.output[-1500:]
