"""Decks with fix integration/monitor for LIGGGHTS and LAMMPS, and what it says."""

from __future__ import annotations

import re
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig import lammps_driver, liggghts_driver
from rig.chains import DENSITY, RADIUS
from rig.liggghts_driver import Run
from rig.scenarios import Material

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


def law(driver: ModuleType, m: Material) -> str:
    if driver is lammps_driver:
        return f"pair_style dembark/granular {lammps_driver.settings(m)}\npair_coeff * * {lammps_driver.coefficients(m)}"
    return f"{liggghts_driver.properties(m)}\npair_style gran {liggghts_driver.models(m)}\npair_coeff * *"


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
