"""Unit styles that LAMMPS and LIGGGHTS name by `ITEM: UNITS`, in SI.

What each style measures in is in the manual of LAMMPS, page `units`; constants are those of CODATA 2018 (E. Tiesinga, P. J. Mohr,
D. B. Newell, B. N. Taylor, Rev. Mod. Phys. 93 (2021) 025010).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

import numpy as np

from .frames import DumpError, RawFrame

KEPT_UNITS = "columns {} stay in the units of the file, {}, for their dimension is not known"

_AVOGADRO = 6.02214076e23
_CALORIE, _ELECTRONVOLT, _HARTREE = 4.184, 1.602176634e-19, 4.3597447222071e-18  # J
_BOHR, _DALTON = 5.29177210903e-11, 1.66053906660e-27  # m, kg


@dataclass(frozen=True)
class UnitStyle:
    """Factors from a unit style to SI; the force and the density have units of their own in some styles."""

    length: float
    mass: float
    time: float
    velocity: float
    force: float
    density: float

    def factor(self, column: str) -> float | None:
        """Factor of a column of a dump of grains or contacts; None for one whose dimension is not known."""
        found = next((dimension for pattern, dimension in _DIMENSIONS if pattern.fullmatch(column)), None)
        values = {"1": 1.0, "length": self.length, "mass": self.mass, "density": self.density, "velocity": self.velocity,
                  "force": self.force, "spin": self.velocity / self.length, "torque": self.force * self.length,
                  "momentum": self.mass * self.length * self.velocity, "volume": self.length**3, "area": self.length**2,
                  "power": self.force * self.velocity}
        return None if found is None else values[found]


# The velocity of `electron` is in Bohr radii over sqrt(dalton bohr^2 / hartree), not over its unit of time, the femtosecond.
_STYLES = {"si": UnitStyle(1.0, 1.0, 1.0, 1.0, 1.0, 1.0), "cgs": UnitStyle(1e-2, 1e-3, 1.0, 1e-2, 1e-5, 1e3),
           "micro": UnitStyle(1e-6, 1e-15, 1e-6, 1.0, 1e-9, 1e3), "nano": UnitStyle(1e-9, 1e-21, 1e-9, 1.0, 1e-12, 1e6),
           "real": UnitStyle(1e-10, 1e-3 / _AVOGADRO, 1e-15, 1e5, 1e3 * _CALORIE / _AVOGADRO / 1e-10, 1e3),
           "metal": UnitStyle(1e-10, 1e-3 / _AVOGADRO, 1e-12, 1e2, _ELECTRONVOLT / 1e-10, 1e3),
           "electron": UnitStyle(_BOHR, _DALTON, 1e-15, math.sqrt(_HARTREE / _DALTON), _HARTREE / _BOHR, _DALTON / _BOHR**3)}
_DIMENSIONS = [(re.compile(pattern), dimension) for pattern, dimension in (
    (r"id|type|mol|procp?1?|i[xyz]|[xyz]su?", "1"), (r"[xyz]u?|radius|diameter|delta", "length"), ("mass", "mass"),
    ("density", "density"), (r"v[xyz]", "velocity"), (r"omega[xyz]", "spin"), (r"f[xyz]|f_force_\w+\[[123]\]", "force"),
    (r"tq[xyz]|torque", "torque"), (r"angmom[xyz]", "momentum"), (r"liquid_volume", "volume"), ("contactArea", "area"),
    (r"dissipated_power", "power"), (r"force_?(normal|tangential)?", "force"))]


def unit_style(name: str, where: str) -> UnitStyle:
    """The style called `name`, "" being SI; DumpError, begun by `where`, for one that has no size in SI or is not known."""
    key = name.strip().lower() or "si"
    if key == "lj":
        raise DumpError(f"{where}: its units are lj, which have no size in SI; scale the numbers first")
    if key not in _STYLES:
        raise DumpError(f"{where}: its units are {name}, which is not a unit style; there are {', '.join(_STYLES)}")
    return _STYLES[key]


def in_si(raw: RawFrame, where: str) -> tuple[RawFrame, list[str]]:
    """The frame of grains in SI, and the columns that stay in the units of the file because their dimension is not known."""
    style = unit_style(raw.units, where)
    if style is _STYLES["si"]:
        return raw, []
    factors = [style.factor(name) for name in raw.columns]
    unknown = [name for name, factor in zip(raw.columns, factors, strict=True) if factor is None]
    scaled = replace(raw, low=raw.low * style.length, high=raw.high * style.length, tilt=raw.tilt * style.length, units="si",
                     values=raw.values * np.array([1.0 if factor is None else factor for factor in factors]),
                     time=None if raw.time is None else raw.time * style.time)
    return scaled, unknown
