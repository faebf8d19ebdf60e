"""Debarking drum: how many impacts logs get in a revolution, how hard they are, and whether the simulation keeps its books.

Everything is taken per revolution of the measuring window, and per log where that makes drums of different size comparable. What must hold
whatever the logs do: the certificate of the contact problem in every step; the energy that the shell brings in (its moment times its
speed) is what is stored plus what is lost; over many revolutions what is stored does not grow, so the drum's power is the power that is
lost; and the mean force of the shell is the weight.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from dembark.postproc.instruments.drum import PLACES, Drum, estimates, fields, read
from dembark.postproc.instruments.growth import Growth, ordered
from dembark.postproc.measurement import Array, Curve, Estimate, Measurement, Points, Replicas, Value, pooled, profile

FORCES = np.logspace(1.0, 6.0, 51)  # edges of the histogram of peak forces, N
CURVES = {"impacts_per_log": ("Impacts per log and revolution", "1"), "peak_force_mean": ("Mean peak force", "kN"),
          "peak_force_p99": ("Peak force that 1 % exceed", "kN"), "dissipated_energy": ("Energy lost per revolution", "kJ"),
          "torque_arm": ("Moment over weight × radius", "1")}


def measure(replicas: Replicas) -> Measurement:
    """Values, profiles, remarks and fields of all loads."""
    drums, given = [read(replica) for replica in replicas], replicas[0].parameters
    found, zero, limit, first = [estimates(drum) for drum in drums], Estimate(0.0, 0.0), given["impact_speed"], drums[0]
    references = dict.fromkeys(("power_ratio", "lift_over_weight"), Estimate(1.0, 0.0))
    begin = f"contacts that begin with {limit:g} m/s or more"
    details = {"impacts_per_revolution": f"{begin}; {first.logs} logs",
               "impact_loss_share": f"{begin}; the rest is lost in rolling and sliding contacts"}
    values = {
        "certificate_max": Value(Estimate(max(drum.certificate for drum in drums), 0.0, "every step of every run"), zero),
        "energy_balance_error": Value(Estimate(max(drum.energy_error for drum in drums), 0.0, "worst row of time.csv"), zero),
    } | {name: Value(pooled(found, name), references.get(name), detail=details.get(name, "")) for name in found[0]}
    recorded = np.mean([drum.recorded / drum.lost.sum() for drum in drums])
    share = given["drum_speed"] / math.sqrt(given["gravity"] / first.radius)
    remarks = [
        (f"{first.logs} logs in a drum of radius {first.radius:.3g} m; its speed is {share:.0%} of the critical one, at which logs would "
         "stay at the shell all around."),
        "The last revolution of the first load of each engine lies as an animation (GIF) among the figures beside the report.",
        f"The records of contacts that ended hold {recorded:.0%} of the energy lost in the window; contacts that last are not in them.",
    ]
    if given["drum_radius"] is not None and given["drum_radius"] > 0.0:
        remarks.append("The drum's radius is given, so the number of logs follows from it and the filling; log_count is not used.")
    if len(replicas) < 3:
        remarks.append("With fewer than three loads the intervals come from quarter revolutions within the run.")
    return Measurement(values, _profiles(drums, limit), remarks, fields(replicas))


def _profiles(drums: Sequence[Drum], limit: float) -> list[Curve]:
    hit = np.nonzero(sum(np.histogram(drum.peak, FORCES)[0] for drum in drums))[0]
    forces = FORCES[max(0, hit[0] - 1) : hit[-1] + 3] if len(hit) else FORCES
    turned = (np.arange(20 * drums[0].revolutions) + 0.5) / 20.0

    def curve(name: str, title: str, along: str, across: str, place: Array, get: Callable[[Drum], Array], **more: Any) -> Curve:
        return profile(name, title, along, across, place, [get(drum) for drum in drums], **more)

    note, around, number = f"approach ≥ {limit:g} m/s", "angle past the lowest point (°)", "per log, turn and 10°"
    return [
        curve("peak_forces", "Peak forces of impacts", "log₁₀ of the peak force (N)", "per log, turn and decade",
              np.log10(np.sqrt(forces[1:] * forces[:-1])),
              lambda one: one.per_log(np.histogram(one.peak, forces)[0]) / np.diff(np.log10(forces)), note=note),
        curve("peak_forces_exceeded", "Impacts harder than F", "log₁₀ of F (N)", "log₁₀ of number per log, turn", np.log10(forces),
              lambda one: np.log10(one.exceeding(forces)), note=note),
        curve("impacts_at_angle", "Where logs meet", around, number, PLACES, lambda one: one.at_angle(one.angle), note="all impacts"),
        curve("shell_impacts_at_angle", "Where logs meet the shell", around, number, PLACES,
              lambda one: one.at_angle(one.angle[one.shell]), note="impacts on the shell"),
        curve("peak_force_at_angle", "How hard they meet", around, "mean peak force (kN)", PLACES, lambda one: 1e-3 * one.peak_at_angle()),
        curve("power", "Power", "revolutions of the window", "power of the drum (W)", turned, lambda one: one.power(one.work, 20),
              reference=np.mean([one.power(one.lost, 20) for one in drums], axis=0), reference_label="power that is lost"),
    ]


def study(_name: str, points: Points, along: str) -> Measurement:
    """The studies `filling` and `speed`: curves of impacts, peak forces and power, and the power of `along` that each grows with."""
    points, place = ordered(points, along)
    label = {"filling": "filling", "drum_speed": "speed of the drum (rad/s)"}.get(along, along.replace("_", " "))
    values, curves = {}, []
    for quantity, (title, unit) in CURVES.items():
        grown = Growth.of(points, quantity, place, 1e-3 if unit[0] == "k" else 1.0)
        values[f"{quantity}_exponent"] = Value(grown.exponent, detail=f"slope of a line through {len(points)} points on logarithmic axes")
        curves.append(grown.curve(quantity, title, label, title.lower() + ("" if unit == "1" else f" ({unit})")))
    remark = "Every point is a drum of the same size; the logs of each are loaded anew and run in for the same number of revolutions."
    return Measurement(values, curves, [remark])
