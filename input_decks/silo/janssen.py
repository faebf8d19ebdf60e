"""Janssen's law of the stresses in a silo, and its fits to measured stresses. sigma_zz = w lambda (1 - exp(-h / lambda)) at the depth h
below the surface for the specific weight w (N/m3) and the decay length lambda (m). With the filled mass for h, the apparent mass for
sigma_zz and w = 1 it is the law of the mass that the base feels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from dembark.postproc.replica import Array


def stress(depth: Array, length: float, weight: float = 1.0) -> Array:
    """sigma_zz in Pa at `depth` (m) for the decay `length` (m) and the specific `weight` (N/m3)."""
    return weight * length * -np.expm1(-depth / length)


def base_share(depth: Array | float) -> Array:
    """Force on the base over the weight, (1 - exp(-y)) / y at the `depth` y over lambda; more than 1 where walls push down, with y < 0."""
    depth = np.asarray(depth, float)
    return np.asarray(-np.expm1(-depth) / np.where(depth == 0.0, 1.0, depth) + (depth == 0.0))


def fitted_friction(depth: Array, shares: Array) -> float:
    """K mu that fits `base_share` best to `shares` (n,) of silos as deep as `depth` (n,) over their sizes, relative to each of them. It is
    a number for every silo, 0 for a liquid, where lambda = size / (2 K mu) is not."""
    return float(least_squares(lambda p: base_share(2.0 * p[0] * depth) / shares - 1.0, [0.2]).x[0])


def two_parameter(depth: Array, length: float, onset: float, weight: float = 1.0) -> Array:
    """Vertical stress in Pa at `depth` (m), hydrostatic down to `onset` (m), exponential with `length` (m) below it (Walker 1966,
    Vanel & Clement 1999)."""
    return np.where(depth < onset, weight * depth, weight * (length + (onset - length) * np.exp(-(depth - onset) / length)))


def fitted_length(depth: Array, measured: Array, start: float, weight: float = 1.0) -> float:
    """lambda (m) that fits the stress `measured` (n,) in Pa best, by least squares from `start` on."""
    fit = least_squares(lambda p: (stress(depth, np.exp(p[0]), weight) - measured) / measured.max(), [np.log(start)])
    return float(np.exp(fit.x[0]))


def fitted_pair(depth: Array, measured: Array, starts: Sequence[tuple[float, float]], limits: Sequence[tuple[float, float]], scale: float,
                weight: float = 1.0) -> tuple[float, float]:
    """(lambda, onset) in m of the two-parameter form: the best of the fits from all `starts`, within `limits` (low, high) of the two."""
    fits = [least_squares(lambda p: (two_parameter(depth, p[0], p[1], weight) - measured) / measured.max(), start,
                          bounds=tuple(zip(*limits, strict=True)), x_scale=scale) for start in starts]
    length, onset = min(fits, key=lambda fit: fit.cost).x
    # Where the second parameter helps nothing, the fit ends at a few rounding errors from zero.
    return float(length), float(onset) if onset > 1e-6 * scale else 0.0


def gain(depth: Array, measured: Array, length: float, pair: tuple[float, float], weight: float = 1.0) -> float:
    """Share of the squared residuals of Janssen's law with `length` that the two-parameter form with `pair` removes; at least 0."""
    if pair[1] == 0.0:
        return 0.0
    one, two = (float(np.sum((law - measured) ** 2)) for law in (stress(depth, length, weight), two_parameter(depth, *pair, weight)))
    return max(0.0, 1.0 - two / one) if one > 0.0 else 0.0
