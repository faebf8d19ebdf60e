"""Granular collapse: run-out and height of the deposit compared with experiments with glass beads, and their exponents in a = H/W. Columns
of few grains run out less far, since the deposit ends where it is half a layer thin: run-out and height of three widths are extrapolated
along d/W, in which they are linear. V&V 20: E = S − D is known within U_val, U_val² = U_sim² + U_size² + U_input² + U_D²: packings, unknown
width of the measured columns, `input_uncertainty`, and the line through the measured points near a."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from dembark.input_decks.common.estimates import over_chaotic, reference_rows, values_and_halves
from dembark.input_decks.common.heaps import at_rest, column_height, front, height, power_law, surface
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.postproc.measurement import Array, Estimate, Measurement, Points, Replica, Replicas, Value, profile
from dembark.postproc.studies import compared, measured, propagated

MEASURED = Path(__file__).with_name("reference") / "lajeunesse_2005.csv"
# Where the exponents of low and of high columns meet.
BREAK = {"run_out": 2.6, "final_height": 0.7}
TITLES = {"run_out": "Run-out", "final_height": "Height at the back wall"}


def points(quantity: str, low: float = 0.0, high: float = math.inf) -> list[tuple[float, float]]:
    """Measured (a, value) with `low` <= a <= `high`, rising in a."""
    rows = [(row.number("a"), row.number("value")) for row in reference_rows(MEASURED, quantity=quantity)]
    return sorted(row for row in rows if low <= row[0] <= high)


def datum(quantity: str, aspect: float) -> Estimate:
    """What was measured at H/W = `aspect`: the power law through the points within a factor of two."""
    return power_law(points(quantity, aspect / 2.0, 2.0 * aspect), aspect)


def deposit(replica: Replica) -> dict[str, float]:
    """Of one run, over W: height of the column, run-out and height of the deposit; whether that is at rest."""
    p, frames = replica.parameters, replica.grains()
    first, last = (frame.select(frame.types == 1) for frame in (frames[0], frames[len(frames) - 1]))
    width, d = p["column_width"], p["grain_diameter"]
    end = front(last, p["column_depth"], d)
    rests = at_rest(last.select(last.positions[:, 0] < end), p["gravity"], d)
    return {"aspect_ratio_measured": height(first) / width, "run_out": end / width - 1.0,
            "final_height": column_height(first, last, 2.0 * d) / width, "rests": rests}


def measure(replicas: Replicas) -> Measurement:
    """Run-out and height of columns of one width, and the surface of the deposit."""
    found = [deposit(replica) for replica in replicas]
    of = {name: over_chaotic(one[name] for one in found) for name in ("aspect_ratio_measured", *TITLES)}
    moving = "" if all(one["rests"] for one in found) else "The deposit is still moving at the end of the run. "
    return Measurement({name: Value(one) for name, one in of.items()}, [_surface(replicas)],
                       [f"{moving}Verdicts are given by the studies, which include the effect of the number of grains."])


def study(name: str, results: Points, along: str) -> Measurement:
    """Along the width: run-out and height of columns as wide as the measured ones. Along the aspect ratio: exponents and the measured
    ones. Along friction: sensitivities."""
    results, place = ordered(results, along)
    if along == "column_width":
        return _as_wide(results)
    if along == "aspect_ratio":
        place = np.array([measured(one, "aspect_ratio_measured").value for one in results])
    growth = {quantity: PowerLawFit.of(results, quantity, place) for quantity in TITLES}
    if along != "aspect_ratio":
        return Measurement({f"{quantity.removeprefix('final_')}_sensitivity": Value(one.exponent) for quantity, one in growth.items()},
                           [one.curve(f"{quantity}_{name}", TITLES[quantity], along.replace("_", " "), "over W")
                            for quantity, one in growth.items()])
    quantity, reference = (("run_out", points("run_out", 0.35, BREAK["run_out"])) if name == "low"
                           else ("final_height", points("final_height", BREAK["final_height"])))
    curves = []
    for one, values in growth.items():
        data = [datum(one, aspect) for aspect in place]
        curves.append(profile(one, TITLES[one], "a = H/W", "over W", place, [values.values], half=values.halves,
                              reference=np.array([datum.value for datum in data]), reference_half=np.array([datum.half for datum in data]),
                              reference_label="Lajeunesse et al. (2005)"))
    return Measurement({f"{quantity.removeprefix('final_')}_exponent": Value(growth[quantity].exponent, power_law(reference))}, curves)


def _as_wide(results: Points) -> Measurement:
    """Run-out and height along d/W, at that of the experiments."""
    p = results[0]["parameters"]
    across = np.array([p["grain_diameter"] / one["parameters"]["column_width"] for one in results])
    there = 1.0 / p["measured_width"]
    aspect = float(np.mean([measured(one, "aspect_ratio_measured").value for one in results]))
    values, curves = {}, []
    for quantity, title in TITLES.items():
        sizes, halves = values_and_halves([measured(one, quantity) for one in results])

        def line(values: Array) -> Array:
            return np.polyfit(across, values, 1)

        simulated = propagated(lambda values: float(np.polyval(line(values), there)), sizes, halves, "the widths")
        reference, slope = datum(quantity, aspect), float(line(sizes)[0])
        of_size, of_input = abs(slope) * there, p["input_uncertainty"] * reference.value
        error = compared(simulated.value, reference, sim=simulated.half, size=of_size, input=of_input)
        values[f"{quantity.removeprefix('final_')}_of_beads"] = Value(
            simulated, reference, half=error.uncertainty / reference.value, detail=f"at a = {aspect:.3g}: {error.text}")
        place = np.append(across, there)
        order = np.argsort(place)
        curves.append(profile(f"{quantity}_width", title, "d/W", "over W", place[order], [np.append(sizes, simulated.value)[order]],
                              half=np.append(halves, simulated.half)[order], reference=np.full(len(place), reference.value),
                              reference_half=np.full(len(place), reference.half), reference_label="Lajeunesse et al. (2005)",
                              note="The leftmost point is extrapolated by a straight line through the others."))
    return Measurement(values, curves)


def _surface(replicas: Replicas) -> dict[str, Any]:
    p = replicas[0].parameters
    width, d = p["column_width"], p["grain_diameter"]
    edges = np.arange(0.0, width * (1.0 + 1.5 * datum("run_out", p["aspect_ratio"]).value), d)
    tops = [[surface(frame.select(frame.types == 1), edges) / width for frame in (frames[0], frames[len(frames) - 1])]
            for frames in (replica.grains() for replica in replicas)]
    return profile("deposit", "Deposit", "x / W", "height / W", 0.5 * (edges[1:] + edges[:-1]) / width, [last for _, last in tops],
                   reference=np.mean([first for first, _ in tops], axis=0), reference_label="when the gate opens")
