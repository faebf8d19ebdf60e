"""Plane silo: a dilute column above the floor between two walls, and the steps of its output."""

import math

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, time_step, window


def setup(p: Parameters) -> Setup:
    """Settling, then the measuring window; walls and floor are 0.15 d_max from the cells of the column."""
    step = time_step(p)
    steps = window(math.ceil(p.settle_time / step), math.ceil(p.measure_time / step / p.frames), p.frames)
    d_max = packing.largest(p)
    sites, height = packing.slab(p, p.silo_width, p.slab_depth, margin=0.15 * d_max, foot=0.15 * d_max)
    box = [(-d_max, p.silo_width + d_max), (0.0, p.slab_depth), (-d_max, height + 2.0 * d_max)]
    return Setup(steps["steps"], step, packing.grains(p, sites, box), {**steps, **contacts(p)})
