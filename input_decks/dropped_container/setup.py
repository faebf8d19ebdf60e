"""Dropped container: a dilute column of grains in a cylinder that is held over a plate, and the steps at which it is let go and lands."""

import math

import numpy as np

from dembark.common.errors import DembarkError
from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Array, Parameters, Setup, rectangle, revolved, time_step

# Diameters between the sphere that lands and the floor of the vessel: no grain comes near.
GAP = 2.0
# Steps that the container's contact with the plate lasts at least, and rows of time.csv in it.
SHORTEST, ROWS = 50, 5


def setup(p: Parameters) -> Setup:
    """The plate is at z = 0. The container is a sphere of the size of a grain that has its mass, the last body, of type 2."""
    d = p.grain_diameter
    lasts = landing(p)
    step = min(time_step(p), lasts / SHORTEST)
    every = math.floor(lasts / ROWS / step)
    fall = math.sqrt(2.0 * p.drop_height / p.gravity)
    # Down, and up and down again as far as the empty container would.
    flight = 2.0 * p.steel_restitution * fall
    stride = every * math.ceil(1.05 * (fall + flight) / (p.frames * every * step))
    release = every * math.ceil(p.settle_time / step / every)
    floor = p.drop_height + (1.0 + GAP) * d
    places, top = sites(p, floor)
    # A grain that meets the floor on its way up is faster than both.
    upward = (p.steel_restitution + p.grain_steel_restitution * (1.0 + p.steel_restitution)) * p.gravity * fall
    airborne = min(1.05 * flight, upward / p.gravity)
    reach, rim = p.container_radius + d, top + airborne * (upward - 0.5 * p.gravity * airborne)
    grains = packing.grains(p, places, [(-reach, reach), (-reach, reach), (-d, rim + d)])
    body = grains.joined(np.array([[0.0, 0.0, p.drop_height + 0.5 * d]]), d, p.container_mass / (math.pi / 6.0 * d**3), 2)
    numbers = {"every": every, "stride": stride, "first": release + stride, "release": release, "skin": 0.2 * d, "wet": 0,
               "floor": floor, "rim": rim + 2.0 * d, "start": p.drop_height + 0.5 * d,
               "grain_mass": grains.volume * p.grain_density}
    return Setup(release + stride * p.frames, step, body, numbers, {"vessel": vessel(p, floor, rim)})


def landing(p: Parameters) -> float:
    """Duration (s) of the container's contact with the plate by Hertz, without damping: delta^(5/2) = 15 m v^2 / (16 E* sqrt(R)),
    T = 2.9433 delta / v; K. L. Johnson, Contact Mechanics (1985) section 11.4. DembarkError where it gives way too far."""
    radius, modulus = 0.5 * p.grain_diameter, 0.5 * p.steel_youngs_modulus / (1.0 - p.steel_poisson_ratio**2)
    speed = math.sqrt(2.0 * p.gravity * p.drop_height)
    depth = (15.0 * p.container_mass * speed**2 / (16.0 * modulus * math.sqrt(radius))) ** 0.4
    if depth > 0.5 * radius:
        raise DembarkError(f"the container gives way by {depth:.3g} m when it lands, half of the radius on which it lands and more",
                           "raise steel_youngs_modulus")
    return 2.9433 * depth / speed


def sites(p: Parameters, floor: float) -> tuple[Array, float]:
    """Sites (n, 3) in m, 1.3 times more than grains, 0.7 d_max or more from the vessel; and their top (m)."""
    largest = packing.largest(p)
    inside, spacing = p.container_radius - 0.7 * largest, 1.15 * largest
    layer = len(packing.cylinder(inside, spacing, 0.0, 1))
    layers = max(1, math.ceil(1.3 * p.grain_count / layer))
    return packing.cylinder(inside, spacing, floor + 0.7 * largest, layers), floor + layers * spacing


def vessel(p: Parameters, floor: float, rim: float) -> Array:
    """Triangles (n, 3, 3) in m of the cylinder's floor and side, a polygon in which a circle of `container_radius` fits."""
    radius = p.container_radius / math.cos(math.pi / p.sides)
    side = revolved([(radius, floor), (radius, rim)], p.sides, 10.0 * p.grain_diameter)
    return np.concatenate([rectangle((-radius, -radius, floor), (2.0 * radius, 0.0, 0.0), (0.0, 2.0 * radius, 0.0)), side])
