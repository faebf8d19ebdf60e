"""What the walls of a vessel do to the grains in it: momentum, impulse and power, in LIGGGHTS and LAMMPS."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.physics import WallMotion
from rig import vessel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Told:
    """What the fix says at the steps (n,): force (n, 3) in N, impulse (n, 3) in N s, velocity (n, 3) in m/s, power (n,) in W."""

    steps: Array
    force: Array
    impulse: Array
    velocity: Array
    power: Array


def assert_walls_move_the_grains(told: Told, grains: Array, motion: str) -> None:
    """Impulse of the walls = change of momentum and of what gravity gave, 1e-9 of the weight; and power is force times velocity.

    grains : (n + 1, grains, columns), the start and each of the steps: velocities in columns 4 to 6, forces in 7 to 9, radii in 10
    """
    mass = vessel.DENSITY * 4.0 / 3.0 * math.pi * grains[0, :, 10] ** 3
    momentum = np.einsum("g,fgk->fk", mass, grains[:, :, 4:7])
    weight = np.array([0.0, 0.0, 9.81 * mass.sum()])
    t = vessel.STEP * told.steps
    assert np.abs(told.impulse - (momentum[1:] - momentum[0] + np.outer(t, weight))).max() < 1e-9 * weight[2] * t[-1]
    speed = WallMotion(motion).velocity(t)
    np.testing.assert_allclose(told.velocity, speed, atol=1e-12)
    np.testing.assert_allclose(told.power, np.einsum("nk,nk->n", told.force, speed), rtol=1e-12, atol=1e-15)
    # All forces that are not between grains are those of the wall.
    forces = grains[1:, :, 7:10].sum(axis=1) + weight
    assert np.abs(told.force - forces).max() < 1e-12 * np.abs(forces).max()
