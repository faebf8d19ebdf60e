"""What the walls of a vessel do to the grains in it: momentum, impulse and power, in LIGGGHTS and LAMMPS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.physics import WallMotion, effective_youngs_modulus
from rig import vessel
from rig.late_motion import BEGUN, OVERLAP, RADIUS
from rig.scenarios import Material

Array = NDArray[np.float64]
ELASTIC = Material(static_friction=0.0, kinetic_friction=0.0, restitution=1.0, youngs_modulus=vessel.MODULUS)


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


def assert_begins_where_it_stands(folder: Path, words: str, times: Array, displacement: Array, angle: Array, force: Array) -> None:
    """The plate is where the motion that begins at BEGUN has it, in what the engine says and by the elastic force on the grain.

    folder : with `late.csv`; times : (n,) s
    displacement : (n, 3) m and angle : (n,) rad of the plate; force : (n,) N, upwards on the grain
    """
    motion = WallMotion(words, folder, begin=BEGUN)
    np.testing.assert_allclose(displacement, motion.displacement(times), atol=1e-13, err_msg=words)
    np.testing.assert_allclose(angle, motion.angle(times), atol=1e-11, err_msg=words)
    if "rocking" in words:
        return
    modulus = effective_youngs_modulus(ELASTIC.youngs_modulus, ELASTIC.poisson_ratio, ELASTIC.youngs_modulus, ELASTIC.poisson_ratio)
    overlap = OVERLAP + motion.displacement(times)[:, 2]
    np.testing.assert_allclose(force, 4.0 / 3.0 * modulus * np.sqrt(RADIUS * overlap) * overlap, rtol=1e-8, err_msg=words)
