"""Lifted cylinder: angle of repose, height and base of the heap on the plate; run-out and height of a released column."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dembark.input_decks.common.estimates import STEP, over_chaotic, reference_rows
from dembark.input_decks.common.heaps import at_rest, height
from dembark.input_decks.common.momentum import unaccounted
from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Array, Estimate, Measurement, Replica, Replicas, Value, exact, profile
from dembark.postproc.replica import cached_per_replica

CODE = Path(__file__).with_name("reference") / "moose_column.csv"
# Height of the deposits of the other code over R, for H/R of 1 and more: from 0.63 to 0.71.
CODE_HEIGHT = Estimate(0.67, 0.04, "three columns")
# Grains over those of a layer of squares in a ring at the edge of a heap, as the other code counts them.
EDGE = 0.3
# Between these shares of the base radius the slope is taken; farther out a heap four grains high is less than one grain high.
LOW, HIGH = 0.2, 0.7
# Diameters from the axis within which the height is taken.
NEAR = 2.0
# Diameters from ring to ring, of which the outermost is the base.
RINGS = 0.05
# Time of the lift over sqrt(H/g), below which it releases the column: half of the grains then fall by less than 5 % of H.
RELEASED = 0.3


class Heap(NamedTuple):
    """A heap on the plane z = 0 about the z axis: angle of its slope (deg), height and radius of the base (m)."""

    angle: float
    height: float
    base: float


def run_out_of_columns(aspect: float) -> float:
    """Lube et al. (2004): (r - R)/R where a column of H/R = `aspect` comes to rest."""
    return 1.24 * aspect if aspect < 1.7 else 1.6 * math.sqrt(aspect)


def height_of_columns(aspect: float) -> float:
    """Lube et al. (2004): its height over R."""
    return aspect if aspect < 0.85 else 0.88 * aspect ** (1.0 / 6.0)


def base_radius(radii: Array, diameter: float) -> float:
    """m, middle of the outermost ring, one `diameter` (m) wide, in which grains at `radii` (n,) in m from the axis are EDGE of a layer."""
    r = np.sort(radii)
    middles = np.arange(0.5 * diameter, r[-1] + diameter, RINGS * diameter)
    low, high = (np.searchsorted(r, middles + side * diameter) for side in (-0.5, 0.5))
    covered = (high - low) * diameter >= EDGE * 2.0 * np.pi * middles
    return float(middles[covered][-1]) if covered.any() else 0.0


def ring_heights(frame: GrainFrame, edges: Array) -> Array:
    """m, surface of a heap in rings between `edges` (n + 1,) in m, (n,): the mean over sectors as long as two rings are wide, at least
    three a ring, of the highest point of a grain whose centre is in it, 0 where there is none."""
    x, y, z = frame.positions.T
    radii, turns, tops = np.hypot(x, y), (np.arctan2(y, x) / (2.0 * np.pi)) % 1.0, z + frame.radii
    found = []
    for low, high in pairwise(edges):
        sectors = max(3, round(0.5 * np.pi * (low + high) / (high - low)))
        inside = (radii >= low) & (radii < high)
        top = np.zeros(sectors)
        np.maximum.at(top, (turns[inside] * sectors).astype(int) % sectors, tops[inside])
        found.append(top.mean())
    return np.array(found)


def heap(frame: GrainFrame, diameter: float) -> Heap:
    """Of grains with the mean `diameter` (m)."""
    radii = np.hypot(*frame.positions[:, :2].T)
    base = base_radius(radii, diameter)
    edges = diameter * np.arange(max(math.ceil(base / diameter), 3) + 1, dtype=np.float64)
    middles, tops = 0.5 * (edges[1:] + edges[:-1]), ring_heights(frame, edges)
    chosen = (middles > LOW * base) & (middles < HIGH * base)
    slope = np.polyfit(middles[chosen], tops[chosen], 1)[0] if chosen.sum() > 1 else 0.0
    near = radii < NEAR * diameter
    top = float((frame.positions[:, 2] + frame.radii)[near].max()) if near.any() else 0.0
    return Heap(-math.degrees(math.atan(slope)), top, base)


@cached_per_replica
def ends(replica: Replica) -> tuple[GrainFrame, GrainFrame, GrainFrame]:
    """The first frame, the last but one, and the last."""
    frames = replica.grains()
    return frames[0], frames[-2], frames[-1]


def off_plate(replica: Replica) -> int:
    """Grains that have gone, or are outside of the rim or below the plate, in the last frame."""
    p, last = replica.parameters, ends(replica)[-1]
    on = (np.hypot(*last.positions[:, :2].T) < p["plate_radius"]) & (last.positions[:, 2] > 0.0)
    return int(replica.derived["poured"] - on.sum())


def balances(replica: Replica) -> tuple[float, float]:
    """Mean force on the plate over the weight − 1, after the last frame but one; and impulse of plate and cylinder, less that of the weight
    and what the grains gain, from the first to the last frame, over that of the weight."""
    rows, (first, before, last) = replica.times(), ends(replica)
    weight = last.masses.sum() * replica.parameters["gravity"]
    force = rows["pan_fz"][rows["step"] > before.step].mean()
    missing = unaccounted(first, last, rows, ["pan", "cylinder"], "z", -replica.parameters["gravity"], replica.time_step)
    return float(force / weight - 1.0), missing / (weight * (last.step - first.step) * replica.time_step)


def measure(replicas: Replicas) -> Measurement:
    """Of all packings: the heap; where nothing rubs, its slope alone; where the cylinder releases a column, its run-out and height."""
    p, d, radius = replicas[0].parameters, replicas[0].parameters["grain_diameter"], replicas[0].parameters["cylinder_radius"]
    lasts = [ends(replica)[-1] for replica in replicas]
    heaps, errors = [heap(last, d) for last in lasts], np.abs([balances(replica) for replica in replicas])
    moving = "" if all(at_rest(last, p["gravity"], d) for last in lasts) else "the grains still move"
    resting = all(at_rest(ends(replica)[0], p["gravity"], d) for replica in replicas)
    raining = "" if resting else "the grains still move when the lift begins: raise settle_time"
    angle = over_chaotic(one.angle for one in heaps)
    values = {"off_plate": Value(exact(float(max(map(off_plate, replicas)))), exact(0.0)),
              "weight_error": Value(exact(errors[:, 0].max()), exact(0.0), inapplicable=moving),
              "impulse_error": Value(exact(errors[:, 1].max()), exact(0.0))}
    if replicas[0].derived["grain_static"] == 0.0:
        return Measurement(values | {"level_angle": Value(angle, exact(0.0))}, [_surface(replicas)])
    values |= {"angle": Value(angle, reason=moving or raining, compared=resting),
               "heap_height": Value(over_chaotic(one.height / d for one in heaps), reason=raining, compared=resting),
               "base_radius": Value(over_chaotic((one.base / d for one in heaps), STEP * RINGS), reason=raining, compared=resting)}
    columns = [height(ends(replica)[0]) for replica in replicas]
    if replicas[0].derived["lift_time"] < RELEASED * math.sqrt(np.mean(columns) / p["gravity"]):
        aspect = over_chaotic(one / radius for one in columns)
        run_out = over_chaotic((one.base / radius - 1.0 for one in heaps), STEP * RINGS * d / radius)
        deposit = over_chaotic(one.height / radius for one in heaps)
        known = np.array([(row.number("aspect_ratio"), row.number("run_out")) for row in reference_rows(CODE)])
        outside = "" if 0.95 <= aspect.value <= known[-1, 0] else f"the other code has columns of H/R from 1 to 3, not {aspect.value:.3g}"
        open_for = moving or raining
        values |= {"aspect_ratio_measured": Value(aspect, reason=raining, compared=resting),
                   "run_out": Value(run_out, reason=raining, compared=resting),
                   "run_out_of_code": Value(run_out, exact(float(np.interp(aspect.value, *known.T))), reason=open_for,
                                            inapplicable=outside),
                   "height_of_code": Value(deposit, CODE_HEIGHT, reason=open_for, inapplicable=outside),
                   "run_out_of_columns": Value(run_out, exact(run_out_of_columns(aspect.value)), reason=open_for),
                   "height_of_columns": Value(deposit, exact(height_of_columns(aspect.value)), reason=open_for)}
    return Measurement(values, [_surface(replicas)])


def _surface(replicas: Replicas) -> dict[str, Any]:
    """Against the distance from the axis."""
    p = replicas[0].parameters
    d = p["grain_diameter"]
    edges = d * np.arange(round(p["plate_radius"] / d) + 1, dtype=np.float64)
    tops = [[ring_heights(frame, edges) / d for frame in (first, last)] for first, _, last in map(ends, replicas)]
    return profile("heap", "Surface of the heap", "distance from the axis / d", "height / d", 0.5 * (edges[1:] + edges[:-1]) / d,
                   [last for _, last in tops], reference=np.mean([first for first, _ in tops], axis=0),
                   reference_label="when the lift begins")
