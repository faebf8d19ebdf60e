"""Parts of restart files of another format or size are refused in one line, and a full disk is noticed."""

from pathlib import Path

import pytest
from rig.fluid import dam, resumed
from rig.fluid import deck as fluid
from rig.liggghts_driver import run_deck
from rig.packing import CREATE, STATE, packing
from rig.restart_parts import OTHER, cut, spoil
from rig.scenarios import Material
from rig.walls import stl

FIXES = {
    "account": "fix account all energy/account",
    "watch": "fix watch all integration/monitor speed 1",
    "shaker": "fix lid all mesh/surface file lid.stl type 2\nfix shaker all wall/motion mesh lid harmonic amplitude 0 0 1e-4 frequency 20",
}
LID = [((0.01, 0.01, 0.04), (0.02, 0.01, 0.04), (0.01, 0.02, 0.04))]


def deck(fix: str, run: str, *, create: str = CREATE, state: str = STATE) -> str:
    material = Material(static_friction=0.5, kinetic_friction=0.4)
    return packing(material, f"{FIXES[fix]}\n{run}", create=create, state=state, every=500).replace("processors 2 1 1\n", "")


def assert_refused(folder: Path, again: str, fix: str, size: bool, file: str = "here.restart") -> None:
    spoil(folder / file, fix, size=size)
    done = run_deck(folder, again, name="again.in")
    assert done.code != 0, done.output[-1500:]
    assert (cut(fix) if size else OTHER) in done.error and fix in done.error, done.error


@pytest.mark.parametrize("size", [False, True], ids=["format", "size"])
@pytest.mark.parametrize("fix", FIXES)
def test_parts_of_another_version_are_refused(tmp_path: Path, fix: str, size: bool) -> None:
    (tmp_path / "lid.stl").write_text(stl(LID))
    done = run_deck(tmp_path, deck(fix, "run 20\nwrite_restart here.restart"))
    assert done.code == 0, done.error or done.output[-1500:]
    assert_refused(tmp_path, deck(fix, "run 20", create="read_restart here.restart", state=""), fix, size)


@pytest.mark.parametrize("size", [False, True], ids=["format", "size"])
@pytest.mark.parametrize("fix", ["fluid", "wall", "body3"])
def test_parts_of_fluids_of_another_version_are_refused(tmp_path: Path, fix: str, size: bool) -> None:
    text = fluid(dam(), 2, run="fix state all resume/exact 1 state\nrun 2")
    done = run_deck(tmp_path, text)
    assert done.code == 0, done.error or done.output[-1500:]
    # The command that resumes would find that the file has changed.
    again = resumed(text, 3).replace("resume_state state", "read_restart state.1.restart")
    assert_refused(tmp_path, again, fix, size, "state.1.restart")


def test_a_full_disk_is_noticed(tmp_path: Path) -> None:
    done = run_deck(tmp_path, deck("account", "run 20\nwrite_restart /dev/full"))
    assert done.code != 0 and "the restart file cannot be written; is the disk full?" in done.error, done.error or done.output[-1500:]
