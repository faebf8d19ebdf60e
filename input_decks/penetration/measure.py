"""Penetration: the bed before the ball comes, and the height of the ball against time, compared with eight published codes."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dembark.input_decks.common.estimates import STEP, over_chaotic, reference_rows
from dembark.postproc.measurement import Array, Curve, Estimate, Measurement, Replica, Replicas, Value, exact, over_replicas, profile
from dembark.postproc.spheres import slice_volumes
from dembark.postproc.statistics import combined, student

REFERENCE = Path(__file__).with_name("reference")
# Quantities of the public bed.
PUBLIC = {"deepest_point": "public_deepest", "rebound_speed": "public_rebound"}
PUBLIC |= {f"height_{k}": f"public_{k}" for k in (22, 24, 26, 28, 29, 40)}
# What makes a run one of the published problem, however its bed was made and its steps are.
DOSTA = {"grain_count": 25000, "grain_diameter": 0.002, "grain_density": 2500.0, "youngs_modulus": 1e9, "poisson_ratio": 0.2,
         "restitution": 0.5, "friction": 0.3, "steel_density": 7200.0, "steel_youngs_modulus": 2.1e11, "steel_poisson_ratio": 0.2,
         "steel_restitution": 0.6, "steel_friction": 0.5, "grain_steel_restitution": 0.4, "grain_steel_friction": 0.2,
         "presliding": "linear", "box_length": 0.098, "box_width": 0.06, "floor": -0.0902431, "ball_diameter": 0.02, "ball_height": 0.06,
         "ball_speed": 5.0, "gravity": 9.81}
# Diameters that the window of the solid fraction is high at least, and packings that all codes ran.
WINDOW, PACKINGS = 0.5, 10


def published() -> dict[str, list[float]]:
    """Means over the packings of each code that counts (see reference/README.md), by quantity."""
    found: dict[str, list[float]] = {}
    for row in reference_rows(REFERENCE / "dosta_2024.csv", counted="1"):
        found.setdefault(row["quantity"], []).append(row.number("mean"))
    return found


def of_packings() -> dict[str, float]:
    """By how much the mean of the codes may be off because all ran the same packings, 95 % half-width by quantity."""
    found: dict[str, list[float]] = {}
    for row in reference_rows(REFERENCE / "dosta_2024.csv", counted="1"):
        found.setdefault(row["quantity"], []).append(row.number("standard_deviation"))
    reach = student(PACKINGS - 1) / math.sqrt(PACKINGS)
    return {name: reach * combined(spreads) / math.sqrt(len(spreads)) for name, spreads in found.items()}


def another(p: Mapping[str, Any]) -> str:
    """Why a run with the parameters `p` is not compared with the published ones; empty where it is."""
    changed = [name for name, value in DOSTA.items() if p[name] != value]
    return f"not the published problem: another {', '.join(changed)}" if changed else ""


def table(name: str) -> Array:
    """The rows of a file of published heights: time (s) and heights (m)."""
    found: Array = np.loadtxt(REFERENCE / name, delimiter=",", skiprows=1)
    return found


def bed(replica: Replica) -> dict[str, float]:
    """Height of the bed, twice that of its centre of mass, and its solid fraction over the full section of the box, from three diameters
    above the floor to eight tenths of that height, NaN where these leave no room; in the first frame, just before the ball touches."""
    p, frame = replica.parameters, replica.grains()[0]
    grains = frame.ids <= p["grain_count"]
    height, radii = frame.positions[grains, 2] - p["floor"], frame.radii[grains]
    total = 2.0 * float(height.mean())
    edges = np.array([3.0 * p["grain_diameter"], 0.8 * total])
    if edges[1] - edges[0] < WINDOW * p["grain_diameter"]:
        return {"solid_fraction": math.nan, "bed_height": total}
    volume = float(slice_volumes(height, radii, edges).sum())
    return {"solid_fraction": volume / (p["box_length"] * p["box_width"] * float(np.diff(edges)[0])), "bed_height": total}


def free_flight(replica: Replica) -> float:
    """Largest deviation (m) of the ball's height from the exact one until it touches."""
    p, rows = replica.parameters, replica.times()
    exactly = p["ball_height"] - p["ball_speed"] * rows["time"] - 0.5 * p["gravity"] * rows["time"] ** 2
    before = rows["step"] <= replica.derived["first"]
    return float(np.abs(rows["ball_height"] - exactly)[before].max(initial=0.0))


def flight(times: Array, heights: Array) -> dict[str, float]:
    """What codes are compared in, of heights (m) at `times` (s), taken each millisecond as they were published, up to 45 ms at most."""
    last = min(45, round(1e3 * times[-1] - 0.4))
    time = 1e-3 * np.arange(1, last + 1)
    height = np.interp(time, times, heights)
    lowest = int(np.argmin(height))
    found = {f"height_{k}": float(height[k - 1]) for k in (22, 24, 26, 28, 29, 40) if k <= last}
    if lowest < last - 1:
        found |= {"deepest_point": float(height[lowest]), "deepest_time": float(time[lowest])}
    if last >= 45:
        found["rebound_speed"] = float(height[44] - height[39]) / 5e-3
    return found


def measure(replicas: Replicas) -> Measurement:
    """Each quantity over the packings against the mean of the codes' means; of the public bed, against three runs of it."""
    beds, runs = [bed(one) for one in replicas], [flight(one.times()["time"], one.times()["ball_height"]) for one in replicas]
    values = {name: Value(over_chaotic(one[name] for one in beds)) for name in beds[0]}
    if math.isnan(values["solid_fraction"].estimate.value):
        values["solid_fraction"] = Value(values["solid_fraction"].estimate, reason="the bed is too low to measure it inside")
    other = another(replicas[0].parameters)
    values["free_flight"] = Value(exact(max(map(free_flight, replicas))), exact(0.0))
    if replicas[0].parameters["bed"] == "public":
        rows = table("dosta_2024_public.csv")
        others = [flight(rows[:, 0], column) for column in rows[:, 1:].T]
        for name, short in PUBLIC.items():
            if name in runs[0]:
                due = [one[name] for one in others]
                # How far one run may be from another is the tolerance.
                values[short] = Value(exact(runs[0][name]), exact(float(np.mean(due))), inapplicable=other,
                                      detail=f"three runs: {min(due):.6g} to {max(due):.6g}")
        return Measurement(values, curves(replicas, rows[:, 0], rows[:, 1:].mean(axis=1), rows[:, 1:].T, "mean and range of three runs"))
    shared = of_packings()
    for name, codes in published().items():
        if all(name in run for run in runs):
            mean = over_replicas([Estimate(one, 0.0) for one in codes])
            due_mean = Estimate(mean.value, combined([mean.half, shared[name]]), f"{len(codes)} codes, and their {PACKINGS} packings")
            read = STEP * 1e-3 if name == "deepest_time" else math.inf  # heights are taken each millisecond
            values[name] = Value(over_chaotic((run[name] for run in runs), read), due_mean, inapplicable=other,
                                 detail=f"means of {len(codes)} codes: {min(codes):.6g} to {max(codes):.6g}")
    rows = table("dosta_2024_height.csv")
    return Measurement(values, curves(replicas, rows[:, 0], rows[:, 1], rows[:, 4:].T, "mean and range of 68 runs of seven codes"), [
        "The packings are not the published ones: how those were made is not published. Packings scatter more than codes.",
        "From 40 ms on the ball flies freely, so that all later heights express one quantity, its speed on leaving the bed."])


def curves(replicas: Replicas, times: Array, means: Array, range_of: Array, label: str) -> list[Curve]:
    """The height against time, and less the published mean: `means` (rows,) in m at `times` (s), extremes of `range_of` (n, rows)."""
    kept = times <= min(one.times()["time"][-1] for one in replicas) + 1e-9
    time, mean, known = 1e3 * times[kept], 1e3 * means[kept], 1e3 * range_of[:, kept]
    found = [1e3 * np.interp(times[kept], one.times()["time"], one.times()["ball_height"]) for one in replicas]

    def curve(name: str, title: str, across: str, less: Array) -> Curve:
        drawn = profile(name, title, "time (ms)", across, time, [height - less for height in found], reference=mean - less,
                        reference_label=label)
        return drawn | {"reference_low": list(known.min(axis=0) - less), "reference_high": list(known.max(axis=0) - less)}

    return [curve("ball_height", "Height of the ball", "z (mm)", np.zeros(len(mean))),
            curve("ball_height_difference", "Height of the ball minus the published mean", "difference (mm)", mean)]
