"""Bulk density: a dilute bed above a plate in a periodic box, the taps of the plate, and the steps of output."""

import math

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, strip, time_step

# Rows of time.csv from tap to tap.
ROWS = 50


def setup(p: Parameters) -> Setup:
    """The grains fall and rest; then a tap follows the other. Frames are of the beds at rest, before each tap and after the last one."""
    step, d_max = time_step(p), packing.largest(p)
    stride = ROWS * math.ceil((4.0 * p.pulse_time + p.rest_time) / step / ROWS)
    every = stride // ROWS
    first = every * math.ceil(p.settle_time / step / every)
    taps = [word for number in range(p.taps) for word in tap(p, (first + number * stride) * step)]
    sites, height = packing.slab(p, p.cell_length, p.cell_width, margin=0.0, foot=0.15 * d_max)
    # Four pulses: up, to rest, down, to rest; a plate that has speeded up flings grains up.
    speed = 2.0 / math.pi * p.tap_gamma * p.gravity * p.pulse_time
    reach = 2.0 * speed * p.pulse_time
    top = height + reach + 0.5 * (2.0 * speed) ** 2 / p.gravity + 2.0 * d_max
    grains = packing.grains(p, sites, [(0.0, p.cell_length), (0.0, p.cell_width), (-reach - 2.0 * d_max, top)])
    numbers = {"first": first, "stride": stride, "every": every, "steps": first + p.taps * stride,
               "area": p.cell_length * p.cell_width}
    plate = strip((0.0, 0.0, 0.0), (p.cell_length, 0.0, 0.0), p.cell_width)
    return Setup(numbers["steps"], step, grains, {**numbers, **contacts(p, skin=0.3)}, {"plate": plate}, {"motion_words": tuple(taps)})


def tap(p: Parameters, start: float) -> tuple[str, ...]:
    """Words of a motion: from `start` (s) on the plate rises, stops, and comes back."""
    return ("jolts", "shape", "half_sine", "acceleration", "0", "0", f"{p.tap_gamma * p.gravity:.17g}", "duration", f"{p.pulse_time:.17g}",
            "interval", f"{p.pulse_time:.17g}", "count", "4", "signs", "+--+", "start", f"{start:.17g}")
