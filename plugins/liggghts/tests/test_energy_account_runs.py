"""fix energy/account in all that happens to a run: several runs, restarts, grains that come, go or are driven, other forces, mistakes."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig import liggghts_driver
from rig.cloud import DECK, cloud
from rig.energy_account import COLUMNS, FIX, NAMES, THERMO, Account
from rig.liggghts_driver import models, run_deck
from rig.packing import CREATE, STATE, packing
from rig.scenarios import Material

DRY = Material(static_friction=0.5, kinetic_friction=0.4, restitution=0.6, youngs_modulus=5e6)
WET = replace(DRY, bridge_volume=5e-11, viscosity=0.01, capillary_model="willett")


def bed(run: str, *, material: Material = DRY, ranks: int = 1, create: str = CREATE, state: str = STATE, fixes: str = "",
        every: int = 100) -> str:
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


@pytest.mark.parametrize("viscosity", [0.01, 0.0], ids=["viscous", "in packs"])
def test_carried_liquid(tmp_path, viscosity):
    material = replace(WET, viscosity=viscosity)
    text = bed("run 1000", material=material, fixes="fix liquid all capillary/liquid content 0.01")
    options = "viscous_liquid on" if viscosity else "capillary_model willett"
    assert options in text
    account = account_bed(tmp_path, re.sub(r"fix p_bridgeVolume.*\n", "", text.replace(options, f"{options} carried_liquid on")))
    account.assert_balanced()
    assert account.bridges[-1] < -1e-3 * account.turnover
    assert (account.viscous[-1] < -1e-3 * account.turnover) == (viscosity > 0.0)


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


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_deleted_grains(tmp_path, ranks):
    """Their kinetic energy is imposed; what their springs held is no error of the step."""
    text = bed("run 1200\ngroup some id 1:20\ndelete_atoms group some compress no\nrun 600", ranks=ranks)
    account = account_bed(tmp_path, text, ranks=ranks)
    account.assert_balanced()
    before, after = np.flatnonzero(account.step == 1200)
    assert account.atoms[after] == account.atoms[before] - 20
    assert account.normal_stored[after] < account.normal_stored[before]
    assert account.imposed[after] == pytest.approx(account.full[after] - account.full[before], rel=1e-12)
    assert account.step_error[after] == pytest.approx(account.step_error[before], abs=1e-13 * account.turnover)


def test_driven_and_frozen_grains_are_walls(tmp_path):
    groups = "group stuck id 1 5 9\ngroup pushed id 17 33\ngroup free subtract all stuck pushed\nvelocity stuck set 0 0 0\n"
    drive = "fix free free nve/sphere\nfix hold stuck freeze\nfix push pushed move wiggle 0.0005 0 0.0005 0.02"
    account = account_bed(tmp_path, bed("run 2500", fixes=groups + drive).replace("fix motion all nve/sphere\n", ""))
    account.assert_balanced()
    assert abs(account.walls[-1]) > 0.01 * account.turnover and abs(account.step_error[-1]) < 1e-3 * account.turnover
    assert account.kinetic[0] < account.full[0]


@pytest.mark.parametrize("spin", [0.0, 30.0])
def test_grains_whose_spin_is_blocked(tmp_path, spin):
    """fix nve moves them and does not turn them: a spin that they have is that of a driven body, and no kinetic energy of theirs."""
    turned = f"variable spin atom {spin}\nset group all omegay v_spin\n" if spin else ""
    words = bed("run 2500", fixes=turned).replace("nve/sphere", "nve")
    account = account_bed(tmp_path, words)
    account.assert_balanced()
    assert abs(account.tangential_spring[-1]) > 0.01 * account.turnover
    if spin:
        assert abs(account.walls[-1]) > 1e-3 * account.turnover and account.kinetic[-1] < account.full[-1]
    else:
        assert abs(account.walls[-1]) < 1e-15 * account.turnover
        np.testing.assert_allclose(account.kinetic, account.full, rtol=1e-13)


def test_forces_that_are_no_part_are_other(tmp_path):
    roll = "fix roll all property/global coefficientRollingFriction peratomtypepair 2 0.1 0.1 0.1 0.1\n"
    words = models(DRY)
    text = bed("run 2500").replace(words, words.replace("finnie_rabinowicz", "finnie_rabinowicz rolling_friction cdt"))
    wall = models(DRY, wall="primitive type 2 zplane 0")
    text = text.replace(wall, wall.replace("finnie_rabinowicz", "finnie_rabinowicz rolling_friction cdt"))
    text = text.replace("pair_style", f"{roll}pair_style")
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


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
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


@pytest.mark.parametrize("material", [DRY, replace(WET, viscosity=0.0)], ids=["dry", "bridges"])
def test_without_the_fix_motion_is_the_same(tmp_path, material):
    """To the bit, and with grains that touch when a run is set up."""
    frames = []
    for name, words in (("with", bed("run 1000\nrun 500", material=material)),
                        ("without", packing(material, "run 1000\nrun 500").replace("processors 2 1 1\n", ""))):
        assert run_deck(tmp_path / name, words).code == 0
        frames.append(liggghts_driver.read_dump(tmp_path / name / "grains.dump")[1][-1])
    assert np.isfinite(frames[0]).all()
    np.testing.assert_array_equal(frames[0], frames[1])


SETTINGS = ["", "limitForce on", "tangential_damping off", "presliding exponential", "presliding partial_slip",
            "rolling_resistance elastic_plastic"]


@pytest.mark.parametrize(("cohesion", "settings"), [
    pytest.param(cohesion, settings, marks=pytest.mark.full if cohesion and settings else ())
    for cohesion in ("", "cohesion capillary") for settings in SETTINGS])
def test_packs_account_as_the_engines_loop_does(tmp_path, monkeypatch, settings, cohesion):
    """In two runs, of grains of two types, some of which are stuck to the floor and to each other."""
    text = DECK.format(cohesion=cohesion, rolling="", settings=settings).replace("stuck id 1:64", "stuck id 1:128")
    text = text.replace("Friction peratomtypepair 2 0 0 0 0", "Friction peratomtypepair 2 0.1 0 0 0.3")
    damping = "fix m12 all property/global coefficientRollingViscousDamping peratomtypepair 2 0.3 0 0 0.1"
    text = text.replace("pair_style", f"{damping}\npair_style")
    text = text.replace("thermo 100", f"{FIX}\n{THERMO}thermo 50").replace("run 1000", "run 600\nrun 600")
    accounts = []
    for lanes in ("8", "1"):
        monkeypatch.setenv("DEMBARK_LANES", lanes)
        (tmp_path / lanes).mkdir()
        (tmp_path / lanes / "cloud.data").write_text(cloud())
        accounts.append(Account(run_deck(tmp_path / lanes, text)))
    packs, loop = accounts
    packs.assert_balanced()
    assert (packs.imposed == 0.0).all() and np.isfinite(packs.rows).all()
    present = {"normal_damping", "tangential_spring"} | ({"bridges"} if cohesion else set()) | (
        {"rolling_damping"} if "rolling" in settings else set())
    for name in present:
        assert abs(getattr(packs, name)[-1]) > 1e-8 * packs.turnover, name
    for name, mine, other in zip(NAMES, packs.rows.T, loop.rows.T, strict=True):
        np.testing.assert_allclose(mine, other, rtol=0.0, atol=1e-8 * np.abs(other).max() + 1e-14 * packs.turnover, err_msg=name)


STOCK = "model hertz tangential history"


@pytest.mark.parametrize(("change", "told"), [
    (lambda t: t.replace(FIX, f"{FIX} every 5"), ("no keywords", "every")),
    (lambda t: t.replace(FIX, f"group some id 1\n{FIX.replace(' all ', ' some ')}"), ("group must be 'all'",)),
    (lambda t: t.replace(FIX, f"{FIX}\n{FIX.replace(' energy ', ' second ')}"), ("one such fix only", "fix energy")),
    (lambda t: t.replace(models(DRY, wall="primitive type 2 zplane 0"), f"{STOCK} primitive type 2 zplane 0"),
     ("tangential finnie_rabinowicz", "fix floor")),
    (lambda t: (t.replace(models(DRY), STOCK)
                .replace("tangential finnie_rabinowicz primitive", "tangential history primitive").replace(" presliding linear", "")),
     ("tangential finnie_rabinowicz", "pair style")),
    (lambda t: t.replace("fix motion all nve/sphere", ""), ("no grain follows its forces", "nve/sphere")),
    (lambda t: t.replace(FIX, f"{FIX}\nfix late all nve/sphere"), ("must come after fix late",)),
    (lambda t: t.replace("nve/sphere", "nve/limit radius_ratio 0.1"), ("fix motion (nve/limit)", "only fix nve/sphere, fix nve")),
    (lambda t: t.replace(FIX, f"group one id 7\nfix push one move linear 0.1 0 0\n{FIX}"),
     ("atom 7", "fix motion and fix push", "disjoint")),
    (lambda t: t.replace(FIX, f"fix squeeze all deform 1 x erate -0.1\n{FIX}"), ("constant size and shape", "fix squeeze (deform)")),
    (lambda t: t.replace("timestep", "run_style respa 2 2\ntimestep"), ("run_style verlet",)),
])
def test_what_it_cannot_account_for_is_told(tmp_path, change, told):
    done = run_deck(tmp_path, change(bed("run 10")))
    assert done.code != 0
    assert "energy/account" in done.error, done.output[-1500:]
    for words in told:
        assert words in done.error, done.error


def test_atoms_that_go_within_a_run_are_told(tmp_path):
    deletion = 'group some id 1\nrun 10\nrun 10 pre no every 5 "delete_atoms group some compress no"'
    done = run_deck(tmp_path, bed(deletion))
    assert done.code != 0
    assert "atoms when forces were computed and" in done.error, done.error or done.output[-1500:]


def test_unfix(tmp_path):
    done = run_deck(tmp_path, bed(f"run 100\nthermo_style one\nunfix energy\nrun 100\n{FIX}\n{COLUMNS}\nrun 100"))
    assert done.code == 0, done.output[-2000:]
