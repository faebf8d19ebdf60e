"""Decks with fix integration/monitor for LIGGGHTS and LAMMPS, and what it says."""

from __future__ import annotations

import re
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from rig import lammps_driver, liggghts_driver
from rig.chains import DENSITY, RADIUS, CompressedChain
from rig.liggghts_driver import Run
from rig.scenarios import Material

BED = Material(static_friction=0.5, kinetic_friction=0.4, restitution=0.7, youngs_modulus=5e6)
COUNT = 24
MONITOR = "fix watch all integration/monitor "
THERMO = (f"thermo_style custom step {' '.join(f'f_watch[{k}]' for k in range(1, COUNT + 1))}\n"
          "thermo_modify lost error norm no format float %.17g\n")
POSITION, VELOCITY, SPIN = slice(0, 4), slice(4, 8), slice(8, 12)


def figures(done: Run) -> NDArray[np.float64]:
    """The rows of the thermo output: the step, and the figures."""
    assert done.code == 0, done.error or done.output[-2000:]
    lines = re.findall(rf"^ *(\d+(?: +[-+.\de]+){{{COUNT}}}) *$", done.output, re.MULTILINE)
    return np.array([line.split() for line in lines], dtype=float)


def assert_estimates_are_true(done: Run, chain: CompressedChain, steps: int) -> None:
    """What the monitor estimates of a compressed chain, watched in each of so many steps, is its true local error, to 2 %."""
    found = figures(done)[-1, 1:]
    along, speed = chain.true_errors()
    assert found[POSITION][1] == pytest.approx(along, rel=0.02)
    assert found[VELOCITY][1] == pytest.approx(speed, rel=0.02)
    assert found[SPIN][0] == 0.0
    assert found[12] == chain.count * (steps - 3)
    # Half a period of two grains on the spring between them.
    assert found[13] == pytest.approx(np.pi * np.sqrt(2) * np.sin(8 * np.pi / 18) / chain.phase, rel=1e-9)


def law(driver: ModuleType, m: Material) -> str:
    if driver is lammps_driver:
        return f"pair_style dembark/granular {lammps_driver.settings(m)}\npair_coeff * * {lammps_driver.coefficients(m)}"
    return f"{liggghts_driver.properties(m)}\npair_style gran {liggghts_driver.models(m)}\npair_coeff * *"


def oblique_impact(driver: ModuleType, dimension: int, motion: str, step: float) -> str:
    """A deck of one impact of two grains with friction, that fix `motion` moves in a space of this dimension."""
    text = line_of_grains(driver, [-RADIUS - 1e-5, RADIUS + 1e-5], [0.5, -0.5], replace(BED, restitution=0.9), step, f"""\
set atom 1 vy 0.3
fix motion all {motion}
{MONITOR}speed 1 every 1 impacts 1 action report
{THERMO}thermo 100
run 1500""")
    return text.replace("boundary f f f", "dimension 2\nboundary f f p") if dimension == 2 else text


def line_of_grains(driver: ModuleType, places: ArrayLike, velocities: ArrayLike, material: Material, step: float, rest: str) -> str:
    """Spheres along x (m, m/s); `rest`: what follows the pair style."""
    along = np.asarray(places, dtype=float)
    grains = "\n".join(f"create_atoms 1 single {x!r} 0 0 units box\nset atom {i} vx {v!r}"
                       for i, (x, v) in enumerate(zip(along.tolist(), np.asarray(velocities, dtype=float).tolist(), strict=True), start=1))
    return f"""\
{driver.head()}
region domain block -0.02 {float(along[-1]) + 0.02!r} -0.02 0.02 -0.02 0.02 units box
create_box 2 domain
neighbor 0.0005 bin
neigh_modify delay 0
timestep {step!r}
{law(driver, material)}
{grains}
set group all diameter {2 * RADIUS!r} density {DENSITY!r}
{rest}
"""
