"""Column collapse: the energies that the engine's account booked, row by row, and the deposit.

Balances run over all rows of time.csv, shares over the collapse, from the row in which the gate begins to move.
"""

import math
from collections.abc import Callable

import numpy as np

from dembark.postproc.instruments.collapse import Collapse, deposits, read, shares
from dembark.postproc.instruments.growth import Growth, ordered
from dembark.postproc.measurement import Estimate, Measurement, Points, Replicas, Value, exact, over_replicas

# What takes the energy, with the titles of the curves; liquid does so in wet columns.
WAYS = {"kinetic": "Kinetic energy", "friction": "Dissipated by friction", "normal_viscous": "Dissipated by normal damping",
        "tangential_viscous": "Dissipated by tangential damping", "held": "Elastic energy of springs", "gate": "Work on the gate"}
WET = {"liquid_viscous": "Dissipated in the viscous liquid", "capillary": "Work against liquid bridges"}


def run_out_law(aspect: float) -> float | None:
    """(L - W)/W by Lube et al. (2005) for H/W = `aspect`; None between its two branches."""
    return 1.2 * aspect if aspect < 1.8 else 1.9 * aspect ** (2.0 / 3.0) if aspect > 2.8 else None


def height_law(aspect: float) -> float | None:
    """Final height over W of a high column by Lube et al. (2005); None for a low one."""
    return aspect**0.4 if aspect > 2.8 else None


def measure(replicas: Replicas) -> Measurement:
    """Values, curves and remarks from all replicas of a series."""
    runs = [read(replica) for replica in replicas]
    ways = WAYS | (WET if replicas[0].parameters["bridge_volume"] > 0.0 else {})

    def over(number: Callable[[Collapse], float]) -> Estimate:
        return over_replicas([Estimate(number(one), math.inf, "one run of a chaotic motion gives no scatter between runs") for one in runs])

    def share(name: str) -> Value:
        return Value(over(lambda one: float(one.lost_in(name)[-1])))

    def worst(number: Callable[[Collapse], float]) -> Value:
        return Value(exact(np.max([number(one) for one in runs])), exact(0.0))  # of numbers that are none: none

    def beside(number: Callable[[Collapse], float], law: float | None) -> Value:
        other = "the experiments used sand, sugar and rice between side walls, not rolling spheres"
        return Value(over(number), None if law is None else exact(law), reason="" if law is None else other)

    aspect = over(lambda one: one.height() / one.width)
    values = {
        "energy_balance": worst(Collapse.imbalance),
        "potential_error": worst(Collapse.potential_error),
        "dissipation_sign": worst(Collapse.given_back),
        "step_error": Value(over(Collapse.step_error)),
        "height_error": Value(over(lambda one: one.potential_error("weight_height"))),
        **{f"{name}_share": share(name) for name in ways},
        "aspect_ratio": Value(aspect),
        "run_out": beside(lambda one: one.front() / one.width - 1.0, run_out_law(aspect.value)),
        "final_height": beside(lambda one: one.height_at_wall() / one.width, height_law(aspect.value)),
        "mean_run_out": Value(over(lambda one: 2.0 * one.centre()[0] / one.width - 1.0)),
        "mean_height": Value(over(lambda one: 2.0 * one.centre()[2] / one.width)),
    }
    fallen, turned = 1e3 * np.mean([(one.fallen, one.rows["scale"][-1]) for one in runs], axis=0)
    remarks = [f"The collapse loses {fallen:.4g} mJ of potential energy; the total work of the run, with the rain, is {turned:.4g} mJ."]
    if len(runs) < 3:
        remarks.append("Shares and deposit vary from packing to packing; fewer than three packings do not show by how much.")
    return Measurement(values, [*shares(runs, {"potential": "Potential energy lost"} | ways), deposits(runs)], remarks)


def study(_name: str, points: Points, along: str) -> Measurement:
    """Exponent of the step's energy error, with the interval that those of the errors give it."""
    points, steps = ordered(points, along)
    errors = Growth.of(points, "step_error", steps)
    told = ", ".join(f"{error:.2e} at {step:g}" for step, error in zip(steps, errors.values, strict=True))
    return Measurement(
        {"order_step_error": Value(errors.exponent, exact(2.0), detail=f"errors {told} of the Rayleigh time")},
        [errors.convergence("step_error", "Energy error of the time step", "time step over the Rayleigh time", 2.0)],
        ["Work and kinetic energy balance to round-off at each of these steps; the error shown is that of the time step."])
