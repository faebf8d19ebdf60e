"""Checks of case `column_collapse`: the energies that the engine's account booked, row by row, and the deposit.

Balances run over all rows of time.csv, shares over the collapse, from the row in which the gate begins to move.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dembark.validation.checks.collapse import FRONT, Collapse, given_back, imbalance, potential_error, read, step_error
from dembark.validation.checks.logs import exact, fitted_exponent
from dembark.validation.checks.quantity import Quantity, measured
from dembark.validation.checks.run import Replica, profile
from dembark.validation.references import LAJEUNESSE, LUBE, SARLIN, STARON, UTILI
from dembark.postproc.statistics import Estimate, combined, over_replicas
from numpy.typing import NDArray

Array = NDArray[np.float64]
REFERENCES = (LUBE, LAJEUNESSE, SARLIN, STARON, UTILI)
# What is exact but for round-off: 1e-16 a step and contact, over some ten thousand steps, stays far below.
ROUND_OFF = 1e-10
# Of the exponent of the step's error: higher orders and collapses that differ.
ORDER_TOLERANCE = 0.2
_NO_INTERVAL = "one run of a chaotic motion says nothing about its spread"
_POINTS = 100


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, curves and remarks from all replicas of a series."""
    runs = [read(replica) for replica in replicas]
    wet = replicas[0].parameters["bridge_volume"] > 0.0

    def over(measure: Callable[[Collapse], float]) -> Estimate:
        return over_replicas([Estimate(measure(one), float("inf"), _NO_INTERVAL) for one in runs])

    def worst(name: str, label: str, measure: Callable[[Collapse], float], detail: str, source: str) -> Quantity:
        value = float(np.max([measure(one) for one in runs]))  # of numbers that are none: none
        return Quantity(
            name,
            label,
            "1",
            exact(value),
            reference=exact(0.0),
            tolerance=ROUND_OFF,
            absolute=True,
            compared=False,
            detail=f"{detail}; the worst of {len(runs)} runs",
            source=source,
        )

    def share(name: str, label: str, detail: str = "") -> Quantity:
        return Quantity(
            f"{name}_share",
            f"{label}, over the potential energy lost",
            "1",
            over(lambda one: float(one.lost_in(name)[-1])),
            detail=detail or "from the opening of the gate to the end",
        )

    found = [
        worst(
            "energy_balance",
            "largest difference between kinetic energy and works, over the energy turned over",
            lambda one: imbalance(one.rows),
            "any row of the run, rain included",
            "kicks of the integrator: exact at any step",
        ),
        worst(
            "potential_error",
            "largest difference between gravity's work and the potential energy lost, over the work",
            potential_error,
            "potential energy at the heights that telescope (README)",
            "sum of the integrator's steps",
        ),
        worst(
            "dissipation_sign",
            "largest energy that damping or the liquid's viscosity gave in a row, over the energy turned over",
            lambda one: given_back(one.rows),
            "0: none ever gave any",
            "second law",
        ),
        Quantity(
            "step_error",
            "energy error of the step in the normal springs, over the potential energy lost",
            "1",
            over(step_error),
            detail="largest since the opening; falls with the square of the step",
            compared=False,
        ),
        Quantity(
            "height_error",
            "gravity's work against the fall of the positions themselves, over the work",
            "1",
            over(lambda one: potential_error(one, "weight_height")),
            compared=False,
            detail="works and positions of a row are not of one time: of first or second order in the step, by the engine",
        ),
        share("friction", "lost by friction", "slip, and what a spring loses when its contact opens or softens"),
        share("normal_viscous", "lost by normal damping"),
        share("tangential_viscous", "lost by tangential damping"),
    ]
    if wet:
        found += [
            share("liquid_viscous", "lost in the viscous liquid"),
            share("capillary", "taken by the pull of liquid bridges", "what bridges take when they are drawn out and do not give back"),
        ]
    found += [
        share("gate", "taken by the gate"),
        share("held", "held by springs at the end", "less than when the gate opened, when the column weighed on them"),
        share("kinetic", "kinetic energy left"),
    ]
    return found + _deposit(runs, over), _curves(runs, wet), _remarks(runs)


def run_out_law(aspect: float) -> float | None:
    """(L - W)/W by Lube et al. (2005) for H/W = `aspect`; None between its two branches."""
    return 1.2 * aspect if aspect < 1.8 else 1.9 * aspect ** (2.0 / 3.0) if aspect > 2.8 else None


def height_law(aspect: float) -> float | None:
    """Final height over W of a high column by Lube et al. (2005); None for a low one."""
    return aspect**0.4 if aspect > 2.8 else None


def _deposit(runs: Sequence[Collapse], over: Callable[[Callable[[Collapse], float]], Estimate]) -> list[Quantity]:
    aspect = over(lambda one: one.height / one.width)
    laws = {"run_out": run_out_law(aspect.value), "final_height": height_law(aspect.value)}
    other = "experiments with sand, sugar and rice between side walls, not with spheres that roll"
    edges = {id(one): np.array([0.0, 2.0 * one.diameter]) for one in runs}

    def deposit(name: str, label: str, measure: Callable[[Collapse], float], detail: str) -> Quantity:
        law = laws[name]
        return Quantity(
            name,
            label,
            "W",
            over(measure),
            reference=None if law is None else exact(law),
            source=LUBE.short if law else "",
            reason=other if law else "",
            detail=detail,
        )

    return [
        Quantity(
            "aspect_ratio", "height of the column over its width, H/W", "1", aspect, detail="H: twice the height of the centre of mass"
        ),
        deposit("run_out", "run-out (L − W)/W", lambda one: one.front / one.width - 1.0, f"{FRONT:.0%} of the mass lie within L"),
        deposit(
            "final_height",
            "height of the deposit at the back wall",
            lambda one: float(one.surface(one.last, edges[id(one)])[0]) / one.width,
            "highest grain within 2 d of it",
        ),
    ]


def _remarks(runs: Sequence[Collapse]) -> list[str]:
    fallen = float(np.mean([one.fallen for one in runs]))
    turned = float(np.mean([one.rows["scale"][-1] for one in runs]))
    remarks = [
        f"The collapse loses {1e3 * fallen:.4g} mJ of potential energy; all works of the run, rain included, make {1e3 * turned:.4g} mJ.",
        *(f"{one.short}: {one.statement}" for one in (LUBE, SARLIN, STARON, UTILI)),
    ]
    if len(runs) < 3:
        remarks.append("Shares and deposit vary from packing to packing; fewer than three tell nothing about by how much.")
    return remarks


def _curves(runs: Sequence[Collapse], wet: bool) -> list[dict[str, Any]]:
    first = runs[0]
    place = np.linspace(0.0, first.time[-1], _POINTS + 1)

    def curve(name: str, title: str, get: Callable[[Collapse], Array]) -> dict[str, Any]:
        return profile(
            name,
            title,
            "time since the gate moves (s)",
            "over the potential energy lost",
            place,
            [np.interp(place, one.time, get(one)) for one in runs],
        )

    ways = [
        ("kinetic", "Kinetic energy"),
        ("friction", "Lost by friction"),
        ("normal_viscous", "Lost by normal damping"),
        ("tangential_viscous", "Lost by tangential damping"),
        ("held", "Held by springs"),
        ("gate", "Taken by the gate"),
    ]
    if wet:
        ways += [("liquid_viscous", "Lost in the viscous liquid"), ("capillary", "Taken by liquid bridges")]
    edges = np.arange(0.0, 5.0 * first.width, first.diameter)
    middle = 0.5 * (edges[1:] + edges[:-1]) / first.width
    before = np.mean([one.surface(one.first, edges) for one in runs], axis=0) / first.width
    return [
        curve("potential", "Potential energy lost", lambda one: -one.gained("potential_energy") / one.fallen),
        *(curve(name, title, lambda one, name=name: one.lost_in(name)) for name, title in ways),  # type: ignore[misc]
        profile(
            "deposit",
            "Deposit",
            "x / W",
            "height / W",
            middle,
            [one.surface(one.last, edges) / one.width for one in runs],
            reference=before,
            reference_label="when the gate opens",
        ),
    ]


def study(name: str, points: Sequence[dict[str, Any]], along: str) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """The study `step`: exponent of the step's energy error, with the interval that those of the errors give it."""
    del name
    points = sorted(points, key=lambda point: float(point["parameters"][along]))
    steps = np.array([point["parameters"][along] for point in points])
    errors = [measured(point, "step_error") for point in points]
    values = np.array([one.value for one in errors])
    # The slope of a straight line is a sum of the logarithms with these weights.
    away = np.log(steps) - np.log(steps).mean()
    parts = [float(weight * one.half / one.value) for weight, one in zip(away / (away @ away), errors, strict=True)]
    found = Quantity(
        "order_step_error",
        "energy error of the step ∝ Δt^p, p",
        "1",
        Estimate(fitted_exponent(steps, values), combined(parts), "propagated from the errors"),
        reference=exact(2.0),
        tolerance=ORDER_TOLERANCE,
        absolute=True,
        source="trapezoidal rule",
        compared=False,
        detail="errors "
        + ", ".join(f"{error:.2e} at {step:g}" for step, error in zip(steps, values, strict=True))
        + " of the Rayleigh time",
    )
    curve = profile(
        "step_error",
        "Energy error of the step",
        "log₁₀ time step over the Rayleigh time",
        "log₁₀ error",
        np.log10(steps),
        [np.log10(values)],
        reference=np.log10(values[-1] * (steps / steps[-1]) ** 2),
        reference_label="slope 2",
    )
    return (
        [found],
        [curve],
        ["Works balance the kinetic energy to round-off at each of these steps; this is what the step makes of the energy."],
    )


def picture(parameters: dict[str, Any]) -> dict[str, Any]:
    """How the report shows the deposit: grains by the contact forces on them."""
    return {"colour_by": "force", "scale": parameters["gravity"], "cut": False}
