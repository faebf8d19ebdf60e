"""Effective elastic constants of two materials in contact."""

from __future__ import annotations

from dembark import _physics
from dembark.physics._checks import contact_number


def effective_youngs_modulus(youngs_1: float, poisson_1: float, youngs_2: float, poisson_2: float) -> float:
    """E* (Pa), 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (Hertz). ValueError for a modulus or a ratio out of range.

    >>> round(effective_youngs_modulus(5e6, 0.3, 5e6, 0.3))
    2747253
    """
    return _physics.effective_youngs_modulus(*_elastic(youngs_1, poisson_1, youngs_2, poisson_2))


def effective_shear_modulus(youngs_1: float, poisson_1: float, youngs_2: float, poisson_2: float) -> float:
    """G* (Pa), 1/G* = (2 - nu1)/G1 + (2 - nu2)/G2 with G = E / (2 (1 + nu)) (Mindlin). ValueError for a modulus or a ratio out of
    range."""
    return _physics.effective_shear_modulus(*_elastic(youngs_1, poisson_1, youngs_2, poisson_2))


def _elastic(*given: float) -> list[float]:
    kinds = ("youngs_modulus", "poissons_ratio")
    return [float(contact_number(kinds[i % 2], value, f"{('youngs', 'poisson')[i % 2]}_{1 + i // 2}")) for i, value in enumerate(given)]
