"""Grains on a slope that ends on a flat, or on a chute: front, depth, deposit, friction of the floor, and profiles of the velocity. The toe
of the slope is the origin. s: distance along the floor, negative on the slope; n: height above it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from dembark.input_decks.common.heaps import EDGE, behind
from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Array, Estimate
from dembark.postproc.resampling import resampled
from dembark.postproc.statistics import time_blocks


@dataclass(frozen=True)
class Slope:
    """A floor that falls by `angle` (rad) up to x = 0 and is flat from there on, under grains of mean `diameter` (m) in a layer of `depth`
    (m) along y; a monolayer counts as one diameter deep."""

    angle: float
    diameter: float
    depth: float

    def above(self, positions: Array) -> NDArray[np.bool_]:
        """Whether places (n, 3) belong to the slope: they are on its side of the bisector of the kink."""
        half = 0.5 * self.angle
        return positions[:, 0] * math.cos(half) < positions[:, 2] * math.sin(half)

    def along(self, positions: Array) -> Array:
        """s (n,) in m."""
        x, z = positions[:, 0], positions[:, 2]
        return np.where(self.above(positions), x * math.cos(self.angle) - z * math.sin(self.angle), x)

    def height(self, positions: Array) -> Array:
        """n (n,) in m."""
        x, z = positions[:, 0], positions[:, 2]
        return np.where(self.above(positions), x * math.sin(self.angle) + z * math.cos(self.angle), z)

    def front(self, frame: GrainFrame) -> float:
        """s (m) of the farthest grain in the farthest strip four diameters wide whose solid volume over its area reaches EDGE, half of a
        layer; single grains that run ahead do not count. NaN when there is none."""
        s, d = self.along(frame.positions), self.diameter
        order = np.argsort(s)
        volume = np.concatenate([[0.0], np.cumsum(4.0 / 3.0 * np.pi * frame.radii[order] ** 3)])
        places = np.arange(s.min() - 2.0 * d, s.max() + 3.0 * d, 0.05 * d)
        low, high = (np.searchsorted(s[order], places + side * d) for side in (-2.0, 2.0))
        covered = np.flatnonzero((volume[high] - volume[low]) / (4.0 * d * self.depth) >= EDGE * d)
        return float(s[order][high[covered[-1]] - 1]) if len(covered) else math.nan

    def reach(self, frame: GrainFrame, share: float = 0.95) -> float:
        """s (m) of the grain behind which this share of the mass lies; a few that roll on to the end of the flat do not count."""
        return behind(self.along(frame.positions), frame.masses, share)

    def thickness(self, frame: GrainFrame, edges: Array) -> Array:
        """m, solid volume over area in the cells of s between `edges` (m)."""
        volume, _ = np.histogram(self.along(frame.positions), edges, weights=4.0 / 3.0 * np.pi * frame.radii**3)
        return volume / (np.diff(edges) * self.depth)

    def grip(self, frame: GrainFrame, floor: NDArray[np.bool_], wall: str = "") -> tuple[float, float]:
        """N, what the grains press on the slope along it and along its normal: the force on the glued grains `floor` (mask), or of the
        `wall` on the grains over the slope."""
        if wall:
            grains = self.above(frame.positions) & (frame.types == 1)
            force = -frame.wall_forces[wall][grains].sum(axis=0)
        else:
            force = frame.forces[floor & self.above(frame.positions)].sum(axis=0)
        sine, cosine = math.sin(self.angle), math.cos(self.angle)
        return float(force[0] * cosine - force[2] * sine), float(-force[0] * sine - force[2] * cosine)


def front_law(times: Array, depth: float, angle: float, friction: float, gravity: float) -> Array:
    """m, how far the front of a layer `depth` (m) deep has come since it was let loose on a long slope of `angle` (rad) with the Coulomb
    `friction` of the floor: 2 sqrt(g H cos a) t + g cos a (tan a - mu) t^2 / 2, as AvaFrame's code has it after Faccanoni and Mangeney."""
    pull = gravity * math.cos(angle)
    return 2.0 * math.sqrt(depth * pull) * times + 0.5 * pull * (math.tan(angle) - friction) * times**2


def profile_power(height: Array, speed: Array) -> float:
    """p of u = u_0 + A [1 - (1 - z/H)^p], `height` being z/H (n,) within 0 ... 1: 3/2 for Bagnold's flow, 1 for a linear profile."""
    powers = np.arange(0.3, 4.0, 0.01)

    def residual(power: float) -> float:
        design = np.column_stack([np.ones_like(height), 1.0 - np.clip(1.0 - height, 0.0, 1.0) ** power])
        solution = np.linalg.lstsq(design, speed, rcond=None)[0]
        return float(((design @ solution - speed) ** 2).sum())

    best = float(powers[int(np.argmin([residual(power) for power in powers]))])
    return float(minimize_scalar(residual, bounds=(best - 0.01, best + 0.01), method="bounded").x)


def mean_power(height: Array, masses: Array, momenta: Array) -> Estimate:
    """`profile_power` of the mean profile of a window, from masses (kg) and momenta (N s) of the layers at `height` (n,) in its frames
    (frames, n); its interval is that of a jackknife over blocks of time."""

    def power(keep: NDArray[np.bool_]) -> float:
        mass = masses[keep].sum(axis=0)
        there = mass > 0.0
        return profile_power(height[there], momenta[keep].sum(axis=0)[there] / mass[there])

    blocks = time_blocks(momenta.sum(axis=1) / masses.sum(axis=1))
    return resampled(lambda keep, _: power(keep), blocks)


def layers(frame: GrainFrame, diameter: float) -> tuple[Array, Array]:
    """Mass (kg) and momentum along x (N s) of the grains in layers one `diameter` (m) thick above z = 0."""
    layer = np.maximum(0, (frame.positions[:, 2] / diameter).astype(np.int64))
    mass, momentum = (np.bincount(layer, weights) for weights in (frame.masses, frame.masses * frame.velocities[:, 0]))
    return np.asarray(mass, float), np.asarray(momentum, float)
