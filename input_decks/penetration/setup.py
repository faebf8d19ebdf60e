"""Penetration: a bed of equal grains in a box, and a ball above it that is shot down."""

import math

import numpy as np

from dembark.common.errors import DembarkError
from dembark.input_decks.common.deposit import deposit
from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Parameters, Setup


def setup(p: Parameters) -> Setup:
    """Grains are of type 1, the ball, the last body, of type 2; a row of time.csv each 0.2 ms, the first frame with the
    last row before the ball touches. The run begins `lead` before that, with the ball where its free fall has brought it by then.
    """
    radius, length, width = 0.5 * p.grain_diameter, p.box_length, p.box_width
    bed = radius * deposit(p.grain_count, (length / radius, width / radius), p.deposit_choices, p.seed)
    corner = np.array([-0.5 * length, -0.5 * width, p.floor])
    places = np.vstack([corner + bed, (0.0, 0.0, p.ball_height)])
    bed_top = places[:-1, 2].max() + radius
    gap = p.ball_height - 0.5 * p.ball_diameter - bed_top
    if gap < p.grain_diameter:
        raise DembarkError("the ball starts in the bed or on it", f"the bed reaches up to z = {bed_top:.4g} m", "raise ball_height")
    touch = (math.sqrt(p.ball_speed**2 + 2.0 * p.gravity * gap) - p.ball_speed) / p.gravity
    # A hair more or less than needed: round-off does not decide how many steps there are.
    every = math.ceil(2e-4 / p.time_step - 1e-6)
    row = every * p.time_step
    start = row * max(0, int((touch - p.lead) / row))
    first = every * int((touch - start) / row + 1e-6)
    stride = every * max(1, math.ceil((p.duration - start - first * p.time_step) / ((p.frames - 1) * row) - 1e-6))
    places[-1, 2] -= p.ball_speed * start + 0.5 * p.gravity * start**2
    count = p.grain_count
    velocities = np.zeros((count + 1, 3))
    velocities[-1, 2] = -p.ball_speed - p.gravity * start
    margin = p.grain_diameter
    # Grains are thrown up, at most twice as fast as the ball came.
    top = p.ball_height + p.ball_diameter + 2.0 * p.ball_speed * p.duration
    box = np.column_stack([corner - margin, (margin - corner[0], margin - corner[1], top)])
    packing = Packing(box, places, np.append(np.full(count, p.grain_diameter), p.ball_diameter),
                      np.append(np.full(count, p.grain_density), p.steel_density), np.append(np.ones(count, np.int64), 2), velocities)
    # A wide skin: with the ball the cells of the neighbour search are ten grains wide, so lists are dear, and the ball is fast.
    return Setup(first + stride * (p.frames - 1), p.time_step, packing,
                 {"every": every, "first": first, "stride": stride, "skin": 0.5 * p.grain_diameter, "start": start})
