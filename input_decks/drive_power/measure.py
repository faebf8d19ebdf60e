"""Drive power: what a shaken bed and a block that sticks where it lands take from the plate, and how a bed rises when shaken hard."""

import math
from collections.abc import Callable

import numpy as np

from dembark.input_decks.common.drive_levels import acceleration
from dembark.input_decks.common.estimates import divided, over_chaotic, values_and_halves
from dembark.input_decks.common.momentum import BRIDGED_PARTS, imbalance
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.postproc.measurement import (
    Array,
    Curve,
    Estimate,
    Measurement,
    Numbers,
    Points,
    Replicas,
    Value,
    exact,
    over_replicas,
    profile,
)
from dembark.postproc.studies import measured

from .drive import Block, Drive, phases, read, sticking_block, transients

# Up to this coefficient of restitution the bed counts as one that sticks.
STICKS = 0.3
# Middle of the published range of the exponent, by the number of dimensions in which grains move.
RISE = {2: 1.4, 3: 1.0}
# Middle of the measured range of the exponent of the number of grains, with its sign turned.
FALL = 0.5
# Parts of Drive.spectrum.
SPECTRUM = ("height_first_harmonic", "height_second_harmonic", "height_fluctuation")


def sticks(p: Numbers) -> Block | None:
    """The block that a bed with the parameters `p` counts as; None where grains bounce well, or liquid holds them on the plate."""
    return sticking_block(acceleration(p)) if p["restitution"] <= STICKS and not p["bridge_volume"] else None


def measure(replicas: Replicas) -> Measurement:
    """Values, curves and remarks from all replicas of a series."""
    runs, p = [read(replica) for replica in replicas], replicas[0].parameters
    # A window in which the plate stops is not that of a steady drive.
    steady = not p["rest_periods"]
    block = sticks(p) if steady else None
    diameter = p["grain_diameter"]

    def over(number: Callable[[Drive], Estimate], scale: float = 1.0) -> Estimate:
        return divided(over_replicas([number(one) for one in runs]), scale)

    def worst(number: Callable[[Drive], float]) -> Value:
        return Value(exact(max((number(one) for one in runs), key=lambda gap: np.inf if np.isnan(gap) else abs(gap))), exact(0.0))

    def once(number: Callable[[Drive], float]) -> Value:
        return Value(over_chaotic(number(one) for one in runs))

    def mean(number: Callable[[Drive], float]) -> Value:
        """Over the runs, with an interval where there are several."""
        return Value(exact(number(runs[0])) if len(runs) == 1 else once(number).estimate, exact(0.0))

    values = {
        "energy_balance": worst(lambda one: imbalance(one.rows, BRIDGED_PARTS)),
        "power_gap": worst(Drive.power_gap),
        **({"dissipation_gap": mean(Drive.dissipation_gap)} if steady else {}),
        "power": Value(over(Drive.power), exact(block.power) if block else None),
        "force_power": Value(over(lambda one: one.power("plate_work"))),
        "flight": Value(over(Drive.flight), exact(block.flight) if block else None),
        "rise": Value(over(Drive.rise, diameter)),
        "height": Value(over(Drive.height, diameter)),
        **{name: Value(divided(over_chaotic(numbers), diameter))
           for name, numbers in zip(SPECTRUM, zip(*[one.spectrum() for one in runs], strict=True), strict=True)},
        "kinetic_energy": Value(over(Drive.kinetic, runs[0].weight * diameter)),
        "power_time": once(Drive.power_time),
        "rise_time": once(Drive.rise_time),
        "acceleration": Value(exact(acceleration(p))),
        "speed": Value(exact(runs[0].speed / math.sqrt(p["gravity"] * diameter))),
    }
    if not steady:
        values["compaction"] = once(lambda one: one.compaction() or 0.0)
    return Measurement(values, [*transients(runs), phases(runs, block)])


def stiffness(points: Points, moduli: Array) -> list[Curve]:
    """Power and time in flight over Young's modulus (Pa), and those of a block that sticks."""
    block = sticks(points[0]["parameters"])

    def curve(quantity: str, title: str, axis: str) -> Curve:
        values, halves = values_and_halves([measured(point, quantity) for point in points])
        return profile(quantity, title, "log₁₀ of Young's modulus (Pa)", axis, np.log10(moduli), [values], half=halves,
                       reference=np.full(len(points), getattr(block, quantity)) if block else None, reference_label="sticking block")

    return [curve("power", "Power of the drive", "P / (M g V)"), curve("flight", "Share of the time in flight", "share")]


def study(name: str, points: Points, along: str) -> Measurement:
    """How the gap between both powers grows with the step; what a bed that springs takes; how the rise of a bed shaken hard falls with
    the number of its grains; how its rise and its kinetic energy grow with the speed of the plate, at one frequency."""
    points, place = ordered(points, along)
    if name == "step":
        gaps = PowerLawFit(place, np.array([abs(measured(point, "power_gap").value) for point in points]), np.zeros(len(points)))
        listed = ", ".join(f"{gap:.2e} at {step:g}" for step, gap in zip(place, gaps.values, strict=True))
        return Measurement({"power_gap_order": Value(gaps.exponent, exact(2.0), detail=f"gaps {listed} of the Rayleigh time")},
                           [gaps.convergence("power_gap", "Gap between both powers", "time step over the Rayleigh time", 2.0)])
    if name == "stiffness":
        return Measurement({}, stiffness(points, place))
    if along == "grain_count":
        rise = PowerLawFit.of(points, "rise", place)
        return Measurement({"rise_exponent_count": Value(divided(rise.exponent, -1.0), exact(FALL))},
                           [rise.curve("rise", "Rise of the centre of mass", "N", "Δz / d", -FALL, f"∝ N^−{FALL:g}")])
    dimensions = int(points[0]["parameters"]["dimensions"])
    speeds = np.array([measured(point, "speed").value for point in points])
    rise, energy = (PowerLawFit.of(points, quantity, speeds) for quantity in ("rise", "kinetic_energy"))
    return Measurement(
        {f"rise_exponent_{dimensions}d": Value(rise.exponent, exact(RISE[dimensions])), "energy_exponent": Value(energy.exponent)},
        [rise.curve("rise", "Rise of the centre of mass", "V / √(g d)", "Δz / d", RISE[dimensions], f"∝ V^{RISE[dimensions]:g}"),
         energy.curve("kinetic_energy", "Kinetic energy", "V / √(g d)", "E / (M g d)", 2.0, "∝ V²")])
