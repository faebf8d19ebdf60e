"""fix resume/exact and resume_state: a resumed run is the same to the bit, whatever the models; mistakes are told in one line."""

import signal
import subprocess
import time

import pytest
from lammps_bed import CREATE, STATE, WET, bed
from rig import lammps_driver
from rig.lammps_driver import run_deck
from rig.liggghts_driver import read_dump
from rig.scenarios import Material

DRY = Material(static_friction=0.5, kinetic_friction=0.4)
# A floor that moves: how it did so in the last step is in the state.
MOVING = "variable rise equal 1e-4*sin(200*time)\nregion floor plane 0 0 0 0 0 1 units box move NULL NULL v_rise"
STATES = "fix state all resume/exact {every} bed cut grains.dump table.csv\n"
EVERY_200 = STATES.format(every=200)
STOCK = "pair_style granular\npair_coeff * * hertz/material 5e6 0.6 0.3 tangential mindlin NULL 1.0 0.5 rolling sds 1e3 0.1 0.1"


def deck(run, *, ranks=1, resume=False, material=WET, newton="off", states=EVERY_200):
    how = "append" if resume else "file"
    table = ('variable step equal step\nvariable energy equal ke\n'
             f'fix table all print 50 "${{step}},${{energy}}" {how} table.csv screen no title "step,energy"\n')
    text = bed(table + states + run, material=material, newton=newton, create="resume_state bed" if resume else CREATE,
               state="" if resume else STATE, head="processors 2 1 1" if ranks == 2 and not resume else "")
    text = text.replace("region floor plane 0 0 0 0 0 1 units box", MOVING)
    return text.replace("dump_modify grains", "dump_modify grains append yes") if resume else text


def run(folder, text, ranks=1):
    done = run_deck(folder, text, ranks=ranks)
    assert done.code == 0, done.error or done.output[-1500:]
    return done.output


def refused(folder, text, told, ranks=1):
    done = run_deck(folder, text, ranks=ranks)
    assert done.code != 0
    errors = [line for line in done.output.splitlines() if line.startswith("ERROR")]
    assert len(errors) == 1 and told in errors[0], done.output[-1500:]


@pytest.mark.parametrize(("material", "newton"), [(WET, "off"), (DRY, "on")], ids=["wet, all histories", "dry, newton on"])
@pytest.mark.parametrize("ranks", [1, 2])
def test_resumed_run_is_the_same_to_the_bit(tmp_path, material, newton, ranks):
    """States every 200 steps, frames every 500: state 400 is resumed where frame 500 and some rows were written already."""
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    for folder, steps in ((whole, 900), (broken, 510)):
        run(folder, deck(f"run {steps}", ranks=ranks, material=material, newton=newton), ranks)
    said = run(broken, deck("run 900 upto", ranks=ranks, resume=True, material=material, newton=newton), ranks)
    assert "dembark: resumed at step 400 exactly" in said
    for name in ("grains.dump", "table.csv", "bed.800.restart"):
        assert (whole / name).read_bytes() == (broken / name).read_bytes(), name
    left = sorted(path.name for path in broken.glob("bed.*"))
    assert left == [f"bed.{step}.restart{end}" for step in (600, 800) for end in ("", ".crc")]


def test_run_that_is_killed_goes_on(tmp_path):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    states = STATES.format(every=50)
    run(whole, deck("run 4000", states=states))
    broken.mkdir()
    (broken / "case.in").write_text(deck("run 4000", states=states))
    engine = subprocess.Popen([lammps_driver.engine(), "-in", "case.in", "-log", "none"], cwd=broken, stdout=subprocess.DEVNULL)
    while engine.poll() is None and not (broken / "bed.1000.restart.crc").exists():
        time.sleep(0.002)
    engine.send_signal(signal.SIGKILL)
    assert engine.wait() == -signal.SIGKILL
    assert "exactly" in run(broken, deck("run 4000 upto", resume=True, states=states))
    for name in ("grains.dump", "table.csv", "bed.3950.restart"):
        assert (whole / name).read_bytes() == (broken / name).read_bytes(), name


def test_pair_style_of_lammps_is_resumed_too(tmp_path):
    whole, broken = tmp_path / "whole", tmp_path / "broken"

    def stock(run_command, resume=False):
        text = deck(run_command, resume=resume, material=DRY).replace("fix floor all wall/dembark region floor type 3", "").replace(
            " f_floor[1] f_floor[2] f_floor[3]", "")
        lines = [line for line in text.splitlines() if not line.startswith(("pair_", "variable rise", "region floor"))]
        at = next(k for k, line in enumerate(lines) if line.startswith("timestep"))
        wall = "fix floor all wall/gran granular hertz/material 5e6 0.6 0.3 tangential mindlin NULL 1.0 0.5 zplane 0 NULL"
        return "\n".join([*lines[: at + 1], STOCK, *lines[at + 1 :]]).replace("fix weight", wall + "\nfix weight") + "\n"

    for folder, steps in ((whole, 900), (broken, 510)):
        run(folder, stock(f"run {steps}"))
    assert "exactly" in run(broken, stock("run 900 upto", resume=True))
    assert (whole / "grains.dump").read_bytes() == (broken / "grains.dump").read_bytes()


def test_stock_restart_is_not_exact(tmp_path):
    """What the fix is for: the same with LAMMPS's commands differs, by the forces of the set-up."""
    run(tmp_path / "whole", deck("run 500", states=""))
    run(tmp_path / "broken", deck("run 250\nwrite_restart bed.restart", states=""))
    run(tmp_path / "broken", deck("run 500 upto", states="", resume=True).replace("resume_state bed", "read_restart bed.restart"))
    one, other = (read_dump(tmp_path / name / "grains.dump")[1][-1] for name in ("whole", "broken"))
    assert (one != other).any()


@pytest.mark.parametrize(("words", "told"), [
    ("resume/exact", "fix state resume/exact: it must have the form"), ("resume/exact ten bed", "EVERY >= 0 steps"),
    ("resume/exact -1 bed", ">= 0 steps"), ("resume/exact 5 bed keep x", "it must have the form"), ("resume/exact 5 bed*", "must not hold"),
    ("resume/exact 5 bed\nfix late all gravity 1 vector 1 0 0", "must come after fix late"),
])
def test_mistakes_of_the_fix(tmp_path, words, told):
    refused(tmp_path, deck("run 10", states=f"fix state all {words}\n"), told)


@pytest.mark.parametrize(("words", "told"), [("resume_state", "the form resume_state BASE"),
                                             ("resume_state bed", "there is no whole state bed.<step>")])
def test_mistakes_of_the_command(tmp_path, words, told):
    refused(tmp_path, deck("run 10", resume=True).replace("resume_state bed", words), told)


def test_what_does_not_fit_is_refused(tmp_path):
    states = STATES.format(every=100)
    run(tmp_path, deck("run 250", states=states + "write_restart stock.restart\n"))
    other = deck("run 260 upto", resume=True, states=states)
    refused(tmp_path, other, "bed.200.restart is of 1 ranks, the run has 2", ranks=2)
    refused(tmp_path, other.replace("resume_state", "read_restart").replace(" bed\n", " bed.200.restart\n", 1),
            "the state is of 1 ranks, the run has 2", ranks=2)
    refused(tmp_path, other.replace("neighbor 0.002 bin", "neighbor 0.0025 bin"), "the atoms or their candidates for contacts are others")
    refused(tmp_path, other.replace("resume_state bed", "read_restart stock.restart"), "was not written by this fix")
    # States are left as they are, and the way that the line shows is one.
    (tmp_path / "bed.200.restart.crc").rename(tmp_path / "kept")
    (tmp_path / "bed.100.restart.crc").unlink()
    text = other.replace("resume_state bed", "read_restart bed.200.restart").replace("fix state", "fix another").replace(
        "exact 100 bed", "exact 0 bed")
    assert "exactly" not in run(tmp_path, text, ranks=2)


@pytest.mark.parametrize("ranks", [1, 2])
def test_run_that_begins_anew_deletes_no_state(tmp_path, ranks):
    text = deck("run 450", ranks=ranks, states=STATES.format(every=200))
    run(tmp_path, text, ranks)
    before = {path.name: path.read_bytes() for path in tmp_path.glob("bed.*")}
    assert len(before) == 4
    refused(tmp_path, text, "bed.400.restart; go on from it by resume_state, move it away", ranks)
    assert {path.name: path.read_bytes() for path in tmp_path.glob("bed.*")} == before


def test_state_that_is_not_whole_does_not_stand_in_the_way(tmp_path):
    tmp_path.joinpath("bed.90000.restart").write_bytes(b"broken")
    run(tmp_path, deck("run 450", states=STATES.format(every=200)))
    assert sorted(path.name for path in tmp_path.glob("bed.*.restart")) == ["bed.200.restart", "bed.400.restart"]
