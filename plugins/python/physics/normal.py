"""Effective elastic constants of two materials in contact."""

from __future__ import annotations

from dembark import _physics


def effective_youngs_modulus(youngs_1: float, poisson_1: float, youngs_2: float, poisson_2: float) -> float:
    """E* (Pa), 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (Hertz).

    >>> round(effective_youngs_modulus(5e6, 0.3, 5e6, 0.3))
    2747253
    """
    return _physics.effective_youngs_modulus(youngs_1, poisson_1, youngs_2, poisson_2)


def effective_shear_modulus(youngs_1: float, poisson_1: float, youngs_2: float, poisson_2: float) -> float:
    """G* (Pa), 1/G* = (2 - nu1)/G1 + (2 - nu2)/G2 with G = E / (2 (1 + nu)) (Mindlin)."""
    return _physics.effective_shear_modulus(youngs_1, poisson_1, youngs_2, poisson_2)
