"""Rotating drum: grains on a dense lattice all over the cross-section, which fall when the drum begins to turn, and the steps of output."""

import math

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, time_step, window


def setup(p: Parameters) -> Setup:
    """Run-in and measuring window; the axis is z, gravity points along -y. The wall of a lined drum is out of the grains' reach."""
    step = time_step(p)
    steps = window(math.ceil(p.run_in / step), math.ceil(p.measure_time / step / p.frames), p.frames)
    d_max, lined = packing.largest(p), p.wall_lining == "grains"
    shell = p.drum_radius + 1.5 * p.grain_diameter * lined
    half = shell + d_max
    box = [(-half, half), (-half, half), (0.0, p.drum_depth)]
    inside = p.drum_radius - 0.65 * d_max
    bodies = packing.grains(p, close_packed(inside, p.drum_depth, 1.15 * d_max), box)
    if lined:
        bodies = bodies.joined(lining(p), p.grain_diameter, p.grain_density, 2)
    return Setup(steps["steps"], step, bodies, {**steps, **contacts(p), "shell_radius": shell})


def close_packed(radius: float, depth: float, spacing: float) -> packing.Array:
    """Points (n, 3) in m within `radius` (m) of the z axis, which are at least `spacing` (m) apart, with the period `depth` (m) along z.

    Layers of a face-centred lattice: stretched along z to fit the period, or compressed along z and stretched across, whichever holds more.
    """
    fewest = 2 * int(depth / (math.sqrt(2.0) * spacing))
    return max((_layers(count, radius, depth, spacing) for count in (fewest, fewest + 2) if 2.0 * depth >= count * spacing), key=len)


def _layers(count: int, radius: float, depth: float, spacing: float) -> packing.Array:
    height = depth / count
    side = math.sqrt(max(0.5 * spacing**2, spacing**2 - height**2))
    reach = math.ceil(radius / side)
    plane = np.arange(-reach, reach + 1)
    k, j, i = (axis.ravel() for axis in np.meshgrid(np.arange(count), plane, plane, indexing="ij"))
    kept = ((i + j + k) % 2 == 0) & (side * np.hypot(i, j) <= radius)
    return np.column_stack((side * i, side * j, height * (k + 0.5)))[kept]


def lining(p: Parameters) -> packing.Array:
    """Places (n, 3) in m of the grains on the wall: rings along the axis, every other one turned by half a grain, about 1.1 d apart."""
    radius, rows = p.drum_radius + 0.5 * p.grain_diameter, 2 * max(1, round(p.drum_depth / (2.2 * p.grain_diameter)))
    around = int(2.0 * math.pi * radius / (1.1 * p.grain_diameter))
    k, i = (axis.ravel() for axis in np.meshgrid(np.arange(rows), np.arange(around), indexing="ij"))
    turn = 2.0 * math.pi / around * (i + 0.5 * (k % 2))
    return np.column_stack((radius * np.cos(turn), radius * np.sin(turn), p.drum_depth / rows * (k + 0.5)))
