"""Bead chain: spheres that touch, side by side along x, or rows of them in a hexagonal layer, and the time that the wave needs."""

import math

import numpy as np

from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, strides, time_step


def setup(p: Parameters) -> Setup:
    """Bodies and output of a row or a layer."""
    return row(p) if p.columns == 1 else layer(p)


def row(p: Parameters) -> Setup:
    """The wave gets to the end of the row but for a tenth, by an estimate of its speed from that of the first sphere."""
    d, count = p.grain_diameter, p.grain_count
    mass, stiffness = sphere_mass(p), hertz(p)
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


def layer(p: Parameters) -> Setup:
    """Rows of spheres along z, one after another along x, all contacts with the same overlap; the first half of the rows has the speed
    along x. Of the fronts that leave both ends of that half, those that go one way meet those of the other after a quarter of all rows."""
    apart, rows = p.grain_diameter - p.overlap, p.grain_count
    number, place = (axis.ravel() for axis in np.meshgrid(np.arange(rows), np.arange(p.columns), indexing="ij"))
    step = 0.5 * math.sqrt(3.0) * apart
    places = np.column_stack([step * (number + 0.5), np.zeros(len(number)), apart * (place + 0.25 + 0.5 * (number % 2))])
    speeds = np.zeros_like(places)
    speeds[number < rows // 2, 0] = p.hit_speed
    room = 4.0 * p.grain_diameter
    box = np.array([(0.0, rows * step), (-room, room), (0.0, p.columns * apart)])
    count = len(number)
    bodies = Packing(box, places, np.full(count, p.grain_diameter), np.full(count, p.grain_density), np.ones(count, np.int64), speeds)
    output = strides(0.23 * rows / row_frequency(p), time_step(p), p.frames)
    numbers = {**output, "first": output["stride"], "row_frequency": row_frequency(p), **contacts(p, skin=0.2)}
    return Setup(output["steps"], time_step(p), bodies, numbers)


def row_frequency(p: Parameters) -> float:
    """Omega (rad/s) of rows in a layer, omega = 2 Omega |sin(q/2)| for a phase q from row to row. A sphere has two neighbours in either of
    the rows next to its own, at 30 degrees to x: Omega^2 = 2 (K cos^2 - (F/a) sin^2) / m with the contacts' stiffness K, force F and
    length a."""
    force = hertz(p) * p.overlap**1.5
    return math.sqrt(2.0 * (0.75 * 1.5 * force / p.overlap - 0.25 * force / (p.grain_diameter - p.overlap)) / sphere_mass(p))


def sphere_mass(p: Parameters) -> float:
    """kg, of a sphere."""
    return float(p.grain_density * math.pi / 6.0 * p.grain_diameter**3)


def hertz(p: Parameters) -> float:
    """k (N/m^1.5) of two equal spheres, F = k overlap^1.5: 4/3 E* sqrt(R*)."""
    modulus = 0.5 * p.youngs_modulus / (1.0 - p.poisson_ratio**2)
    return float(4.0 / 3.0 * modulus * math.sqrt(0.25 * p.grain_diameter))
