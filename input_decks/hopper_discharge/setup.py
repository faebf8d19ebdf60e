"""Discharge of a bin: a dilute column above a bottom with a slot, the gate below that, and the steps of output."""

import math

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, strip, time_step, window


def setup(p: Parameters) -> Setup:
    """Settling, then frames from the moment on at which the gate begins to drop; it stops above the floor that catches the grains."""
    step = time_step(p)
    settle_steps = math.ceil(p.settle_time / step)
    stride = math.ceil(p.discharge_time / step / (p.frames - 1))
    steps = window(settle_steps - stride, stride, p.frames)
    d_max = packing.largest(p)
    # Room for a front and a rear wall, within the cells of the column and outside of the bin.
    margin, outside = (0.15 * d_max, d_max) if p.ends == "walls" else (0.0, 0.0)
    sites, height = packing.slab(p, p.bin_width, p.bin_depth - 2.0 * margin, 0.15 * d_max, foot=0.15 * d_max)
    box = [(-d_max, p.bin_width + d_max), (-outside, p.bin_depth + outside), (-p.fall - 2.0 * d_max, height + 2.0 * d_max)]
    left, right = 0.5 * (p.bin_width - p.outlet_width), 0.5 * (p.bin_width + p.outlet_width)
    bottom = np.vstack([strip((low, 0.0, 0.0), (left, 0.0, 0.0), p.bin_depth) for low in (0.0, right)])
    drop_steps = math.ceil((p.fall - 2.0 * d_max) / (p.gate_speed * step))
    numbers = {"settle_steps": settle_steps, "drop_steps": drop_steps, "outlet_left": left, "outlet_right": right}
    if p.rolling_length is not None:
        # The coefficients refer to the effective radius: d/4 of two equal grains, d/2 of a grain and a wall.
        numbers |= {"grain_rolling": 4.0 * p.rolling_length / p.grain_diameter, "wall_rolling": 2.0 * p.rolling_length / p.grain_diameter}
    # Beads that fall are fast: a wide skin keeps the neighbour lists longer.
    beads = packing.grains(p, sites + np.array([0.0, margin, 0.0]), box)
    return Setup(steps["steps"], step, beads, {**steps, **contacts(p, skin=0.4), **numbers},
                 {"bottom": bottom, "lid": strip((left, 0.0, 0.0), (right - left, 0.0, 0.0), p.bin_depth)})
