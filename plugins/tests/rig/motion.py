"""What every driver returns."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray


@dataclass
class Motion:
    """Frames of a scenario: `time` (n,), the rest (n, grains, 3). Full-step velocities; forces and torques are those of the step.

    Torques and forces of the contact on each grain, gravity included (m, m/s, rad/s, N, N m).
    """

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    angular_velocity: NDArray[np.float64]
    force: NDArray[np.float64]
    torque: NDArray[np.float64]

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit normal (n, 3) from grain 2, or the wall, to grain 1."""
        if self.position.shape[1] == 1:
            return np.broadcast_to([0.0, 0.0, 1.0], (len(self.time), 3))
        separation = self.position[:, 0] - self.position[:, 1]
        return separation / np.linalg.norm(separation, axis=1)[:, None]

    @property
    def normal_force(self) -> NDArray[np.float64]:
        """Component along the normal of the force on grain 1 (n,), N; positive = repulsive."""
        return np.einsum("ij,ij->i", self.force[:, 0], self.normal)

    @property
    def tangential_force(self) -> NDArray[np.float64]:
        """The rest of the force on grain 1 (n, 3), N."""
        return self.force[:, 0] - self.normal_force[:, None] * self.normal


QUANTITIES = (*(f.name for f in fields(Motion)), "tangential_force")


def deviation(a: Motion, b: Motion, scale: Motion | None = None) -> dict[str, float]:
    """Largest difference of each quantity relative to its largest value in `scale` (default `a`); 0 where it vanishes in all."""
    result = {}
    for name in QUANTITIES:
        x, y = getattr(a, name), getattr(b, name)
        if x.shape != y.shape:
            raise ValueError(f"{name}: shapes {x.shape} and {y.shape}")
        size = np.abs(getattr(scale or a, name)).max()
        difference = np.abs(x - y).max()
        result[name] = float(difference / size) if size > 0.0 else float(difference)
    return result
