"""Gravity-driven channel: a dilute column between two walls, compressed to the channel's solid fraction; steps of the output."""

import math

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, time_step, window


def setup(p: Parameters) -> Setup:
    """Compression along the flow, run-in, and the measuring window; the period along the flow follows from the volume of all grains."""
    step, fall_time = time_step(p), math.sqrt(p.channel_width / p.gravity)
    pack_steps = math.ceil(p.pack_time * math.sqrt(p.grain_diameter / p.gravity) / step)
    run_in_steps = math.ceil(p.run_in * fall_time / step)
    # The walls' friction is only steady in the mean: many rows.
    steps = window(pack_steps + run_in_steps, math.ceil(p.measure * fall_time / (step * p.frames)), p.frames, rows=10000)
    d_max = packing.largest(p)
    sites, height = packing.slab(p, p.channel_width, p.channel_depth, margin=0.15 * d_max, foot=0.0)
    box = [(-d_max, p.channel_width + d_max), (0.0, p.channel_depth), (0.0, height)]
    grains = packing.grains(p, sites, box)
    period = grains.volume / (p.solid_fraction * (p.channel_width * p.channel_depth))
    numbers = {"pack_steps": pack_steps, "period": period, "squeeze": math.log(period / height) / (pack_steps * step),
               "start_velocity": -p.start_speed * math.sqrt(p.gravity * p.channel_width)}
    # Fast grains: a wide skin keeps the neighbour lists longer.
    return Setup(steps["steps"], step, grains, {**steps, **contacts(p, skin=0.4), **numbers})
