"""A free part that falls and turns while grains hit it one after the other, without friction: an integration of its own, with small steps.
Numbers z + i x stand for vectors in the plane."""

from __future__ import annotations

import cmath
import math
from typing import Any, NamedTuple

import numpy as np

from dembark.input_decks.common.trough import polygon, prism
from dembark.input_decks.tests.measuring import defaults
from dembark.input_decks.vibro_finishing.touches import FreeRecord, Spheres, read_record
from dembark.postproc.tests.packings import frame_of
from dembark.postproc.walls import MeshWall

# s, steps from one frame to the next and from one impact to the next; grains; their radius (m) and mass (kg).
STEP, STRIDE, APART, COUNT, RADIUS, MASS = 2e-6, 40, 1000, 12, 0.0025, 1.6e-4
SPEED, SLIP = 0.3, 0.2
PART_MASS, PART_MOMENT = 3.3e-3, 4e-7
# A turned dumbbell, and a sphere.
DUMBBELL, BALL = (np.array([-0.008 + 0.002j, 0.004 - 0.006j, 0.012 + 0.01j]), 0.00125), (np.zeros(1, complex), 0.02)
SURFACE = MeshWall("part", prism(polygon(0.04, 48, (0.0, 0.0)), 0.01))


class Hits(NamedTuple):
    """The record of all impacts, the sphere of the part that each hit, and where from its centre, along the axes of the part."""

    record: FreeRecord
    spheres: Any
    normals: Any


def force_of_law(overlap: float, closing: float, radius: float, p: Any) -> float:
    """The law of the contacts, with both masses (N)."""
    modulus = 0.5 * p["youngs_modulus"] / (1.0 - p["poisson_ratio"] ** 2)
    reduced, mass = RADIUS * radius / (RADIUS + radius), MASS * PART_MASS / (MASS + PART_MASS)
    beta = -math.log(p["restitution"]) / math.hypot(math.log(p["restitution"]), math.pi)
    root = math.sqrt(reduced * overlap)
    return 4.0 / 3.0 * modulus * root * overlap + 2.0 * math.sqrt(5.0 / 6.0) * beta * math.sqrt(2.0 * modulus * root * mass) * closing


def hits(shape: Any = DUMBBELL, spin: float = 40.0, lost: int = 0) -> Hits:
    """All impacts on a part of this `shape`, which turns at `spin` (rad/s) at first; nothing was recorded of the first `lost` grains."""
    places, radius = shape
    p = defaults("vibro_finishing", grain_count=COUNT, periods=COUNT, impact_periods=COUNT, grain_diameter=2.0 * RADIUS)
    centre, velocity, angle, frames, struck, normals = 0.1 + 0.2j, 0.05 - 0.1j, 0.0, [], [], []
    grain = way = 0j
    for step in range(COUNT * APART + 1):
        turned = cmath.exp(1j * angle)
        number, since = divmod(step, APART)
        # At all phases of a frame.
        if since == 7 * number % STRIDE and number < COUNT:
            struck.append(number % len(places))
            own = turned * places[struck[-1]]
            # From below, mostly, and away from the other spheres.
            normal = (-1.0 if len(places) == 1 else own / abs(own)) * cmath.exp(0.7j * math.sin(number))
            normals.append(normal / turned)
            grain = centre + own + (radius + RADIUS + 1e-9) * normal
            way = velocity + 1j * spin * (own + radius * normal) - (SPEED - SLIP * 1j) * normal
        force = torque = 0j
        for place in places:
            arm = turned * place
            apart = grain - centre - arm
            overlap = radius + RADIUS - abs(apart)
            if overlap > 0.0:
                normal = apart / abs(apart)
                touch = arm + radius * normal
                closing = -((way - velocity - 1j * spin * touch) * normal.conjugate()).real
                push = force_of_law(overlap, closing, radius, p) * normal
                force += push
                torque -= (touch.conjugate() * push).imag
        if step % STRIDE == 0:
            there = [(len(struck), grain, way, RADIUS)] if struck and len(struck) > lost else []
            part = [(COUNT + 1 + k, centre + turned * place, velocity + 1j * spin * turned * place, radius)
                    for k, place in enumerate(places) if k in {0, len(places) - 1}]
            ids, where, speeds, radii = (np.array(column) for column in zip(*there, *part, strict=True))
            frames.append(frame_of(np.column_stack([where.imag, 0.0 * ids, where.real]), radii, {"trough": np.zeros((len(ids), 3))},
                                   velocities=np.column_stack([speeds.imag, 0.0 * ids, speeds.real]), omegas=[0.0, spin, 0.0], ids=ids,
                                   step=step, masses=np.where(ids > COUNT, PART_MASS, MASS)))
        velocity -= (p["gravity"] + force / PART_MASS) * STEP
        way += (force / MASS - p["gravity"]) * STEP
        spin += torque.real / PART_MOMENT * STEP
        centre, grain, angle = centre + velocity * STEP, grain + way * STEP, angle + spin * STEP
    numbers = {"sample": STRIDE, "period_steps": APART, "touches": 0, "body_spheres": len(places)}
    numbers |= {f"{which}_{axis}": value for which, row in (("first", 0), ("last", -1))
                for axis, value in zip("zx", (places[row].real, places[row].imag), strict=True)}
    part = Spheres(places, radius, PART_MASS, PART_MOMENT, flat=len(places) > 1)
    record = read_record(frames, part, SURFACE, numbers, p, STEP)
    return Hits(record, np.array(struck), np.array(normals))
