"""How a flow in a channel grows with the channel's width: exponents of measured quantities and the collapse of scaled profiles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dembark.validation.checks.quantity import Quantity, measured
from dembark.validation.references import DEBNATH
from dembark.postproc.statistics import Estimate
from numpy.typing import NDArray

Array = NDArray[np.float64]

RATIO_TOLERANCE = 0.10
COLLAPSE_TOLERANCE = 0.10


def exponent(widths: Array, values: Sequence[Estimate]) -> Estimate:
    """Slope of ln(value) against ln(width) by least squares, with the half-width that the values' own intervals give it."""
    place = np.log(widths) - np.log(widths).mean()
    weights = place / np.sum(place**2)
    slope = float(weights @ np.log([one.value for one in values]))
    half = float(np.sqrt(np.sum((weights * [one.half / one.value for one in values]) ** 2)))
    return Estimate(slope, half, f"propagated from {len(widths)} widths")


def _curve(point: dict[str, Any]) -> tuple[Array, Array]:
    one = next(entry for entry in point["profiles"] if entry["name"] == "scaled_velocity")
    return np.array(one["place"], float), np.array(one["value"], float)


def common_exponential(curves: Sequence[tuple[Array, Array]]) -> tuple[float, float]:
    """(a, largest deviation) of the one function a exp(-place) that fits all curves best."""
    place, value = (np.concatenate(parts) for parts in zip(*curves, strict=True))
    a = float(np.exp(-place) @ value / np.sum(np.exp(-2.0 * place)))
    return a, float(np.abs(value - a * np.exp(-place)).max())


def width_study(points: Sequence[dict[str, Any]], name: str) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, profiles and remarks from the measured widths `points` (contents of metrics.json) of the study `name`."""
    points = sorted(points, key=lambda point: float(point["parameters"]["channel_width"]))
    widths = np.array([float(point["parameters"]["channel_width"]) for point in points])
    diameter = float(points[0]["parameters"]["grain_diameter"])
    scale = np.sqrt(widths * float(points[0]["parameters"]["gravity"]))
    greatest = [measured(point, "greatest_velocity", factor) for point, factor in zip(points, scale, strict=True)]
    slip = [measured(point, "slip_velocity", factor) for point, factor in zip(points, scale, strict=True)]
    thickness, ratio = ([measured(point, key) for point in points] for key in ("shear_zone_thickness", "velocity_ratio"))
    fractions = [[measured(point, key).value for point in points] for key in ("solid_fraction", "wall_solid_fraction")]
    broken = next(
        (
            f"W = {width / diameter:.0f} d: {quantity['reason']}"
            for point, width in zip(points, widths, strict=True)
            for quantity in point["quantities"]
            if quantity["name"] == "greatest_velocity" and quantity["reason"]
        ),
        "",
    )
    span = f"{widths[0] / diameter:.0f} to {widths[-1] / diameter:.0f} d"
    loose = ", ".join(
        f"{core:.3f} and {wall:.3f} at {width / diameter:.0f} d" for core, wall, width in zip(*fractions, widths, strict=True)
    )
    short = f"the abstract speaks of sufficiently wide channels and names no width; these are {span}"
    amplitude, worst = common_exponential([_curve(point) for point in points])
    spread = max(abs(one.value / np.mean([each.value for each in ratio]) - 1.0) for one in ratio)
    found = [
        Quantity(
            "exponent_greatest_velocity",
            "exponent of u_max in W",
            "1",
            exponent(widths, greatest),
            reference=Estimate(0.5, 0.0),
            absolute=True,
            reason=broken or short,
            source=DEBNATH.short,
        ),
        Quantity(
            "exponent_slip_velocity",
            "exponent of u_slip in W",
            "1",
            exponent(widths, slip),
            reference=Estimate(0.5, 0.0),
            absolute=True,
            reason=broken or short,
            source=DEBNATH.short,
        ),
        Quantity(
            "exponent_thickness",
            "exponent of the shear zones' thickness in W",
            "1",
            exponent(widths, thickness),
            reference=Estimate(1.0, 0.0),
            absolute=True,
            reason=broken or short,
            source=DEBNATH.short,
        ),
        Quantity(
            "ratio_spread",
            "u_max / u_slip: largest deviation of a width from the mean",
            "1",
            Estimate(spread, max(one.half / one.value for one in ratio), "largest of the widths"),
            reference=Estimate(0.0, 0.0),
            tolerance=RATIO_TOLERANCE,
            absolute=True,
            reason=broken,
            source=DEBNATH.short,
            detail="the ratio depends neither on the width nor on the mean solid fraction",
            compared=False,
        ),
        Quantity(
            "profile_collapse",
            "scaled profiles: largest deviation from one exponential",
            "1",
            Estimate(worst, 0.0, "largest of all places and widths"),
            reference=Estimate(0.0, 0.0),
            tolerance=COLLAPSE_TOLERANCE,
            absolute=True,
            reason=broken or "the abstract does not say how the profile is scaled; this scaling was chosen here, with first runs at hand",
            source=DEBNATH.short,
            detail=f"(u_max − u)/(u_max − u_slip) against {amplitude:.2f} exp(−distance/thickness) in cells of one diameter; the distance "
            "is that from the layer at the wall",
            compared=False,
        ),
    ]
    remarks = [
        (
            f"Solid fraction of the core and within two diameters of the walls: {loose}. Velocities in proportion to √W belong to shear zones "
            "of the same solid fraction; those of a channel in which the plug leaves them room for one or two layers only get looser as it gets "
            "wider, and the flow faster."
        ),
        f"{DEBNATH.short}: {DEBNATH.statement}",
    ]
    return found, _growth(widths / diameter, greatest, slip, thickness, points, amplitude), remarks


def _growth(
    widths: Array, greatest: Sequence[Estimate], slip: Sequence[Estimate], thickness: Sequence[Estimate], points: Any, amplitude: float
) -> list[dict[str, Any]]:
    drawn = []
    for name, title, across, values, power in (
        ("greatest_velocity", "Greatest velocity", "u_max (m/s)", greatest, 0.5),
        ("slip_velocity", "Velocity at the wall", "u_slip (m/s)", slip, 0.5),
        ("thickness", "Thickness of the shear zones", "thickness / d", thickness, 1.0),
    ):
        middle, halves = np.array([one.value for one in values]), np.array([one.half for one in values])
        scale = np.exp(np.mean(np.log(middle) - power * np.log(widths)))
        entry = {
            "name": name,
            "title": title,
            "along": "width W / d",
            "across": across,
            "vertical": False,
            "place": widths.tolist(),
            "value": middle.tolist(),
            "note": "",
            "reference": (scale * widths**power).tolist(),
            "reference_label": "proportional to " + ("√W" if power == 0.5 else "W"),
        }
        if np.isfinite(halves).all():
            entry |= {"low": (middle - halves).tolist(), "high": (middle + halves).tolist(), "band": "95 % interval"}
        drawn.append(entry)
    for point, width in zip(points, widths, strict=True):
        place, value = _curve(point)
        drawn.append(
            {
                "name": f"scaled_velocity_{width:.0f}",
                "title": f"Scaled velocity deficit, W = {width:.0f} d",
                "along": "distance from the layer at the wall over the thickness",
                "across": "(u_max − u) / (u_max − u_slip)",
                "vertical": False,
                "place": place.tolist(),
                "value": value.tolist(),
                "note": "",
                "reference": (amplitude * np.exp(-place)).tolist(),
                "reference_label": "one exponential for all widths",
            }
        )
    return drawn
