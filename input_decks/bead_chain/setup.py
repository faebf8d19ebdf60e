"""Bead chain: spheres that touch, side by side along x, or planes of them in a lattice, and the time that the wave needs."""

import math
from typing import NamedTuple

import numpy as np

from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Array, Parameters, Setup, contacts, strides, time_step


class Lattice(NamedTuple):
    """Planes of spheres across x, which lie in each other's hollows in turn: the contacts of a sphere with those of the next plane, and the
    cosine of the angle between these contacts and x."""

    contacts: int
    cosine: float


# fcc along [001], hcp along [0001]; long waves along [111] of fcc are as fast as these.
LATTICES = {"row": Lattice(1, 1.0), "hexagonal": Lattice(2, math.sqrt(3.0 / 4.0)), "fcc": Lattice(4, math.sqrt(1.0 / 2.0)),
            "hcp": Lattice(3, math.sqrt(2.0 / 3.0))}


def setup(p: Parameters) -> Setup:
    """With an overlap of the contacts the first half of the planes has the speed along x. Of the fronts that leave both ends of that half,
    those that go one way meet those of the other after a quarter of all planes. Without, the first plane has it, and the wave gets to the
    end of the bed but for a tenth, by an estimate of its speed from that of the first plane."""
    apart, planes = p.grain_diameter - p.overlap, p.grain_count
    spacing = LATTICES[p.lattice].cosine * apart
    across, shift, sides = plane(p.lattice, p.columns, apart)
    number, place = (axis.ravel() for axis in np.meshgrid(np.arange(planes), np.arange(len(across)), indexing="ij"))
    tangential = across[place] + (number % 2)[:, None] * shift
    places = np.column_stack([spacing * (number + 0.5), np.mod(tangential, sides, out=tangential, where=sides > 0.0)])
    speeds = np.zeros_like(places)
    speeds[number < (planes // 2 if p.overlap else 1), 0] = p.hit_speed
    room = 4.0 * p.grain_diameter
    box = np.array([(0.0, planes * spacing) if p.overlap else (-room, planes * spacing + room),
                    *((0.0, side) if side else (-room, room) for side in sides)])
    count, stiffness = len(number), plane_stiffness(p)
    bodies = Packing(box, places, np.full(count, p.grain_diameter), np.full(count, p.grain_density), np.ones(count, np.int64), speeds)
    numbers = {"stiffness": stiffness, "mass": sphere_mass(p), "spacing": spacing}
    if p.overlap:
        numbers["row_frequency"] = row_frequency(p)
        lasts = 0.23 * planes / row_frequency(p)
    else:
        # The largest force is about that of two planes that meet at this speed.
        force = stiffness * (1.25 * 0.5 * sphere_mass(p) * p.hit_speed**2 / stiffness) ** 0.6
        lasts = 0.9 * planes / (0.9 * stiffness ** (1.0 / 3.0) * force ** (1.0 / 6.0) / math.sqrt(sphere_mass(p)))
    output = strides(lasts, time_step(p), p.frames)
    return Setup(output["steps"], time_step(p), bodies, {**output, "first": output["stride"], **numbers, **contacts(p, skin=0.2)})


def plane(lattice: str, columns: int, apart: float) -> tuple[Array, Array, Array]:
    """Places (n, 2) along y and z in m of the spheres of a plane, `apart` (m) from each other; how far (2,) the next plane is shifted; and
    periods (2,), 0 along an axis with one sphere."""
    if lattice == "row":
        return np.zeros((1, 2)), np.zeros(2), np.zeros(2)
    if lattice == "hexagonal":
        z = apart * (np.arange(columns) + 0.25)
        return np.column_stack([0.0 * z, z]), np.array([0.0, 0.5 * apart]), np.array([0.0, columns * apart])
    i, k = (axis.ravel() for axis in np.meshgrid(np.arange(columns), np.arange(columns), indexing="ij"))
    if lattice == "fcc":
        return (np.column_stack([apart * (i + 0.25), apart * (k + 0.25)]), np.array([0.5 * apart, 0.5 * apart]),
                np.array([columns * apart, columns * apart]))
    high = math.sqrt(0.75) * apart
    return (np.column_stack([apart * (i + 0.25 + 0.5 * (k % 2)), high * (k + 0.25)]), np.array([0.5 * apart, high / 3.0]),
            np.array([columns * apart, columns * high]))


def row_frequency(p: Parameters) -> float:
    """Omega (rad/s) of planes that are pressed together, omega = 2 Omega |sin(q/2)| for a phase q from plane to plane. A sphere has n
    contacts with either of the planes next to its own, at an angle to x: Omega^2 = n (K cos^2 - (F/a) sin^2) / m with the contacts'
    stiffness K, force F and length a."""
    number, cosine = LATTICES[p.lattice]
    force = hertz(p) * p.overlap**1.5
    across = force / (p.grain_diameter - p.overlap) * (1.0 - cosine**2)
    return math.sqrt(number * (1.5 * force / p.overlap * cosine**2 - across) / sphere_mass(p))


def plane_stiffness(p: Parameters) -> float:
    """k (N/m^1.5) of two planes, F = k u^1.5 a sphere when they get closer by u from where they touch: each of the n contacts overlaps by
    u cos, and presses along x with cos of its force."""
    number, cosine = LATTICES[p.lattice]
    return number * cosine**2.5 * hertz(p)


def sphere_mass(p: Parameters) -> float:
    """kg, of a sphere."""
    return float(p.grain_density * math.pi / 6.0 * p.grain_diameter**3)


def hertz(p: Parameters) -> float:
    """k (N/m^1.5) of two equal spheres, F = k overlap^1.5: 4/3 E* sqrt(R*)."""
    modulus = 0.5 * p.youngs_modulus / (1.0 - p.poisson_ratio**2)
    return float(4.0 / 3.0 * modulus * math.sqrt(0.25 * p.grain_diameter))
