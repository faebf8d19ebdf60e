"""Angle of repose: slope of both flanks of the heap, compared with the measured law for glass beads and with another code. V&V 20: E = S −
D is known within U_val, U_val² = U_sim² + U_num² + U_input² + U_D²; U_input by the exponents of Zhou et al. for each coefficient."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from dembark.input_decks.common.estimates import over_chaotic, reference_rows, values_and_halves
from dembark.input_decks.common.heaps import at_rest, flank, surface
from dembark.input_decks.common.power_law import ordered
from dembark.postproc.measurement import Estimate, Measurement, Points, Replica, Replicas, Value, exact, profile
from dembark.postproc.studies import compared, fitted_exponent, measured, propagated

CODE = Path(__file__).with_name("reference") / "moose_dem.csv"
# Zhou et al.: angle of glass beads (degrees), d in mm; their error of a measured angle (degrees); exponents of the angle in friction
# between beads and with walls and in rolling resistance between beads and with walls.
GLASS, GLASS_EXPONENT, WALLS, MEASURED = 29.6, -0.206, 0.18, 2.0
EXPONENTS = (0.27, 0.22, 0.06, 0.12)
# Width in grains of the plates of the measurement and of the other code. Heaps on narrower ones are flatter.
PLATE = 30.0
# Between these shares of half of the plate the slope is taken.
LOW, HIGH = 0.15, 0.85


def law(diameter: float, confinement: float) -> float:
    """Measured angle of repose (degrees) of glass beads of `diameter` (m), with front and rear walls at d/w = `confinement`; 0: none."""
    return GLASS * (1e3 * diameter) ** GLASS_EXPONENT * wall_factor(confinement)


def wall_factor(confinement: float) -> float:
    """The measured angle over that without front and rear walls."""
    return 1.0 + math.exp(-WALLS / confinement) if confinement > 0.0 else 1.0


def code(confinement: float | None = None) -> list[tuple[float, float, float]]:
    """What the other code found: (d/w, coefficient of rolling resistance, angle in degrees), rising; at one d/w if given."""
    rows = [(row.number("confinement"), row.number("rolling_friction"), row.number("angle")) for row in reference_rows(CODE)]
    return sorted(row for row in rows if confinement in (None, row[0]))


def flanks(replica: Replica) -> tuple[float, float, bool]:
    """Slopes (degrees) of the two flanks of the heap at the end, and whether it is at rest."""
    p, frames = replica.parameters, replica.grains()
    heap, d, half = frames[len(frames) - 1], p["grain_diameter"], 0.5 * p["plate_width"]
    heap = heap.select((heap.positions[:, 2] > 0.0) & (np.abs(heap.positions[:, 0] - half) < half))
    right = flank(heap, half * (1.0 + LOW), half * (1.0 + HIGH), d)
    left = -flank(heap, half * (1.0 - HIGH), half * (1.0 - LOW), d)
    return left, right, at_rest(heap, p["gravity"], d)


def measure(replicas: Replicas) -> Measurement:
    """The angle, mean of both flanks and of all packings."""
    p, found = replicas[0].parameters, [flanks(replica) for replica in replicas]
    simulated = over_chaotic(0.5 * (left + right) for left, right, _ in found)
    of_input = simulated.value * p["input_uncertainty"] * math.hypot(*EXPONENTS)
    plate = p["plate_width"] / p["grain_diameter"]
    narrow = f"the plate is {plate:.3g} d wide, that of the experiment and of the other code {PLATE:g} d" if plate < 0.99 * PLATE else ""
    moving = "" if all(rests for *_, rests in found) else "the heap is still moving"
    values = {"flank_difference": Value(exact(max(abs(left - right) for left, right, _ in found)))}
    if p["beads"] == "glass":
        datum = Estimate(law(p["grain_diameter"], p["confinement"]), MEASURED, "error of the measured angles")
        error = compared(simulated.value, datum, sim=simulated.half, num=p["numerical_uncertainty"], input=of_input)
        values["angle"] = Value(simulated, datum, half=error.uncertainty, reason=moving, inapplicable=narrow, detail=error.text)
    else:
        values["angle"] = Value(simulated)
    other = [angle for walls, rolling, angle in code(p["confinement"]) if math.isclose(rolling, p["rolling_friction"])]
    if other and p["rolling_resistance"] == "elastic_plastic":
        half = math.hypot(simulated.half, p["numerical_uncertainty"])
        values["angle_of_code"] = Value(simulated, exact(other[0]), half=half, reason=moving, inapplicable=narrow)
    return Measurement(values, [_surface(replicas)])


def study(name: str, results: Points, along: str) -> Measurement:
    """The wall factor, with the angle against d/w; or the exponent in rolling resistance, with the angle against it."""
    results, place = ordered(results, along)
    values, halves = values_and_halves([measured(one, "angle") for one in results])
    if name == "rolling":
        _, rolling, other = np.array(code(0.25)).T
        return Measurement({"rolling_exponent": Value(propagated(lambda y: fitted_exponent(place, y), values, halves, "the angles"),
                                                      exact(fitted_exponent(rolling, other)))},
                           [_curve("angle_rolling", "coefficient of rolling resistance", place, values, halves,
                                   np.interp(place, rolling, other), None, "another code")])
    # From no walls to the narrowest.
    factor = propagated(lambda y: y[-1] / y[0], values, halves, "the angles")
    datum = Estimate(wall_factor(place[-1]), 0.1, "error of the measured angles")
    glass = np.array([law(results[0]["parameters"]["grain_diameter"], confinement) for confinement in place])
    return Measurement({"wall_factor": Value(factor, datum)}, [
        _curve("angle_walls", "d/w", place, values, halves, glass, np.full(len(place), MEASURED), "Zhou et al. (2002)")])


def _curve(name: str, along: str, place: Any, values: Any, halves: Any, reference: Any, reference_half: Any, label: str) -> dict[str, Any]:
    return profile(name, "Angle of repose", along, "angle (°)", place, [values], half=halves, reference=reference,
                   reference_half=reference_half, reference_label=label)


def _surface(replicas: Replicas) -> dict[str, Any]:
    p = replicas[0].parameters
    width, d = p["plate_width"], p["grain_diameter"]
    edges = np.linspace(0.0, width, round(width / d) + 1)
    tops = [surface(frame.select(frame.positions[:, 2] > 0.0), edges) / d for frame in (replica.grains()[-1] for replica in replicas)]
    middle = 0.5 * (edges[1:] + edges[:-1])
    if p["beads"] != "glass":
        return profile("heap", "Surface of the heap", "x / d", "height / d", middle / d, tops)
    slope = math.tan(math.radians(law(d, p["confinement"])))
    straight = np.mean(tops) + slope * (0.25 * width - np.abs(middle - 0.5 * width)) / d
    return profile("heap", "Surface of the heap", "x / d", "height / d", middle / d, tops, reference=straight,
                   reference_label="slope of Zhou et al. (2002)")
