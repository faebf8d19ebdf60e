"""Grains that enter or grow after the start of a run are in the lists of pairs, as with LAMMPS's `granular`, or one line ends it."""

import re

import numpy as np
import pytest
from rig.lammps_driver import run_deck
from rig.liggghts_driver import read_dump

OWN = ("dembark/granular", (
    "youngs_modulus 5e6 poissons_ratio 0.3 restitution 0.3 static_friction 0.5 kinetic_friction 0.4 critical_slip_distance 1e-5"))
STOCK = ("granular", "hertz/material 5e6 0.3 0.3 tangential mindlin NULL 0.5 0.5 damping coeff_restitution")
MOLECULE = """\
two grains

2 atoms

Coords

1 0 0 0
2 0.007 0 0

Types

1 1
2 2

Diameters

1 0.006
2 0.008

Masses

1 2.8e-4
2 6.7e-4
"""
BIG = """\
a large grain

1 atoms

Coords

1 0 0 0

Types

1 1

Diameters

1 0.01

Masses

1 1.309e-3
"""
SLAB = "region slab block 0.005 0.025 0.005 0.025 0.02 0.04 units box\n"
POUR = SLAB + "fix new grains pour 20 {} 4711 region slab {} dens 2500 2500 vel 0 0 0 0 -0.3"
DEPOSIT = SLAB + "fix new grains deposit 3 {} 100 4711 region slab near 0.004 vz -0.3 -0.3 {}"
TWO_GRAINS = "create_atoms 1 single 0.01 0.01 0.01 units box\ncreate_atoms 2 single 0.02 0.01 0.01 units box\nset group all density 2500"


def deck(style, entry, *, style_options="", tilt="", atom_style="sphere", head="", more=""):
    """A box that is empty until `entry`; `more`: the runs."""
    name, coefficients = style
    floor = f"gran/region {name} {coefficients} region floor" if style is STOCK else "dembark region floor type 1"
    return f"""\
units si
atom_style {atom_style}
atom_modify map array
boundary p p f
newton off
comm_modify vel yes
{head}
region domain {'prism' if tilt else 'block'} 0 0.03 0 0.03 -0.001 0.06 {tilt} units box
create_box 2 domain
neighbor 0.001 bin
pair_style {name} {style_options}
pair_coeff * * {coefficients}
region floor plane 0 0 0 0 0 1 units box
fix floor all wall/{floor}
group grains type 1 2
timestep 1e-5
fix weight all gravity 9.81 vector 0 0 -1
{entry}
thermo_modify lost error
{more}
"""


def reach(folder, text, ranks=1):
    """What LAMMPS lists pairs up to, and how far it fetches ghosts, in each run."""
    done = run_deck(folder, text, ranks=ranks)
    assert done.code == 0 and not done.error, done.error or done.output[-1500:]
    return re.findall(r"(?:master list distance|ghost atom) cutoff = (\S+)", done.output)


MOVE = "fix motion all nve/sphere\nrun 0"
ENTRIES = {
    "pour, one size": (POUR.format(1, "diam one 0.005"), MOVE),
    "pour, a range": (POUR.format(1, "diam range 0.003 0.007"), MOVE),
    "pour, several sizes": (POUR.format(1, "diam poly 2 0.004 0.5 0.0065 0.5"), MOVE),
    "pour, rigid molecules": (
        "molecule pair pair.mol\nfix body grains rigid/small molecule mol pair\n" + POUR.format(0, "mol pair rigid body"), "run 0"),
    "deposit, single grains": (DEPOSIT.format("1", "units box"), MOVE),
    "deposit, molecules": ("molecule pair pair.mol\n" + DEPOSIT.format("0", "mol pair units box"), MOVE),
    "pour and deposit": (POUR.format(1, "diam one 0.005") + (
        "\nmolecule pair pair.mol\nfix big grains deposit 1 0 100 4711 region slab mol pair units box"), MOVE),
    "create_atoms and set between runs": (TWO_GRAINS + "\nset group all diameter 0.004 density 2500", (
        f"{MOVE}\ncreate_atoms 1 single 0.01 0.02 0.01 units box\nset atom 3 diameter 0.009 density 2500\nrun 0\n"
        "set atom 3 diameter 0.005\nrun 0")),
}


@pytest.mark.parametrize("name", ENTRIES)
@pytest.mark.parametrize("tilt", ["", "0.004 0 0"], ids=["right angles", "triclinic"])
def test_lists_look_as_far_as_those_of_granular(tmp_path, name, tilt):
    entry, runs = ENTRIES[name]
    if tilt and "pour" in entry:
        pytest.skip("fix pour itself refuses such a box")
    head = "fix property all property/atom mol ghost yes" if "rigid" in entry else ""
    (tmp_path / "pair.mol").write_text(MOLECULE)
    own, stock = (reach(tmp_path, deck(style, entry, tilt=tilt, head=head, more=runs)) for style in (OWN, STOCK))
    assert own == stock and len(own) >= 2


FILL = f"""\
{POUR.format(1, "diam poly 2 0.004 0.5 0.0065 0.5").replace("pour 20", "pour 60")}
molecule big big.mol
region loft block 0.012 0.018 0.012 0.018 0.047 0.05 units box
fix big grains deposit 1 0 2500 4711 region loft mol big vz -0.3 -0.3 units box
fix motion all nve/sphere
timestep 2e-5
dump grains all custom 7500 grains.dump id x y z radius vx vy vz
dump_modify grains sort id
run 7500"""
WET = (OWN[0], OWN[1] + " bridge_volume 5e-12 contact_angle 0.3")


@pytest.mark.parametrize(("style", "options", "ranks"), [(OWN, "", 1), pytest.param(WET, "capillary_model exact surface_tension 0.072", 2,
                                                                                marks=pytest.mark.full)],
                         ids=["dry", "wet, two ranks"])
def test_an_empty_box_is_filled(tmp_path, style, options, ranks):
    """Grains of two sizes, and a large one later, all fall on others and on the floor: none sinks in."""
    (tmp_path / "big.mol").write_text(BIG)
    done = run_deck(tmp_path, deck(style, FILL, style_options=options, head="processors * * 1"), ranks=ranks)
    assert done.code == 0 and not done.error, done.error or done.output[-1500:]
    grains = read_dump(tmp_path / "grains.dump")[1][-1]
    assert len(grains) == 61
    place, radius = grains[:, 1:4], grains[:, 4]
    apart = place[:, None] - place[None]
    apart[..., :2] -= 0.03 * np.round(apart[..., :2] / 0.03)
    sums = radius[:, None] + radius[None]
    overlap = sums - np.sqrt((apart**2).sum(-1))
    np.fill_diagonal(overlap, 0.0)
    touching = (overlap > 0.0).sum(1)
    assert (overlap / sums).max() < 0.03 and (radius - place[:, 2]).max() < 0.03 * radius.max()
    assert touching.mean() > 1.0


GROWING = """\
create_atoms 1 single 0.01 0.015 0.015 units box
create_atoms 1 single 0.014 0.015 0.015 units box
create_atoms 2 single 0.0101 0.015 0.0025 units box
set group all diameter 0.001 density 2500
variable size equal ramp(0.001,0.0052)
fix growth all adapt 5 atom diameter v_size
fix motion all nve/sphere
unfix weight
{coefficients}
neigh_modify delay 0 every 1 {lists}
dump grains all custom 250 grains.dump id x y z vx vy vz radius
dump_modify grains sort id format float %.17g
run 1500"""


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_grains_that_grow_find_each_other_and_the_wall(tmp_path, ranks):
    """They do not move before they touch, so that LAMMPS by itself would not make new lists; as with lists of every step."""
    found = {}
    for lists in ("check yes", "check no"):
        text = deck(OWN, GROWING.format(coefficients="pair_coeff * * largest_radius 0.0026", lists=lists), atom_style="sphere 1",
                    head="processors * 1 1")
        done = run_deck(tmp_path / lists, text, ranks=ranks)
        assert done.code == 0 and not done.error, done.error or done.output[-1500:]
        found[lists] = np.array(read_dump(tmp_path / lists / "grains.dump")[1])
    now = found["check yes"]
    np.testing.assert_allclose(now, found["check no"], rtol=1e-12, atol=1e-15)
    assert now[-1, 1, 1] - now[-1, 0, 1] > 0.0051 and now[-1, 2, 3] > 0.00252


@pytest.mark.parametrize(("coefficients", "kind", "largest"), [("", 2, "0.0005"), ("pair_coeff 2 2 largest_radius 0.0026", 1, "0.0005"),
                                                               ("pair_coeff * * largest_radius 0.002", 2, "0.002")])
def test_a_grain_that_grows_beyond_what_was_said_ends_the_run(tmp_path, coefficients, kind, largest):
    done = run_deck(tmp_path, deck(OWN, GROWING.format(coefficients=coefficients, lists="check yes"), atom_style="sphere 1"))
    assert done.code != 0
    assert f"pair_coeff {kind} {kind} largest_radius R" in done.error
    assert "the radius of grain" in done.error and f"type {kind} up to {largest}; " in done.error
