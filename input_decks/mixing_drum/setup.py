"""Mixing drum: two sorts of grains one above the other in a drum of even sides, and the steps of the filling and of the output."""

import math
from dataclasses import replace

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Array, Parameters, Setup, of_sort, rectangle, revolved, time_step

SORTS = ("small", "large")
# While the grains fall: Young's moduli of the source over those of the run, and the step over the Rayleigh time.
FILLING = {"softening": 100.0, "time_step_fraction": 0.2}
# Seconds from one row of time.csv to the next.
ROW = 0.01


def setup(p: Parameters) -> Setup:
    """Steps count from the moment on at which the drum begins to turn; a row of time.csv each 10 ms, evenly spaced frames."""
    soft = Parameters(**{**vars(p), **FILLING})
    every = math.ceil(ROW / least_step(p))
    step, soft_step, rows = ROW / every, least_step(soft), round(p.duration / ROW)
    small, large = packings(p)
    grains = replace(small.joined(large.positions, p.large_diameter, p.large_density, 3), type_count=3)
    fill_steps = math.ceil((math.sqrt(4.0 * p.drum_radius / p.gravity) + p.settle_time) / soft_step)
    moduli = {f"{sort}_{name}": getattr(p, f"{sort}_youngs_modulus") / one.softening for sort in SORTS
              for name, one in (("modulus", p), ("soft_modulus", soft))}
    numbers = {**moduli, "soft_step": soft_step, "fill_steps": fill_steps, "relax_steps": math.ceil(p.relax_time / step),
               "drag": packing.drag(of_sort(p, "small"), step), "every": every, "first": every,
               "stride": every * max(1, rows // p.frames), "skin": 0.5 * p.small_diameter}
    turning = ("rotation", "point", 0.0, 0.0, 0.0, "axis", 0.0, -1.0, 0.0, "rate", p.drum_speed)
    return Setup(every * rows, step, grains, numbers, {"drum": drum(p)}, {"motion_words": turning})


def least_step(p: Parameters) -> float:
    """The shorter of the time steps (s) of both sorts."""
    sorts = [of_sort(p, sort) for sort in SORTS]
    return min(time_step(Parameters(**{**vars(one), "youngs_modulus": one.youngs_modulus / p.softening})) for one in sorts)


def drum(p: Parameters) -> Array:
    """Triangles (n, 3, 3) in m of the polygon about y, a corner at z = 0, and of its end plates."""
    half, wide = 0.5 * p.drum_width, 1.01 * p.drum_radius
    shell = revolved([(p.drum_radius, -half), (p.drum_radius, half)], p.sides, 3.0 * p.large_diameter)[..., [0, 2, 1]]
    ends = [rectangle((-wide, y, -wide), (2.0 * wide, 0.0, 0.0), (0.0, 0.0, 2.0 * wide)) for y in (-half, half)]
    return np.vstack([shell, *ends])


def packings(p: Parameters) -> tuple[packing.Packing, packing.Packing]:
    """Small grains above large ones, without a contact, in the drum and its box."""
    reach, half = p.drum_radius + p.large_diameter, 0.5 * p.drum_width + p.large_diameter
    box = [(-reach, reach), (-half, half), (-reach, reach)]
    places, top = sites(p, p.large_diameter, p.large_count, -p.drum_radius)
    large = packing.grains(of_sort(p, "large"), places, box)
    places, _ = sites(p, p.small_diameter, p.small_count, top)
    return packing.grains(of_sort(p, "small"), places, box), large


def sites(p: Parameters, diameter: float, count: int, low: float) -> tuple[Array, float]:
    """Sites (n, 3) in m from the height `low` (m) on, the lowest first, 1.15 times more than grains, 0.7 d or more inside of the walls; and
    the height (m) of their upper end."""
    spacing, margin = 1.15 * diameter, 0.7 * diameter
    inside, half = p.drum_radius * math.cos(math.pi / p.sides) - margin, 0.5 * p.drum_width - margin
    across = np.arange(-math.floor(inside / spacing), math.floor(inside / spacing) + 1) * spacing
    along = np.linspace(-half, half, math.floor(2.0 * half / spacing) + 1)
    up = np.arange(low + 0.5 * spacing, inside, spacing)
    packing.require_room(len(up) * len(along) * len(across), spacing)
    z, y, x = (axis.ravel() for axis in np.meshgrid(up, along, across, indexing="ij"))
    places = np.column_stack((x, y, z))[np.hypot(x, z) <= inside][:math.ceil(1.15 * count)]
    return places, float(places[-1, 2]) + 0.5 * spacing if len(places) else low
