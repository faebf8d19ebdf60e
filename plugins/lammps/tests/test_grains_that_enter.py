"""Grains that enter or grow after the start of a run are in the lists of pairs, as with LAMMPS's own `granular`, or the run ends with one line."""

import re

import numpy as np
import pytest
from rig.lammps_driver import run_deck
from rig.liggghts_driver import read_dump

OWN = ("dembark/granular", "youngs_modulus 5e6 poissons_ratio 0.3 restitution 0.3 static_friction 0.5 kinetic_friction 0.4 "
       "critical_slip_distance 1e-5")
STOCK = ("granular", "hertz/material 5e6 0.3 0.3 tangential mindlin NULL 0.5 0.5 damping coeff_restitution")
MOLECULE = "two grains\n\n2 atoms\n\nCoords\n\n1 0 0 0\n2 0.007 0 0\n\nTypes\n\n1 1\n2 2\n\nDiameters\n\n1 0.006\n2 0.008\n\n" \
           "Masses\n\n1 2.8e-4\n2 6.7e-4\n"
POUR = "region slab block 0.005 0.025 0.005 0.025 0.02 0.04 units box\nfix new grains pour 20 {} 4711 region slab {} dens 2500 2500 vel 0 0 0 0 -0.3"
DEPOSIT = "region slab block 0.01 0.02 0.01 0.02 0.02 0.04 units box\nfix new grains deposit 3 {} 100 4711 region slab near 0.004 vz -0.3 -0.3 {}"
TWO_GRAINS = "create_atoms 1 single 0.01 0.01 0.01 units box\ncreate_atoms 2 single 0.02 0.01 0.01 units box\nset group all density 2500"


def deck(style, entry, *, style_options="", boundary="p p f", tilt="", atom_style="sphere", head="", more=""):
    """A box that is empty until `entry`; `more`: the runs."""
    name, coefficients = style
    box = f"region domain {'prism' if tilt else 'block'} 0 0.03 0 0.03 -0.001 0.06 {tilt} units box"
    floor = f"fix floor all wall/{'dembark region floor type 1' if name.startswith('dembark') else f'gran/region {name} {coefficients} region floor'}"
    return f"""\
units si
atom_style {atom_style}
atom_modify map array
boundary {boundary}
newton off
comm_modify vel yes
{head}
{box}
create_box 2 domain
neighbor 0.001 bin
pair_style {name} {style_options}
pair_coeff * * {coefficients}
region floor plane 0 0 0 0 0 1 units box
{floor}
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


ENTRIES = {
    "pour, one size": (POUR.format(1, "diam one 0.005"), "fix motion all nve/sphere\nrun 0"),
    "pour, a range": (POUR.format(1, "diam range 0.003 0.007"), "fix motion all nve/sphere\nrun 0"),
    "pour, several sizes": (POUR.format(1, "diam poly 2 0.004 0.5 0.0065 0.5"), "fix motion all nve/sphere\nrun 0"),
    "pour, rigid molecules": (f"molecule pair pair.mol\nfix body grains rigid/small molecule mol pair\n{POUR.format(0, 'mol pair rigid body')}",
                              "run 0"),
    "deposit, single grains": (DEPOSIT.format("1", "units box"), "fix motion all nve/sphere\nrun 0"),
    "deposit, molecules": (f"molecule pair pair.mol\n{DEPOSIT.format('0', 'mol pair units box')}", "fix motion all nve/sphere\nrun 0"),
    "two fixes": (POUR.format(1, "diam one 0.005") + "\nfix old grains deposit 1 2 100 4711 region slab units box",
                  "fix motion all nve/sphere\nrun 0"),
    "create_atoms and set between two runs": (TWO_GRAINS + "\nset group all diameter 0.004 density 2500\nfix motion all nve/sphere",
                                              "run 0\ncreate_atoms 1 single 0.01 0.02 0.01 units box\n"
                                              "set atom 3 diameter 0.009 density 2500\nrun 0\nset atom 3 diameter 0.005\nrun 0"),
}
BOXES = {"right angles": {}, "triclinic": {"tilt": "0.004 0 0"}}


@pytest.mark.parametrize("name", ENTRIES)
@pytest.mark.parametrize("box", BOXES)
def test_lists_look_as_far_as_those_of_granular(tmp_path, name, box):
    entry, runs = ENTRIES[name]
    options = dict(BOXES[box], more=runs)
    if "mol" in entry:
        options["head"], options["atom_style"] = "fix property all property/atom mol ghost yes" if "rigid" in entry else "", "sphere"
    (tmp_path / "pair.mol").write_text(MOLECULE)
    own, stock = (reach(tmp_path, deck(style, entry, **options)) for style in (OWN, STOCK))
    assert own == stock and len(own) >= 2
