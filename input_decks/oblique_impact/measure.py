"""Oblique impact: the motion of each sphere after it, compared with the measurement.

V&V 20: the error E = S − D of a simulated value S against the datum D is known within U_val, U_val² = U_num² + U_input² + U_D². A run knows
U_input, from spheres with changed inputs; the study of three time steps adds U_num and the datum, and has the verdicts.
"""

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dembark.postproc.convergence import SAFETY_UNSEEN_ORDER, convergence, refinement
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.replica import Array, Replica
from dembark.postproc.resampling import profile
from dembark.postproc.statistics import Estimate
from dembark.postproc.studies import compared

MEASURED = Path(__file__).with_name("reference") / "kharaz_2001.csv"
TITLES = {"tangential_restitution": ("Tangential restitution", "e_t"), "spin": ("Rebound spin", "ω (rad/s)"),
          "centre_angle": ("Rebound angle of the centre", "angle after (°)"),
          "contact_angle": ("Rebound angle of the point of contact", "angle after (°)")}


def measured() -> list[dict[str, Any]]:
    """The measured points, with the `name` of the quantity at that angle."""
    with MEASURED.open(encoding="utf-8") as file:
        rows = [{key: text if key == "quantity" else float(text) for key, text in row.items()} for row in csv.DictReader(file)]
    return [row | {"name": f"{row['quantity']}_{row['angle']:.0f}"} for row in rows]


def rebounds(replica: Replica) -> dict[str, Array]:
    """What is measured of each sphere, (spheres,) by quantity, in the order of their numbers."""
    first, *_, last = replica.grains()
    (v, _), (v_after, w_after) = ((frame.velocities[order], frame.omegas[order, 0]) for frame in (first, last)
                                  for order in [np.argsort(frame.ids)])
    along, away = v_after[:, 1], v_after[:, 2]
    return {"tangential_restitution": along / v[:, 1], "spin": -w_after, "centre_angle": np.degrees(np.arctan2(along, away)),
            "contact_angle": np.degrees(np.arctan2(along + replica.parameters["radius"] * w_after, away))}


def measure(replicas: Sequence[Replica]) -> Measurement:
    """Each quantity at its angles, with U_input: the root of the sum of squares of what each input's uncertainty changes."""
    rows, found = measured(), rebounds(replicas[0])
    values = {}
    for k, row in enumerate(rows):
        nominal, *changed = found[row["quantity"]][k :: len(rows)]
        values[row["name"]] = Value(Estimate(nominal, math.dist([nominal] * len(changed), changed), "uncertainty of the inputs"))
    return Measurement(values, remarks=["Verdicts are given by the study, which includes the error of the time step."])


def study(_name: str, points: Sequence[Mapping[str, Any]], along: str) -> Measurement:
    """The simulation with the smallest time step against the measurement, with all parts of U_val."""
    steps = [refinement(along, point["parameters"][along]) for point in points]
    runs = [{one["name"]: one for one in point["quantities"]} for point in points]
    fine, rows, values, known = runs[int(np.argmin(steps))], measured(), {}, 0
    for row in rows:
        one = fine[row["name"]]
        of_inputs = 0.5 * (one["interval"][1] - one["interval"][0])
        of_steps = _of_steps(steps, [run[row["name"]]["value"] for run in runs])
        simulated = Estimate(one["value"], math.hypot(of_inputs, of_steps), "inputs and time step")
        datum = Estimate(row["value"], math.hypot(row["value_digitised"], row["value_measured"]), "measurement and reading of the figure")
        error = compared(simulated.value, datum, num=of_steps, input=of_inputs)
        known += error.seen
        values[row["name"]] = Value(simulated, datum, detail=error.text)
    return Measurement(values, [_curve(quantity, [(row["angle"], values[row["name"]]) for row in rows if row["quantity"] == quantity])
                                for quantity in TITLES], [
        f"At {known} of {len(rows)} points |E| exceeds U_val: a model error is detected there, whether or not the tolerance allows it.",
        "Friction was inferred from the same experiment, in gross sliding (beyond 32°); below that angle the values are predictions."])


def _of_steps(steps: Sequence[float], values: Sequence[float]) -> float:
    """U_num; where no order shows, three times the range (L. Eça, M. Hoekstra, J. Comput. Phys. 262 (2014) 104)."""
    found = convergence(steps, values).uncertainty
    return SAFETY_UNSEEN_ORDER * float(np.ptp(values)) if found is None else found


def _curve(quantity: str, points: Sequence[tuple[float, Value]]) -> dict[str, Any]:
    angles = np.array([angle for angle, _ in points])
    simulated, half, datum, datum_half = np.array([(one.estimate.value, one.estimate.half, one.reference.value, one.reference.half)
                                                   for _, one in points if one.reference]).T
    return profile(quantity, TITLES[quantity][0], "angle of incidence (°)", TITLES[quantity][1], angles, [simulated], half=half,
                   reference=datum, reference_half=datum_half, reference_label="Kharaz et al. (2001)")
