"""Liquid exchange: five grains of different sizes in a row between two walls, their paths, and the liquid that they begin with."""

import math

import numpy as np

from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Parameters, Setup, strides

DENSITY = 2500.0


def setup(p: Parameters) -> Setup:
    """Grains begin in the middle of their paths; the left wall is at x = 0, and grains 1 and 4 are wet."""
    output = strides(p.duration, p.time_step, p.rows)
    diameters = p.grain_diameter * np.array([1.0, 0.7, 1.2, 0.8, 1.0])
    gap = p.gap * p.grain_diameter
    middles = gap * np.arange(1, 6) + np.cumsum(diameters) - 0.5 * diameters
    end = 6.0 * gap + float(diameters.sum())
    low, high = -2.0 * p.grain_diameter, end + 2.0 * p.grain_diameter
    grains = Packing(np.array([(low, high)] * 3), np.column_stack((middles, np.zeros((5, 2)))), diameters, np.full(5, DENSITY),
                     np.ones(5, np.int64), type_count=1)
    wet = p.liquid_content * 4.0 / 3.0 * math.pi * (0.5 * diameters) ** 3 * [1, 0, 0, 1, 0]
    # No bridge holds a cubic metre: that is no limit.
    numbers = {**output, "end": end, "reach": p.amplitude * p.grain_diameter, "skin": 0.5 * p.grain_diameter,
               "largest_bridge": p.max_bridge or 1.0}
    return Setup(output["steps"], p.time_step, grains, numbers,
                 tables={"periods": tuple(p.period * part for part in (1.0, 1.37, 0.83, 1.61, 1.13)), "volumes": tuple(wet.tolist())})
