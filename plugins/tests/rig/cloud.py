"""A cloud of grains of two types and many sizes that falls on a plane with some grains stuck to it: everything a pair loop meets."""

import random

import numpy as np

DECK = """
atom_style granular
atom_modify map array
boundary p p f
newton off
communicate single vel yes
units si
processors * 1 *
read_data cloud.data
neighbor 0.001 bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype 5.e6 1.e7
fix m2 all property/global poissonsRatio peratomtype 0.3 0.2
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.5 0.7 0.7 0.9
fix m4 all property/global staticFriction peratomtypepair 2 0.5 0.3 0.3 0.6
fix m5 all property/global kineticFriction peratomtypepair 2 0.4 0.3 0.3 0.2
fix m6 all property/global criticalSlipDistance peratomtypepair 2 1e-5 2e-5 2e-5 1e-6
fix m7 all property/global interfaceShearStrength peratomtypepair 2 1e4 1e300 1e300 1e300
fix m8 all property/global coefficientRollingFriction peratomtypepair 2 0 0 0 0
fix m9 all property/global surfaceTension scalar 0.072
fix m10 all property/global contactAngle peratomtype 0.3 0.1
fix m11 all property/global bridgeVolume peratomtypepair 2 1e-12 5e-12 5e-12 0
pair_style gran model hertz tangential finnie_rabinowicz {cohesion} {rolling} {settings}
pair_coeff * *
timestep 5e-6
fix weight all gravity 9.81 vector 0.1 0 -1
fix floor all wall/gran model hertz tangential finnie_rabinowicz {cohesion} {rolling} primitive type 1 zplane 0.0 {settings}
group stuck id 1:64
fix motion all nve/sphere
fix held stuck freeze
set group all vz -0.5
thermo 100
dump frames all custom 200 grains.dump id x y z vx vy vz omegax omegay omegaz fx fy fz
dump_modify frames sort id format "%d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g"
run 1000
"""
LAYERS = 12


def cloud() -> str:
    """Layers of 8 x 8 grains of two types and many sizes, each a little off its place, that fall on each other."""
    chance = random.Random(1)
    rows = []
    for layer in range(LAYERS):
        for row in range(8):
            for column in range(8):
                number = len(rows) + 1
                place = [(k + 0.5) * 0.0025 + chance.uniform(-1e-4, 1e-4) for k in (column, row)]
                rows.append(f"{number} {1 + (number % 3 == 0)} {0.002 * chance.uniform(0.7, 1.1)} 2500 "
                            f"{place[0]} {place[1]} {0.0011 + layer * 0.0021}")
    head = f"cloud\n\n{len(rows)} atoms\n2 atom types\n\n0 0.02 xlo xhi\n0 0.02 ylo yhi\n-0.002 0.04 zlo zhi\n\nAtoms\n\n"
    return head + "\n".join(rows) + "\n"


def deviation(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of positions, velocities, spins or forces over the largest value of its kind."""
    kinds = [slice(first, first + 3) for first in (1, 4, 7, 10)]
    return max(np.abs(one[..., kind] - other[..., kind]).max() / np.abs(other[..., kind]).max() for kind in kinds)
