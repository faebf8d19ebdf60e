"""Vibrating screen: grains of two sizes above bars across y, in a bin with a pan, one layer with its centres at y = 0."""

import math
from dataclasses import replace

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.motion import amplitude, motion
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rectangle
from dembark.input_decks.common.vibration import fixed_phases, highest_speed, suitable_step


def setup(p: Parameters) -> Setup:
    """Grains fall on the screen at rest; then the amplitude grows, and the frames begin."""
    frequency, width = p.motion_frequency, p.slots * p.pitch
    still = math.ceil(p.settle_time * frequency)
    moving = motion(p, start=still / frequency)
    speed, reach = highest_speed(p), amplitude(p)
    step, numbers = fixed_phases(frequency, suitable_step(p, speed), still + math.ceil(p.motion_ramp), p.periods, rows=2)
    biggest = packing.largest(p) * p.oversize_ratio
    margin = 0.15 * biggest
    sites, height = packing.slab(p, width, biggest, margin, foot=margin + reach, rows=1, size=biggest)
    # Grains thrown off the surface fly no higher than this.
    top = height + 2.0 * margin + 4.0 * reach + 0.5 * (2.0 * speed) ** 2 / p.gravity
    box = [(-biggest, width + biggest), (-biggest, biggest), (-p.drop - biggest, top + biggest)]
    grains = packing.grains(p, sites, box)
    oversize = packing.rank(p.grain_count, p.seed) < round(p.oversize_part * p.grain_count)
    grains = replace(grains, positions=grains.positions * [1, 0, 1], diameters=np.where(oversize, p.oversize_ratio, 1.0) * grains.diameters)
    # A grain below this is through, wherever the screen is.
    found = {**numbers, **contacts(p, skin=0.2), "width": width, "below": -reach - 0.5 * packing.largest(p)}
    return Setup(numbers["steps"], step, grains, found, {"screen": screen(p, biggest), "bin": bin_walls(p, width, top, biggest)},
                 {"motion_words": moving.words})


def screen(p: Parameters, half: float) -> packing.Array:
    """Bars in the plane z = 0 as triangles (n, 3, 3) in m, -`half` < y < `half` (m); half a bar at either end, and slots between them."""
    edges = p.pitch * np.arange(p.slots + 1)
    low, high = np.maximum(edges - 0.5 * p.bar_width, 0.0), np.minimum(edges + 0.5 * p.bar_width, edges[-1])
    return np.vstack([rectangle((a, -half, 0.0), (b - a, 0.0, 0.0), (0.0, 2.0 * half, 0.0)) for a, b in zip(low, high, strict=True)])


def bin_walls(p: Parameters, width: float, top: float, half: float) -> packing.Array:
    """Pan and side walls as triangles (n, 3, 3) in m; normals point inwards."""
    across, rise = (0.0, 2.0 * half, 0.0), (0.0, 0.0, top + p.drop)
    pan = rectangle((0.0, -half, -p.drop), (width, 0.0, 0.0), across)
    sides = rectangle((0.0, -half, -p.drop), across, rise), rectangle((width, -half, -p.drop), rise, across)
    return np.vstack([pan, *sides])
