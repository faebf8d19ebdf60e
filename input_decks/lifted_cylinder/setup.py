"""Lifted cylinder: a dilute column in a cylinder on a plate with a rim, the lift of the cylinder, and the steps of output."""

import math

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Array, Parameters, Setup, contacts, rectangle, revolved, rows_and_frames, time_step

# Sides of the polygons that cylinder and rim are, and height of the rim in largest diameters.
SIDES, RIM = 48, 4.0


def setup(p: Parameters) -> Setup:
    """The plate is z = 0, the cylinder stands on it about the z axis; it begins to rise at the first frame. 20 rows of time.csv between two
    frames."""
    step, d_max = time_step(p), packing.largest(p)
    lift = p.aspect_ratio * p.cylinder_radius + 2.0 * p.grain_diameter
    lift_time = lift / p.lift_speed
    output = rows_and_frames(step, p.settle_time, lift_time + p.rest_time, p.frames)
    start = output["first"] * step
    places, top = sites(p, d_max)
    half = p.plate_radius / math.cos(math.pi / SIDES) + d_max
    grains = packing.grains(p, places, [(-half, half), (-half, half), (-d_max, top + lift + d_max)])
    words = ("uniform", "velocity", "0", "0", f"{p.lift_speed:.17g}", "start", f"{start:.17g}", "until", f"{start + lift_time:.17g}")
    side = 2.0 * (half - 0.5 * d_max)
    pan = np.concatenate([rectangle((-0.5 * side, -0.5 * side, 0.0), (side, 0.0, 0.0), (0.0, side, 0.0)),
                          tube(p.plate_radius, RIM * d_max, p.grain_diameter)])
    meshes = {"cylinder": tube(p.cylinder_radius, top, p.grain_diameter), "pan": pan}
    numbers = {**output, "lift_time": lift_time, "poured": p.grain_count, **contacts(p, skin=0.3)}
    return Setup(output["steps"], step, grains, numbers, meshes, {"motion_words": words})


def tube(radius: float, height: float, diameter: float) -> Array:
    """Triangles (n, 3, 3) in m of a polygon on z = 0 in which a circle of `radius` (m) fits."""
    corner = radius / math.cos(math.pi / SIDES)
    return revolved([(corner, 0.0), (corner, height)], SIDES, 10.0 * diameter)


def sites(p: Parameters, d_max: float) -> tuple[Array, float]:
    """Sites (n, 3) in m in the cylinder, 1.3 times more than grains, 0.7 d_max or more from plate and wall; and their top (m)."""
    inside, spacing, low = p.cylinder_radius - 0.7 * d_max, 1.15 * d_max, 0.7 * d_max
    layers = math.ceil(1.3 * p.grain_count / len(packing.cylinder(inside, spacing, low, 1)))
    return packing.cylinder(inside, spacing, low, layers), low + layers * spacing
