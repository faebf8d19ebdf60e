"""Rotating drum: grains on a dense lattice all over the cross-section, which fall when the drum begins to turn, and the steps of output."""

import math

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rectangle, time_step, window


def setup(p: Parameters) -> Setup:
    """Run-in and measuring window; the axis is z, gravity points along -y. The wall of a lined drum is out of the grains' reach."""
    step = time_step(p)
    steps = window(math.ceil(p.run_in / step), math.ceil(p.measure_time / step / p.frames), p.frames)
    d_max, lined = packing.largest(p), p.wall_lining == "grains"
    shell = p.drum_radius + 1.5 * p.grain_diameter * lined
    half = shell + d_max
    closed, inside = p.ends == "walls", p.drum_radius - 0.65 * d_max
    # Grains at the end walls have room for their shift, too.
    room, margin = (0.6 * d_max, d_max) if closed else (0.0, 0.0)
    box = [(-half, half), (-half, half), (-margin, p.drum_depth + margin)]
    sites = close_packing(inside, p.drum_depth, 1.15 * d_max, room)
    bodies = packing.grains(p, sites, box)
    if lined:
        bodies = bodies.joined(lining(p), p.grain_diameter, p.grain_density, 2)
    meshes = {"ends": np.vstack([rectangle((-shell, -shell, z), (2.0 * shell, 0.0, 0.0), (0.0, 2.0 * shell, 0.0))
                                 for z in (0.0, p.drum_depth)])} if closed else {}
    return Setup(steps["steps"], step, bodies, {**steps, **contacts(p), "shell_radius": shell}, meshes)


def close_packing(radius: float, depth: float, spacing: float, room: float = 0.0) -> packing.Array:
    """Points (n, 3) in m within `radius` (m) of the z axis, which are at least `spacing` (m) apart, with the period `depth` (m) along z;
    or, with `room` (m), that far or farther from the ends z = 0 and z = `depth`. Layers of a face-centred lattice: stretched along z to
    fit, or compressed along z and stretched across, whichever holds more."""
    span = depth - 2.0 * room
    fewest = int(math.sqrt(2.0) * span / spacing)
    if room > 0.0:
        fitting = [(gaps + 1, span / gaps, room) for gaps in (fewest, fewest + 1)]
    else:
        # Every other layer is the same, so a period has an even number of them.
        fitting = [(count, span / count, 0.5 * span / count) for count in (fewest - fewest % 2, fewest - fewest % 2 + 2)]
    return max((_layers(count, height, first, radius, spacing) for count, height, first in fitting if 2.0 * height >= spacing), key=len)


def _layers(count: int, height: float, first: float, radius: float, spacing: float) -> packing.Array:
    side = math.sqrt(max(0.5 * spacing**2, spacing**2 - height**2))
    reach = math.ceil(radius / side)
    plane = np.arange(-reach, reach + 1)
    k, j, i = (axis.ravel() for axis in np.meshgrid(np.arange(count), plane, plane, indexing="ij"))
    kept = ((i + j + k) % 2 == 0) & (side * np.hypot(i, j) <= radius)
    return np.column_stack((side * i, side * j, first + height * k))[kept]


def lining(p: Parameters) -> packing.Array:
    """Places (n, 3) in m of the grains on the wall: rings along the axis, every other one turned by half a grain, about 1.1 d apart."""
    radius, rows = p.drum_radius + 0.5 * p.grain_diameter, 2 * max(1, round(p.drum_depth / (2.2 * p.grain_diameter)))
    around = int(2.0 * math.pi * radius / (1.1 * p.grain_diameter))
    k, i = (axis.ravel() for axis in np.meshgrid(np.arange(rows), np.arange(around), indexing="ij"))
    turn = 2.0 * math.pi / around * (i + 0.5 * (k % 2))
    return np.column_stack((radius * np.cos(turn), radius * np.sin(turn), p.drum_depth / rows * (k + 0.5)))
