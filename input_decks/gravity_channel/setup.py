"""Gravity-driven channel: a dilute column between two walls, compressed to the channel's solid fraction; steps of the output."""

from __future__ import annotations

import math
from types import SimpleNamespace

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Setup, contacts, time_step, window


def setup(p: SimpleNamespace) -> Setup:
    """Compression along the flow, run-in, and the measuring window; the period along the flow follows from the volume of all grains."""
    step, fall_time = time_step(p), math.sqrt(p.channel_width / p.gravity)
    pack_steps = math.ceil(p.pack_time * math.sqrt(p.grain_diameter / p.gravity) / step)
    run_in_steps = math.ceil(p.run_in * fall_time / step)
    # The walls' friction is only steady in the mean, hence many rows.
    steps = window(pack_steps + run_in_steps, math.ceil(p.measure * fall_time / (step * p.frames)), p.frames, rows=10000)
    # As many grains as fill the channel to solid_fraction: a diameter uniform within the spread s has <d^3> = d^3 (1 + s^2).
    area = p.channel_width * p.channel_depth
    mean = math.pi / 6.0 * p.grain_diameter**3 * (1.0 + p.grain_diameter_spread**2)
    count = math.floor(p.solid_fraction * area * p.channel_length / mean + 0.5)
    d_max = packing.largest(p)
    sites, height = packing.slab(p, p.channel_width, p.channel_depth, margin=0.15 * d_max, foot=0.0, count=count)
    box = [(-d_max, p.channel_width + d_max), (0.0, p.channel_depth), (0.0, height)]
    grains = packing.grains(p, sites, box, count)
    period = grains.volume / (p.solid_fraction * area)
    numbers = {"pack_steps": pack_steps, "period": period, "squeeze": math.log(period / height) / (pack_steps * step),
               "start_velocity": -p.start_speed * math.sqrt(p.gravity * p.channel_width)}
    # Fast grains: a wide skin keeps the neighbour lists longer.
    return Setup(steps["steps"], step, grains, {**steps, **contacts(p, skin=0.4), **numbers})
