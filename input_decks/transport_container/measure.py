"""Transport container: force, torque and pressure of its walls, the period with which the bed rings, and the onset of sliding."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.input_decks.common.estimates import over_chaotic, values_and_halves
from dembark.input_decks.common.momentum import imbalance, impulses
from dembark.input_decks.common.motion import about_y, motion
from dembark.input_decks.common.power_law import ordered
from dembark.postproc.measurement import Array, Curve, Measurement, Points, Replica, Replicas, Value, exact, profile
from dembark.postproc.studies import measured

WALLS = ("left", "right", "base")
# Slow pulses are at least so many ring periods long.
SLOW = 20.0
# Diameters, from a wall, of the centres of grains that touch it.
NEAR = 0.7


def ring_period(times: Array, force: Array) -> float:
    """s, of the strongest line in the spectrum of `force` (n,) at evenly spaced `times` (n,), between two samples and half of the record;
    its place among the frequencies by a parabola through the logarithms of the highest value and its neighbours."""
    window = np.hanning(len(force))
    power = np.abs(np.fft.rfft(window * (force - np.average(force, weights=window)), 8 * len(force))) ** 2
    low = 16
    k = low + int(np.argmax(power[low:-1]))
    left, middle, right = np.log(power[k - 1 : k + 2] + 1e-300)
    curvature = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / curvature if curvature < 0.0 else 0.0
    return float(8 * len(force) * (times[1] - times[0]) / (k + shift))


def tops(places: Array, cell: float, low: float, high: float) -> NDArray[np.int64]:
    """Numbers of the highest grains of the cells, `cell` (m) wide, of x between `low` and `high` (m); `places`: x and z (n, 2)."""
    column = np.floor(places[:, 0] / cell).astype(np.int64)
    inside = (places[:, 0] > low) & (places[:, 0] < high)
    own = [np.flatnonzero(inside & (column == k)) for k in np.unique(column[inside])]
    return np.array([one[np.argmax(places[one, 1])] for one in own])


def slid(places: Sequence[Array], surface: NDArray[np.int64]) -> Array:
    """m, (frames,): how far the grains of the `surface` have come along x in the container since the first of the frames, in the median."""
    return np.array([float(np.median(one[surface, 0] - places[0][surface, 0])) for one in places])


def opening(replica: Replica) -> int:
    """Row of time.csv in which the container begins to move, at the first frame."""
    return int(np.flatnonzero(replica.times()["step"] == replica.grains()[0].step)[0])


def moving(replica: Replica) -> Any:
    """The motion of a run."""
    start = replica.time_step * replica.derived["first"]
    return motion(SimpleNamespace(**replica.parameters), start=start, point=(0.5 * replica.derived["length"], 0.0, 0.0))


def forces(replica: Replica, wall: str = "", axis: str = "x") -> Array:
    """N, (rows - 1,): mean force on the grains in each row but the first, of a wall or of all."""
    rows = replica.times()
    impulse = np.diff(rows[f"{wall}_j{axis}"]) if wall else impulses(rows, "vessel", axis, replica.time_step)
    return impulse / (replica.time_step * np.diff(rows["step"]))


def read(replica: Replica) -> dict[str, float]:
    """Measure one run."""
    p, rows, first = replica.parameters, replica.times(), opening(replica)
    frames = [frame.select(frame.types == 1) for frame in replica.grains()]
    mass, g, d = float(frames[0].masses.sum()), float(p["gravity"]), float(p["grain_diameter"])
    times = rows["time"]
    # Each wall's own sum over all steps, which the engine made, and the momentum of the grains.
    all_walls = [np.diff(rows[f"{name}_jx"])[first:] for name in WALLS]
    gained = float(rows["momentum_x"][-1] - rows["momentum_x"][first])
    size = float(sum(np.abs(one).sum() for one in all_walls))
    found = {"impulse_error": abs(float(np.sum(all_walls)) - gained) / size}
    if p["motion"] == "rotation" or p["motion_shape"] == "rising":
        return found | {"slide_slope": _onset(replica)}
    way = moving(replica)
    peak = p["motion_acceleration"] * mass
    force = forces(replica)[first:]
    found |= {"amplification": float(np.abs(force).max()) / peak, "rear_share": float(np.abs(forces(replica, "left")[first:]).max()) / peak}
    moved = np.asarray(way.acceleration(times))[:, 0]
    after = np.flatnonzero(moved != 0.0)[-1] + 1 if (moved != 0.0).any() else first
    if after + 40 < len(times):
        found["ring_period"] = ring_period(times[after + 1 :], forces(replica)[after:]) / math.sqrt(d / g)
    return found


def _in_box(positions: Array, way: Any, time: float, middle: float) -> Array:
    """Positions (n, 3) in the frame of the box at a time (s), which turns about the middle of its base."""
    about = np.array([middle, 0.0, 0.0])
    return np.asarray((positions - np.asarray(way.displacement(time)) - about) @ about_y(way, time) + about)


def _onset(replica: Replica) -> float:
    """Slope of effective gravity to the base's normal when the surface has slid by half a diameter; NaN when it has not."""
    p, way, d = replica.parameters, moving(replica), float(replica.parameters["grain_diameter"])
    frames = [frame.select(frame.types == 1) for frame in replica.grains()]
    times = replica.time_step * np.array([frame.step for frame in frames])
    length = replica.derived["length"]
    middle = 0.5 * length
    places = [_in_box(frame.positions, way, time, middle)[:, ::2] for frame, time in zip(frames, times, strict=True)]
    surface = tops(places[0], d, 0.25 * length, 0.75 * length)
    way_of_surface = slid(places, surface)
    there = np.flatnonzero(np.abs(way_of_surface) > 0.5 * d)
    if not len(there):
        return math.nan
    k = int(there[0])
    share = (0.5 * d - abs(way_of_surface[k - 1])) / (abs(way_of_surface[k]) - abs(way_of_surface[k - 1]))
    time = times[k - 1] + share * (times[k] - times[k - 1])
    if p["motion"] == "rotation":
        return abs(math.tan(float(np.asarray(way.angle(time)))))
    return abs(float(np.asarray(way.acceleration(time))[0])) / float(p["gravity"])


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of all replicas of a series."""
    runs = [read(replica) for replica in replicas]
    values = {"energy_balance": Value(exact(max(imbalance(replica.times()) for replica in replicas)), exact(0.0)),
              "impulse_error": Value(exact(max(run["impulse_error"] for run in runs)), exact(0.0))}
    values |= {name: Value(over_chaotic(run[name] for run in runs)) for name in runs[0] if name != "impulse_error"}
    curves = [_history(replicas, wall) for wall in ("", "left", "right", "base")] + [_pressure(replicas, "left")]
    if "slide_slope" in runs[0]:
        # For the study, which compares bed by bed.
        curves.append(profile("slide_slopes", "Slope at which each bed slides", "bed", "slope", np.arange(1.0, len(runs) + 1.0),
                              [np.array([run["slide_slope"] for run in runs])]))
    return Measurement(values, curves)


def _history(replicas: Replicas, wall: str) -> Curve:
    """Force along x over M g against time."""
    found = []
    for replica in replicas:
        first, rows = opening(replica), replica.times()
        weight = replica.parameters["gravity"] * float(replica.grains()[0].masses.sum())
        found.append((rows["time"][first + 1 :] - rows["time"][first], forces(replica, wall)[first:] / weight))
    place = np.linspace(0.0, found[0][0][-1], 401)
    title = f"Force of {wall} along x" if wall else "Total force along x"
    return profile(f"force_{wall or 'total'}", title, "time since the container moves (s)", "over the weight of the bed", place,
                   [np.interp(place, *one) for one in found])


def _pressure(replicas: Replicas, wall: str) -> Curve:
    """Mean pressure on a side wall over height, without the grains on the base, while the container moves and at rest."""
    d = float(replicas[0].parameters["grain_diameter"])
    edges = d * np.arange(0.0, replicas[0].parameters["bed_height"] + 1.0)

    def pressure(replica: Replica, frame: Any) -> Array:
        way, time, middle = moving(replica), frame.step * replica.time_step, 0.5 * replica.derived["length"]
        places = _in_box(frame.positions, way, time, middle)
        # Grains that touch the wall and not the base, whose friction is along x as well.
        near = (places[:, 0] < NEAR * d) & (places[:, 2] > NEAR * d)
        push = (frame.wall_forces["vessel"] @ about_y(way, time))[near, 0]
        sums, _ = np.histogram(places[near, 2], edges, weights=np.maximum(push, 0.0))
        return sums / (d * np.diff(edges))

    found = []
    for replica in replicas:
        frames = [frame.select(frame.types == 1) for frame in replica.grains()]
        found.append((np.mean([pressure(replica, frame) for frame in frames[1:]], axis=0), pressure(replica, frames[0])))
    return profile(f"pressure_{wall}", f"Force on the {wall} wall over d²", "z / d", "Pa", 0.5 * (edges[1:] + edges[:-1]) / d,
                   [one for one, _ in found], vertical=True, reference=np.mean([one for _, one in found], axis=0),
                   reference_label="at rest")


def study(name: str, results: Points, along: str) -> Measurement:
    """D of the longest pulse against one, if it is slow; or the onset on a ramp against that of tilting."""
    results, place = ordered(results, along)
    quantity = "amplification" if name == "pulse" else "slide_slope"
    found = [measured(one, quantity) for one in results]
    values, halves = values_and_halves(found)
    if name != "pulse":
        # The last one is tilted at the rate of the ramp.
        ramp, tilt = (next(one["value"] for one in results[k]["profiles"] if one["name"] == "slide_slopes") for k in (0, -1))
        ratios = over_chaotic(float(one / other) for one, other in zip(ramp, tilt, strict=True))
        return Measurement({"sliding_onset": Value(ratios, exact(1.0))}, [
            profile("onset", "Onset of sliding", "angular acceleration of tilting (rad/s²); 0: ramp", "slope of effective gravity", place,
                    [values], half=halves)])
    given = results[-1]["parameters"]
    unit = math.sqrt(given["grain_diameter"] / given["gravity"])
    period = unit * measured(results[0], "ring_period").value
    slow = place[-1] >= SLOW * period
    reason = "" if slow else f"the longest pulse has {place[-1] / period:.3g} periods, fewer than {SLOW:g}"
    curve = profile("amplification", "Force of a pulse", "log₁₀ of its length over the ring period", "D", np.log10(place / period),
                    [values], half=halves, reference=np.ones(len(values)), reference_label="rigid")
    return Measurement({"slow_amplification": Value(found[-1], exact(1.0), reason=reason)}, [curve])
