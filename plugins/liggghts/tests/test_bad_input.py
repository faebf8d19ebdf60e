"""A user's mistake ends the run with one line that says what is wrong, where, and what would be right."""

from dataclasses import replace

import pytest
from rig import liggghts_driver
from rig.scenarios import Grain, Material, Scenario

WET = Material(bridge_volume=2e-10)
PAIR = "peratomtypepair 2 "


def run(folder, change=lambda deck: deck, *, tangential="finnie_rabinowicz", **overrides):
    case = Scenario(name="two grains", material=WET, steps=10,
                    grains=(Grain(position=(0.0, 0.0, 5.1e-3)), Grain(position=(0.0, 0.0, -4.8e-3))))
    deck = liggghts_driver.deck(case, tangential=tangential, material_lines=liggghts_driver.properties(WET, **overrides))
    changed = change(deck)
    return liggghts_driver.run_deck(folder, changed)


def assert_one_line(done, *words):
    assert done.code != 0
    errors = [line for line in done.output.splitlines() if line.startswith("ERROR")]  # not those of Open MPI as it ends
    assert len(errors) == 1, done.output[-2000:]
    for word in words:
        assert word in errors[0], errors[0]


@pytest.mark.parametrize("name", ["staticFriction", "kineticFriction", "criticalSlipDistance", "bridgeVolume", "contactAngle",
                                  "surfaceTension"])
def test_missing_property(tmp_path, name):
    assert_one_line(run(tmp_path, **{name: ""}), name, "property/global", "fix ID all")


@pytest.mark.parametrize("name", ["interfaceShearStrength", "healingTime"])
def test_optional_property(tmp_path, name):
    done = run(tmp_path, **{name: ""})
    assert done.code == 0, done.error


@pytest.mark.parametrize(("name", "values", "words"), [
    ("staticFriction", PAIR + "0.5 0.5 0.4 0.5", ("staticFriction", "symmetric")),
    ("bridgeVolume", PAIR + "1e-10 1e-10 2e-10 1e-10", ("bridgeVolume", "symmetric")),
    ("kineticFriction", PAIR + "0.7 0.5 0.5 0.5", ("kinetic friction must not exceed static friction", "types 1-1")),
    ("kineticFriction", PAIR + "-0.1 -0.1 -0.1 -0.1", ("kineticFriction must be >= 0",)),
    ("criticalSlipDistance", PAIR + "-1e-6 -1e-6 -1e-6 -1e-6", ("criticalSlipDistance (m) must be >= 0",)),
    ("interfaceShearStrength", PAIR + "0 0 0 0", ("interfaceShearStrength (Pa) must be > 0", "not 0")),
    ("healingTime", "scalar -1", ("healingTime (s) must be >= 0",)),
    ("bridgeVolume", PAIR + "-1e-10 -1e-10 -1e-10 -1e-10", ("bridgeVolume (m^3) must be >= 0", "types 1-1")),
    ("surfaceTension", "scalar -0.07", ("surfaceTension (N/m) must be >= 0",)),
    ("contactAngle", "peratomtype 1.7 1.7", ("contactAngle (rad) must be >= 0 and <= 1.5708", "1.7")),
    ("contactAngle", "peratomtype -0.1 -0.1", ("contactAngle (rad) must be >= 0",)),
    ("contactAngle", "peratomtype 0.3", ("contactAngle",)),
    ("contactAngle", "peratomtype 20 20", ("contactAngle (rad)",)),
    ("contactAngle", "peratomtype 1e999 1e999", ("contactAngle (rad)",)),
    ("staticFriction", PAIR + "1e999 1e999 1e999 1e999", ("staticFriction must be >= 0",)),
    ("surfaceTension", "scalar 1e999", ("surfaceTension (N/m) must be >= 0 and finite",)),
    ("bridgeVolume", PAIR + "1e999 1e999 1e999 1e999", ("bridgeVolume (m^3) must be >= 0 and finite",)),
    ("bridgeVolume", PAIR + "1 1 1 1", ("bridgeVolume (m^3)", "cubes of the largest radius")),
    # One in a form that does not fit is told even where the property may be left out; it was disregarded.
    ("staticFriction", "scalar 0.5", ("staticFriction peratomtypepair 2 VALUE", "not scalar")),
    ("staticFriction", "peratomtype 0.5 0.5", ("staticFriction peratomtypepair 2 VALUE", "not peratomtype")),
    ("surfaceTension", "peratomtype 0.07 0.07", ("surfaceTension scalar VALUE", "not peratomtype")),
    ("contactAngle", "scalar 0.3", ("contactAngle peratomtype VALUE", "not scalar")),
    ("interfaceShearStrength", "scalar 1e5", ("interfaceShearStrength peratomtypepair 2 VALUE", "not scalar")),
    ("healingTime", "peratomtype 0 0", ("healingTime scalar VALUE", "not peratomtype")),
    # These are lines of the engine itself.
    ("bridgeVolume", "peratomtypepair 1 1e-10", ("bridgeVolume", "Length not correct")),
    ("staticFriction", PAIR + "0.5 0.5 0.5", ("staticFriction", "multiple of nCols")),
    ("staticFriction", PAIR + "nan 0.5 0.5 0.5", ("Expected floating point parameter",)),
])
def test_bad_value(tmp_path, name, values, words):
    assert_one_line(run(tmp_path, **{name: values}), *words)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("capillary_model exact", "capillary_model magic", ("capillary_model", "magic", "exact, willett, willett_full, rabinovich, bagheri")),
    ("presliding linear", "rolling_resistance uphill", ("rolling_resistance", "uphill", "off, constant_torque or elastic_plastic")),
    ("presliding linear", "rolling_resistance constant_torque", ("coefficientRollingFriction", "property/global", "fix ID all")),
    ("presliding linear", "presliding curved", ("presliding", "curved", "linear, exponential or partial_slip")),
    ("presliding linear", "friction_limit viscous", ("friction_limit", "viscous", "total or elastic")),
    ("model hertz", "model hertz/stiffness", ("combination", "not compiled", "model hertz/stiffness", "can be hertz, hooke")),
    ("tangential finnie_rabinowicz", "tangential no_history",
     ("not compiled", "tangential no_history", "can be finnie_rabinowicz, history")),
    ("cohesion capillary", "cohesion capillary rolling_friction epsd",
     ("not compiled", "rolling_friction epsd", "can be off, cdt, epsd2", "rolling_friction off|cdt|epsd2")),
    ("cohesion capillary", "cohesion capillary rolling_friction cdt surface multicontact", ("surface multicontact", "can be default")),
    ("cohesion capillary", "cohesion sjkr", ("not compiled", "cohesion sjkr", "can be off, capillary, adhesion")),
    # Models that stand in another order than the engine reads them are none to it.
    ("tangential finnie_rabinowicz cohesion capillary", "cohesion capillary tangential finnie_rabinowicz",
     ("not compiled", "tangential off", "can be finnie_rabinowicz, history", "in this order")),
])
def test_bad_models(tmp_path, old, new, words):
    def change(deck):
        assert old in deck
        changed = deck.replace(old, new)
        # A keyword of a model that is not chosen any more would be refused first.
        for other, keyword in (("no_history", "presliding linear"), ("sjkr", "capillary_model exact")):
            changed = changed.replace(keyword, "") if other in new else changed
        return changed

    assert_one_line(run(tmp_path, change), *words)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("0.0 0.0 0.0051 ", "0.0 0.0 -0.0048 ", ("atoms 1 and 2 have the same centre",)),
    ("run 10", "group one id 1\nvariable nothing equal ln(-1)\nset group one vx v_nothing\nrun 10", ("ERROR",)),
])
@pytest.mark.parametrize("rolling", ["", "rolling_friction cdt"])
def test_what_has_no_normal_or_number(tmp_path, old, new, words, rolling):
    """Coincident centres in our pair loop and in the engine's; a velocity that is no number."""
    def change(deck):
        lines = "fix p_roll all property/global coefficientRollingFriction peratomtypepair 2 0 0 0 0\npair_style"
        deck = deck.replace("pair_style", lines).replace("cohesion capillary", f"cohesion capillary {rolling}")
        assert old in deck
        return deck.replace(old, new)

    assert_one_line(run(tmp_path, change), *words)


@pytest.mark.parametrize("models", ["tangential finnie_rabinowicz", "tangential finnie_rabinowicz cohesion capillary",
                                    "tangential history cohesion capillary"])
@pytest.mark.parametrize("option", ["computeElasticPotential", "computeDissipatedEnergy", "heating_normal_hertz", "heating_tracking",
                                    "heating_tangential_history"])
def test_sums_in_which_our_models_have_no_part(tmp_path, models, option):
    """Energies and heat that the engine's models count were incomplete without a word; elastic energy at a primitive wall was a crash."""
    keywords = models.replace("tangential", "").replace("cohesion", "")

    def change(deck):
        changed = deck.replace("tangential finnie_rabinowicz cohesion capillary", models)
        changed = changed if "finnie" in models else changed.replace(" presliding linear", "")
        changed = changed if "capillary" in models else changed.replace(" capillary_model exact", "")
        return "".join(f"{line} {option} on\n" if line.startswith("pair_style") else f"{line}\n" for line in changed.splitlines())

    done = run(tmp_path, change)
    # Heat of contacts is complete with friction of the engine and bridges without viscosity.
    if option.startswith("heating") and "finnie" not in keywords:
        assert done.code == 0, done.error
    else:
        assert_one_line(done, option, "energy/account", "leave it out")


def test_heat_of_viscous_bridges(tmp_path):
    def change(deck):
        deck = deck.replace("tangential finnie_rabinowicz", "tangential history").replace(" presliding linear", "")
        return deck.replace("capillary_model exact", "capillary_model exact viscous_liquid on heating_normal_hertz on")

    assert_one_line(run(tmp_path, change), "cohesion capillary", "heating_normal_hertz", "viscous_liquid")


def test_units_that_do_not_fit_together(tmp_path):
    """The engine refuses `real` and `metal`, but not these."""
    done = run(tmp_path, lambda deck: deck.replace("units si", "units electron"))
    assert_one_line(done, "units electron", "si, cgs, micro, nano or lj")


@pytest.mark.parametrize(("change", "words"), [
    ("neighbor 0.0001 bin", ("a bridge", "neighbor")),
    ("timestep 1e-3", ("with viscous_liquid on a bridge", "needs a time step <=", "not 0.001"))])
def test_a_bridge_of_the_run_before_does_not_fit_the_next_one(tmp_path, change, words):
    case = Scenario(name="on a wall", material=replace(WET, viscosity=0.1, minimum_gap=1e-5), steps=10, wall=True,
                    grains=(Grain(position=(0.0, 0.0, 4.99e-3)),))
    assert_one_line(liggghts_driver.run_deck(tmp_path, f"{liggghts_driver.deck(case)}{change}\nrun 10\n"), *words)


def test_numbers_by_which_contacts_know_each_other_stay(tmp_path):
    """Stock LIGGGHTS loses histories and bridges with them, and may find those of another pair."""
    def with_end(end):
        return lambda deck: f"{deck}group gone id 3\n{end}\nrun 1\n"

    assert_one_line(run(tmp_path, with_end("delete_atoms group gone")), "delete_atoms would give", "other numbers", "'compress no'")
    assert_one_line(run(tmp_path, with_end("delete_atoms group gone compress yes")), "add 'compress no'")
    before = run(tmp_path, lambda deck: deck.replace("thermo", "group gone id 3\ndelete_atoms group gone\nthermo", 1))
    for done in (before, run(tmp_path, with_end("delete_atoms group gone compress no"))):
        assert done.code == 0, done.error


def test_another_pair_style_after_a_run_is_warned_of(tmp_path):
    def again(deck):
        style = next(line for line in deck.splitlines() if line.startswith("pair_style"))
        return f"{deck}{style}\npair_coeff * *\nrun 1\n"

    done = run(tmp_path, again)
    assert done.code == 0 and done.output.count("WARNING: pair_style gran: given again after a run") == 1, done.output[-2000:]
    assert "given again" not in run(tmp_path / "once").output
    assert "given again" not in run(tmp_path / "clear", lambda deck: f"{deck}clear\n{deck}").output


def test_a_new_grain_does_not_take_over_the_bridge_of_a_deleted_one(tmp_path):
    """It gets the number of that one, and is as near to its neighbour, but has not touched it."""
    new = "create_atoms 1 single 0 0 -0.0052 units box\nset atom 2 diameter 0.01 density 2500\n"
    gone = "group gone id 2\ndelete_atoms group gone compress no\n"
    assert_one_line(run(tmp_path, lambda deck: f"{deck}{gone}{new}run 10\n"), "atom 2 has the number of one that was deleted", "run 0")
    force = "variable size equal fz[2]\nfix out all print 1 \"found ${size}\" file out.txt\n"
    done = run(tmp_path, lambda deck: f"{deck}{gone}run 0\n{new}{force}run 1\n")
    assert done.code == 0, done.error or done.output[-2000:]
    assert (tmp_path / "out.txt").read_text().splitlines()[-1] == "found 0"


@pytest.mark.parametrize("lanes", ["8", "1"])
def test_a_pair_that_touches_twice_is_refused(tmp_path, monkeypatch, lanes):
    """Across a box of 1.2 diameters; side by side in it a pair touches once."""
    monkeypatch.setenv("DEMBARK_LANES", lanes)
    case = Scenario(name="", material=Material(presliding="partial_slip"), steps=10,
                    grains=(Grain(position=(0.0, 0.0, 0.003)), Grain(position=(0.0078, 0.0, 0.009))))
    deck = liggghts_driver.deck(case).replace("boundary f f f", "boundary f f p").replace(
        "block -0.05 0.05 -0.05 0.05 -0.05 0.05", "block -0.05 0.05 -0.05 0.05 0 0.012").replace(
        "neigh_modify delay 0", "neigh_modify delay 0 every 1 check no")
    assert_one_line(liggghts_driver.run_deck(tmp_path, deck), "grain 1 touches grain 2 and an image of it", "two diameters")
    done = liggghts_driver.run_deck(tmp_path, deck.replace("0.0078 0.0 0.009", "0.0098 0.0 0.003"))
    assert done.code == 0, done.error
