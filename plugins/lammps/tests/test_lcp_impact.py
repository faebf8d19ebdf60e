"""fix lcp/impact in LAMMPS: what is LAMMPS's own, and mistakes; the rest is in plugins/tests."""

from functools import partial

import pytest
from rig import impact_decks
from rig.impact_decks import Case, Log, assert_same, pile, rolled
from rig.lammps_driver import run_deck

run = partial(impact_decks.run, engine="lammps")
FLAT = {"dimension": 2, "boundary": "f f p", "after": "fix flat all enforce2d"}


@pytest.mark.parametrize(("factor", "words", "settings"), [
    (0.5, "", {}), (0.4, "inertia sphere", {}), (0.5, "", FLAT), (0.5, "", {**FLAT, "motion": "nve/sphere disc"}),
    (0.4, "inertia sphere", {**FLAT, "motion": "nve/sphere disc"})])
def test_sliding_becomes_rolling(tmp_path, factor, words, settings):
    """Whatever inertia LAMMPS turns its atoms with."""
    rolled(tmp_path, factor, words, "lammps", **settings)


@pytest.mark.parametrize(("group", "says"), [("two id 2", "fixes two and motion (nve/sphere) turn its grains with different moments"),
                                             ("two empty", "")])
def test_movers_of_different_inertia_are_refused(tmp_path, group, says):
    """Of grains that both move; a mover of none of its grains does not matter."""
    settings = {**FLAT, "motion": "nve/sphere disc", "before": f"group {group}\nfix two two nve/sphere"}
    case = Case([Log((0.0, 0.0)), Log((0.5, 0.0))], "stiffness 1e7", 1e-5, "run 1", **settings)
    done = impact_decks.start(tmp_path, case, engine="lammps")
    assert says in one_line(done) if says else done.code == 0, done.output[-1500:]


@pytest.mark.parametrize("engine", ["lammps", "liggghts"])
def test_steps_are_not_counted_anew(tmp_path, engine):
    case = Case([Log((0.0, 0.0)), Log((0.5, 0.0))], "stiffness 1e7", 1e-5, "run 1\nreset_timestep 0\nrun 1")
    done = impact_decks.start(tmp_path, case, engine=engine)
    assert done.code != 0 and "reset timestep" in done.output + done.error, done.output[-1500:]


def test_beside_pair_forces(tmp_path):
    """A pair style for other atoms: excluded from each other's neighbour lists, the logs feel nothing of it."""
    pair = """pair_style dembark/granular
pair_coeff * * youngs_modulus 5e6 poissons_ratio 0.3 restitution 0.5 static_friction 0.5 kinetic_friction 0.4 critical_slip_distance 1e-5
neigh_modify exclude group all all"""
    alone, beside = run(tmp_path / "alone", pile()), run(tmp_path / "beside", pile(before=pair))
    assert_same(alone.last, beside.last, 0.0)


def refused(folder, words="stiffness 1e7", **settings):
    done = impact_decks.start(folder, Case([Log((0.0, 0.0)), Log((0.5, 0.0))], words, 1e-5, "run 1", **settings), engine="lammps")
    return one_line(done)


def one_line(done):
    assert done.code != 0, done.output[-2000:]
    errors = [line for line in done.output.splitlines() if line.startswith("ERROR")]
    assert len(errors) == 1, done.output[-2000:]
    return errors[0]


@pytest.mark.parametrize(("words", "says"), [
    ("", "stiffness is missing: one value (N/m) for each atom type"),
    ("stiffness 1e7 frction 0.3", "'frction' is no keyword; there is stiffness, damping"),
    ("stiffness 1e7 wall mesh floor stl stiffness 1e7", "wall: the shape can be plane or cylinder, not 'mesh'"),
    ("stiffness 1e7 impacts no/such/folder/file.txt", "impacts: file no/such/folder/file.txt cannot be written"),
])
def test_bad_words(tmp_path, words, says):
    line = refused(tmp_path, words)
    assert says in line and "fix hits lcp/impact" in line


def test_forces_after_the_contact_forces_are_refused(tmp_path):
    line = refused(tmp_path, after="fix push all addforce 1.0 0.0 0.0")
    assert "fix push (addforce) may add forces after the contact forces are known; define it before this fix" in line


def test_other_run_styles_are_refused(tmp_path):
    assert "run_style respa is not supported; use run_style verlet" in refused(tmp_path, after="run_style respa 1")


@pytest.mark.parametrize("units", ["real", "metal"])
def test_units_without_newtons_law_are_refused(tmp_path, units):
    text = pile(count=2, steps=1).text("lammps").replace("units si", f"units {units}")
    assert f"in units {units} force is not mass times acceleration" in one_line(run_deck(tmp_path, text))


def test_bodies_of_several_grains_are_refused(tmp_path):
    """Their forces would move the grains one by one."""
    line = refused(tmp_path, after="fix stiff all rigid/nve single")
    assert "it knows single grains, and fix stiff (rigid/nve) moves bodies made of several" in line


def test_restart_files_that_do_not_fit(tmp_path):
    run(tmp_path, pile(steps=200), run="run 200\nwrite_restart here.restart")
    case = pile(steps=200)
    case.words = case.words.replace("wall plane ground", "wall plane floor")
    line = one_line(impact_decks.start(tmp_path, case, engine="lammps", head="read_restart here.restart"))
    assert "wall 1 is ground in the restart file and floor in the command" in line
    (tmp_path / "impacts.txt").write_text("# short\n")
    line = one_line(impact_decks.start(tmp_path, pile(steps=200), engine="lammps", head="read_restart here.restart"))
    assert "impacts.txt has 8 bytes, the saved run goes on after" in line


def test_other_atom_styles_are_refused(tmp_path):
    text = pile(count=2, steps=1).text("lammps").replace("atom_style sphere", "atom_style atomic")
    text = "\n".join(line for line in text.splitlines() if not line.startswith(("set atom", "fix weight")))
    assert "use atom_style sphere" in one_line(run_deck(tmp_path, text))
