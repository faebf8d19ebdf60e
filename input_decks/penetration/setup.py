"""Penetration: a bed of equal grains in a box, and a ball above it that is shot down."""

import math
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from dembark.common.errors import DembarkError
from dembark.input_decks.common.packing import Array, Packing, drag, uniform
from dembark.input_decks.common.setup import Parameters, Setup

# Centres (25 000, 3) of the published grains, in units of 0.1 nm.
PUBLIC = Path(__file__).with_name("reference") / "packing_25k.npy"


def setup(p: Parameters) -> Setup:
    """Grains are of type 1; the decks add the ball, the last body, of type 2. A row of time.csv each 0.2 ms. Steps count from the published
    start on, when the ball is at `ball_height`; a bed that settles does so in `fall_steps` of `soft_step` (s) and `relax_steps` before."""
    places = cloud(p) if p.bed == "settled" else 1e-10 * np.load(PUBLIC)
    top = places[:, 2].max() + 0.5 * p.grain_diameter
    if p.ball_height - 0.5 * p.ball_diameter - top < p.grain_diameter:
        raise DembarkError("the ball starts among the grains or on them", f"they reach up to z = {top:.4g} m at first", "raise ball_height")
    # A hair more or less than needed: round-off does not decide how many steps there are.
    every = math.ceil(2e-4 / p.time_step - 1e-6)
    first = every * int(p.first_frame / (every * p.time_step) + 1e-6)
    stride = every * max(1, math.ceil((p.duration - first * p.time_step) / ((p.frames - 1) * every * p.time_step) - 1e-6))
    soft_step = p.time_step * math.sqrt(p.youngs_modulus / p.soft_modulus)
    reach = np.array([0.5 * p.box_length, 0.5 * p.box_width]) + p.grain_diameter
    # Grains are thrown up, at most twice as fast as the ball came.
    heights = p.floor - p.grain_diameter, p.ball_height + p.ball_diameter + 2.0 * p.ball_speed * p.duration
    packing = Packing(np.array([(-reach[0], reach[0]), (-reach[1], reach[1]), heights]), places, np.full(len(places), p.grain_diameter),
                      np.full(len(places), p.grain_density), np.ones(len(places), np.int64))
    # A wide skin: with the ball the cells of the neighbour search are ten grains wide, so lists are dear, and the ball is fast.
    return Setup(first + stride * (p.frames - 1), p.time_step, packing,
                 {"every": every, "first": first, "stride": stride, "skin": 0.5 * p.grain_diameter, "soft_step": soft_step,
                  "fall_steps": math.ceil(p.fall_time / soft_step), "relax_steps": math.ceil(p.relax_time / p.time_step),
                  "drag": drag(p, p.time_step)})


def cloud(p: Parameters) -> Array:
    """Centres (n, 3) in m of grains that lie at random above the floor, without a contact: those that overlap an earlier one move on."""
    count, d = p.grain_count, p.grain_diameter
    height = count * math.pi / 6.0 * d**3 / (p.cloud_fraction * p.box_length * p.box_width)
    low = np.array([-0.5 * p.box_length, -0.5 * p.box_width, p.floor])
    sides = np.array([p.box_length, p.box_width, height])
    places, moved = np.empty((count, 3)), np.arange(count)
    draw = 0
    while len(moved):
        numbers = moved + 1 + draw * count
        places[moved] = low + 0.5 * d + (sides - d) * np.column_stack([uniform(numbers, p.seed, use) for use in (1, 2, 3)])
        moved = np.unique(cKDTree(places).query_pairs(1.001 * d, output_type="ndarray").max(axis=1, initial=0))
        moved = moved[moved > 0]
        draw += 1
    return places
