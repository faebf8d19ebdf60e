"""Discharge of a bin: a dilute column above a bottom with a slot, the gate below that, and the steps of output."""

import math

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rectangle, time_step, window


def setup(p: Parameters) -> Setup:
    """Settling, then frames from the moment on at which the gate begins to drop; it stops above the floor that catches the grains."""
    step = time_step(p)
    settle_steps = math.ceil(p.settle_time / step)
    stride = math.ceil(p.discharge_time / step / (p.frames - 1))
    steps = window(settle_steps - stride, stride, p.frames)
    d_max, depth = packing.largest(p), (0.0, p.bin_depth, 0.0)
    sites, height = packing.slab(p, p.bin_width, p.bin_depth, 0.15 * d_max, foot=0.15 * d_max)
    box = [(-d_max, p.bin_width + d_max), (0.0, p.bin_depth), (-p.fall - 2.0 * d_max, height + 2.0 * d_max)]
    left, right = 0.5 * (p.bin_width - p.outlet_width), 0.5 * (p.bin_width + p.outlet_width)
    # Panels about as wide as the period is deep, for LIGGGHTS cannot place elements that are much larger than the period.
    bottom = np.vstack([_strip(0.0, left, p.bin_depth, depth), _strip(right, p.bin_width, p.bin_depth, depth)])
    drop_steps = math.ceil((p.fall - 2.0 * d_max) / (p.gate_speed * step))
    numbers = {"settle_steps": settle_steps, "drop_steps": drop_steps, "outlet_left": left, "outlet_right": right}
    return Setup(steps["steps"], step, packing.grains(p, sites, box), {**steps, **contacts(p), **numbers},
                 {"bottom": bottom, "lid": _strip(left, right, p.bin_depth, depth)})


def _strip(low: float, high: float, width: float, depth: tuple[float, float, float]) -> packing.Array:
    """Triangles (n, 3, 3) in m of the plane z = 0 between two x, in panels of about a `width`."""
    panels = max(1, round((high - low) / width))
    side = (high - low) / panels
    return np.vstack([rectangle((low + side * k, 0.0, 0.0), (side, 0.0, 0.0), depth) for k in range(panels)])
