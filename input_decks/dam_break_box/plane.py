"""The same dam break in the plane, with a box as wide as the tank, where finer particles are cheap and theory knows the face of the box.

`python -m dembark.input_decks.dam_break_box.plane 28 56` prints the mean pressures at P1 to P4 from 0.7 to 0.8 s with so many particles
over the depth of the column, next to a jet as deep as the water at the gauge H2 before the box, turned by a plate whose edge it leaves
without pressure.
"""

from __future__ import annotations

import math
import sys

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

from dembark.physics import SphFluid
from dembark.physics.sph import lattice, tank_walls
from dembark.postproc.measurement import Array

from .pressures import kernel
from .sensors import FACE, GAUGES

# The experiment (m): column, way to the face of the box, its sides, tank; heights of P1 to P4.
LENGTH, DEPTH, WAY, BOX, TANK, HIGH = 1.228, 0.55, 1.1675, 0.161, 3.22, 1.4
HEIGHTS = np.array(FACE)
# Of the mean (s), where the flow has become steady.
WINDOW = (0.7, 0.8)
GRAVITY, DENSITY, SMOOTHING = 9.81, 1000.0, 1.3


def turned(depth: float, edge: float) -> tuple[float, Array, Array]:
    """A jet of that `depth` (m) along a floor, and a plate from the floor to its `edge` (m) that turns it, without gravity: the angle by
    which it is turned, heights (m) on the plate, and 1 − (u/U)² there, U being the speed of the jet.

    By a hodograph: on the plate u/U = s, and y(s) follows from sources of the jet at ±1 and of its end at ±exp(±iα), where the angle α
    makes y(1) the edge. For a depth without bound it is G. Kirchhoff's plate, J. reine angew. Math. 70 (1869) 289.
    """
    s = np.linspace(0.0, 1.0, 20001)

    def height(angle: float) -> Array:
        c = math.cos(2.0 * angle)
        slope = 1.0 / (1.0 + s**2) - (s**2 + c) / (s**4 + 2.0 * c * s**2 + 1.0)
        return np.asarray(4.0 * depth / math.pi * cumulative_trapezoid(slope, s, initial=0.0))

    angle = brentq(lambda one: float(height(one)[-1]) - edge, 0.01, 0.5 * math.pi - 1e-3)
    return angle, height(angle), 1.0 - s**2


def expected(lowest: float, depth: float) -> Array:
    """Pressures (Pa, 4) by theory that goes with `lowest` (Pa) at P1: Bernoulli's, with the speed of the jet at the height of the edge."""
    slow = np.interp(HEIGHTS, *turned(depth, BOX)[1:])
    weight, lost = DENSITY * GRAVITY, 1.0 - slow
    # p + ρ g z + (1 − slow) (head − ρ g edge) = head, at P1.
    head = (lowest + weight * (HEIGHTS[0] - lost[0] * BOX)) / (1.0 - lost[0])
    return np.asarray(head - weight * HEIGHTS - lost * (head - weight * BOX))


def simulated(number: int) -> tuple[Array, float]:
    """Mean pressures (Pa, 4) and depth of the water (m) with `number` particles over the depth of the column."""
    dx = DEPTH / number
    h, front = SMOOTHING * dx, round(LENGTH / dx) * dx
    face = front + WAY
    water = SphFluid(lattice([0, 0], [front, DEPTH], dx), spacing=dx, sound_speed=20.0 * math.sqrt(GRAVITY * DEPTH), alpha=0.02,
                     gravity=[0, -GRAVITY])
    water.add_wall(tank_walls([0, 0], [math.ceil(TANK / dx) * dx, math.ceil(HIGH / dx) * dx], dx))
    inside = (np.arange(round(BOX / dx)) + 0.5) * dx
    water.add_wall(np.stack([part.ravel() for part in np.meshgrid(face + inside, BOX - inside)], axis=1))
    water.run(WINDOW[0])
    gauge = front + GAUGES["H2"]
    rows = []
    while water.time < WINDOW[1]:
        water.run(0.002)
        places = water.positions[:, :2]
        near = np.abs(places[:, 0] - face) < 2.0 * h
        x, head = places[near], water.pressures[near] + DENSITY * GRAVITY * places[near, 1]
        weights = kernel(np.hypot(x[:, 0] - face, x[:, 1] - HEIGHTS[:, None]), h)
        depth = np.count_nonzero(np.abs(places[:, 0] - gauge) < 2.0 * dx) * dx / 4.0
        rows.append([*(weights @ head / weights.sum(axis=1) - DENSITY * GRAVITY * HEIGHTS), depth])
    *pressures, depth = np.mean(rows, axis=0)
    return np.array(pressures), float(depth)


def main() -> None:
    """Print a line for each of the numbers of particles that are given."""
    for number in map(int, sys.argv[1:]):
        found, depth = simulated(number)
        print(f"{number}: {' '.join(f'{one:.0f}' for one in found)} Pa at P1 to P4, water {1e3 * depth:.0f} mm deep; "
              f"theory {' '.join(f'{one:.0f}' for one in expected(found[0], depth))} Pa")


if __name__ == "__main__":
    main()
