"""Trajectories of the cubes beside the experiment, gaps and floor, and what must not happen."""

import csv
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np

from dembark.postproc.history import reached
from dembark.postproc.measurement import Array, Measurement, Replica, Replicas, Value, exact, profile
from dembark.postproc.replica import once

MEASURED = Path(__file__).with_name("reference") / "trajectories.csv"
STORED = ("kinetic_energy", "potential_energy", "compression_energy", "body_energy", "contact_energy")
# Curves are compared from here on (s) of three cubes: before, the experiment's cube stands.
FROM = {"three": 0.5, "six": 0.0, "one": 0.5}
FLOW = (0.8, 1.2)  # s: the flow passes the cubes
NEAR_FLOOR = 0.05  # m: gaps are looked at below this height
BARE = (1.0, 1.7)  # m along the flume, before the cubes


def published(cubes: str, axis: str) -> tuple[Array, Array]:
    """Times (s) and places (m) of the top cube; empty where there are none."""
    with MEASURED.open(encoding="utf-8") as file:
        rows = [(float(row["time"]), float(row["place"])) for row in csv.DictReader(file) if (row["cubes"], row["axis"]) == (cubes, axis)]
    times, places = np.array(rows).reshape(-1, 2).T
    return times, places


def rotated(axes: Array, quaternion: Array) -> Array:
    """Vectors (..., 3) in the frame of a body whose orientation is w, x, y, z, from space."""
    w, v = quaternion[0], -quaternion[1:]
    t = 2.0 * np.cross(v, axes)
    return np.asarray(axes + w * t + np.cross(v, t))


def pose(times: Mapping[str, Array], cube: int, row: int) -> tuple[Array, Array]:
    """Centre (m) and orientation of a cube, from 1 on, in a row of the history."""
    return (np.array([times[f"cube{cube}_{axis}"][row] for axis in "xyz"]),
            np.array([times[f"cube{cube}_{part}"][row] for part in ("qw", "qx", "qy", "qz")]))


@once
def water(run: Replica) -> dict[str, float]:
    """What the frames of the fluid show."""
    p, times, dx = run.parameters, run.times(), run.parameters["spacing"]
    count, half = int(run.derived["cube_count"]), 0.5 * p["edge"]
    found = {"inside": 0.0, "leaked": 0.0, "gap_filled": 0.0, "floor_wetted": float("nan")}
    for frame in run.grains():
        places, now = frame.positions, frame.step * run.time_step
        row = int(np.argmin(np.abs(times["step"] - frame.step)))
        outside = (places[:, 2] < -0.5 * dx) | ((places[:, 2] < p["flume_height"]) & (
            (np.abs(places[:, 1]) > 0.5 * (p["flume_width"] + dx)) | (places[:, 0] < -p["column_length"] - 0.5 * dx)
            | (places[:, 0] > p["downstream_length"] + 0.5 * dx)))
        found["leaked"] = max(found["leaked"], float(outside.sum() + run.derived["grain_count"] - len(frame.ids)))
        poses = [pose(times, cube, row) for cube in range(1, count + 1)]
        within = sum(int((np.abs(rotated(places - centre, turn)) < half - 0.5 * dx).all(axis=1).sum()) for centre, turn in poses)
        found["inside"] = max(found["inside"], float(within))
        if p["arrangement"] == "six" and FLOW[0] <= now <= FLOW[1]:
            found["gap_filled"] = max(found["gap_filled"], filled(places, [centre for centre, _ in poses[:3]], half, dx))
        if np.isnan(found["floor_wetted"]) and now >= 1.5 - 0.5 * run.derived["stride"] * run.time_step:
            found["floor_wetted"] = wetted(places, p["flume_width"], dx)
    return found


def filled(places: Array, centres: list[Array], half: float, dx: float) -> float:
    """Volume of particles between neighbours of the lowest row, over that of the gaps, where they are side by side."""
    volume = water_there = 0.0
    for left, right in pairwise(centres):
        low = np.array([max(left[0], right[0]) - half, left[1] + half, 0.0])
        high = np.array([min(left[0], right[0]) + half, right[1] - half, NEAR_FLOOR])
        if (high > low).all():
            volume += float(np.prod(high - low))
            water_there += float(((places > low) & (places < high)).all(axis=1).sum()) * dx**3
    return water_there / volume if volume > 0.0 else 0.0


def wetted(places: Array, width: float, dx: float) -> float:
    """Part of the floor before the cubes with water on it, in squares of two spacings."""
    low = places[(places[:, 2] < 2.0 * dx) & (places[:, 0] > BARE[0]) & (places[:, 0] < BARE[1]) & (np.abs(places[:, 1]) < 0.5 * width)]
    shape = round((BARE[1] - BARE[0]) / (2.0 * dx)), round(width / (2.0 * dx))
    grid = np.zeros(shape, bool)
    at = ((low[:, :2] - [BARE[0], -0.5 * width]) / (2.0 * dx)).astype(int)
    at = at[(at < shape).all(axis=1)]
    grid[at[:, 0], at[:, 1]] = True
    return float(grid.mean())


def arrival(run: Replica) -> float:
    """Time (s) of the foremost particle at the first face, between frames; nan if it does not come."""
    frames = [(frame.step * run.time_step, float(frame.positions[:, 0].max())) for frame in run.grains()]
    times, places = np.array([(0.0, 0.0), *frames]).T
    return reached(times, places, run.parameters["distance"])


def prepare(run: Replica) -> None:
    """The frames are read while other runs go on."""
    water(run)


def measure(replicas: Replicas) -> Measurement:
    """Of the one run: nothing is random."""
    run = replicas[0]
    p, rows, seen = run.parameters, run.times(), water(run)
    cubes, top = p["arrangement"], int(run.derived["cube_count"])
    time, x, z = rows["time"], rows[f"cube{top}_x"], rows[f"cube{top}_z"]
    start = z[0]
    came = arrival(run)
    values = {"arrival": Value(exact(came), reason="" if came > 0.0 else "the front did not come"),
              "rise": Value(exact(float(np.max(z[time <= 1.0]) - start)), exact(0.0)),
              "x_end": Value(exact(float(np.interp(1.5, time, x, right=np.nan))),
                             reason="" if time[-1] >= 1.5 else "the run ends before 1.5 s"),
              "inside": Value(exact(seen["inside"]), exact(0.0)), "leaked": Value(exact(seen["leaked"]), exact(0.0)),
              "floor_wetted": Value(exact(seen["floor_wetted"]), exact(1.0),
                                    reason="" if seen["floor_wetted"] >= 0.0 else "the run ends before 1.5 s")}
    # What can be turned over: the column that comes to lie on the floor.
    energy = 0.5 * p["fluid_density"] * p["gravity"] * p["column_length"] * p["flume_width"] * p["column_height"] ** 2
    stored = np.sum([rows[name] for name in STORED], axis=0)
    values["energy_growth"] = Value(exact(float(np.max(stored - np.minimum.accumulate(stored))) / energy), exact(0.0))
    if "overlap" in rows:
        values["overlap"] = Value(exact(float(rows["overlap"].max() / p["rounding"])))
    curves = []
    data = {axis: published(cubes, axis) for axis in "xz"}
    times, places = data["x"]
    judged = (times >= FROM[cubes]) & (times <= time[-1])
    if judged.any():
        own = np.interp(times[judged], time, x)
        if cubes in ("three", "six"):
            values[f"{cubes}_rms_x"] = Value(exact(float(np.sqrt(np.mean((own - places[judged]) ** 2)))), exact(0.0))
        curves.append(profile("x", "Top cube along the flume", "t / s", "x / m", times[judged], [own], reference=places[judged],
                              reference_label="Canelas et al. (2016)"))
    times, places = data["z"]
    if cubes in ("three", "six"):
        fallen = reached(time, -z, -0.5 * (start + 0.5 * p["edge"]))
        # Of six the ends of the curve stand for the layers.
        middle = 0.5 * (places[0] + places[-1]) if cubes == "six" else 0.5 * (start + 0.5 * p["edge"])
        due = reached(times, -places, -middle)
        if np.isnan(fallen) and time[-1] > due + 0.1:
            fallen = float(time[-1])
        values["half_fallen"] = Value(exact(fallen), exact(due), reason="" if fallen > 0.0 else "the run ends before")
        seen_there = times <= time[-1]
        curves.append(profile("z", "Height of the top cube", "t / s", "z / m", times[seen_there], [np.interp(times[seen_there], time, z)],
                              reference=places[seen_there], reference_label="Canelas et al. (2016)"))
    # Into narrower gaps no particle gets.
    if cubes == "six" and p["gap"] >= p["spacing"]:
        values["gap_filled"] = Value(exact(seen["gap_filled"]), exact(1.0))
    return Measurement(values, curves)
