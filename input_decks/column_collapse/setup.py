"""Column collapse: a dilute column between a back wall and a gate, and the steps of its output."""

import math

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rows_and_frames, strip, time_step


def setup(p: Parameters) -> Setup:
    """A row of time.csv every `every` steps, a frame every 20 rows; the gate begins to move at a row, which is the first frame."""
    step = time_step(p)
    output = rows_and_frames(step, p.settle_time, p.collapse_time, p.frames)
    d_max = packing.largest(p)
    sites, height = packing.slab(p, p.column_width, p.column_depth, margin=0.15 * d_max, foot=0.15 * d_max)
    # The box reaches as far as the gate gets.
    far, top = p.column_width + p.gate_speed * step * (output["steps"] - output["first"]) + 2.0 * d_max, height + 2.0 * d_max
    grains = packing.grains(p, sites, [(-d_max, far), (0.0, p.column_depth), (-2.0 * d_max, top)])
    gate = strip((p.column_width, 0.0, -d_max), (0.0, 0.0, top + d_max), p.column_depth)
    # Steps until the gate has its speed.
    numbers = {**output, "ramp": math.ceil(p.gate_speed / (p.gate_acceleration * step))}
    # A thicker skin than the bridges need pays while the gate moves.
    return Setup(output["steps"], step, grains, {**numbers, **contacts(p, skin=0.2)}, {"gate": gate})
