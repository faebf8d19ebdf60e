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
@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
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
    refused(tmp_path, other.replace("resume_state bed", "read_restart stock.restart"),
            "this restart file has no exact state: it was written by restart or write_restart; read one that fix resume/exact has")
    # States are left as they are, and the way that the line shows is one.
    (tmp_path / "bed.200.restart.crc").rename(tmp_path / "kept")
    (tmp_path / "bed.100.restart.crc").unlink()
    text = other.replace("resume_state bed", "read_restart bed.200.restart").replace("fix state", "fix another").replace(
        "exact 100 bed", "exact 0 bed")
    assert "exactly" not in run(tmp_path, text, ranks=2)


def test_steps_are_not_counted_anew(tmp_path):
    """The newest state is that of the highest step."""
    refused(tmp_path, deck("run 250\nreset_timestep 0\nrun 250"), "reset")


def test_states_of_ranks_that_fix_balance_divided_are_refused(tmp_path):
    """The cuts are not in a restart file, and those of a new run are others: a run says so before it writes states."""
    states = "fix cuts all balance 100 1.0 shift z 10 1.0\n" + EVERY_200
    # Grains are in the lower half of the box.
    text = deck("run 450", ranks=2, states=states).replace("processors 2 1 1", "processors 1 1 2")
    assert "approximately: fix cuts (balance)" in run(tmp_path, text, 2)
    refused(tmp_path, deck("run 500 upto", ranks=2, resume=True, states=states),
            "the atoms or their candidates for contacts are others", ranks=2)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
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


# --- which fixes go on exactly --------------------------------------------------------------------------------------------

# Fixes of the list in one bed: groups of grains that are pushed, held, moved or limited, and walls.
EXACT = """\
group pushed id 1:8
group held id 9:12
group frozen id 13:14
group moved id 15:16
group limited id 17:20
group free subtract all moved limited
variable push equal 1e-3*sin(300*time)
fix own all property/atom d_number
fix push pushed addforce v_push 0 0
fix hold held setforce NULL NULL 0
fix drag held drag 0.01 0.01 0 1e-6 0.002
fix slow all viscous 1e-5
fix plane held planeforce 1 0 0
fix line held lineforce 0 1 0
fix still frozen freeze
fix rest all momentum 50 linear 1 1 0
fix side all wall/gran hertz/history 1e6 NULL 10 NULL 0.5 1 zplane NULL 0.03 shear x 0.1
fix top all wall/reflect zhi EDGE
fix motion free nve/sphere
fix shake moved move wiggle 0.0005 0 0 0.01
fix limit limited nve/limit 1e-5
compute energy all ke
fix mean all ave/time 1 20 20 c_energy
variable mean equal f_mean
fix means all print 100 "${mean}" append means.txt screen no title none
"""


def test_fixes_of_the_list_are_resumed_exactly(tmp_path):
    whole, broken = tmp_path / "whole", tmp_path / "broken"

    def text(run_command, resume=False):
        lines = EXACT if not resume else "".join(line for line in EXACT.splitlines(True) if not line.startswith("group"))
        states = EVERY_200.replace("table.csv", "table.csv means.txt")
        return deck(run_command, resume=resume, states=states).replace("fix motion all nve/sphere\n", lines)

    for folder, steps in ((whole, 900), (broken, 510)):
        said = run(folder, text(f"run {steps}"))
        assert "approximately" not in said
    assert "dembark: resumed at step 400 exactly" in run(broken, text("run 900 upto", resume=True))
    for name in ("grains.dump", "table.csv", "means.txt", "bed.800.restart"):
        assert (whole / name).read_bytes() == (broken / name).read_bytes(), name


INEXACT = {
    "fix rain (pour) begins anew": "region rain block 0.002 0.022 0.002 0.022 0.03 0.045 units box\n"
                                   "fix rain all pour 40 1 4321 region rain diam one 0.004",
    "fix heat (langevin) begins anew": "fix heat all langevin 1 1 0.1 4321",
    "fix swing (wall/gran) counts its time anew": "fix swing all wall/gran hertz/history 1e6 NULL 10 NULL 0.5 1 zplane NULL 0.06 "
                                                  "wiggle z 0.001 0.01",
    "fix mean (ave/time) averages over more than one interval": "fix mean all ave/time 1 20 20 c_thermo_temp ave running",
    "fix late (ave/time) is within an interval at step 400": "fix late all ave/time 1 30 30 c_thermo_temp",
    "fix bins (ave/histo) begins anew": "fix bins all ave/histo 1 20 20 -1 1 5 vz mode vector",
    "variable chance uses random": "variable chance equal 1e-6*random(0,1,4321)\nfix push all addforce v_chance 0 0",
    "variable past uses elapsed": "variable past equal elapsed*dt",
}


def test_fixes_with_a_state_of_their_own_are_named(tmp_path):
    """The engine begins them anew: what goes on is another run, and says so, beforehand and when it goes on."""
    lines = "".join(f"{line}\n" for line in INEXACT.values())
    told = run(tmp_path, deck("run 450").replace("fix motion", lines + "fix motion"))
    warned = next(line for line in told.splitlines() if "goes on from these states approximately" in line)
    said = run(tmp_path, deck("run 460 upto", resume=True).replace("fix motion", lines + "fix motion"))
    reasons = next(line for line in said.splitlines() if "dembark: resumed at step 400 approximately: " in line)
    for reason in INEXACT:
        assert reason in reasons
        assert reason.replace("400", "200") in warned


def test_what_another_run_changed_is_named(tmp_path):
    run(tmp_path, deck("run 250"))
    other = deck("run 210 upto", resume=True)
    for old, new in (("timestep 1e-5", "timestep 2e-5"), ("gravity 9.81", "gravity 9.8"), ("static_friction 0.6", "static_friction 0.65"),
                     ("wall/dembark region floor type 3", "wall/dembark region floor type 1"),
                     ("fix motion", "group low region floor\ngroup some type 1\nfix extra some setforce NULL NULL NULL\nfix motion")):
        other = other.replace(old, new)
    other = "\n".join(line for line in other.splitlines() if "fix table" not in line) + "\n"
    said = run(tmp_path, other)
    reasons = next(line for line in said.splitlines() if "dembark: resumed at step 200 approximately: " in line)
    for reason in ("timestep was 1.0000000000000001e-05, and is 2.0000000000000002e-05", "acceleration of fix weight was 0 0 -9.81",
                   "fix floor was wall/dembark region floor type 3, and is wall/dembark region floor type 1",
                   "coefficients of the pair style changed", "fix extra (setforce) is not in the state",
                   "fix table (print) of the state is missing", "number of atoms of group some (24) is not in the state"):
        assert reason in reasons, reasons


# --- what a resumed run appends to ------------------------------------------------------------------------------------------

OUTPUT = """\
compute slabs all chunk/atom bin/1d z lower 0.01 units box
fix mean all ave/time 1 5 50 c_thermo_temp c_thermo_press {how} mean.txt
fix named all ave/time 1 5 50 c_thermo_temp title1 "my table" title2 "n a" {how} named.txt
fix rows all ave/time 1 5 50 c_thermo_press mode vector {how} rows.txt
fix slabs all ave/chunk 1 5 50 slabs vz density/mass {how} slabs.txt
fix bins all ave/histo 1 5 50 -1 1 5 vz mode vector {how} bins.txt
fix words all print 50 "no step, but ${{energy}}" {how} words.txt screen no
dump timed all custom 50 timed.dump id x y z
dump_modify timed units yes time yes sort id
dump yaml all yaml 50 frames.yaml id x y z
dump_modify yaml sort id
dump xyz all xyz 50 frames.xyz
dump_modify xyz sort id
dump binary all custom 50 frames.bin id x y z
dump_modify binary sort id
"""
FILES = ("mean.txt", "named.txt", "rows.txt", "slabs.txt", "bins.txt", "words.txt", "timed.dump", "frames.yaml", "frames.xyz", "frames.bin",
         "grains.dump", "table.csv")


def with_output(run_command, resume=False):
    lines = OUTPUT.format(how="append" if resume else "file")
    if resume:
        lines += "".join(f"dump_modify {name} append yes\n" for name in ("timed", "yaml", "xyz", "binary"))
    states = f"fix state all resume/exact 200 bed cut {' '.join(FILES)}\n"
    return deck(lines + run_command, resume=resume, states="").replace(run_command, states + run_command)


def test_every_output_goes_on_where_the_state_ends(tmp_path):
    """No row of theirs is lost and none is there twice, whatever the format; rows of before do not come from the resumed run."""
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    for folder, steps in ((whole, 900), (broken, 530)):
        run(folder, with_output(f"run {steps}"))
    said = run(broken, with_output("run 900 upto", resume=True))
    assert "what was written up to step 400 is in frames.bin.until-400" in said
    assert "dembark: resumed at step 400 approximately: fix slabs (ave/chunk) begins anew or differently" in said
    for name in FILES:
        one, other = (folder / name for folder in (whole, broken))
        if name == "frames.bin":
            # LAMMPS writes such a file anew.
            assert one.read_bytes() == (broken / "frames.bin.until-400").read_bytes() + other.read_bytes()
            continue
        if name == "timed.dump":
            assert [line for line in other.read_text().splitlines() if line not in ("ITEM: UNITS", "si")] == [
                line for line in one.read_text().splitlines() if line not in ("ITEM: UNITS", "si")]
        else:
            assert one.read_bytes() == other.read_bytes(), name
        # What was cut off is kept, because this run goes on approximately.
        assert (broken / f"{name}.after-400").stat().st_size > 0


def test_files_that_are_not_those_of_the_state_are_left(tmp_path):
    run(tmp_path, deck("run 450"))
    (tmp_path / "table.csv").write_text("another table\n" * 100)
    (tmp_path / "notes.txt").write_text("585 grains\n715 grains\n")
    text = deck("run 460 upto", resume=True, states=EVERY_200.replace("table.csv", "table.csv notes.txt"))
    said = run(tmp_path, text)
    assert "dembark: file table.csv is left as it is: it is another one than at step 400" in said
    assert "dembark: file notes.txt is left as it is: nothing in it says" in said
    assert (tmp_path / "notes.txt").read_text() == "585 grains\n715 grains\n"
    # Nothing is cut before the run is known to go on.
    before = (tmp_path / "grains.dump").read_bytes()
    refused(tmp_path, text.replace("neighbor 0.002 bin", "neighbor 0.0025 bin"), "the atoms or their candidates for contacts are others")
    assert (tmp_path / "grains.dump").read_bytes() == before
