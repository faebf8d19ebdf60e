"""Ranks, newton's third law over borders, restarts and the forces of single pairs, on a wet packing with all histories."""

import re
from dataclasses import replace

import numpy as np
import pytest
from lammps_bed import COLUMNS, WET, bed
from rig.lammps_driver import run_deck
from rig.liggghts_driver import read_dump
from rig.scenarios import Material


def run(folder, text, ranks=1):
    done = run_deck(folder, text, ranks=ranks)
    assert done.code == 0 and not done.error, done.error or done.output[-1500:]
    return read_dump(folder / "grains.dump")[1]


def assert_same(a, b, tolerance):
    assert (a[:, 0] == b[:, 0]).all()
    for k in (1, 4, 7, 10, 13, 16):
        assert np.abs(a[:, k : k + 3] - b[:, k : k + 3]).max() < tolerance * np.abs(a[:, k : k + 3]).max(), k


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    return run(tmp_path_factory.mktemp("serial"), bed("run 2000"))


def test_grains_collide_and_touch_the_floor(serial):
    assert (serial[-1][:, 18] != 0.0).sum() > 3 and len(serial) == 5
    held = serial[-1][:, 10:13] - serial[-1][:, 16:19]
    assert np.abs(held).max() > 1e-3


@pytest.mark.parametrize(("ranks", "newton", "head"), [
    (1, "on", ""), (2, "off", "processors 2 1 1"), pytest.param(2, "on", "processors 1 2 1", marks=pytest.mark.full),
    (1, "off", "atom_modify sort 100 0.005")])
def test_parallel_runs_give_the_same(serial, tmp_path, ranks, newton, head):
    # Sums in another order: chaos has 1000 steps to grow round-off.
    found = run(tmp_path, bed("run 1000", newton=newton, head=head), ranks)
    assert_same(serial[2], found[2], 1e-8)


@pytest.mark.parametrize("presliding", ["partial_slip", "exponential"])
def test_what_is_asked_of_a_step_does_not_change_it(tmp_path, presliding):
    """The virial needs the forces of single pairs, and runs that ask for it at other steps are the same to the bit."""
    text = bed("run 1000", material=replace(WET, presliding=presliding))
    run(tmp_path / "asked", text.replace("thermo 1000", "thermo 7"))
    run(tmp_path / "left", text)
    assert (tmp_path / "asked/grains.dump").read_bytes() == (tmp_path / "left/grains.dump").read_bytes()


DRY = Material(static_friction=0.5, kinetic_friction=0.3, critical_slip_distance=2e-6, healing_time=1e-3)


@pytest.mark.parametrize("lanes", ["2", "4"])
def test_narrower_packs_give_the_same_bits(tmp_path, monkeypatch, lanes):
    """Of contacts that stick, slip and heal."""
    run(tmp_path / "wide", bed("run 2000", material=DRY))
    monkeypatch.setenv("DEMBARK_LANES", lanes)
    run(tmp_path / "narrow", bed("run 2000", material=DRY))
    assert (tmp_path / "wide/grains.dump").read_bytes() == (tmp_path / "narrow/grains.dump").read_bytes()


def test_steps_of_zero_length_change_nothing(tmp_path):
    """Contacts that slide neither stick in them nor forget their slip."""
    material = replace(DRY, healing_time=0.0)
    end = f"write_dump all custom end.dump {COLUMNS} modify sort id format float %.17g"
    for folder, between in (("left", ""), ("asked", "timestep 0.0\nrun 2\ntimestep 1e-5\n")):
        run(tmp_path / folder, bed(f"run 1000\n{between}run 500\n{end}", material=material))
    left, asked = (read_dump(tmp_path / folder / "end.dump")[1][0] for folder in ("left", "asked"))
    assert (np.abs(left[:, 10:13]) > 0.0).any()
    np.testing.assert_array_equal(left, asked)


def test_the_virial_is_that_of_the_pairs(tmp_path):
    """Sum of F.r over the pairs, which compute pair/local tells, over three volumes, without damping, so that forces know no velocity."""
    ask = " ".join(f"p{k}" for k in (1, 2, 3, 13, 14, 15, 16, 17, 18))
    text = bed(f"""\
compute forces all pair/local {ask}
compute virial all pressure NULL virial
dump pairs all local 500 pairs.dump index {" ".join(f"c_forces[{k}]" for k in range(1, 10))}
dump_modify pairs format float %.17g
thermo_style custom step c_virial
thermo_modify format float %.17g
run 1000""", newton="on", material=replace(WET, restitution=1.0, rolling_damping_ratio=0.0))
    done = run_deck(tmp_path, text)
    told = float(re.findall(r"^ +1000 +(\S+)", done.output, re.MULTILINE)[-1])
    rows = read_dump(tmp_path / "pairs.dump")[1][2][:, 1:]
    due = np.einsum("ij,ij->", rows[:, :3], rows[:, 3:6] - rows[:, 6:9]) / (3.0 * 0.024 * 0.024 * 0.051)
    assert len(rows) > 10 and told == pytest.approx(due, rel=1e-9)


def test_a_restart_keeps_histories(serial, tmp_path):
    """Not to the bit, for the set-up's forces have full-step velocities; but far nearer than with histories lost."""
    run(tmp_path, bed("run 1000\nwrite_restart state"))
    script = bed("run 500", create="read_restart state", state="")
    found = run(tmp_path, script)
    assert_same(serial[2], found[0], 0.3)
    kept = np.abs(found[1][:, 1:4] - serial[3][:, 1:4]).max()
    (tmp_path / "lost").mkdir()
    lost = run(tmp_path / "lost", script.replace("read_restart state", "read_restart ../state").replace(
        "pair_style", "pair_style zero 0.01\npair_coeff * *\nrun 0 post no\npair_style", 1))
    assert kept < 0.1 * np.abs(lost[1][:, 1:4] - serial[3][:, 1:4]).max()


def test_forces_of_pairs_add_up(tmp_path):
    """compute pair/local asks for one pair after the other; with the floor and the weight they are the forces of the step."""
    # Without damping forces do not know whether velocities are those of the half or of the full step.
    ask = " ".join(f"p{k}" for k in range(1, 19))
    text = bed(f"""\
compute pairs all property/local patom1 patom2
compute forces all pair/local {ask}
dump pairs all local 500 pairs.dump c_pairs[1] c_pairs[2] {" ".join(f"c_forces[{k}]" for k in range(1, 19))}
dump_modify pairs format float %.17g
run 1000""", newton="on", material=replace(WET, restitution=1.0, rolling_damping_ratio=0.0))
    frames = run(tmp_path, text)
    grains, pairs = frames[2], read_dump(tmp_path / "pairs.dump")[1][2]
    mass = 2500.0 * 4.0 / 3.0 * np.pi * (0.0025 * (1.0 + 0.1 * np.sin(37.0 * grains[:, 0]))) ** 3
    total = grains[:, 16:19] - 9.81 * mass[:, None] * [0.0, 0.0, 1.0]
    for row in pairs:
        for atom, sign in ((int(row[0]), 1.0), (int(row[1]), -1.0)):
            total[atom - 1] += sign * row[2:5]
    assert np.abs(total - grains[:, 10:13]).max() < 1e-9 * np.abs(grains[:, 10:13]).max()
    touching = pairs[pairs[:, 11] > 0.0]
    assert len(touching) > 10 and (touching[:, 12] > 0.0).all() and (touching[:, 13] == WET.bridge_volume).all()
    along = np.einsum("ij,ij->i", touching[:, 5:8], touching[:, 14:17] - touching[:, 17:20])
    assert np.abs(along).max() < 1e-12 * np.abs(touching[:, 2:5]).max()
