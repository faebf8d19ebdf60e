"""Drive power: a dilute bed above a plate in a periodic box, and the steps of output at fixed phases of the drive."""

import math
from dataclasses import replace

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.motion import amplitude, motion
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rectangle, strip
from dembark.input_decks.common.vibration import fixed_phases, highest_speed, suitable_step


def setup(p: Parameters) -> Setup:
    """The bed falls on the plate at rest, for full periods; then the amplitude grows, stays, and with `rest_periods` falls again."""
    frequency, d_max = p.motion_frequency, packing.largest(p)
    still = math.ceil(p.settle_time * frequency)
    start = still + p.motion_ramp + p.run_in
    stop = (math.ceil(start) + p.periods) / frequency if p.rest_periods else None
    moving = motion(p, start=still / frequency, until=stop)
    step, numbers = fixed_phases(frequency, suitable_step(p, highest_speed(p)), start, p.periods)
    period, held = numbers["period_steps"], numbers["steps"]
    if p.rest_periods:
        numbers["steps"] = held + (math.ceil(p.motion_ramp) + p.rest_periods) * period
    sites, height = packing.slab(p, p.cell_width, p.cell_depth, margin=0.0, foot=0.15 * d_max, rows=p.dimensions == 2)
    beyond = d_max if p.sides == "walls" else 0.0
    box = [(-beyond, p.cell_width + beyond), (-beyond, p.cell_depth + beyond), (-amplitude(p) - 2.0 * d_max, height + p.headroom)]
    grains = packing.grains(p, sites, box)
    if p.dimensions == 2:
        grains = replace(grains, positions=grains.positions * [1, 0, 1] + [0, 0.5 * p.cell_depth, 0])
    plate = strip((0.0, 0.0, 0.0), (p.cell_width, 0.0, 0.0), p.cell_depth)
    if p.sides == "walls":
        plate = np.vstack((plate, tube(p.cell_width, p.cell_depth, height + p.headroom - amplitude(p))))
    more = {"begin": still * period, "held": held}
    return Setup(numbers["steps"], step, grains, {**numbers, **more, **contacts(p, skin=0.2)}, {"plate": plate},
                 {"motion_words": moving.words})


def tube(width: float, depth: float, height: float) -> packing.Array:
    """Four side walls as triangles (n, 3, 3) in m, from z = 0 up, in panels four times as high as the tube is wide, for most of a gas is
    low: more of them cost time to move, fewer are near more grains."""
    count = max(1, round(height / (4.0 * width)))
    up, x, y = height / count, (width, 0.0, 0.0), (0.0, depth, 0.0)
    walls = (((0.0, 0.0), y), ((width, 0.0), y), ((0.0, 0.0), x), ((0.0, depth), x))
    return np.vstack([rectangle((*corner, up * k), side, (0.0, 0.0, up)) for corner, side in walls for k in range(count)])
