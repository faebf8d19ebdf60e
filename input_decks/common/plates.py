"""A dilute layer of grains between two plates of glued grains, for decks with plates.in."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from . import packing
from .packing import Array, Packing
from .setup import Parameters

# Solid fraction by which the height of the dense layer is estimated.
DENSE = 0.6


@dataclass(frozen=True)
class Layer:
    """A layer, periodic along x and y, above a plate at z = 0: `packing` with the velocities of the upper plate, `numbers` for the decks,
    `height` (m) of the dense layer, and `fall` (s), in which the upper plate comes down to it under its load."""

    packing: Packing
    numbers: dict[str, float | int]
    height: float
    fall: float


def dense_height(p: Parameters) -> float:
    """Height (m) of the layer at the solid fraction DENSE."""
    volume = p.grain_count * math.pi / 6.0 * p.grain_diameter**3 * (1.0 + p.grain_diameter_spread**2)
    return float(volume / (DENSE * p.cell_length * p.cell_width))


def layer(p: Parameters, speed: float) -> Layer:
    """Grains of p.grain_count on p.cell_length x p.cell_width under p.normal_stress; the upper plate moves along x with `speed` (m/s)."""
    d, d_max, area = p.grain_diameter, packing.largest(p), p.cell_length * p.cell_width
    # Glued grains reach up to half a diameter and a tenth from their plate.
    clear = 0.6 * d + 0.1 * d_max
    sites, top = packing.slab(p, p.cell_length, p.cell_width, margin=0.0, foot=clear)
    lid, height = clear + top + 0.6 * d, dense_height(p)
    # The plate takes the dilute layer along: twice the time of half of its mass under the load.
    fall = 2.0 * math.sqrt((lid - height) * DENSE * height * p.grain_density / p.normal_stress)
    grains = packing.grains(p, sites, [(0.0, p.cell_length), (0.0, p.cell_width), (-2.0 * d, lid + 2.0 * d)])
    lower, upper = plate(p, 0.0, 5), plate(p, lid, 6)
    bodies = grains.joined(np.vstack([lower, upper]), d, p.grain_density, 2)
    velocities = np.zeros_like(bodies.positions)
    velocities[-len(upper):, 0] = speed
    first, count = p.grain_count + 1, len(lower)
    numbers = {"lower_first": first, "lower_last": first + count - 1, "upper_first": first + count, "upper_last": first + 2 * count - 1,
               "area": area, "shear_speed": speed, "grain_load": p.normal_stress * area / count}
    return Layer(replace(bodies, velocities=velocities), numbers, height, fall)


def plate(p: Parameters, height: float, use: int) -> Array:
    """Places (n, 3) in m of the glued grains of a plate at `height` (m): at most 1.1 d apart, so that no grain is pressed through, and up
    to d/10 above and below it."""
    rows = [math.ceil(length / (1.1 * p.grain_diameter)) for length in (p.cell_length, p.cell_width)]
    places = packing.lattice((rows[0], rows[1], 1), (p.cell_length / rows[0], p.cell_width / rows[1], 1.0), (0.0, 0.0, height - 0.5))
    places[:, 2] += 0.2 * p.grain_diameter * (packing.uniform(np.arange(1, len(places) + 1), p.seed, use) - 0.5)
    return places
