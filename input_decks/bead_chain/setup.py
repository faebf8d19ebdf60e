"""Bead chain: spheres that touch, side by side along x, and the time that the wave needs."""

import math

import numpy as np

from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, strides, time_step


def setup(p: Parameters) -> Setup:
    """The wave gets to the end of the row but for a tenth, by an estimate of its speed from that of the first sphere."""
    d, count = p.grain_diameter, p.grain_count
    mass = p.grain_density * math.pi / 6.0 * d**3
    stiffness = hertz(p)
    # The largest force is about that of two spheres that meet at this speed.
    force = stiffness * (1.25 * 0.5 * mass * p.hit_speed**2 / stiffness) ** 0.6
    speed = 0.9 * d * stiffness ** (1.0 / 3.0) * force ** (1.0 / 6.0) / math.sqrt(mass)
    output = strides(0.9 * count * d / speed, time_step(p), p.frames)
    places = np.column_stack([d * (np.arange(count) + 0.5), np.zeros(count), np.zeros(count)])
    speeds = np.zeros((count, 3))
    speeds[0, 0] = p.hit_speed
    room = 4.0 * d
    box = np.array([(-room, count * d + room), (-room, room), (-room, room)])
    bodies = Packing(box, places, np.full(count, d), np.full(count, p.grain_density), np.ones(count, np.int64), speeds)
    numbers = {**output, "first": output["stride"], "stiffness": stiffness, "mass": mass, **contacts(p, skin=0.2)}
    return Setup(output["steps"], time_step(p), bodies, numbers)


def hertz(p: Parameters) -> float:
    """k (N/m^1.5) of two equal spheres, F = k overlap^1.5: 4/3 E* sqrt(R*)."""
    modulus = 0.5 * p.youngs_modulus / (1.0 - p.poisson_ratio**2)
    return float(4.0 / 3.0 * modulus * math.sqrt(0.25 * p.grain_diameter))
