"""A user's mistake ends the run with one line that says what is wrong, where, and what would be right."""

import os
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from rig import lammps_driver
from rig.scenarios import Grain, Material, Scenario

WET = Material(bridge_volume=2e-10)
WALL = "fix floor all wall/dembark region floor type 2"
FIND = Path(__file__).resolve().parents[3] / "packaging/lammps.sh"


@pytest.fixture(scope="module")
def deck():
    case = Scenario(name="", material=WET, steps=10, wall=True, grains=(Grain(position=(0.0, 0.0, 4.99e-3)),))
    return lammps_driver.deck(case)


def assert_one_line(done, *words):
    assert done.code != 0
    errors = [line for line in done.output.splitlines() if line.startswith("ERROR")]
    assert len(errors) == 1, done.output[-2000:]
    for word in words:
        assert word in errors[0], errors[0]


def test_the_deck_runs_as_it_is(tmp_path, deck):
    done = lammps_driver.run_deck(tmp_path, deck)
    assert done.code == 0 and not done.error, done.output


@pytest.mark.parametrize(("old", "new", "words"), [
    ("normal hertz", "normal linear", ("pair_style dembark/granular", "normal 'linear'", "hertz or hooke")),
    ("normal hertz", "normal hooke -1", ("characteristic_velocity (m/s) must be > 0",)),
    ("normal hertz", "normals hertz", ("'normals' is unknown", "presliding, friction_limit, rolling_resistance, cohesion")),
    ("presliding linear", "presliding bent", ("presliding 'bent'", "linear, exponential or partial_slip")),
    ("presliding linear", "friction_limit viscous", ("friction_limit 'viscous'", "total or elastic")),
    ("healing_time 0.0", "healing_time soon", ("healing_time needs a number, not 'soon'",)),
    ("surface_tension 0.072", "surface_tension -1", ("surface_tension", ">= 0 and finite")),
    ("surface_tension 0.072", "", ("capillary_model needs surface_tension",)),
    ("capillary_model exact", "capillary_model magic", ("magic", "exact, willett, willett_full, rabinovich, bagheri or constant")),
    ("capillary_model exact", "", ("surface_tension is given, but cohesion is none; it needs bridge, which a capillary_model is",)),
    ("rolling_resistance off", "rolling_resistance constant_torque viscous_liquid 0.1",
     ("viscous_liquid needs a number, not 'healing_time'",)),
    ("restitution 0.8", "bounce 0.8", ("knows no 'bounce'", "restitution")),
    ("restitution 0.8", "", ("types 1-1 have no restitution", "pair_coeff 1 1 restitution VALUE")),
    ("restitution 0.8", "restitution 0", ("pair_coeff * *: restitution must be > 0 and <= 1, not 0",)),
    # What would decide in silence, or not at all.
    ("presliding linear", "presliding linear presliding partial_slip", ("presliding is given twice",)),
    ("restitution 0.8", "restitution 0.8 restitution 0.9", ("pair_coeff * *: restitution is given twice",)),
    ("rolling_friction 0.0", "rolling_friction 0.2", ("rolling_friction is given, but rolling_resistance is off; it needs constant_torq",)),
    ("bridge_volume 2e-10", "work_of_adhesion 0.2", ("work_of_adhesion is given, but cohesion is bridge; it needs dmt or jkr",)),
    ("capillary_model exact surface_tension 0.072", "", ("bridge_volume is given, but cohesion is none; it needs bridge",)),
    # 80 litres for grains of 5 mm.
    ("bridge_volume 2e-10", "bridge_volume 8e-2", ("bridge_volume (m^3) is 640000 cubes of the largest radius", "types 1-1")),
    ("restitution 0.8", "restitution", ("restitution needs a number, not 'static_friction'",)),
    ("youngs_modulus 10000000.0", "youngs_modulus -1", ("youngs_modulus (Pa) must be > 0",)),
    ("poissons_ratio 0.3", "poissons_ratio 0.6", ("poissons_ratio must be > -1 and <= 0.5",)),
    ("kinetic_friction 0.3", "kinetic_friction 0.9", ("kinetic friction must not exceed static friction", "types 1-1")),
    ("critical_slip_distance 1e-05", "critical_slip_distance -1", ("critical_slip_distance (m) must be >= 0",)),
    ("bridge_volume 2e-10", "bridge_volume -1", ("bridge_volume (m^3) must be >= 0",)),
    ("contact_angle 0.35", "contact_angle 20", ("contact_angle (rad) must be >= 0 and <= 1.5708, not 20",)),
    ("pair_coeff * *", "pair_coeff 1 1", ("All pair coeffs are not set",)),
    ("pair_coeff * *", "pair_coeff 1 2", ("youngs_modulus belongs to one type", "pair_coeff 1 1")),
    ("comm_modify vel yes", "", ("comm_modify vel yes",)),
    ("type 2", "type 3", ("fix floor wall/dembark", "no atom type 3")),
    ("type 2", "kind 2", ("'wall/dembark region ID type T'",)),
    ("region floor type", "region flour type", ("no region flour",)),
    ("neighbor 0.001 bin", "neighbor 0.0001 bin\ncreate_atoms 1 single 0 0 0.01495\nset atom 2 diameter 0.01 density 2500",
     ("a bridge reaches", "neighbor skin is 0.0001", "use neighbor")),
])
def test_one_line_says_what_is_wrong(tmp_path, deck, old, new, words):
    assert old in deck
    assert_one_line(lammps_driver.run_deck(tmp_path, deck.replace(old, new, 1)), *words)


@pytest.mark.parametrize(("change", "words"), [
    ("neighbor 0.0001 bin", ("a bridge reaches", "neighbor skin is 0.0001", "use neighbor")),
    ("timestep 1e-3", ("with viscous_liquid a bridge", "needs a timestep <=", "not 0.001"))])
def test_a_bridge_of_the_run_before_does_not_fit_the_next_one(tmp_path, change, words):
    case = Scenario(name="", material=replace(WET, viscosity=0.1, minimum_gap=1e-5), steps=10,
                    grains=(Grain(position=(0.0, 0.0, 4.999e-3)), Grain(position=(0.0, 0.0, -5e-3))))
    assert_one_line(lammps_driver.run_deck(tmp_path, f"{lammps_driver.deck(case)}{change}\nrun 10\n"), *words)


@pytest.mark.parametrize(("command", "words"), [
    ("delete_atoms group gone", ("delete_atoms would give", "other numbers", "add 'compress no'")),
    ("delete_atoms group gone compress yes", ("add 'compress no'",)),
    ("reset_atoms id", ("reset_atoms id would give", "other numbers", "before the first run"))])
def test_numbers_by_which_contacts_know_each_other_stay(tmp_path, deck, command, words):
    assert_one_line(lammps_driver.run_deck(tmp_path, f"{deck}group gone empty\n{command}\nrun 1\n"), *words)
    first = deck.replace("timestep", f"group gone empty\n{command}\ntimestep", 1)
    for text in (first, f"{deck}group gone empty\ndelete_atoms group gone compress no\nrun 1\n"):
        done = lammps_driver.run_deck(tmp_path, text)
        assert done.code == 0, done.error


@pytest.mark.parametrize("newton", ["off", "on"])
def test_a_pair_that_touches_twice_is_refused(tmp_path, newton):
    """Across a box of 1.2 diameters; side by side in it a pair touches once."""
    case = Scenario(name="", material=Material(presliding="partial_slip"), steps=10,
                    grains=(Grain(position=(0.0, 0.0, 0.003)), Grain(position=(0.0078, 0.0, 0.009))))
    deck = lammps_driver.deck(case, newton=newton).replace("boundary f f f", "boundary f f p").replace(
        "block -0.05 0.05 -0.05 0.05 -0.05 0.05", "block -0.05 0.05 -0.05 0.05 0 0.012")
    assert_one_line(lammps_driver.run_deck(tmp_path, deck + "run 1\n"), "grain 1 touches grain 2 and an image of it", "two diameters")
    done = lammps_driver.run_deck(tmp_path, deck.replace("0.0078 0.0 0.009", "0.0098 0.0 0.003") + "run 1\n")
    assert done.code == 0, done.error


def test_a_new_grain_does_not_take_over_the_bridge_of_a_deleted_one(tmp_path):
    """It gets the number of that one, and is as near to its neighbour, but has not touched it."""
    case = Scenario(name="", material=WET, steps=10, grains=(Grain(position=(0.0, 0.0, 4.9e-3)), Grain(position=(0.0, 0.0, -5e-3))))
    new = "create_atoms 1 single 0 0 -0.0052 units box\nset atom 2 diameter 0.01 density 2500\n"
    gone = "group gone id 2\ndelete_atoms group gone compress no\n"
    deck = lammps_driver.deck(case)
    done = lammps_driver.run_deck(tmp_path, f"{deck}{gone}{new}run 10\n")
    assert_one_line(done, "atom 2 has the number of one that was deleted", "run 0")
    force = "thermo_style custom step fmax\nthermo_modify format float %.17g\n"
    for ranks in (1, 2):
        done = lammps_driver.run_deck(tmp_path, f"{deck}{gone}run 0\n{new}{force}run 0\n", ranks=ranks)
        assert done.code == 0 and done.output.rpartition("Fmax")[2].split()[:2] == ["10", "0"], done.error or done.output[-2000:]


def test_a_wall_needs_the_pair_style(tmp_path, deck):
    lines = [line for line in deck.splitlines() if not line.startswith(("pair_style", "pair_coeff"))]
    assert_one_line(lammps_driver.run_deck(tmp_path, "\n".join(lines) + "\n"), "fix floor wall/dembark", "pair_style dembark/granular")


def test_an_older_release_is_refused(tmp_path):
    (tmp_path / "src").mkdir()
    (tmp_path / "src/version.h").write_text('#define LAMMPS_VERSION "2 Aug 2023"\n')
    own = os.environ | {"LAMMPS_SOURCE_DIR": str(tmp_path), "LAMMPS_EXECUTABLE": "/bin/true"}
    done = subprocess.run([FIND], env=own, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and len(done.stderr.splitlines()) == 1
    assert "LAMMPS 2 Aug 2023" in done.stderr and "29 Aug 2024 or a later one" in done.stderr
