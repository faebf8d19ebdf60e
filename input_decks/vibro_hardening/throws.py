"""Grains that are thrown at the flat top of a part, each at an angle of its own, and meet it at one time."""

from dataclasses import replace

import numpy as np

from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Array

# Between path and surface, of the first grain and of the last (degrees). Steeper ones hardly cut.
FLATTEST, STEEPEST = 10.0, 60.0
# Distance of two grains on the surface, in diameters.
APART = 1.3


def angles(count: int) -> Array:
    """Angles (count,) in rad between the surface and the paths."""
    return np.radians(np.linspace(FLATTEST, STEEPEST, count))


def aimed(bodies: Packing, top: float, speed: float, time: float, gravity: float) -> Packing:
    """`bodies` where they have to be to meet the plane z = `top` (m) after `time` (s), in which they fall, with `speed` (m/s)."""
    count, radii = len(bodies.diameters), 0.5 * bodies.diameters
    angle = angles(count)
    meets = APART * bodies.diameters.max() * (np.arange(count) - 0.5 * (count - 1))
    forward, down = speed * np.cos(angle), speed * np.sin(angle)
    height = top + radii + (down - 0.5 * gravity * time) * time
    zero = np.zeros(count)
    return replace(bodies, positions=np.column_stack([meets - forward * time, zero, height]),
                   velocities=np.column_stack([forward, zero, gravity * time - down]))
