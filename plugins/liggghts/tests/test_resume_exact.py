"""fix resume/exact and resume_state: a resumed run is the same to the bit, whatever the models; mistakes are told in one line."""

import shutil
from dataclasses import replace

import pytest
from rig import liggghts_driver
from rig.liggghts_driver import run_deck
from rig.packing import CREATE, STATE, packing
from rig.scenarios import SPRING, Material
from rig.walls import stl

BED = Material(static_friction=0.5, kinetic_friction=0.4, interface_shear_strength=1e5, bridge_volume=2e-10)
STOCK = """\
fix roll all property/global coefficientRollingFriction peratomtypepair 2 0.1 0.1 0.1 0.1
fix loss all property/global coefficientRollingViscousDamping peratomtypepair 2 0.1 0.1 0.1 0.1
"""
STATES = "fix state all resume/exact {every} bed cut grains.dump\n"


def bed(stock, run_command, *, ranks, resume=False, material=BED):
    """A packing of 64 grains with our models, or with those of stock LIGGGHTS that keep histories."""
    text = packing(material, run_command, create="resume_state bed" if resume else CREATE, state="" if resume else STATE, every=500)
    if stock:
        kinds: tuple = (("pair", {}), ("wall", {"wall": "primitive type 2 zplane 0"}))
        ours = {word: liggghts_driver.models(material, **kind) for word, kind in kinds}
        models = "model hertz tangential history rolling_friction epsd2"
        text = text.replace(ours["wall"], f"{models} primitive type 2 zplane 0").replace(ours["pair"], models)
        text = text.replace("pair_style", STOCK + "pair_style")
    if resume:
        text = text.replace("dump_modify grains sort id", "dump_modify grains append yes sort id")
    return text if ranks == 2 else text.replace("processors 2 1 1\n", "")


@pytest.mark.parametrize(("stock", "material"), [(False, BED), (True, BED), (False, replace(BED, presliding="partial_slip", **SPRING))],
                         ids=["ours", "stock", "partial slip, rolling spring"])
@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_resumed_run_is_the_same_to_the_bit(tmp_path, stock, material, ranks):
    """States every 700 steps, frames every 500: state 1400 is resumed where frame 1500 was written already."""
    states = STATES.format(every=700)
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    for folder, steps in ((whole, 3000), (broken, 1600)):
        done = run_deck(folder, bed(stock, f"{states}run {steps}", ranks=ranks, material=material), ranks=ranks)
        assert done.code == 0, done.error
    done = run_deck(broken, bed(stock, f"{states}run 3000 upto", ranks=ranks, resume=True, material=material), ranks=ranks)
    assert done.code == 0, done.error
    assert "dembark: resumed at step 1400 exactly" in done.output
    for name in ("grains.dump", "bed.2800.restart"):
        assert (whole / name).read_bytes() == (broken / name).read_bytes(), name
    left = sorted(path.name for path in broken.glob("bed.*"))
    assert left == [f"bed.{step}.restart{end}" for step in (2100, 2800) for end in ("", ".crc")]


def test_state_at_a_frame_does_not_write_it_twice(tmp_path):
    states = STATES.format(every=500)
    done = run_deck(tmp_path, bed(False, f"{states}run 1200", ranks=1))
    assert done.code == 0, done.error
    done = run_deck(tmp_path, bed(False, f"{states}run 2000 upto", ranks=1, resume=True))
    assert done.code == 0, done.error
    assert liggghts_driver.read_dump(tmp_path / "grains.dump")[0].tolist() == [0, 500, 1000, 1500, 2000]


def test_stock_restart_is_not_exact(tmp_path):
    """What the fix is for: the same with stock commands differs, by the forces of the set-up."""
    for name, run_command in (("whole", "run 200"), ("broken", "run 100\nwrite_restart bed.restart")):
        assert run_deck(tmp_path / name, bed(False, run_command, ranks=1).replace("all custom 500", "all custom 200")).code == 0
    text = bed(False, "run 200 upto", ranks=1, resume=True).replace("resume_state bed", "read_restart bed.restart")
    assert run_deck(tmp_path / "broken", text.replace("all custom 500", "all custom 200")).code == 0
    one, other = (liggghts_driver.read_dump(tmp_path / name / "grains.dump")[1][-1] for name in ("whole", "broken"))
    assert (one != other).any()


@pytest.mark.parametrize(("words", "told"), [
    ("resume/exact", "must have the form"), ("resume/exact ten bed", "must have the form"), ("resume/exact -1 bed", "must have the form"),
    ("resume/exact 5 bed keep x", "must have the form"), ("resume/exact 5 bed*", "must not hold"),
    ("resume/exact 5 bed\nfix late all gravity 1 vector 1 0 0", "must come after fix late"),
    ("resume/exact 5 nowhere/bed", "nowhere/bed"),
])
def test_mistakes_of_the_fix(tmp_path, words, told):
    done = run_deck(tmp_path, bed(False, f"fix state all {words}\nrun 10", ranks=1))
    assert done.code != 0
    assert told in done.error, done.output[-1000:]


@pytest.mark.parametrize(("words", "told"), [("resume_state", "must have the form"),
                                             ("resume_state bed", "there is no whole state bed.<step>")])
def test_mistakes_of_the_command(tmp_path, words, told):
    done = run_deck(tmp_path, bed(False, "run 10", ranks=1, resume=True).replace("resume_state bed", words))
    assert done.code != 0
    assert told in done.error, done.output[-1000:]


def test_other_models_than_those_of_the_state_are_refused_or_approximate(tmp_path):
    done = run_deck(tmp_path, bed(False, STATES.format(every=100) + "run 250", ranks=1))
    assert done.code == 0, done.error
    other = bed(False, STATES.format(every=100) + "run 300 upto", ranks=1, resume=True)
    shutil.copytree(tmp_path, tmp_path / "other")
    done = run_deck(tmp_path / "other", other.replace("neighbor 0.002 bin", "neighbor 0.0025 bin"))
    assert done.code == 0 and "dembark: resumed at step 200 approximately: the atoms or their candidates" in done.output


def test_steps_are_not_counted_anew(tmp_path):
    """The newest state is that of the highest step."""
    done = run_deck(tmp_path, bed(False, STATES.format(every=100) + "run 150\nreset_timestep 0\nrun 150", ranks=1))
    assert done.code != 0 and "reset" in done.error, done.output[-1000:]


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_run_that_begins_anew_deletes_no_state(tmp_path, ranks):
    """States of an earlier run in the folder: the run ends with one line before anything is written over."""
    deck = bed(False, STATES.format(every=500) + "run 1200", ranks=ranks)
    assert run_deck(tmp_path, deck, ranks=ranks).code == 0
    before = {path.name: path.read_bytes() for path in tmp_path.glob("bed.*")}
    assert len(before) == 4
    done = run_deck(tmp_path, deck, ranks=ranks)
    assert done.code != 0
    assert "bed.1000.restart; go on from it by resume_state, move it away" in done.error
    assert {path.name: path.read_bytes() for path in tmp_path.glob("bed.*")} == before


def test_state_that_is_not_whole_does_not_stand_in_the_way(tmp_path):
    (tmp_path / "bed.90000.restart").write_bytes(b"broken")
    assert run_deck(tmp_path, bed(False, STATES.format(every=500) + "run 1200", ranks=1)).code == 0
    assert sorted(path.name for path in tmp_path.glob("bed.*.restart")) == ["bed.1000.restart", "bed.500.restart"]


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_stock_command_reads_a_state_exactly_under_its_name_only(tmp_path, ranks):
    states = STATES.format(every=500)
    assert run_deck(tmp_path, bed(False, f"{states}run 700", ranks=ranks), ranks=ranks).code == 0
    (tmp_path / "other.restart").write_bytes((tmp_path / "bed.500.restart").read_bytes())
    for name, told in (("bed.500", "at step 500 exactly"), ("other", "approximately: file bed.500.restart does not hold")):
        if name == "other":
            (tmp_path / "bed.500.restart").unlink()
        deck = bed(False, f"{states}run 600 upto", ranks=ranks, resume=True).replace("resume_state bed", f"read_restart {name}.restart")
        done = run_deck(tmp_path, deck, ranks=ranks)
        assert done.code == 0, done.error
        assert told in done.output


def test_data_of_a_state_do_not_count_against_the_limit_of_a_fix(tmp_path):
    """The engine stores at most 2 GB of one fix: what grows with the grains stands behind its end of the file."""
    sizes = []
    for every, text in ((500, "resume/exact 500 bed"), (0, "")):
        folder = tmp_path / str(every)
        fix = f"fix state all {text}\n" if text else ""
        done = run_deck(folder, bed(False, f"{fix}run 600\nwrite_restart whole.restart", ranks=1))
        assert done.code == 0, done.error
        sizes.append((folder / "whole.restart").stat().st_size)
    assert 0 < sizes[0] - sizes[1] < 200
    assert (tmp_path / "500" / "bed.500.restart").stat().st_size > sizes[0] + 8 * 6 * 64


def test_file_of_the_stock_command_says_that_it_has_no_parts(tmp_path):
    """It has the name of a state, and nothing behind the engine's end of the file that could be taken for a part."""
    states = STATES.format(every=500)
    assert run_deck(tmp_path, bed(False, f"{states}run 700\nwrite_restart bed.700.restart", ranks=1)).code == 0
    deck = bed(False, f"{states}run 800 upto", ranks=1, resume=True).replace("resume_state bed", "read_restart bed.700.restart")
    done = run_deck(tmp_path, deck)
    assert done.code == 0, done.error
    assert "at step 700 approximately: file bed.700.restart does not hold the forces and histories" in done.output


# --- which fixes go on exactly --------------------------------------------------------------------------------------------

# Fixes of the list in one bed: groups of grains that are pushed, held or moved, and a plate that shakes.
GROUPS = """\
group pushed id 1:8
group held id 9:12
group frozen id 13:14
group moved id 15:16
group free subtract all moved
"""
EXACT = """\
variable push equal 1e-3*sin(300*step*dt)
fix push pushed addforce v_push 0 0
fix hold held setforce NULL NULL 0
fix drag held drag 0.01 0.01 0 1e-6 0.002
fix slow all viscous 1e-5
fix plane held planeforce 1 0 0
fix line held lineforce 0 1 0
fix still frozen freeze
fix rest all momentum 50 linear 1 1 0
fix note all property/atom note vector yes no no 0 0 0
fix check all check/timestep/gran 100 0.9 0.9
fix plate all mesh/surface file plate.stl type 2
fix shake all move/mesh mesh plate wiggle amplitude 0. 0. 0.0003 period 0.01
fix wall all wall/gran {wall}
fix motion free nve/sphere
fix still_more moved move wiggle 0.0005 0 0 0.01
compute energy all ke
fix mean all ave/time 1 20 20 c_energy
variable mean equal f_mean
fix means all print 100 "${{mean}}" {how} means.txt screen no title none
"""
PLATE = [((0.001, 0.001, 1e-4), (0.023, 0.001, 1e-4), (0.023, 0.023, 1e-4))]


def with_fixes(folder, text, lines):
    folder.mkdir(exist_ok=True)
    (folder / "plate.stl").write_text(stl(PLATE))
    assert "fix motion all nve/sphere\n" in text
    return text.replace("fix motion all nve/sphere\n", lines)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_fixes_of_the_list_are_resumed_exactly(tmp_path, ranks):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    wall = liggghts_driver.models(BED, wall="mesh n_meshes 1 meshes plate")
    states = STATES.format(every=200).replace("grains.dump", "grains.dump means.txt")
    for folder, steps in ((whole, 900), (broken, 530)):
        text = with_fixes(folder, bed(False, f"{states}run {steps}", ranks=ranks), GROUPS + EXACT.format(wall=wall, how="file"))
        done = run_deck(folder, text, ranks=ranks)
        assert done.code == 0, done.error or done.output[-1500:]
        assert "approximately" not in done.output
    text = with_fixes(broken, bed(False, f"{states}run 900 upto", ranks=ranks, resume=True), EXACT.format(wall=wall, how="append"))
    done = run_deck(broken, text, ranks=ranks)
    assert done.code == 0, done.error or done.output[-1500:]
    assert "dembark: resumed at step 400 exactly" in done.output
    for name in ("grains.dump", "means.txt"):
        assert (whole / name).read_bytes() == (broken / name).read_bytes(), name
    assert liggghts_driver.read_dump(broken / "grains.dump")[0].tolist() == [0, 500]


def test_histories_of_another_length_are_refused(tmp_path):
    """A mesh wall that has lost its bridges: a contact has fewer numbers than in the state, with the pair style as it was."""
    states = STATES.format(every=200)
    for material, run_command, resume in ((BED, "run 250", False), (replace(BED, bridge_volume=0.0), "run 260 upto", True)):
        wall = liggghts_driver.models(material, wall="mesh n_meshes 1 meshes plate")
        lines = f"fix plate all mesh/surface file plate.stl type 2\nfix wall all wall/gran {wall}\nfix motion all nve/sphere\n"
        done = run_deck(tmp_path, with_fixes(tmp_path, bed(False, states + run_command, ranks=1, resume=resume), lines))
        assert (done.code == 0) != resume, done.error or done.output[-1500:]
    assert "used different contact history model" in done.error


INEXACT = {
    "fix rain (insert/pack) begins anew": """\
fix one all particletemplate/sphere 15485863 atom_type 1 density constant 2500 radius constant 0.002
fix kinds all particledistribution/discrete 15485867 1 one 1.0
region high block 0.002 0.022 0.002 0.022 0.03 0.05 units box
fix rain all insert/pack seed 49979687 distributiontemplate kinds vel constant 0. 0. -0.5 insert_every 30 overlapcheck yes &
    particles_in_region 20 region high""",
    "fix mean (ave/time) averages over more than one interval": "fix mean all ave/time 1 20 20 c_thermo_temp ave running",
    "fix late (ave/time) is within an interval at step 400": "fix late all ave/time 1 30 30 c_thermo_temp",
    "fix file (ave/time) writes its file anew": "fix file all ave/time 1 20 20 c_thermo_temp file mean.txt",
    "fix bins (ave/histo) begins anew": "fix bins all ave/histo 1 20 20 -1 1 5 vz mode vector",
    "variable chance uses random": "variable chance equal 1e-6*random(0,1,15485863)\nfix push all addforce v_chance 0 0",
    "variable past uses ramp": "variable past equal ramp(0,1)",
}


def test_fixes_with_a_state_of_their_own_are_named(tmp_path):
    """The engine begins them anew: what goes on is another run, and says so, beforehand and when it goes on."""
    lines = "".join(f"{line}\n" for line in INEXACT.values()) + "fix motion all nve/sphere\n"
    states = STATES.format(every=200)
    done = run_deck(tmp_path, with_fixes(tmp_path, bed(False, f"{states}run 450", ranks=1), lines))
    assert done.code == 0, done.error or done.output[-1500:]
    warned = next(line for line in done.output.splitlines() if "goes on from these states approximately" in line)
    done = run_deck(tmp_path, with_fixes(tmp_path, bed(False, f"{states}run 460 upto", ranks=1, resume=True), lines))
    assert done.code == 0, done.error or done.output[-1500:]
    reasons = next(line for line in done.output.splitlines() if "dembark: resumed at step 400 approximately: " in line)
    for reason in INEXACT:
        assert reason in reasons
        assert reason.replace("400", "200") in warned


def test_what_another_run_changed_is_named(tmp_path):
    states = STATES.format(every=200)
    assert run_deck(tmp_path, bed(False, f"{states}run 250", ranks=1)).code == 0
    other = bed(False, f"{states}run 210 upto", ranks=1, resume=True)
    for old, new in (("timestep 1e-5", "timestep 2e-5"), ("gravity 9.81", "gravity 9.8"),
                     ("staticFriction peratomtypepair 2 0.5", "staticFriction peratomtypepair 2 0.45"),
                     ("fix motion", "group some id 1:24\nfix extra some setforce NULL NULL NULL\nfix motion")):
        assert old in other
        other = other.replace(old, new)
    done = run_deck(tmp_path, other)
    assert done.code == 0, done.error or done.output[-1500:]
    reasons = next(line for line in done.output.splitlines() if "dembark: resumed at step 200 approximately: " in line)
    for reason in ("timestep was 1.0000000000000001e-05, and is 2.0000000000000002e-05", "acceleration of fix weight was 0 0 -9.81",
                   "values of fix p_staticFriction changed", "fix extra (setforce) is not in the state",
                   "number of atoms of group some (24) is not in the state"):
        assert reason in reasons, reasons


def test_state_of_another_run_under_the_same_name_is_not_taken(tmp_path):
    """Forces and histories stand in the file BASE.<step>.restart: if that is of another run, they do not belong to these atoms."""
    states = STATES.format(every=200)
    for folder, material in (("one", BED), ("other", replace(BED, static_friction=0.45))):
        assert run_deck(tmp_path / folder, bed(False, f"{states}run 250", ranks=1, material=material)).code == 0
    text = bed(False, f"{states}run 260 upto", ranks=1, resume=True).replace("resume_state bed", "read_restart ../one/bed.200.restart")
    done = run_deck(tmp_path / "other", text)
    assert done.code == 0, done.error or done.output[-1500:]
    assert "approximately: file bed.200.restart does not hold the forces and histories of its ranks" in done.output


# --- what a resumed run appends to ------------------------------------------------------------------------------------------

OUTPUT = """\
variable energy equal ke
fix words all print 50 "no step, but ${{energy}}" {how} words.txt screen no
compute pairs all pair/gran/local id force
dump touch all local 50 touch.dump c_pairs[1] c_pairs[2]
dump_modify touch label contacts
dump xyz all xyz 50 frames.xyz
dump_modify xyz sort id
dump binary all custom 50 frames.bin id x y z
dump_modify binary sort id
"""
FILES = ("words.txt", "touch.dump", "frames.xyz", "frames.bin", "grains.dump")


def test_every_output_goes_on_where_the_state_ends(tmp_path):
    """No row or frame is lost and none is there twice, whatever the format."""
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    states = f"fix state all resume/exact 200 bed cut {' '.join(FILES)}\n"
    for folder, steps in ((whole, 900), (broken, 530)):
        done = run_deck(folder, bed(False, OUTPUT.format(how="file") + f"{states}run {steps}", ranks=1))
        assert done.code == 0, done.error or done.output[-1500:]
    lines = OUTPUT.format(how="append") + "".join(f"dump_modify {name} append yes\n" for name in ("touch", "xyz", "binary"))
    done = run_deck(broken, bed(False, f"{lines}{states}run 900 upto", ranks=1, resume=True))
    assert done.code == 0, done.error or done.output[-1500:]
    assert "dembark: resumed at step 400 exactly" in done.output
    assert "what was written up to step 400 is in frames.bin.until-400" in done.output
    for name in FILES:
        one, other = (folder / name for folder in (whole, broken))
        before = (broken / "frames.bin.until-400").read_bytes() if name == "frames.bin" else b""
        assert one.read_bytes() == before + other.read_bytes(), name
