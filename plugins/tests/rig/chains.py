"""Chains of equal spheres along x with exact solutions: a compressed one that swings in a mode, and one that is struck at its end."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from dembark.physics import effective_youngs_modulus
from rig.scenarios import Material

RADIUS, DENSITY = 2.5e-3, 2500.0
MASS = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY
MATERIAL = Material(restitution=1.0, static_friction=0.0, kinetic_friction=0.0, normal_law="hooke", characteristic_velocity=0.5,
                    youngs_modulus=5e6)


def hooke_stiffness(m: Material = MATERIAL) -> float:
    """N/m, of two of these spheres."""
    rigidity = sqrt(RADIUS / 2) * effective_youngs_modulus(m.youngs_modulus, m.poisson_ratio, m.youngs_modulus, m.poisson_ratio)
    return 16 / 15 * rigidity * (15 * (MASS / 2) * m.characteristic_velocity**2 / (16 * rigidity)) ** 0.2


@dataclass(frozen=True)
class CompressedChain:
    """`count` spheres between two that are held, all contacts compressed so far that none opens; they swing in the mode `mode`.

    Steps are such that omega h = `phase`. By leapfrog the positions are amplitude * shape * cos(Omega h n), with
    sin(Omega h / 2) = omega h / 2.
    """

    phase: float
    count: int = 8
    mode: int = 8
    amplitude: float = 5e-5
    overlap: float = 4e-4

    @property
    def omega(self) -> float:
        return 2.0 * sqrt(hooke_stiffness() / MASS) * sin(self.mode * pi / (2 * (self.count + 1)))

    @property
    def step(self) -> float:
        return self.phase / self.omega

    @property
    def places(self) -> NDArray[np.float64]:
        """m, of all spheres without the motion; the first and the last are held."""
        return (2 * RADIUS - self.overlap) * np.arange(self.count + 2)

    @property
    def shape(self) -> NDArray[np.float64]:
        return np.sin(self.mode * pi * np.arange(1, self.count + 1) / (self.count + 1))

    def positions(self, n: int) -> NDArray[np.float64]:
        """m, of those that swing, after n steps."""
        return self.places[1:-1] + self.amplitude * self.shape * np.cos(2.0 * np.arcsin(0.5 * self.phase) * n)

    def true_errors(self, steps: int = 2000) -> tuple[float, float]:
        """Root mean square of what the steps miss: of positions (m) and of velocities (m/s)."""
        h, x, v, missed = self.phase, 1.0, 0.0, []
        for _ in range(steps):
            exact = x * np.cos(h) + v * np.sin(h), v * np.cos(h) - x * np.sin(h)
            a = -x
            x += h * v + h * h / 2 * a
            v += h / 2 * (a - x)
            missed.append((exact[0] - x, exact[1] - v))
        along, speed = np.sqrt(np.mean(np.square(missed), axis=0)) * self.amplitude * np.sqrt(np.mean(self.shape**2))
        return float(along), float(speed * self.omega)


def hertz_stiffness(m: Material = MATERIAL) -> float:
    """k of F = k overlap^1.5, N/m^1.5."""
    return 4 / 3 * effective_youngs_modulus(m.youngs_modulus, m.poisson_ratio, m.youngs_modulus, m.poisson_ratio) * sqrt(RADIUS / 2)


def solitary_wave(positions: NDArray[np.float64], time: NDArray[np.float64], first: int, last: int) -> tuple[float, float]:
    """Speed (m/s) of the wave between the contacts `first` and `last`, and what theory gives it for the peak force that it has there.

    positions : (n, grains), m, at the times (n,), s. The speed is 0.9055 d k^(1/3) F^(1/6) / sqrt(m), of F = k overlap^1.5.
    """
    overlap = np.maximum(2 * RADIUS - np.diff(positions, axis=1), 0.0)

    def peak(contact: int) -> tuple[float, float]:
        n = int(overlap[:, contact].argmax())
        a, b, c = overlap[n - 1 : n + 2, contact]
        part = 0.5 * (a - c) / (a - 2 * b + c)
        return time[n] + part * (time[1] - time[0]), b - 0.25 * (a - c) * part

    times, depths = zip(*(peak(contact) for contact in range(first, last + 1)), strict=True)
    force = hertz_stiffness() * np.mean(depths) ** 1.5
    speed = 2 * RADIUS * (last - first) / (times[-1] - times[0])
    return float(speed), float(0.9055 * 2 * RADIUS * hertz_stiffness() ** (1 / 3) * force ** (1 / 6) / sqrt(MASS))
