"""Viscous force of a liquid bridge between two spheres, or a sphere and a wall."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import numbers, together
from dembark.physics.capillary import bridge_radius


class ViscousResistance(NamedTuple):
    """Force per velocity (N s/m); the force is this times the velocity, against it."""

    normal: NDArray[np.float64] | float
    tangential: NDArray[np.float64] | float


def check_viscous(viscosity: ArrayLike, minimum_gap: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Both as arrays; ValueError for a viscosity without a gap to cut off at."""
    eta = numbers("viscosity", viscosity, "Pa s", low=0.0)
    floor = numbers("minimum_gap", minimum_gap, "m", low=0.0)
    eta, floor = together(viscosity=eta, minimum_gap=floor)
    if ((eta > 0.0) & (floor == 0.0)).any():
        raise ValueError("minimum_gap must be > 0 m with a viscosity: viscous forces diverge as the gap closes; the roughness of the "
                         "surfaces is usual")
    return eta, floor


def viscous_resistance(radius_i: ArrayLike, radius_j: ArrayLike, gap: ArrayLike, volume: ArrayLike, viscosity: ArrayLike,
                       minimum_gap: ArrayLike) -> ViscousResistance:
    """Resistance of a bridge to normal and to tangential motion: F = -resistance * velocity, of the surfaces against each other.

    Parameters broadcast against each other; scalars come back for scalars.

    radius_i, radius_j : m, > 0; ``inf`` is a wall
    gap : m, surface to surface; anything below `minimum_gap`, overlap too, counts as that
    volume : m^3 of liquid in the bridge, >= 0; without liquid there is no force. Whether there is a bridge is not decided here.
    viscosity : Pa s, >= 0
    minimum_gap : m, > 0: lower cut-off, usually the roughness of the surfaces

    Normal: 3/2 pi eta R^2 X^2 / s with R = 2 R* and X = 1 - 1/sqrt(1 + 2 V/(pi R s^2)): Pitois, Moucheront & Chateau, J. Colloid
    Interface Sci. 231 (2000) 26; X = 1 is Adams & Perchard, Inst. Chem. Eng. Symp. Ser. 91 (1985) 147. Tangential:
    6 pi eta R* (8/15 ln(R*/s) + 0.9588): Goldman, Cox & Brenner, Chem. Eng. Sci. 22 (1967) 637; for two spheres Nase et al., Powder
    Technol. 116 (2001) 214. Raises ValueError or TypeError for arguments out of range.

    >>> dry, wet = viscous_resistance(1e-3, 1e-3, 1e-5, [0.0, 1e-11], 1e-3, 1e-6).normal
    >>> bool(wet > dry == 0.0)
    True
    """
    eta, floor = check_viscous(viscosity, minimum_gap)
    columns = together(radius_i=bridge_radius(radius_i, radius_j), gap=numbers("gap", gap, "m", infinite=True),
                       volume=numbers("volume", volume, "m^3", low=0.0), viscosity=eta, minimum_gap=floor)
    shape = columns[0].shape
    parts = _physics.viscous_resistance(*(np.ascontiguousarray(c.ravel()) for c in columns))
    return ViscousResistance(*(part.reshape(shape) if shape else float(part[0]) for part in parts))
