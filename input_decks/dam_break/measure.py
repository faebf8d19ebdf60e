"""The front of the column beside two experiments."""

import csv
import math
from pathlib import Path

import numpy as np

from dembark.postproc.history import reached
from dembark.postproc.instruments.growth import Growth, ordered
from dembark.postproc.instruments.water import common_values
from dembark.postproc.measurement import Array, Measurement, Points, Replica, Replicas, Value, exact, profile
from dembark.postproc.replica import once
from dembark.postproc.studies import measured

MEASURED = Path(__file__).with_name("reference") / "fronts.csv"
# Where the time of the front's way begins and ends, over the width of the column.
WAY = (1.44, 4.11)


def published(source: str) -> tuple[Array, Array]:
    """Times T and fronts, over a."""
    with MEASURED.open(encoding="utf-8") as file:
        rows = [(float(row["time"]), float(row["front"])) for row in csv.DictReader(file) if row["source"] == source]
    times, fronts = np.array(rows).T
    return times, fronts


@once
def front(run: Replica) -> tuple[Array, Array]:
    """Times T = t √(2g/a) and places over a of the front: the foremost particle and half a spacing."""
    p = run.parameters
    width, unit = p["column_width"], math.sqrt(p["column_width"] / (2.0 * p["gravity"]))
    frames = [(frame.step * run.time_step / unit, (frame.positions[:, 0].max() + 0.5 * width / p["resolution"]) / width)
              for frame in run.grains()]
    times, places = np.array([(0.0, 1.0), *frames]).T
    return times, places


def beside(run: Replica, source: str) -> float:
    """Mean of the front over that measured, T ≥ 1."""
    times, fronts = published(source)
    own = front(run)
    judged = (times >= 1.0) & (times <= own[0][-1])
    return float(np.mean(np.interp(times[judged], *own) / fronts[judged]))


def measure(replicas: Replicas) -> Measurement:
    """Of the one run: nothing is random."""
    run = replicas[0]
    times, places = front(run)
    start, end = (reached(times, places, place) for place in WAY)
    table_times, table = published("table")
    due = float(np.interp(WAY[1], table, table_times) - np.interp(WAY[0], table, table_times))
    p = run.parameters
    energy = p["fluid_density"] * p["gravity"] * 2.0 * p["column_width"] ** 3
    values = {"front": Value(exact(beside(run, "table")), exact(1.0)),
              "front_koshizuka": Value(exact(beside(run, "koshizuka")), exact(1.0)),
              "passage": Value(exact(end - start), exact(due), reason="" if end > start else "the front did not get there"),
              "front_at_3": Value(exact(float(np.interp(3.0, times, places)))), **common_values(run, energy)}
    place = table_times[table_times <= times[-1]]
    curves = [profile(name, title, "T = t √(2g/a)", "front over a", published(source)[0],
                      [np.interp(published(source)[0], times, places)], reference=published(source)[1], reference_label=label)
              for name, source, title, label in (("front", "table", "Front", "Martin & Moyce (1952)"),
                                                 ("front_koshizuka", "koshizuka", "Front, another experiment", "Koshizuka & Oka (1996)"))]
    return Measurement(values, curves if len(place) else [])


def study(name: str, points: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """How far the two finest spacings are apart."""
    points, place = ordered(points, along)
    fronts = np.array([measured(point, "front_at_3").value for point in points])
    return Measurement({"front_converged": Value(exact(fronts[-1] - fronts[-2]), exact(0.0))},
                       [Growth(place, fronts, 0.0 * fronts).curve("front", "Front at T = 3", "particles across the column", "over a")])
