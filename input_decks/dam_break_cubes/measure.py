"""Trajectories of the cubes and of the experiment, gaps and floor, and what must not happen."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dembark.input_decks.common.estimates import reference_rows, unlike
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.input_decks.common.water_run import Tank
from dembark.postproc.convergence import convergence
from dembark.postproc.history import reached
from dembark.postproc.measurement import Array, Estimate, Measurement, Points, Replica, Replicas, Value, exact, over_replicas, profile
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.statistics import replica_mean
from dembark.postproc.studies import measured

MEASURED = Path(__file__).with_name("reference") / "trajectories.csv"
STORED = ("kinetic_energy", "potential_energy", "compression_energy", "body_energy", "contact_energy")
# Curves are compared from here on (s) of three cubes: before, the experiment's cube stands.
FROM = {"three": 0.5, "six": 0.0, "one": 0.5}
FLOW = (0.8, 1.2)  # s: the flow passes the cubes
NEAR_FLOOR = 0.05  # m: gaps are looked at below this height
BARE = (1.0, 1.7)  # m along the flume, before the cubes
WORST = ("inside", "leaked", "overtopped", "energy_growth", "overlap")
CONVERGING = (("x_end", "x of the top cube at 1.5 s", "m"), ("half_fallen", "Time at which the top cube is half fallen", "s"))
# The flume, the column and the cubes of the experiment, of which its figures hold; the length of the column counts from 1.5 m on, the rest
# of the flume from where the cubes are pushed to.
PUBLISHED = {"column_height": 0.4, "flume_width": 0.7, "edge": 0.15, "cube_density": 800.0, "distance": 1.7, "fluid_density": 1000.0,
             "gravity": 9.81}
LEAST_LENGTHS = {"column_length": 1.5, "downstream_length": 3.5}
# Of which arrangements there are data that agree with each other.
JUDGED = ("three", "six")
OF_EXPERIMENT = ("three_rms_x", "six_rms_x", "half_fallen", "rise")


def published(cubes: str, axis: str) -> tuple[Array, Array]:
    """Times (s) and places (m) of the top cube; empty where there are none."""
    rows = [(row.number("time"), row.number("place")) for row in reference_rows(MEASURED, cubes=cubes, axis=axis)]
    times, places = np.array(rows).reshape(-1, 2).T
    return times, places


def pose(times: Mapping[str, Array], cube: int, row: int) -> tuple[Array, Rotation]:
    """Centre (m) and orientation of a cube, from 1 on, in a row of the history."""
    return (np.array([times[f"cube{cube}_{axis}"][row] for axis in "xyz"]),
            Rotation.from_quat([times[f"cube{cube}_q{part}"][row] for part in "xyzw"]))


def tank(p: Mapping[str, Any], thick: float) -> Tank:
    """The flume, with walls of the thickness `thick` (m)."""
    return Tank(p["column_length"], p["downstream_length"], 0.5 * p["flume_width"], p["flume_height"], thick, p["spacing"], p["gravity"])


@cached_per_replica
def water(run: Replica) -> dict[str, float]:
    """What the frames of the fluid show."""
    p, times, dx = run.parameters, run.times(), run.parameters["spacing"]
    count, half, flume = int(run.derived["cube_count"]), 0.5 * p["edge"], tank(p, run.derived["layers"] * dx)
    found = {"inside": 0.0, "leaked": 0.0, "overtopped": 0.0, "gap_filled": float("nan"), "floor_wetted": float("nan")}
    fronts = [(0.0, 0.0)]  # s, and m: the foremost particle
    for frame in run.grains():
        places, now = frame.positions, frame.step * run.time_step
        row = int(np.argmin(np.abs(times["step"] - frame.step)))
        fronts.append((now, float(places[:, 0].max())))
        through, over = flume.outside(places, frame.velocities)
        found["leaked"] = max(found["leaked"], float(through.sum() + run.derived["grain_count"] - len(frame.ids)))
        found["overtopped"] = max(found["overtopped"], float(over.sum()))
        poses = [pose(times, cube, row) for cube in range(1, count + 1)]
        within = sum(int((np.abs(turn.inv().apply(places - centre)) < half - 0.5 * dx).all(axis=1).sum()) for centre, turn in poses)
        found["inside"] = max(found["inside"], float(within))
        if p["arrangement"] == "six" and FLOW[0] <= now <= FLOW[1]:
            found["gap_filled"] = float(np.fmax(found["gap_filled"], gap_filling(places, [centre for centre, _ in poses[:3]], half, dx)))
        if np.isnan(found["floor_wetted"]) and now >= 1.5 - 0.5 * run.derived["stride"] * run.time_step:
            found["floor_wetted"] = wetted_share(places, p["flume_width"], dx)
    # Between frames; nan if it does not come.
    when, where = np.array(fronts).T
    found["arrival"] = reached(when, where, p["distance"])
    return found


def gap_filling(places: Array, centres: list[Array], half: float, dx: float) -> float:
    """Volume of particles between neighbours of the lowest row, over that of the gaps; nan unless some are side by side along half an edge:
    a shorter gap is that of a few particles."""
    volume = water_there = 0.0
    for left, right in pairwise(centres):
        low = np.array([max(left[0], right[0]) - half, left[1] + half, 0.0])
        high = np.array([min(left[0], right[0]) + half, right[1] - half, NEAR_FLOOR])
        if high[0] - low[0] >= half and (high > low).all():
            volume += float(np.prod(high - low))
            water_there += float(((places > low) & (places < high)).all(axis=1).sum()) * dx**3
    return water_there / volume if volume > 0.0 else float("nan")


def wetted_share(places: Array, width: float, dx: float) -> float:
    """Part of the floor before the cubes with water on it, in squares of two spacings."""
    low = places[(places[:, 2] < 2.0 * dx) & (places[:, 0] > BARE[0]) & (places[:, 0] < BARE[1]) & (np.abs(places[:, 1]) < 0.5 * width)]
    shape = round((BARE[1] - BARE[0]) / (2.0 * dx)), round(width / (2.0 * dx))
    grid = np.zeros(shape, bool)
    at = ((low[:, :2] - [BARE[0], -0.5 * width]) / (2.0 * dx)).astype(int)
    at = at[(at < shape).all(axis=1)]
    grid[at[:, 0], at[:, 1]] = True
    return float(grid.mean())


@cached_per_replica
def cube_history(run: Replica) -> dict[str, float]:
    """What the history shows of the cubes and of energies; nan for what the run does not reach."""
    p, rows = run.parameters, run.times()
    cubes, top = p["arrangement"], int(run.derived["cube_count"])
    time, x, z = rows["time"], rows[f"cube{top}_x"], rows[f"cube{top}_z"]
    found = {"rise": float(np.max(z[time <= 1.0]) - z[0]) if time[-1] >= 1.0 - 1e-9 else float("nan"),
             "x_end": float(np.interp(1.5, time, x, right=np.nan))}
    # What can be turned over: the column that comes to lie on the floor.
    energy = 0.5 * p["fluid_density"] * p["gravity"] * p["column_length"] * p["flume_width"] * p["column_height"] ** 2
    stored = np.sum([rows[name] for name in STORED], axis=0)
    found["energy_growth"] = float(np.max(stored - np.minimum.accumulate(stored))) / energy
    if "overlap" in rows:
        found["overlap"] = float(rows["overlap"].max() / p["rounding"])
    times, places = published(cubes, "x")
    judged = (times >= FROM[cubes]) & (times <= time[-1])
    if cubes in JUDGED and judged.any():
        found[f"{cubes}_rms_x"] = float(np.sqrt(np.mean((np.interp(times[judged], time, x) - places[judged]) ** 2)))
    if cubes in JUDGED:
        found["half_fallen"] = reached(time, -z, -0.5 * (z[0] + 0.5 * p["edge"]))
        found["standing"] = float(np.isnan(found["half_fallen"]))
        if found["standing"] and time[-1] > half_fallen(cubes, p["edge"]) + 0.1:
            found["half_fallen"] = float(time[-1])
    return found


def half_fallen(cubes: str, edge: float) -> float:
    """Time (s) at which the experiment's top cube is half fallen. Of six the ends of the curve stand for the layers."""
    times, places = published(cubes, "z")
    top = 2.5 * edge
    return reached(times, -places, -0.5 * (places[0] + places[-1] if cubes == "six" else top + 0.5 * edge))


def curves(replicas: Replicas) -> list[Any]:
    """The top cube's way in all replicas and in the experiment."""
    cubes, top, found = replicas[0].parameters["arrangement"], int(replicas[0].derived["cube_count"]), []
    for axis, title in (("x", "Top cube along the flume"), ("z", "Height of the top cube")):
        times, places = published(cubes, axis)
        first = FROM[cubes] if axis == "x" else 0.0
        seen = (times >= first) & (times <= min(run.times()["time"][-1] for run in replicas))
        if seen.any() and (axis == "x" or cubes in JUDGED):
            own = [np.interp(times[seen], run.times()["time"], run.times()[f"cube{top}_{axis}"]) for run in replicas]
            found.append(profile(axis, title, "t / s", f"{axis} / m", times[seen], own, reference=places[seen],
                                 reference_label="Canelas et al. (2016)"))
    return found


def mean_of(values: list[float], noisy: bool) -> Estimate:
    """Over runs; of a single one that is displaced by chance nothing is known of the spread."""
    return replica_mean(values) if noisy and len(values) < 3 else over_replicas([exact(one) for one in values])


def measure(replicas: Replicas) -> Measurement:
    """Means over replicas, whose lattices and cubes are displaced a little."""
    p = replicas[0].parameters
    cubes = p["arrangement"]
    late = "the run ends before 1.5 s"
    due = {"rise": 0.0, "inside": 0.0, "leaked": 0.0, "energy_growth": 0.0, "three_rms_x": 0.0, "six_rms_x": 0.0}
    missing = {"rise": "the run ends before 1 s", "arrival": "the front does not reach the cubes", "x_end": late, "floor_wetted": late,
               "half_fallen": "the run ends before",
               "gap_filled": "the lowest cubes are not side by side while the flow passes"}
    of_water = ["arrival", "inside", "leaked", "overtopped", "floor_wetted"]
    # Into narrower gaps no particle gets.
    if cubes == "six" and p["gap"] >= p["spacing"]:
        of_water.append("gap_filled")
    every = [{**cube_history(run), **{name: water(run)[name] for name in of_water}} for run in replicas]
    if cubes in JUDGED:
        due["half_fallen"] = half_fallen(cubes, p["edge"])
    noisy = p["lattice_noise"] > 0.0 or p["cube_noise"] > 0.0
    values = {}
    other = unlike(p, PUBLISHED | {name: value for name, value in LEAST_LENGTHS.items() if p[name] < value})
    for name in every[0]:
        # What may in no run happen is that of the worst.
        mean = exact(max(one[name] for one in every)) if name in WORST else mean_of([one[name] for one in every], noisy)
        values[name] = Value(mean, exact(due[name]) if name in due else None, reason="" if np.isfinite(mean.value) else missing[name],
                             inapplicable=other if name in OF_EXPERIMENT else "")
    return Measurement(values, curves(replicas))


def study(name: str, points: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """How far the two finest spacings are apart, and the order that three show."""
    points, place = ordered(points, along)
    values, shown, remarks = {}, [], []
    for quantity, label, unit in CONVERGING:
        growth = PowerLawFit.of(points, quantity, place)
        found, halves = growth.values.tolist(), growth.halves.tolist()
        between = exact(found[0] - found[1], float(np.hypot(halves[0], halves[1])))
        # A cube that stands falls at no time.
        stands = quantity == "half_fallen" and any(measured(point, "standing").value > 0.0 for point in points[:2])
        values[f"{quantity}_converged"] = Value(between, exact(0.0), reason="it does not fall in all runs" if stands else "")
        shown.append(growth.curve(quantity, label, "spacing / m", f"{label} / {unit}"))
        judged = convergence(place.tolist(), found, halves)
        more = "" if judged.extrapolated is None else f", order {judged.order:.2g}, extrapolated {judged.extrapolated:.3f} {unit}"
        bound = "none can be given" if judged.uncertainty is None else f"± {judged.uncertainty:.3f} {unit}"
        remarks.append(f"{label}: {judged.kind}{more}; numerical uncertainty of the finest: {bound}.")
    return Measurement(values, shown, remarks)
