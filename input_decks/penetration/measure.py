"""Penetration: the bed before the ball comes, and the height of the ball against time, compared with eight published codes."""

import csv
import math
from pathlib import Path

import numpy as np

from dembark.postproc.measurement import Array, Curve, Estimate, Measurement, Replica, Replicas, Value, exact, over_replicas, profile
from dembark.postproc.spheres import slice_volumes

REFERENCE = Path(__file__).with_name("reference")
ONE_RUN = "one packing gives no scatter between packings"


def published() -> dict[str, list[float]]:
    """Means over the packings of each code that counts (see reference/README.md), by quantity."""
    found: dict[str, list[float]] = {}
    with (REFERENCE / "dosta_2024.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["counted"] == "1":
                found.setdefault(row["quantity"], []).append(float(row["mean"]))
    return found


def bed(replica: Replica) -> dict[str, float]:
    """Height of the bed, twice that of its centre of mass, and its solid fraction over the whole section of the box, from three diameters
    above the floor to eight tenths of that height; in the first frame, just before the ball touches."""
    p, frame = replica.parameters, replica.grains()[0]
    grains = frame.ids <= p["grain_count"]
    height, radii = frame.positions[grains, 2] - p["floor"], frame.radii[grains]
    whole = 2.0 * float(height.mean())
    edges = np.array([3.0 * p["grain_diameter"], 0.8 * whole])
    volume = float(slice_volumes(height, radii, edges).sum())
    return {"solid_fraction": volume / (p["box_length"] * p["box_width"] * float(np.diff(edges)[0])), "bed_height": whole}


def free_flight(replica: Replica) -> float:
    """Largest deviation (m) of the ball's height from the exact one until it touches."""
    p, (time, height) = replica.parameters, fall(replica)
    exactly = p["ball_height"] - p["ball_speed"] * time - 0.5 * p["gravity"] * time**2
    before = replica.times()["step"] <= replica.derived["first"]
    return float(np.abs(height - exactly)[before].max(initial=0.0))


def fall(replica: Replica) -> tuple[Array, Array]:
    """Time (s), from the published start on, and height of the ball (m), each (rows,)."""
    rows = replica.times()
    return rows["time"] + replica.derived["start"], rows["ball_height"]


def flight(replica: Replica) -> dict[str, float]:
    """What the codes are compared in, of the ball's height each millisecond as it was published; no more than the run is long."""
    rows = fall(replica)
    last = round(1e3 * rows[0][-1] - 0.4)
    time = 1e-3 * np.arange(1, last + 1)
    height = np.interp(time, *rows)
    lowest = int(np.argmin(height))
    found = {f"height_{k}": float(height[k - 1]) for k in (24, 28, 40) if k <= last}
    if lowest < last - 1:
        found |= {"deepest_point": float(height[lowest]), "deepest_time": float(time[lowest])}
    if last >= 45:
        found["rebound_speed"] = float(height[44] - height[39]) / 5e-3
    return found


def measure(replicas: Replicas) -> Measurement:
    """Each quantity over the packings against the mean of the codes' means."""
    runs, known = [bed(one) | flight(one) for one in replicas], published()
    values = {"free_flight": Value(exact(max(map(free_flight, replicas))), exact(0.0))}
    for name in (name for name in runs[0] if all(name in run for run in runs)):
        codes = known[name]
        reference = over_replicas([Estimate(mean, 0.0) for mean in codes]) if len(codes) > 1 else Estimate(codes[0], 0.0, "one packing")
        values[name] = Value(over_replicas([Estimate(run[name], math.inf, ONE_RUN) for run in runs]), reference,
                             detail=f"means of {len(codes)} codes: {min(codes):.6g} to {max(codes):.6g}" if len(codes) > 1 else "")
    return Measurement(values, curves(replicas), [
        "The packings are not the published ones: they are generated with the same solid fraction. Packings scatter more than codes.",
        "From 40 ms on the ball flies freely, so that all later heights express one quantity, its speed on leaving the bed."])


def curves(replicas: Replicas) -> list[Curve]:
    """The height against time, and less the mean of the codes, where the band shows how far single runs of theirs lie from it."""
    with (REFERENCE / "dosta_2024_height.csv").open(encoding="utf-8") as file:
        table = np.array([[float(x) for x in row] for row in list(csv.reader(file))[1:]])
    runs = [fall(one) for one in replicas]
    table = table[(table[:, 0] >= max(one[0][0] for one in runs)) & (table[:, 0] <= min(one[0][-1] for one in runs) + 1e-9)]
    time, mean, low, high = 1e3 * table[:, 0], 1e3 * table[:, 1], 1e3 * table[:, 4], 1e3 * table[:, 5]
    heights = [1e3 * np.interp(table[:, 0], *one) for one in runs]

    def curve(name: str, title: str, across: str, less: Array) -> Curve:
        drawn = profile(name, title, "time (ms)", across, time, [height - less for height in heights], reference=mean - less,
                        reference_label="mean and range of 69 runs of seven codes")
        return drawn | {"reference_low": list(low - less), "reference_high": list(high - less)}

    return [curve("ball_height", "Height of the ball", "z (mm)", np.zeros(len(mean))),
            curve("ball_height_difference", "Height of the ball minus the mean of the codes", "difference (mm)", mean)]
