"""Pressures on the walls and levels of the water: arrival, peak and impulse at each sensor, compared where they were measured."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from dembark.input_decks.common.estimates import reference_rows
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.input_decks.common.water_run import Tank, growth
from dembark.input_decks.common.water_run import pressure as fluid_pressure
from dembark.postproc import GrainsDump
from dembark.postproc.convergence import convergence
from dembark.postproc.measurement import (
    Array,
    Curve,
    Estimate,
    Measurement,
    Numbers,
    Points,
    Replica,
    Replicas,
    Value,
    exact,
    profile,
)
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.studies import compared, measured, numerical, quantity

from .pressures import Flags, baseline, full, marks, pressure_at, smoothed
from .sensors import GAUGES, sensors

REFERENCE = Path(__file__).with_name("reference")
# Of the impulses: s in the experiment with the box, and t √(g/H) on the far wall.
BOX_WINDOW, WALL_WINDOW = (0.4, 1.0), (2.0, 5.0)
# Pressures are means over this part of √(H/g), in runs and experiment: each layer of particles that arrives makes the pressure jump.
MEAN = 0.1
# Spacings along a side of the square in which water is counted for a level.
SQUARE = 4
# m: wider than any slab, which is periodic.
PERIODIC = 1e9
MARKS = ("arrival", "peak", "impulse")
# m of water by which the record misses the level at rest in its last 4.4 s: heads at the face of the box, levels; reference/README.md.
MISCLOSURE = {"P1": 1.3e-3, "P2": 1.0e-3, "P3": 11.6e-3, "P4": 1.4e-3}
LEVEL_MISCLOSURE = 5e-3


def published(file: str) -> tuple[Array, dict[str, Array]]:
    """Times (s, n) and what each sensor of a `file` of the experiment shows (Pa or m, n), less its offset before it is wet."""
    rows = reference_rows(REFERENCE / file)
    times = np.array([row.number("time") for row in rows])
    found = {name: np.array([row.number(name) for row in rows]) for name in rows[0] if name != "time"}
    return times, {name: trace - (baseline(times, trace) if name.startswith("P") else 0.0) for name, trace in found.items()}


def units(p: Numbers) -> tuple[float, float]:
    """√(H/g) (s) and ρ g H (Pa)."""
    return math.sqrt(p["column_depth"] / p["gravity"]), p["fluid_density"] * p["gravity"] * p["column_depth"]


def window(p: Numbers) -> tuple[float, float]:
    """Times t √(g/H) between which the impulse is taken."""
    time, _ = units(p)
    return (BOX_WINDOW[0] / time, BOX_WINDOW[1] / time) if p["scene"] == "box" else WALL_WINDOW


@cached_per_replica
def traces(run: Replica) -> tuple[Array, dict[str, Array]]:
    """Times (s, n), and the pressure (Pa, n) at each sensor. Water of a periodic slab is also there a period to either side."""
    p, d = run.parameters, run.derived
    places = sensors(p["scene"], p["distance"] if p["scene"] == "box" else d["tank_end"], d["box_z"], d["box_x"])
    images = np.array([[0.0, k * 2.0 * d["side"], 0.0] for k in ((-1, 0, 1) if p["scene"] == "wall" else (0,))])
    h, weight, times, rows = p["smoothing"] * d["spacing"], p["fluid_density"] * p["gravity"], [0.0], [[0.0] * len(places)]
    rooms = [full(point, h, d["spacing"], lambda at: solid(run, at)) for point in places.values()]
    for frame in GrainsDump(run.folder / "near.dump"):
        if frame.step == 0:
            continue
        water = (frame.positions + images[:, None]).reshape(-1, 3)
        pressures = np.tile(fluid_pressure(frame), len(images)) if len(frame.ids) else np.zeros(0)
        times.append(frame.step * run.time_step)
        rows.append([pressure_at(point, water, pressures, h, weight, room) for point, room in zip(places.values(), rooms, strict=True)])
    return np.array(times), dict(zip(places, np.array(rows).T, strict=True))


def solid(run: Replica, places: Array) -> Flags:
    """Which places (n, 3) are in the floor, and in the box or the far wall."""
    p, d, (x, y, z) = run.parameters, run.derived, places.T
    if p["scene"] == "wall":
        return np.asarray((z < 0.0) | (x > d["tank_end"]))
    behind = x - p["distance"]
    boxed = (behind > 0.0) & (behind < d["box_x"]) & (np.abs(y) < 0.5 * d["box_y"]) & (z < d["box_z"])
    return np.asarray((z < 0.0) | boxed)


@cached_per_replica
def levels(run: Replica) -> tuple[Array, dict[str, Array]]:
    """Times (s, n), and the depth of water (m, n) at each gauge: its volume in a square around it."""
    rows = run.times()
    return rows["time"], {name: rows[name] * run.derived["spacing"] / SQUARE**2 for name in GAUGES if name in rows}


@cached_per_replica
def astray(run: Replica) -> tuple[float, float]:
    """The most particles in a frame that are in walls or the box, deeper than half a spacing, or beyond walls, or gone; and the most that
    flew over the walls."""
    p, d, half = run.parameters, run.derived, 0.5 * run.derived["spacing"]
    box = p["scene"] == "box"
    tank = Tank(d["column"], d["tank_end"], d["side"] if box else PERIODIC, d["tank_top"], d["thick"], d["spacing"], p["gravity"])
    centre, size = np.array([p["distance"] + 0.5 * d["box_x"], 0.0, 0.5 * d["box_z"]]), np.array([d[f"box_{axis}"] for axis in "xyz"])
    found = []
    for frame in run.grains():
        through, over = tank.outside(frame.positions, frame.velocities)
        if box:
            through = through | (np.abs(frame.positions - centre) < 0.5 * size - half).all(axis=1)
        found.append((float(through.sum() + d["grain_count"] - len(frame.ids)), float(over.sum())))
    leaked, over = np.max(found, axis=0)
    return float(leaked), float(over)


def measure(replicas: Replicas) -> Measurement:
    """Of the one run: nothing is random."""
    run = replicas[0]
    p, d, box = run.parameters, run.derived, run.parameters["scene"] == "box"
    time, pressure = units(p)
    energy = 0.5 * p["fluid_density"] * p["gravity"] * d["column"] * 2.0 * d["side"] * p["column_depth"] ** 2
    leaked, over = astray(run)
    values = {"energy_growth": Value(exact(growth(run.times()) / energy), exact(0.0)), "leaked": Value(exact(leaked), exact(0.0)),
              "overtopped": Value(exact(over))}
    curves = []
    times, found = traces(run)
    measured_times, known = published("pressures.csv") if box else (times, {})
    for name, trace in found.items():
        shown = smoothed(times / time, trace / pressure, MEAN)
        own = marks(times / time, shown, window(p))
        reason = "" if math.isfinite(own[0]) else "no water gets there"
        values |= {f"{what}_{name}": Value(exact(one), reason=reason) for what, one in zip(MARKS, own, strict=True)}
        seen = measured_times <= times[-1]
        curves.append(_curve(f"pressure_{name}", f"Pressure, {name.replace('_', ' ')}", "p / (ρ g H)", measured_times[seen] / time,
                             np.interp(measured_times[seen], times, shown),
                             smoothed(measured_times / time, known[name] / pressure, MEAN)[seen] if name in known else None))
    if box:
        measured_times, known = published("levels.csv")
        times, found = levels(run)
        seen = measured_times <= times[-1]
        for name, trace in found.items():
            own, due = np.interp(measured_times[seen], times, trace), known[name][seen]
            values[f"level_error_{name}"] = Value(exact(float(np.abs(own - due).mean() / due.max())))
            curves.append(_curve(f"level_{name}", f"Level, {name}", "height / H", measured_times[seen] / time, own / p["column_depth"],
                                 due / p["column_depth"]))
    return Measurement(values, curves)


def due(p: Numbers) -> dict[str, Estimate]:
    """What the experiment has for the quantities of the box, by name. U_D: of an arrival what lies between two samples, of an impulse and a
    level the misclosure of the record."""
    time, pressure = units(p)
    times, known = published("pressures.csv")
    found = {f"{what}_{name}": exact(one) for name, trace in known.items()
             for what, one in zip(MARKS, marks(times / time, smoothed(times / time, trace / pressure, MEAN), window(p)), strict=True)}
    found["arrival_P1"] = exact(found["arrival_P1"].value, 0.001 / time)
    lasts = (BOX_WINDOW[1] - BOX_WINDOW[0]) / time
    for name, head in MISCLOSURE.items():
        found[f"impulse_{name}"] = exact(found[f"impulse_{name}"].value, head / p["column_depth"] * lasts)
    levels_known = published("levels.csv")[1]
    return found | {f"level_error_{name}": exact(0.0, LEVEL_MISCLOSURE / float(levels_known[name].max())) for name in GAUGES}


def study(name: str, points: Points, along: str) -> Measurement:  # noqa: ARG001 (both studies do the same)
    """The quantities with the finest particles, known to what the spacings leave open: compared with the experiment, or predicted."""
    points, place = ordered(points, along)
    p, sizes = points[0]["parameters"], list(1.0 / place)
    references = due(p) if p["scene"] == "box" else {}
    values, curves, remarks = {}, [], []
    for one in points[-1]["quantities"]:
        key = one["name"]
        # What does not get wet in all of them shows no spacing.
        if not key.startswith((*MARKS, "level_error")) or any(quantity(point, key)["value"] is None for point in points):
            continue
        series = [measured(point, key).value for point in points]
        bound, limit = numerical(sizes, series), convergence(sizes, series)
        more = "" if limit.extrapolated is None else f"; order {limit.order:.2g}, extrapolated {limit.extrapolated:.4g}"
        remarks.append(f"{one['label']}: {', '.join(f'{value:.4g}' for value in series)}, {limit.kind}{more}.")
        reference = references.get(key)
        values[key] = Value(Estimate(series[-1], bound, "spacing"), reference,
                            detail="" if reference is None else compared(series[-1], reference, num=bound).text)
        if key.startswith(("arrival", "impulse")):
            curves.append(PowerLawFit(place, np.array(series), np.zeros(len(series))).curve(key, one["label"], "particles over the depth",
                                                                                           one["unit"]))
    return Measurement(values, curves, remarks)


def _curve(name: str, title: str, across: str, times: Array, own: Array, known: Array | None) -> Curve:
    """A trace of a run over t √(g/H), with that of the experiment where there is one."""
    return profile(name, title, "t √(g/H)", across, times, [own], reference=known,
                   reference_label="" if known is None else "Kleefsman et al. (2005)")
