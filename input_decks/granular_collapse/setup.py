"""Granular collapse: a dilute column on a floor of glued grains between a back wall and a gate, and the steps of its output."""

import math

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rows_and_frames, strip, time_step


def setup(p: Parameters) -> Setup:
    """The gate leaves at the first frame and stops at the far end of the floor; 20 rows of time.csv between two frames. The level of the
    floor, z = 0, is that of the tops of the glued grains in the mean."""
    step, d, d_max = time_step(p), p.grain_diameter, packing.largest(p)
    fall = math.sqrt(p.aspect_ratio * p.column_width / p.gravity)
    output = rows_and_frames(step, p.settle_time * fall, p.collapse_time * fall, p.frames)
    sites, height = packing.slab(p, p.column_width, p.column_depth, margin=0.15 * d_max, foot=0.1 * d + 0.15 * d_max)
    # 1.5 times as far as columns of glass beads run out.
    floor = p.column_width * (1.0 + 1.5 * min(1.8 * p.aspect_ratio, 2.3 * p.aspect_ratio ** (2.0 / 3.0))) + 10.0 * d
    speed = 2.0 * p.aspect_ratio * p.column_width / fall
    opened = math.floor((floor - p.column_width) / (speed * step))
    top = height + 2.0 * d_max
    bodies = packing.grains(p, sites, [(-d_max, floor + 4.0 * d), (0.0, p.column_depth), (-2.0 * d, top)])
    bodies = bodies.joined(glued_places(p, floor), d, p.grain_density, 2)
    # The gate ends above the glued grains, which it would push; the gap lets no grain through.
    foot = 0.15 * d
    gate = strip((p.column_width, 0.0, foot), (0.0, 0.0, top - foot), p.column_depth)
    numbers = {**output, "gate_speed": speed, "opened": output["first"] + opened, "base": -0.5 * d}
    return Setup(output["steps"], step, bodies, {**numbers, **contacts(p, skin=0.4)}, {"gate": gate})


def glued_places(p: Parameters, far: float) -> packing.Array:
    """Places (n, 3) in m of the floor's grains from x = 0 to `far`: 1.1 d apart in the plane, tops up to d/10 off the level z = 0."""
    d = p.grain_diameter
    columns = int(p.column_depth / (1.1 * d))
    counts = (math.ceil(far / (1.1 * d)), columns, 1)
    places = packing.lattice(counts, (1.1 * d, p.column_depth / columns, d), (0.0, 0.0, -d))
    places[:, 2] += 0.2 * d * (packing.uniform(p.grain_count + np.arange(1, len(places) + 1), p.seed, 2) - 0.5)
    return places
