"""Features of LAMMPS (docs/how-to/lammps_features.md): those that work give the results of the plain run, the others are refused."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lammps_bed import WET, bed
from rig import lammps_driver
from rig.lammps_driver import run_deck
from rig.liggghts_driver import read_dump
from rig.scenarios import Material
from test_bad_input import assert_one_line
from test_bed import assert_same, run

STEPS = 500
SOFT = replace(WET, youngs_modulus=5e6)


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("plain")
    run(folder, bed(f"run {STEPS}"))
    return folder


def hybrid(text: str, style: str) -> str:
    """The deck with `style`, words for pair_style in which {} stands for this style and its own."""
    settings = text.partition("pair_style ")[2].partition("\n")[0]
    text = text.replace(f"pair_style {settings}", "pair_style " + style.format(settings))
    for pair in ("* *", "2 2", "1 2"):
        text = text.replace(f"pair_coeff {pair}", f"pair_coeff {pair} dembark/granular")
    return text


SAME_BITS = {
    "hybrid": lambda text: hybrid(text, "hybrid {}"),
    "hybrid/overlay": lambda text: hybrid(text, "hybrid/overlay zero 0.004 {}").replace(
        "pair_coeff 1 2", "pair_coeff * * zero\npair_coeff 1 2"),
    "hybrid/scaled": lambda text: hybrid(text, "hybrid/scaled 1.0 {}"),
    "suffix omp": lambda text: "package omp 2\nsuffix omp\n" + text,
    "suffix opt": lambda text: "suffix opt\n" + text,
    "suffix kk": lambda text: "suffix kk\n" + text,
}


@pytest.mark.parametrize("name", SAME_BITS)
def test_it_changes_no_bit(tmp_path, plain, name):
    run(tmp_path, SAME_BITS[name](bed(f"run {STEPS}")))
    assert (tmp_path / "grains.dump").read_bytes() == (plain / "grains.dump").read_bytes()


SAME = {
    "neighbor multi": (1, lambda text: text.replace("neighbor 0.002 bin", "neighbor 0.002 multi")),
    "neighbor multi, intervals": (2, lambda text: text.replace(
        "neighbor 0.002 bin", "neighbor 0.002 multi\nneigh_modify collection/interval 2 0.005 0.006\ncomm_modify mode multi")),
    "balance rcb": (3, lambda text: text.replace("\nrun", "\ncomm_style tiled\nfix balance all balance 100 1.0 rcb\nrun")),
    "balance shift": (4, lambda text: text.replace("\nrun", "\nfix balance all balance 100 1.0 shift xyz 5 1.1\nrun")),
}


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.full) if "balance" in name else name for name in SAME])
def test_it_changes_no_more_than_round_off(tmp_path, plain, name):
    ranks, change = SAME[name]
    assert_same(read_dump(plain / "grains.dump")[1][-1], run(tmp_path, change(bed(f"run {STEPS}")), ranks)[-1], 1e-8)


TILTED = ("region domain block 0 0.024 0 0.024 -0.001 0.05", "region domain prism 0 0.024 0 0.024 -0.001 0.05 0.006 0 0")
LEAVE = {
    "triclinic": (f"run {STEPS}", TILTED),
    "evaporate": (f"region top block INF INF INF INF 0.006 INF units box\nfix leave all evaporate 50 1 top 4711\nrun {STEPS}", ("", "")),
    "delete_atoms": ("run 250\nregion top block INF INF INF INF 0.01 INF units box\ndelete_atoms region top compress no\nrun 250",
                     ("", "")),
}


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.full) if name == "evaporate" else name for name in LEAVE])
def test_two_ranks_give_what_one_gives(tmp_path, name):
    commands, (old, new) = LEAVE[name]
    text = bed(commands).replace(old, new, 1)
    one, two = (run(tmp_path / str(ranks), text, ranks)[-1] for ranks in (1, 2))
    assert_same(one, two, 1e-8)
    assert len(one) < 48 or name == "triclinic"


def test_a_pair_over_a_tilted_border_moves_as_one_within(tmp_path):
    """The upper neighbour of a grain at the border of y is an image that is shifted along x by the tilt."""
    found = []
    for name, (x, y) in (("within", (0.012, 0.012)), ("border", (0.012, 0.0005))):
        head, rest = bed("run 500", create="@", state="velocity all set 0 0 0\nset group all diameter 0.005 density 2500\nset atom 1 vy -1",
                         every=100).split("@")
        other = (x + 0.001, y - 0.0049) if name == "within" else (x + 0.001 + 0.006, y - 0.0049 + 0.024)
        box = f"""\
region domain prism 0 0.024 0 0.024 -0.001 0.05 0.006 0 0 units box
create_box 3 domain
create_atoms 1 single {x} {y} 0.02 units box
create_atoms 1 single {other[0]} {other[1]} 0.0201 units box"""
        found.append(np.array(run(tmp_path / name, head + box + rest)))
    assert np.abs(found[0][-1, :, 4:10]).max() > 0.1
    np.testing.assert_allclose(found[0][:, :, 4:16], found[1][:, :, 4:16], rtol=1e-9, atol=1e-9)


FOREIGN = """\
create_atoms 3 single 0.012 0.012 0.03 units box
set type 3 diameter 0.004 density 2500
pair_coeff 3 3 lj/cut 1e-9 0.001
pair_coeff 1*2 3 lj/cut 1e-9 0.001
group grains type 1 2
region floor"""


def test_hybrid_needs_the_coefficients_of_its_own_pairs_only(tmp_path):
    """Type 3 belongs to another style; the wall, of type 1, takes the grains."""
    text = hybrid(bed(f"run {STEPS}"), "hybrid {} lj/cut 0.004").replace("region floor", FOREIGN, 1)
    for pair in ("* *", "1 2"):
        text = text.replace(f"pair_coeff {pair} dembark", "pair_coeff 1*2 1*2 dembark" if pair == "* *" else "pair_coeff 1 2 dembark")
    served = text.replace("fix floor all", "fix floor grains").replace("floor type 3", "floor type 1")
    assert (run(tmp_path, served)[-1][:, 18] != 0.0).any()
    for change, types in ((text, "types 1 and 3"), (served.replace("fix floor grains", "fix floor all"), "types 3 and 1")):
        assert_one_line(run_deck(tmp_path / types, change), "fix floor wall/dembark", types, "no dembark/granular")


@pytest.mark.parametrize("words", ["energy/account", "integration/monitor speed 1 action report"])
def test_what_knows_this_style_alone_refuses_hybrid_styles(tmp_path, words):
    text = hybrid(bed("run 1"), "hybrid {}").replace("fix motion", f"fix more all {words}\nfix motion")
    assert_one_line(run_deck(tmp_path, text), f"fix more {words.partition(' ')[0]}", "pair_style dembark/granular only")


@pytest.mark.parametrize(("old", "new", "words"), [
    ("\nrun", "\nrun_style respa 2 2\nrun", ("run_style respa is not supported", "use run_style verlet")),
    ("\nrun", "\nminimize 0 0 10 10\nrun", ("no energy that minimize could lower",)),
    *(("units si", f"units {units}", (f"in units {units} force is not", "si, cgs, micro, nano or lj"))
      for units in ("real", "metal", "electron")),
    ("pair_coeff 1 2", "pair_coeff 1 2 largest_radius", ("largest_radius needs a number, not 'static_friction'",)),
    ("pair_coeff 1 2 static_friction 0.6", "pair_coeff 1 2 largest_radius 0.1", ("largest_radius belongs to one type",)),
    ("pair_coeff 1 2 static_friction 0.6", "pair_coeff 1 1 largest_radius -1", ("largest_radius must be >= 0",)),
    ("\nrun", "\nrun 10\npair_style dembark/granular capillary_model exact surface_tension 0.07\nrun",
     ("other options than before need other histories", "pair_style none")),
])
def test_what_cannot_be_is_refused(tmp_path, old, new, words):
    text = bed("run 10", material=SOFT)
    assert old in text
    assert_one_line(run_deck(tmp_path, text.replace(old, new, 1)), *words)


ROLLING = Material(youngs_modulus=5e6, rolling_resistance="elastic_plastic", rolling_friction=0.1)


def test_histories_of_other_options_are_not_taken_for_ones_own(tmp_path):
    """A rolling spring and a bridge with the liquid lent to it are three numbers each."""
    run(tmp_path, bed("run 400\nwrite_restart state", material=ROLLING))
    again = bed("run 10", create="read_restart state", state="", material=ROLLING)
    run(tmp_path, again)
    for name, options in (("lent", "capillary_model exact surface_tension 0.07 carried_liquid on"), ("off", "rolling_resistance off")):
        other = re.sub(r"rolling_(friction|damping_ratio) \S+ ", "", again.replace("rolling_resistance elastic_plastic", options))
        if name == "lent":
            liquid = "pair_coeff * * contact_angle 0.35\nfix liquid all capillary/liquid content 0.01\n"
            other = other.replace("region floor", liquid + "region floor", 1)
        other = other.replace("read_restart state", "read_restart ../state")
        assert_one_line(run_deck(tmp_path / name, other), "fix floor", "other options")
        without = "\n".join(line for line in other.splitlines() if not line.startswith(("fix floor", "dump")))
        assert_one_line(run_deck(tmp_path / name, without), "pair_style", "histories of contacts that were computed with other options")


def test_histories_are_found_whatever_styles_were_there_before(tmp_path):
    run(tmp_path, bed("run 400\nwrite_restart state"))
    again = bed("run 200", create="read_restart state", state="")
    kept = run(tmp_path, again)
    # Other styles, another deck before: the style has another number in the program.
    more = run(tmp_path, bed("run 1") + "clear\n" + again.replace("pair_style d", "pair_style zero 0.01\npair_style none\npair_style d", 1))
    np.testing.assert_array_equal(kept[-1], more[-1])


RIGID = """\
units si
atom_style sphere
atom_modify map array
boundary f f f
newton off
comm_modify vel yes
region domain block -0.02 0.04 -0.02 0.02 -0.02 0.02 units box
fix property all property/atom mol ghost yes
create_box 1 domain
create_atoms 1 single 0 0 0 units box
create_atoms 1 single -0.005 0 0 units box
create_atoms 1 single 0.00601 0 0 units box
create_atoms 1 single 0.01101 0 0 units box
set group all diameter 0.006 density 2500
set atom 1*2 mol 1
set atom 3*4 mol 2
set atom 1*2 vx 1
neighbor 0.002 bin
neigh_modify every 50 exclude molecule/intra all
pair_style dembark/granular {}
pair_coeff * * {}
region wall plane 0.0175 0 0 -1 0 0 units box
fix wall all wall/dembark region wall type 1
fix body all {}
timestep 2e-6
thermo_style custom step
dump grains all custom 1000 grains.dump id x y z vx
dump_modify grains sort id format float %.17g
run 4000
"""


@pytest.mark.parametrize(("options", "style", "ranks"), [
    ("", "rigid molecule", 1), pytest.param("", "rigid/small molecule", 2, marks=pytest.mark.full),
    ("normal hooke 1.0", "rigid/small molecule", 1)])
def test_rigid_bodies_rebound_as_their_restitution_says(tmp_path, options, style, ranks):
    """Two clumps of two spheres collide, then one hits a wall: what damps is the mass of the body, not that of a sphere."""
    material = Material(youngs_modulus=5e6, restitution=0.5)
    done = run_deck(tmp_path, RIGID.format(options, lammps_driver.coefficients(material), style), ranks=ranks)
    assert done.code == 0 and not done.error, done.error or done.output[-1500:]
    velocity = np.array(read_dump(tmp_path / "grains.dump")[1])[:, :, 4]
    np.testing.assert_allclose(velocity[1], [0.25, 0.25, 0.75, 0.75], atol=2e-3)
    np.testing.assert_allclose(velocity[4, 2:], -0.375, atol=2e-3)


@pytest.mark.parametrize(("units", "length", "mass"), [("cgs", 1e2, 1e3), ("micro", 1e6, 1e18)])
def test_coherent_units_give_the_same_motion(tmp_path, units, length, mass):
    """Two wet grains that collide and roll, and the floor: the law has no unit of its own. Micro counts in microseconds."""
    def motion(units: str, length: float, mass: float, time: float) -> np.ndarray:
        material = replace(SOFT, youngs_modulus=SOFT.youngs_modulus * mass / length / time**2, surface_tension=0.072 * mass / time**2,
                           bridge_volume=SOFT.bridge_volume * length**3, critical_slip_distance=1e-5 * length,
                           interface_shear_strength=1e5 * mass / length / time**2, rolling_resistance="elastic_plastic",
                           rolling_friction=0.1)
        text = f"""\
{lammps_driver.head().replace("units si", f"units {units}")}
region domain block {-0.02 * length} {0.02 * length} {-0.02 * length} {0.02 * length} {-0.02 * length} {0.02 * length} units box
create_box 1 domain
create_atoms 1 single 0 0 {0.00249 * length} units box
create_atoms 1 single {0.001 * length} 0 {0.0075 * length} units box
set group all diameter {0.005 * length} density {2500 * mass / length**3}
set atom 2 vz {-0.5 * length / time} vy {0.2 * length / time}
neighbor {0.002 * length} bin
pair_style dembark/granular {lammps_driver.settings(material)}
pair_coeff * * {lammps_driver.coefficients(material)}
region floor plane 0 0 0 0 0 1 units box
fix floor all wall/dembark region floor type 1
fix motion all nve/sphere
timestep {1e-5 * time}
dump grains all custom 200 grains.dump id x y z vx vy vz
dump_modify grains sort id format float %.17g
run 600
"""
        frames = np.array(run(tmp_path / units, text))
        return np.concatenate([frames[:, :, 1:4] / length, frames[:, :, 4:7] / length * time], axis=2)

    si = motion("si", 1.0, 1.0, 1.0)
    assert np.abs(si[-1] - si[0]).max() > 1e-4
    np.testing.assert_allclose(motion(units, length, mass, 1e6 if units == "micro" else 1.0), si, rtol=1e-7, atol=1e-10)
