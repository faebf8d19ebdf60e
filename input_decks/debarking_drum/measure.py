"""Debarking drum: impacts per revolution of the measuring window and per log, their forces, and checks that hold for any motion:
certificate of the contact problem, balance of energy, power of the drum against the power dissipated, mean force of the shell against the
weight."""

import math

import numpy as np

from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.postproc.measurement import Estimate, Measurement, Numbers, Points, Replicas, Value, pooled

from .debarked import debarked, debarking_profiles, force_bound
from .drum_impacts import estimates, fields, profiles, read

CURVES = {"impacts_per_log": ("Impacts per log and revolution", "1"), "peak_force_mean": ("Mean peak force", "kN"),
          "peak_force_p99": ("Peak force that 1 % exceed", "kN"), "dissipated_energy": ("Energy dissipated per revolution", "kJ"),
          "torque_arm": ("Torque over weight × radius", "1"), "useful_impacts": ("Impacts that remove bark and spare wood", "1"),
          "damaging_impacts": ("Impacts that damage wood", "1"), "debarking_time": ("Residence time to 90 %", "s"),
          "wood_loss_index": ("Wood-loss index per revolution", "J/kg")}


def measure(replicas: Replicas) -> Measurement:
    """Values, profiles, remarks and fields of all loads."""
    drums, given = [read(replica) for replica in replicas], replicas[0].parameters
    found, zero, limit, first = [estimates(drum) for drum in drums], Estimate(0.0, 0.0), given["impact_speed"], drums[0]
    references = dict.fromkeys(("power_ratio", "lift_over_weight"), Estimate(1.0, 0.0))
    begin = f"contacts that begin at {limit:g} m/s or more"
    details = {"impacts_per_revolution": f"{begin}; {first.logs} logs",
               "impact_loss_share": f"{begin}; the rest is dissipated in rolling and sliding contacts"}
    values = {
        "certificate_max": Value(Estimate(max(drum.certificate for drum in drums), 0.0, "every step of every run"), zero),
        "energy_balance_error": Value(Estimate(max(drum.energy_error for drum in drums), 0.0, "worst row of time.csv"), zero),
    } | {name: Value(pooled(found, name), references.get(name), detail=details.get(name, "")) for name in found[0]}
    bound, largest = force_bound(given, first.radius), max(float(drum.peak.max(initial=0.0)) for drum in drums)
    values["peak_force_over_bound"] = Value(Estimate(largest / bound, 0.0, "every impact of the window"), zero,
                                            detail=f"{1e-3 * largest:.3g} kN of {1e-3 * bound:.3g} kN")
    results = [one for one in map(debarked, replicas) if one is not None]
    if results:
        outcomes = [one.values for one in results]
        values |= {name: Value(pooled(outcomes, name)) for name in outcomes[0]}
    recorded = np.mean([drum.recorded / drum.lost.sum() for drum in drums])
    share = given["drum_speed"] / math.sqrt(given["gravity"] / first.radius)
    remarks = [
        (f"{first.logs} logs in a drum of radius {first.radius:.3g} m; its speed is {share:.0%} of the critical speed, at which logs would "
         "stay on the shell all the way round."),
        "The figures of the report include an animation (GIF) of the last revolution of the first load of each engine.",
        f"Records of ended contacts account for {recorded:.0%} of the energy dissipated in the window; ongoing contacts are missing.",
    ]
    if given["drum_radius"] is not None and given["drum_radius"] > 0.0:
        remarks.append("The number of logs follows from the given drum radius and the filling; log_count is not used.")
    if len(replicas) < 3:
        remarks.append("With fewer than three loads the intervals come from quarter revolutions within the run.")
    curves = profiles(drums, limit) + (debarking_profiles(results) if results else [])
    return Measurement(values, curves, remarks, fields(replicas))


def study(_name: str, points: Points, along: str) -> Measurement:
    """The studies: curves of impacts, peak forces, power and debarking, and the exponent of `along` of each."""
    points, place = ordered(points, along)
    label = {"filling": "filling", "drum_speed": "speed of the drum (rad/s)", "shell_stiffness": "stiffness of the shell (N/m)",
             "log_stiffness": "stiffness of the logs (N/m)", "log_diameter_max": "largest diameter (m)"}.get(along, along.replace("_", " "))
    values, curves = {}, []
    for quantity, (title, unit) in CURVES.items():
        if not all(_positive(point, quantity) for point in points):
            continue
        grown = PowerLawFit.of(points, quantity, place, 1e-3 if unit[0] == "k" else 1.0)
        values[f"{quantity}_exponent"] = Value(grown.exponent, detail=f"slope of a line through {len(points)} points on logarithmic axes")
        curves.append(grown.curve(quantity, title, label, title.lower() + ("" if unit == "1" else f" ({unit})")))
    remark = "All points are drums of the same size, each loaded separately and run in for the same number of revolutions."
    return Measurement(values, curves, [remark])


def _positive(point: Numbers, quantity: str) -> bool:
    """Whether `point` has a positive value of it, of which there is a logarithm."""
    return any(one["name"] == quantity and one["value"] is not None and one["value"] > 0.0 for one in point["quantities"])
