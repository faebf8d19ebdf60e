"""Cheap stand-ins for three calibrations: quantities that are smooth functions of two parameters, with the scatter of packings.

Only NumPy is needed: GrainLearning's Python, which has another one, imports this module, too. Functions and scatter follow what runs of
`known-oedometer`, `known-shear` and `known-heap` measured; parameters are quantiles of the ranges of these campaigns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

# Packings of each run, and of the experiment.
PACKINGS = 5
# Quantiles of the parameters on a grid, of which the exact posterior is computed.
GRID = 301

Array = Any


def oedometer(place: Array) -> Array:
    """Modulus (Pa), compression and K₀ of Young's modulus (5 to 20 MPa, its logarithm is uniform) and friction (0.1 to 0.8)."""
    stiffer, friction = (5.0 * 4.0 ** place[..., 0] / 9.0) ** (2.0 / 3.0), 0.1 + 0.7 * place[..., 1]
    modulus, compression = 3.7e5 * stiffer * (1.0 + 0.1 * (friction - 0.3)), 0.021 / stiffer * (1.0 - 0.2 * (friction - 0.3))
    return np.stack([modulus, compression, 0.5 + 0.25 * np.exp(-friction / 0.2)], axis=-1)


def shear_cell(place: Array) -> Array:
    """Slope of the yield locus and solid fraction of friction (0.1 to 0.8) and rolling friction (0 to 0.3)."""
    friction, rolling = 0.1 + 0.7 * place[..., 0], 0.3 * place[..., 1]
    slope = 0.08 + (0.25 + 0.5 * rolling) * (1.0 - np.exp(-friction / 0.2))
    return np.stack([slope, 0.635 - (0.05 + 0.05 * rolling) * (1.0 - np.exp(-friction / 0.25))], axis=-1)


def heap(place: Array) -> Array:
    """Angle (°) of friction (0.2 to 0.8) and rolling friction (0.02 to 0.2), which raise it together."""
    friction, rolling = 0.2 + 0.6 * place[..., 0], 0.02 + 0.18 * place[..., 1]
    return (9.0 + (12.0 + 60.0 * rolling) * (1.0 - np.exp(-friction / 0.3)))[..., None]


@dataclass(frozen=True)
class StandIn:
    """`model` maps quantiles (..., 2) to quantities (..., n); `scatter` (n): their standard deviations over packings."""

    model: Callable[[Array], Array]
    scatter: tuple[float, ...]

    @property
    def uncertainty(self) -> Array:
        """Standard uncertainty (n) of the means over PACKINGS, of runs and of targets."""
        return np.array(self.scatter) / np.sqrt(PACKINGS)

    def runs(self, places: Array, random: np.random.Generator) -> tuple[Array, Array]:
        """Means over packings and their measured variances, both (points, n), at `places` (points, 2)."""
        packings = self.model(places)[:, None] + self.scatter * random.standard_normal((len(places), PACKINGS, len(self.scatter)))
        return packings.mean(axis=1), packings.var(axis=1, ddof=1) / PACKINGS

    def experiment(self, seed: int) -> tuple[Array, Array]:
        """Known parameters (2) and targets (n) that scatter by their uncertainty."""
        random = np.random.default_rng(seed)
        truth = random.uniform(size=2)
        return truth, self.model(truth) + self.uncertainty * random.standard_normal(len(self.scatter))

    def exact(self, targets: Array) -> tuple[Array, Array]:
        """Mean and standard deviation (2) of the posterior for `targets`, of a model without scatter."""
        grid = np.stack(np.meshgrid(*[(np.arange(GRID) + 0.5) / GRID] * 2), axis=-1).reshape(-1, 2)
        away = -0.5 * (((self.model(grid) - targets) / self.uncertainty) ** 2).sum(axis=1)
        weights = np.exp(away - away.max())
        weights /= weights.sum()
        mean = weights @ grid
        return mean, np.sqrt(weights @ (grid - mean) ** 2)


STAND_INS = {
    "oedometer": StandIn(oedometer, (7e3, 1.1e-3, 0.038)),
    "shear_cell": StandIn(shear_cell, (0.044, 2.2e-3)),
    "heap": StandIn(heap, (2.6,)),
}
