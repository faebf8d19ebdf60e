"""Silo: a dilute column above the floor of a cylinder, and the steps of its output."""

import math

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, time_step, window


def setup(p: Parameters) -> Setup:
    """Sites of a cubic lattice, 1.3 times more than grains; no grain touches another or a wall, even when it is shifted: neighbours are
    0.15 d_max apart, and so are walls. With a skin this wide few steps of the rain need new neighbour lists."""
    step = time_step(p)
    steps = window(math.ceil(p.settle_time / step), math.ceil(p.measure_time / step / p.frames), p.frames)
    d_max = packing.largest(p)
    spacing, low, half = 1.15 * d_max, 0.7 * d_max, p.cylinder_radius + d_max
    inside = p.cylinder_radius - low
    layers = math.ceil(1.3 * p.grain_count * spacing**2 / (math.pi * inside**2)) + 2
    box = [(-half, half), (-half, half), (-d_max, low + layers * spacing + 4.0 * d_max)]
    grains = packing.grains(p, packing.cylinder(inside, spacing, spacing, layers), box)
    return Setup(steps["steps"], step, grains, {**steps, **contacts(p, skin=0.3)})
