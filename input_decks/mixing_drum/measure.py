"""Mixing drum: grains of each sort in two zones and their centres of mass against time, compared with other codes."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from dembark.input_decks.common.estimates import reference_rows
from dembark.postproc import GrainFrame
from dembark.postproc.measurement import Array, Estimate, Measurement, Replica, Replicas, Value, exact, number, over_replicas, profile

HERE = Path(__file__).with_name("reference")
CODES, SORTS, ZONES = ("musen", "liggghts"), ("small", "large"), ("zone1", "zone2")
# What makes a run one of the published drum, whatever its moduli are.
PUBLISHED = {
    "small_count": 30000, "small_diameter": 0.002, "small_density": 2500.0, "large_count": 8000, "large_diameter": 0.004,
    "large_density": 2000.0, "small_restitution": 0.5, "small_large_restitution": 0.45, "small_steel_restitution": 0.4,
    "large_restitution": 0.4, "large_steel_restitution": 0.4, "small_friction": 0.3, "small_large_friction": 0.2,
    "small_steel_friction": 0.2, "large_friction": 0.4, "large_steel_friction": 0.2, "drum_radius": 0.1, "drum_width": 0.06,
    "drum_speed": 2.0, "sides": 100, "gravity": 9.81}
# Seconds between the published numbers.
EACH = 0.1
# Turning points of the numbers in zone 2: sort, 1 for a peak and -1 for a trough, and the window (s) in which it lies.
TURNING = {
    "small_peak_1": ("small", 1, 0.3, 1.0), "small_trough_1": ("small", -1, 1.0, 2.0), "small_peak_2": ("small", 1, 1.9, 3.1),
    "small_trough_2": ("small", -1, 2.8, 4.0), "small_peak_3": ("small", 1, 3.8, 4.9), "large_peak_1": ("large", 1, 1.1, 2.3),
    "large_peak_2": ("large", 1, 2.7, 4.1)}
# Extremes of the centres of mass; those that the start has are not among them.
EXTREMES = {"small_x_least": ("small_x", min), "small_x_most": ("small_x", max), "small_z_least": ("small_z", min),
            "small_z_most": ("small_z", max), "large_x_most": ("large_x", max), "large_z_most": ("large_z", max)}
# One frame in so many is searched for contacts.
FRAMES = 5


def published() -> dict[str, dict[str, Array]]:
    """Times (s) and numbers of grains by code."""
    rows = reference_rows(HERE / "zone_counts.csv")
    return {code: {"time": np.array([row.number("time") for row in rows])} | {
        f"{sort}_{zone}": np.array([row.number(f"{sort}_{zone}_{code}") for row in rows]) for sort in SORTS for zone in ZONES}
        for code in CODES}


def centres() -> dict[str, Array]:
    """Times (s) and centres of mass (m) of one code."""
    rows = reference_rows(HERE / "centres.csv")
    return {name: np.array([row.number(name) for row in rows]) for name in rows[0]}


def is_published(p: Mapping[str, Any]) -> bool:
    """Whether a run with the parameters `p` is one of the published drum."""
    return all(p[name] == value for name, value in PUBLISHED.items())


def turning_point(rows: Mapping[str, Array], name: str, shift: float = 0.0) -> tuple[float, float]:
    """Time (s) and number of grains of a turning point: the vertex of the parabola through the extreme number and its neighbours, read each
    0.1 s, `shift` (s) later; NaN where the extreme is at the edge of the window, or the run ends before."""
    sort, sign, low, high = TURNING[name]
    times = np.arange(round(low / EACH), round(high / EACH) + 1) * EACH + shift
    if rows["time"][-1] < times[-1] - shift - 1e-6:
        return math.nan, math.nan
    times = times[times <= rows["time"][-1] + 1e-6]
    counts = np.interp(times, rows["time"], rows[f"{sort}_zone2"])
    k = int(np.argmax(sign * counts))
    if k in (0, len(times) - 1):
        return math.nan, math.nan
    before, at, after = counts[k - 1:k + 2]
    bend = before - 2.0 * at + after
    offset = 0.5 * (before - after) / bend if bend else 0.0
    return float(times[k] + EACH * offset), float(at - 0.25 * (before - after) * offset)


def turning_points(rows: Mapping[str, Array]) -> dict[str, tuple[Estimate, Estimate]]:
    """Time (s) and number of each turning point that the run reaches; interval: half of the range of ten readings."""
    found = {}
    for name in TURNING:
        if not math.isnan(turning_point(rows, name)[0]):
            readings = np.array([turning_point(rows, name, shift) for shift in np.arange(10) * 0.1 * EACH])
            half = 0.5 * np.ptp(readings, axis=0)
            time, count = (Estimate(float(value), float(width), "range of ten readings") for value, width in
                           zip(readings[0], half, strict=True))
            found[name] = time, count
    return found


def at_times(rows: Mapping[str, Array], name: str, times: Array) -> Array:
    """A column of a run at `times` (s)."""
    return np.interp(times, rows["time"], rows[name])


def differences(rows: Mapping[str, Array]) -> Iterator[tuple[str, Value]]:
    """The numbers of a run less the mean of the codes: the largest difference up to 0.5 s, and root mean squares of small grains in
    zone 2."""
    codes = published()
    times = codes[CODES[0]]["time"]

    def off(name: str, low: float, high: float) -> Array:
        inside = (times > low - 1e-9) & (times < high + 1e-9)
        return at_times(rows, name, times[inside]) - np.mean([codes[code][name][inside] for code in CODES], axis=0)

    end = rows["time"][-1] + 1e-6
    if end >= 0.5:
        yield "early_numbers", number(max(float(np.abs(off(f"{sort}_{zone}", 0.1, 0.5)).max()) for sort in SORTS for zone in ZONES), 0.0)
    for name, low, high in (("rms_early", 0.1, 2.0), ("rms_late", 2.1, 5.0)):
        if end >= high:
            yield name, number(float(np.sqrt((off("small_zone2", low, high) ** 2).mean())), 0.0)


def extremes(rows: Mapping[str, Array]) -> dict[str, float]:
    """Extremes (m) of the centres of mass of a run or code at the published times; none of a run that ends earlier."""
    times = centres()["time"][1:]
    if rows["time"][-1] < times[-1] - 1e-6:
        return {}
    return {name: float(which(at_times(rows, column, times))) for name, (column, which) in EXTREMES.items()}


def overlaps(frame: GrainFrame) -> Array:
    """Overlaps of grains that touch, over the diameter of the smaller one."""
    pairs = cKDTree(frame.positions).query_pairs(2.0 * float(frame.radii.max()), output_type="ndarray")
    distance = np.linalg.norm(frame.positions[pairs[:, 0]] - frame.positions[pairs[:, 1]], axis=1)
    depth = frame.radii[pairs].sum(axis=1) - distance
    return depth[depth > 0.0] / (2.0 * frame.radii[pairs].min(axis=1)[depth > 0.0])


def leaked(replica: Replica) -> int:
    """The most grains, in any frame, whose middle is outside of the drum."""
    p = replica.parameters
    return max(int(((np.hypot(frame.positions[:, 0], frame.positions[:, 2]) > p["drum_radius"])
                    | (np.abs(frame.positions[:, 1]) > 0.5 * p["drum_width"])).sum()) for frame in replica.grains())


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of all replicas of a series."""
    runs, frames = [replica.times() for replica in replicas], [list(replica.grains())[::FRAMES] for replica in replicas]
    depths = np.concatenate([overlaps(frame) for some in frames for frame in some])
    values = {"leaked": number(max(map(leaked, replicas)), 0.0), "overlap": number(float(depths.mean()), 0.0),
              "deep_overlap": number(float(np.quantile(depths, 0.999)))}
    for sort in SORTS:
        values[f"{sort}_start"] = Value(over_replicas([exact(float(run[f"{sort}_z"][0])) for run in runs]))
    known = is_published(replicas[0].parameters)
    codes, paths = published(), centres()
    points, due = [turning_points(run) for run in runs], {code: turning_points(rows) for code, rows in codes.items()}
    for name in set.intersection(*map(set, points)):
        for which, what in enumerate((f"{name}_time", name)):
            reference = _spread([due[code][name][which].value for code in CODES]) if known else None
            values[what] = Value(over_replicas([one[name][which] for one in points]), reference)
    if known:
        found = [dict(differences(run)) for run in runs]
        for name in found[0]:
            values[name] = Value(over_replicas([one[name].estimate for one in found]), exact(0.0))
        for sort in SORTS:
            values[f"{sort}_start"] = Value(values[f"{sort}_start"].estimate, exact(float(paths[f"{sort}_z"][0])))
    reached, published_extremes = [extremes(run) for run in runs], extremes(paths)
    for name in reached[0]:
        values[name] = Value(over_replicas([exact(one[name]) for one in reached]), exact(published_extremes[name]) if known else None)
    return Measurement(values, list(curves(runs, known)))


def curves(runs: list[dict[str, Array]], known: bool) -> Iterator[dict[str, Any]]:
    """Numbers and centres against time, with those of the codes."""
    codes, paths = published(), centres()
    for sort in SORTS:
        for zone in ZONES:
            name, times = f"{sort}_{zone}", codes[CODES[0]]["time"]
            times = times[times < runs[0]["time"][-1] + 1e-6]
            both = np.array([codes[code][name][:len(times)] for code in CODES])
            more = {"reference": both.mean(axis=0), "reference_half": 0.5 * np.ptp(both, axis=0), "reference_label": "two codes"}
            yield profile(name, f"{sort.capitalize()} grains in zone {zone[-1]}", "time (s)", "grains", times,
                          [at_times(run, name, times) for run in runs], **(more if known else {}))
        for axis in "xz":
            name, times = f"{sort}_{axis}", paths["time"][1:]
            times = times[times < runs[0]["time"][-1] + 1e-6]
            more = {"reference": paths[name][1:len(times) + 1], "reference_label": "MUSEN"}
            yield profile(name, f"Centre of mass of {sort} grains, {axis}", "time (s)", f"{axis} (m)", times,
                          [at_times(run, name, times) for run in runs], **(more if known else {}))


def _spread(found: list[float]) -> Estimate:
    return Estimate(float(np.mean(found)), 0.5 * float(np.ptp(found)), "half of the range of the codes")
