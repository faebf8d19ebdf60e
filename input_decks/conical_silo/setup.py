"""Conical silo: a dilute column of grains in a closed silo, its walls as triangles, and the steps of the filling and of the output."""

import math
from types import SimpleNamespace

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Array, Parameters, Setup, rectangle, revolved, time_step

# The grains fall with this modulus (Pa) and fraction of the Rayleigh time.
FILLING = {"youngs_modulus": 5e6, "time_step_fraction": 0.2}
# Bulk over grain density, and constants of the law of Beverloo, for how long the silo takes.
FRACTION, C, K = 0.6, 0.58, 1.4


def setup(p: Parameters) -> Setup:
    """The middle of the lip is the origin. A row of time.csv each 10 ms or more often; frames in the first half of the run."""
    modulus, (places, top) = p.youngs_modulus / p.softening, sites(p)
    step, soft_step = (time_step(SimpleNamespace(**{**vars(p), **given})) for given in ({"youngs_modulus": modulus}, FILLING))
    duration = 1.3 * emptying(p) if p.duration is None else p.duration
    rows = 20 * p.frames * math.ceil(max(duration / 0.01, 200) / (20 * p.frames))
    every = math.ceil(duration / rows / step)
    stride = every * (rows // (2 * p.frames))
    around = p.barrel_radius + p.grain_diameter
    grains = packing.grains(p, places, [(-around, around), (-around, around), (-p.drop, top + 2.0 * p.grain_diameter)])
    fill_steps = math.ceil((math.sqrt(2.0 * top / p.gravity) + p.settle_time) / soft_step)
    numbers = {"modulus": modulus, "soft_modulus": FILLING["youngs_modulus"], "soft_step": soft_step, "fill_steps": fill_steps,
               "relax_steps": math.ceil(p.relax_time / step), "drag": packing.drag(p, step), "every": every, "first": every,
               "stride": stride, "last": every + stride * (p.frames - 1), "skin": 0.4 * p.grain_diameter}
    lines = [(p.lip_radius, 0.0), (p.barrel_radius, p.barrel_radius - p.lip_radius), (p.barrel_radius, top + p.grain_diameter)]
    corner, side = 1.1 * p.lip_radius, 2.2 * p.lip_radius
    meshes = {"shell": revolved(lines, p.sides, 5.0 * p.grain_diameter),
              "lid": rectangle((-corner, -corner, 0.0), (side, 0.0, 0.0), (0.0, side, 0.0))}
    return Setup(every * rows, step, grains, numbers, meshes)


def emptying(p: Parameters) -> float:
    """Time (s) after which the silo is empty, by the law of Beverloo."""
    opening = 2.0 * p.lip_radius - K * p.grain_diameter
    return p.grain_count * math.pi / 6.0 * p.grain_diameter**3 / (C * FRACTION * math.sqrt(p.gravity) * opening**2.5)


def sites(p: Parameters) -> tuple[Array, float]:
    """Sites (n, 3) in m, the lowest first, 1.3 times more than grains, 0.7 d or more inside of cone and barrel; and their top (m)."""
    spacing, low = 1.15 * p.grain_diameter, 0.7 * p.grain_diameter
    inside, count = p.barrel_radius - low, math.ceil(1.3 * p.grain_count)
    layers = math.ceil((count * spacing**2 / (math.pi * inside**2) + p.barrel_radius / spacing) * 1.05) + 2
    places = packing.cylinder(inside, spacing, low, layers)
    places = places[np.hypot(places[:, 0], places[:, 1]) <= p.lip_radius + places[:, 2] - math.sqrt(2.0) * low][:count]
    return places, float(places[-1, 2] + spacing)
