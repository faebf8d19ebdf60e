"""The packing at the start, and the steps of the output: once for all engines."""

import math

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, time_step, window


def setup(p: Parameters) -> Setup:
    """A dilute column above the floor at z = 0; positions and diameters change with the seed."""
    step, d_max = time_step(p), packing.largest(p)
    steps = window(math.ceil(p.settle_time / step), math.ceil(p.measure_time / step / p.frames), p.frames)
    sites, height = packing.slab(p, p.box_width, p.box_width, margin=0.0, foot=0.15 * d_max)
    box = [(0.0, p.box_width), (0.0, p.box_width), (-d_max, height + 2.0 * d_max)]
    return Setup(steps["steps"], step, packing.grains(p, sites, box), {**steps, **contacts(p)})
