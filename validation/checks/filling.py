"""The classical experiment on Janssen's law: the mass that the base of a silo feels against the mass that was filled in.

Janssen's law for the base, M_app = M_sat (1 - exp(-M / M_sat)), M_sat = rho_b A lambda the mass that the base feels of a very high filling.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dembark.validation.checks.quantity import Quantity, measured
from dembark.validation.references import JANSSEN, WALKER
from dembark.postproc.statistics import Estimate, combined
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]


def apparent_mass(mass: Array, saturation: float) -> Array:
    """M_app (kg) of filled masses (kg) by Janssen's law."""
    return saturation * -np.expm1(-mass / saturation)


def apparent_mass_with_onset(mass: Array, saturation: float, onset: float) -> Array:
    """The same when the walls carry nothing of the first `onset` kg below the surface (two-parameter form)."""
    return np.where(mass < onset, mass, saturation + (onset - saturation) * np.exp(-(mass - onset) / saturation))


def fitted_saturation(mass: Array, apparent: Array) -> float:
    """M_sat (kg) that fits the curve best, by least squares."""
    fit = least_squares(lambda p: (apparent_mass(mass, np.exp(p[0])) - apparent) / apparent.max(), [np.log(apparent.max())])
    return float(np.exp(fit.x[0]))


def fitted_pair(mass: Array, apparent: Array) -> tuple[float, float]:
    """(M_sat, onset) in kg of the two-parameter form."""
    scale, starts = apparent.max(), (0.02, 0.3)
    fits = [
        least_squares(
            lambda p: (apparent_mass_with_onset(mass, p[0], p[1]) - apparent) / scale,
            [scale, start * scale],
            bounds=([0.05 * scale, 0.0], [50.0 * scale, 0.95 * scale]),
            x_scale=scale,
        )
        for start in starts
    ]
    best = min(fits, key=lambda fit: fit.cost)
    return float(best.x[0]), float(best.x[1])


def propagated(measure: Callable[[Array], float], values: Array, halves: Array) -> Estimate:
    """`measure(values)` with the half-width that independent ones of `values` give it, to first order."""
    middle = measure(values)
    parts = []
    for index, half in enumerate(halves):
        if not np.isfinite(half):
            return Estimate(middle, float("inf"), "an apparent mass has no interval")
        moved = values.copy()
        moved[index] += half
        parts.append(measure(moved) - middle)
    return Estimate(middle, combined(parts), "propagated from the apparent masses")


def filling_study(points: Sequence[dict[str, Any]], tolerance: float) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, profiles and remarks from the measured fillings `points` (contents of metrics.json, any order)."""
    points = sorted(points, key=lambda point: measured(point, "filled_mass").value)
    mass = np.array([measured(point, "filled_mass").value for point in points])
    shares = [measured(point, "apparent_mass_ratio") for point in points]
    apparent = mass * [one.value for one in shares]
    halves = mass * [one.half for one in shares]
    deepest = points[-1]
    # Mass of a piece of the column as high as the radius.
    per_radius = mass[-1] / measured(deepest, "filling_height").value
    predicted = measured(deepest, "janssen_length_predicted")
    fitted = propagated(lambda values: fitted_saturation(mass, values) / per_radius, apparent, halves)
    saturation, onset = fitted_pair(mass, apparent)
    one = float(np.sum((apparent_mass(mass, fitted.value * per_radius) - apparent) ** 2))
    two = float(np.sum((apparent_mass_with_onset(mass, saturation, onset) - apparent) ** 2))
    found = [
        Quantity(
            "filling_length",
            "λ fitted to M_app(M), over R",
            "R",
            fitted,
            reference=predicted,
            tolerance=tolerance,
            source=JANSSEN.short,
            detail="reference: R / (2 K μ_mob) of the deepest filling, nothing fitted",
        ),
        Quantity(
            "largest_apparent_mass",
            "apparent mass of the deepest filling",
            "kg",
            Estimate(float(apparent[-1]), float(halves[-1]), shares[-1].basis),
            reference=Estimate(float(apparent_mass(mass[-1:], predicted.value * per_radius)[0]), 0.0),
            tolerance=tolerance,
            source=JANSSEN.short,
            detail="reference: Janssen's law with the predicted λ",
        ),
        Quantity(
            "filling_two_parameter_gain",
            "share of the squared residuals that a hydrostatic zone removes",
            "1",
            Estimate(max(0.0, 1.0 - two / one) if one > 0.0 else 0.0, 0.0),
            source=WALKER.short,
            compared=False,
            detail=f"with it λ is {saturation / per_radius:.2f} R and the zone holds {onset:.3g} kg; {len(points)} fillings",
        ),
    ]
    curve = {
        "name": "apparent_mass",
        "title": "Apparent mass",
        "along": "filled mass (kg)",
        "across": "force on the base / g (kg)",
        "vertical": False,
        "place": mass.tolist(),
        "value": apparent.tolist(),
        "note": "",
        "reference": apparent_mass(mass, predicted.value * per_radius).tolist(),
        "reference_label": "Janssen, nothing fitted",
        "low": (apparent - halves).tolist() if np.isfinite(halves).all() else None,
        "high": (apparent + halves).tolist() if np.isfinite(halves).all() else None,
        "band": "95 % interval",
    }
    remarks = [
        "Each point is a packing of its own, filled by rain to that height, with the wall creeping upward, so that all have the same history.",
    ]
    return found, [curve], remarks
