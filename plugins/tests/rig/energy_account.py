"""What fix energy/account returns in a deck's thermo output, and what has to hold of it."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from rig.liggghts_driver import Run

NAMES = ("kinetic", "start", "gravity", "normal_spring", "normal_damping", "tangential_spring", "tangential_damping", "bridges", "viscous",
         "walls", "other", "imposed", "balance", "normal_stored", "tangential_stored", "step_error", "scale", "rolling_spring",
         "rolling_damping", "rolling_stored")
WORKS = NAMES[2:12] + NAMES[17:19]
LOSSES = ("normal_damping", "tangential_damping", "viscous", "rolling_damping")
FIX = "fix energy all energy/account"
COLUMNS = f"thermo_style custom step atoms c_linear c_angular {' '.join(f'f_energy[{k}]' for k in range(1, len(NAMES) + 1))}"
THERMO = f"""\
compute linear all ke
compute angular all erotate/sphere
{COLUMNS}
thermo_modify lost ignore norm no format float %.17g
"""


class Account:
    """Energies and works line by line, by name (J); `full`: kinetic energy of all atoms as the engine's computes have it."""

    def __init__(self, done: Run) -> None:
        assert done.code == 0, done.output[-2000:]
        lines = re.findall(rf"^ *\d+ +\d+(?: +[-+.\de]+){{{2 + len(NAMES)}}} *$", done.output, re.MULTILINE)
        rows = np.array([line.split() for line in lines], dtype=float)
        assert len(rows) > 1 and np.isfinite(rows).all()
        self.rows, self.step, self.atoms, self.full = rows[:, 4:], rows[:, 0], rows[:, 1], rows[:, 2] + rows[:, 3]

    def __getattr__(self, name: str) -> NDArray[np.float64]:
        if name not in NAMES:
            raise AttributeError(name)
        return self.rows[:, NAMES.index(name)]

    @property
    def turnover(self) -> float:
        """J, of the last line: what all works are made of."""
        return float(self.scale[-1])

    def assert_balanced(self, *, other: bool = True, within: float = 1e-12) -> None:
        """The works add up to the kinetic energy, dissipation takes energy, and (`other`) all of the force is in a known part."""
        total = self.start + sum(getattr(self, name) for name in WORKS)
        assert np.abs(self.balance).max() <= within * self.turnover
        np.testing.assert_allclose(self.kinetic - total, self.balance, atol=1e-15 * self.turnover * len(WORKS))
        if other:
            assert np.abs(self.other).max() <= within * self.turnover
        for name in LOSSES:
            assert (getattr(self, name) <= 1e-15 * self.turnover).all(), name
