"""Oedometer: a layer between two plates, and the steps of the load and of the output."""

import math

from dembark.input_decks.common.plates import layer
from dembark.input_decks.common.setup import Parameters, Setup, contacts, time_step

# Rows of time.csv between two frames.
ROWS = 40


def setup(p: Parameters) -> Setup:
    """The plate comes down and rests under the smallest load; then the load is doubled `octaves` times, rests for
    as long as a doubling takes, and is halved as often."""
    step, compressed = time_step(p), layer(p, 0.0)
    each = p.frames // (2 * p.octaves + 1)
    stride = ROWS * math.ceil(p.octave_time / step / (ROWS * each))
    start, octave_steps = math.ceil((compressed.fall + p.rest_time) / step), stride * each
    steps, peak = start + (2 * p.octaves + 1) * octave_steps, start + p.octaves * octave_steps
    numbers = {"first": start + stride, "stride": stride, "every": stride // ROWS, "steps": steps, "start_step": start,
               "octave_steps": octave_steps, "peak_step": peak, "fall_step": peak + octave_steps}
    return Setup(steps, step, compressed.packing, {**numbers, **compressed.numbers, **contacts(p, skin=0.3)})
