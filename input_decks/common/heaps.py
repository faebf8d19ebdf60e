"""Heaps and deposits of grains: their surface, their flanks, how far they reach, and whether they are at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.stats import linregress

from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Array
from dembark.postproc.statistics import Estimate, student

# Solid volume over area, in mean diameters, at the end of a deposit: half of a layer one diameter thick with a solid fraction of 0.6.
EDGE = 0.3
# Mean kinetic energy of a grain over what lifts it by its diameter, below which a heap counts as at rest.
REST = 1e-3


def surface(frame: GrainFrame, edges: Array) -> Array:
    """m, highest point of a grain whose centre is in each cell of x (0 where there is none)."""
    top = np.zeros(len(edges) - 1)
    cell = np.searchsorted(edges, frame.positions[:, 0]) - 1
    inside = (cell >= 0) & (cell < len(top))
    np.maximum.at(top, cell[inside], (frame.positions[:, 2] + frame.radii)[inside])
    return top


def flank(frame: GrainFrame, low: float, high: float, diameter: float) -> float:
    """Inclination (degrees, positive where the surface falls along x) of the straight line through the surface in cells one `diameter`
    wide, from x = 0 on, whose middles lie between `low` and `high` (m). The highest grain of each cell counts, as in a silhouette."""
    edges = diameter * np.arange(math.floor(low / diameter), math.ceil(high / diameter) + 1, dtype=np.float64)
    middles, tops = 0.5 * (edges[1:] + edges[:-1]), surface(frame, edges)
    chosen = (middles > low) & (middles < high)
    slope = np.polyfit(middles[chosen], tops[chosen], 1)[0]
    return -math.degrees(math.atan(slope))


def front(frame: GrainFrame, depth: float, diameter: float) -> float:
    """m, place along x at which a deposit that begins at x = 0, `depth` (m) along y, ends: where the solid volume over the area of a
    strip two diameters wide first falls below EDGE. Single grains that rolled farther do not count."""
    order = np.argsort(frame.positions[:, 0])
    x = frame.positions[order, 0]
    volume = np.concatenate([[0.0], np.cumsum(4.0 / 3.0 * np.pi * frame.radii[order] ** 3)])
    places = np.arange(diameter, x[-1] + 3.0 * diameter, 0.05 * diameter)
    low, high = (np.searchsorted(x, places + side * diameter) for side in (-1.0, 1.0))
    covered = (volume[high] - volume[low]) / (2.0 * diameter * depth) >= EDGE * diameter
    return float(places[np.argmin(covered)])


def behind(places: Array, masses: Array, share: float) -> float:
    """Place (m) up to which `share` of the mass lies, of grains at `places` (n,) in m with `masses` (n,) in kg."""
    order = np.argsort(places)
    part = np.cumsum(masses[order]) / masses.sum()
    return float(places[order[np.searchsorted(part, share)]])


def column_height(first: GrainFrame, last: GrainFrame, reach: float) -> float:
    """m, height of the deposit `last` next to the wall x = 0: that of the column `first`, twice that of its centre of mass, times the ratio
    of the volumes within `reach` (m) of the wall, in which what the wall does to the packing cancels."""
    near = [float((frame.radii[frame.positions[:, 0] < reach] ** 3).sum()) for frame in (first, last)]
    return height(first) * near[1] / near[0]


def height(frame: GrainFrame) -> float:
    """m, of a level bed on z = 0: twice that of its centre of mass."""
    return float(2.0 * np.average(frame.positions[:, 2], weights=frame.masses))


def at_rest(frame: GrainFrame, gravity: float, diameter: float) -> bool:
    """Whether the mean kinetic energy of translation of the grains is below REST."""
    energy = 0.5 * frame.masses @ (frame.velocities**2).sum(axis=1)
    return bool(energy < REST * frame.masses.sum() * gravity * diameter)


def power_law(points: Sequence[tuple[float, float]], place: float | None = None) -> Estimate:
    """Measured `points` (x, y) by the straight line through their logarithms: y at `place`, or the exponent when there is none, with the
    95 % interval that their scatter gives the line; inf for fewer than three points."""
    x, y = np.log(np.asarray(points, float)).T
    if len(x) < 3:
        slope, offset = np.polyfit(x, y, 1)
        return Estimate(float(slope) if place is None else math.exp(slope * math.log(place) + offset), math.inf, "two points")
    line, reach, basis = linregress(x, y), student(len(x) - 2), f"scatter of {len(x)} measured points"
    if place is None:
        return Estimate(float(line.slope), reach * float(line.stderr), basis)
    away, value = math.log(place) - float(x.mean()), math.exp(line.slope * math.log(place) + line.intercept)
    return Estimate(value, value * reach * float(line.stderr) * math.hypot(float(x.std()), away), basis)
