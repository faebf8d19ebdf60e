"""Log pile: rows of logs of unequal diameters above the ground, between two stakes."""

import math

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, strides


def setup(p: Parameters) -> Setup:
    """Places with a log each, none touching: 0.2 of the largest radius between two, of which the shift takes a half."""
    output = strides(p.duration, p.time_step, p.frames - 1)
    largest = p.radius * (1.0 + p.radius_spread)
    level, columns = 2.2 * largest, math.floor(p.width / (2.2 * largest))
    rows = math.ceil(p.log_count / columns)
    number = np.arange(1, p.log_count + 1)
    size, x, y = (2.0 * packing.uniform(number, p.seed, use) - 1.0 for use in (1, 2, 3))
    radii = p.radius * (1.0 + p.radius_spread * size)
    places = packing.lattice((columns, rows, 1), (p.width / columns, level, 0.0), (-0.5 * p.width, 0.0, 0.0))[: p.log_count]
    places += 0.05 * largest * np.column_stack((x, y, np.zeros(p.log_count)))
    box = [(-p.width, p.width), (-p.width, (rows + 2) * level), (-p.width, p.width)]
    logs = packing.bodies(box, places, radii, p.density * math.pi * radii**2 * p.log_length)
    return Setup(output["steps"], p.time_step, logs, {**output, "half": 0.5 * p.width})
