"""Parts of restart files of another format or size are refused in one line, and a full disk is noticed."""

from dataclasses import replace

import pytest
from lammps_bed import CREATE, STATE, WET, bed
from rig.lammps_driver import run_deck
from rig.restart_parts import OTHER, cut, spoil

FIXES = {
    "floor": "",
    "account": "fix account all energy/account",
    "watch": "fix watch all integration/monitor speed 1",
    "liquid": "fix liquid all capillary/liquid content 0.01",
    "shaker": "fix shaker all wall/dembark region floor type 3 motion harmonic amplitude 0 0 1e-4 frequency 20",
}


def deck(fix: str, run: str, *, create: str = CREATE, state: str = STATE) -> str:
    text = bed(f"{FIXES[fix]}\n{run}", material=replace(WET, bridge_volume=0.0), create=create, state=state)
    if fix == "liquid":
        text = text.replace("pair_style dembark/granular", "pair_style dembark/granular capillary_model exact surface_tension 0.07 "
                            "carried_liquid on").replace("pair_coeff 1 2", "pair_coeff * * contact_angle 0.35\npair_coeff 1 2")
    return text


@pytest.mark.parametrize("size", [False, True], ids=["format", "size"])
@pytest.mark.parametrize("fix", FIXES)
def test_parts_of_another_version_are_refused(tmp_path, fix, size):
    done = run_deck(tmp_path, deck(fix, "run 20\nwrite_restart here.restart"))
    assert done.code == 0, done.error or done.output[-1500:]
    spoil(tmp_path / "here.restart", fix, size=size)
    done = run_deck(tmp_path, deck(fix, "run 20", create="read_restart here.restart", state=""), name="again.in")
    assert done.code != 0, done.output[-1500:]
    surface = size and fix in ("floor", "shaker")
    expected = "the restart file was written with another surface" if surface else cut(fix) if size else OTHER
    assert expected in done.error and f"fix {fix} " in done.error, done.error


def test_a_full_disk_is_noticed(tmp_path):
    done = run_deck(tmp_path, deck("account", "run 20\nwrite_restart /dev/full"))
    assert done.code != 0 and "the restart file cannot be written; is the disk full?" in done.error, done.error or done.output[-1500:]
