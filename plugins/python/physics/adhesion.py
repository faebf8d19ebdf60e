"""Adhesion of dry spheres, or of a sphere and a wall, after Derjaguin, Muller & Toporov and after Johnson, Kendall & Roberts."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import contact_number, numbers

Numbers = NDArray[np.float64] | float


def dmt_pull_off(work_of_adhesion: ArrayLike, effective_radius: ArrayLike) -> Numbers:
    """Largest attraction (N) of a DMT contact, 2 pi W R*; `work_of_adhesion` W in J/m^2, `effective_radius` R* in m.

    B. V. Derjaguin, V. M. Muller & Yu. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314. ValueError for values out of range.

    >>> round(dmt_pull_off(0.05, 1e-4), 9)
    3.1416e-05
    """
    work, radius = _checked(work_of_adhesion, effective_radius)
    return _as_given(2.0 * np.pi * work * radius)


def jkr_pull_off(work_of_adhesion: ArrayLike, effective_radius: ArrayLike) -> Numbers:
    """Largest attraction (N) of a JKR contact, 3/2 pi W R*, see `dmt_pull_off` and `jkr_force`."""
    work, radius = _checked(work_of_adhesion, effective_radius)
    return _as_given(1.5 * np.pi * work * radius)


def jkr_force(overlap: ArrayLike, work_of_adhesion: float, effective_radius: float, effective_youngs_modulus: float) -> Numbers:
    """Force (N, > 0 repulsive) of a JKR contact held at an `overlap` (m; < 0 is a gap), springs and adhesion together.

    work_of_adhesion : W, J/m^2, twice the surface energy of equal materials
    effective_radius, effective_youngs_modulus : R*, m, and E*, Pa

    nan beyond the gap of rupture. The gap at which a contact forms is 0. K. L. Johnson, K. Kendall & A. D. Roberts, Proc. R. Soc. Lond. A
    324 (1971) 301. ValueError for values out of range.

    >>> round(jkr_force(0.0, 0.05, 1e-4, 1e7) / jkr_pull_off(0.05, 1e-4), 6)
    -0.888889
    """
    law = _scalars(work_of_adhesion, effective_radius, effective_youngs_modulus)
    at = numbers("overlap", overlap, "m")
    force = np.vectorize(lambda one: _physics.jkr_force(*law, _physics.jkr_contact_radius(*law, one)), otypes=[float])(at)
    return _as_given(np.where(at < -_physics.jkr_rupture_distance(*law), np.nan, force))


def jkr_rupture_distance(work_of_adhesion: float, effective_radius: float, effective_youngs_modulus: float) -> float:
    """Gap (m) beyond which a JKR contact breaks, 3/4 (pi^2 W^2 R* / E*^2)^(1/3); arguments and errors as in `jkr_force`."""
    return _physics.jkr_rupture_distance(*_scalars(work_of_adhesion, effective_radius, effective_youngs_modulus))


def jkr_loss(work_of_adhesion: float, effective_radius: float, effective_youngs_modulus: float) -> float:
    """Energy (J) that an impact of bodies that lose no other loses to JKR's hysteresis, 7.09 (W^5 R*^4 / E*^2)^(1/3).

    Below it bodies stick: C. Thornton & Z. Ning, Powder Technology 99 (1998) 154. Arguments and errors as in `jkr_force`.
    """
    return _physics.jkr_loss(*_scalars(work_of_adhesion, effective_radius, effective_youngs_modulus))


def _checked(work: ArrayLike, radius: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return contact_number("work_of_adhesion", work), numbers("effective_radius", radius, "m", low=0.0, low_open=True)


def _scalars(work: float, radius: float, youngs: float) -> tuple[float, float, float]:
    _checked(work, radius)
    contact_number("youngs_modulus", youngs, "effective_youngs_modulus")
    return float(work), float(radius), float(youngs)


def _as_given(values: NDArray[np.float64]) -> Numbers:
    return values if values.shape else float(values)
