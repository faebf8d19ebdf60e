"""Plug flow: a dilute column above a plate between two walls, which may have grains glued to them, and the steps of its output."""

import math

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rectangle, time_step, window


def setup(p: Parameters) -> Setup:
    """Settling, the plate's run-in and the measuring window. Box and glued grains reach as far down as the plate sinks."""
    step = time_step(p)
    settle_steps = math.ceil(p.settle_time / step)
    run_in_steps = math.ceil(p.run_in * p.grain_diameter / (p.base_speed * step))
    steps = window(settle_steps + run_in_steps, math.ceil(p.travel * p.grain_diameter / (p.base_speed * step * p.frames)), p.frames)
    d_max, rough = packing.largest(p), p.wall_roughness == "rough"
    # Glued grains are as wide as the mean grain and centred up to 0.1 of that off the wall.
    margin = 0.15 * d_max + (0.6 * p.grain_diameter if rough else 0.0)
    # Room for a front and a rear wall, within the cells of the column and outside of the channel.
    inset, outside = (0.15 * d_max, d_max) if p.ends == "walls" else (0.0, 0.0)
    sites, height = packing.slab(p, p.channel_width, p.channel_depth - 2.0 * inset, margin, foot=0.15 * d_max)
    sites[:, 1] += inset
    low = -p.base_speed * step * (steps["steps"] - settle_steps) - 2.0 * d_max
    box = [(-d_max, p.channel_width + d_max), (-outside, p.channel_depth + outside), (low, height + 2.0 * d_max)]
    bodies = packing.grains(p, sites, box)
    if rough:
        bodies = bodies.joined(glued_places(p, low, height), p.grain_diameter, p.grain_density, 2)
    # The plate stops short of glued grains, which a mesh wall pushes in any group; the gap lets no grain through.
    ends = (0.62 * p.grain_diameter, p.channel_width - 0.62 * p.grain_diameter) if rough else box[0]
    plate = rectangle((ends[0], 0.0, 0.0), (ends[1] - ends[0], 0.0, 0.0), (0.0, p.channel_depth, 0.0))
    return Setup(steps["steps"], step, bodies, {**steps, **contacts(p, skin=0.3), "settle_steps": settle_steps}, {"plate": plate})


def glued_places(p: Parameters, low: float, high: float) -> packing.Array:
    """Places (n, 3) in m of the walls' grains, left and right in turn: 1.1 d apart in the wall's plane, up to d/10 off it."""
    columns, rise = int(p.channel_depth / (1.1 * p.grain_diameter)), 1.1 * p.grain_diameter
    first = math.ceil(low / rise - 0.5)
    counts = (2, columns, math.floor(high / rise - 0.5) + 1 - first)
    # The middles of two cells across are the walls.
    cell = (p.channel_width, p.channel_depth / columns, rise)
    places = packing.lattice(counts, cell, (-0.5 * p.channel_width, 0.0, first * rise))
    places[:, 0] += 0.2 * p.grain_diameter * (packing.uniform(p.grain_count + np.arange(1, len(places) + 1), p.seed, 2) - 0.5)
    return places
