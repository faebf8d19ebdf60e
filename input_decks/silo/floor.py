"""Normal forces of single grains on the floor of a packing at rest under its own weight, over their mean: f. Measured are beta of P(f) ~
exp(-beta f) above the mean and alpha of P(f) ~ f^alpha below it, both by largest likelihood (G. Løvoll, K. J. Måløy, E. G. Flekkøy, Phys.
Rev. E 60 (1999) 5872). Grains that carry no other are counted or left out: the source's abstract does not say what it did."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial import cKDTree

from dembark.postproc.measurement import Array, Estimate, Measurement, Replica, Replicas, Value, exact, pooled, profile
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.statistics import jackknife

# Of the abstract, which does not say where small forces end. Where the two laws are joined at f = 1, the mean of f is 0.98, so it is there.
ALPHA, BETA = 0.3, 1.8
# D. M. Mueth, H. M. Jaeger, S. R. Nagel, Phys. Rev. E 57 (1998) 3164, abstract: nearly uniform below the mean.
UNIFORM = 0.0
# The side wall orders the grains next to it and carries some: within so many diameters of it no grain is counted.
MARGIN = 5.0
# A grain that carries no other has f = 0.1 in a bed of ten layers. The power law is fitted from twice that on, up to the mean.
LOW = 0.2
# Grains whose places on the floor are up to this many diameters apart are neighbours: the first gap between their shells.
NEIGHBOURS = 1.4
_SECTORS = 10


@dataclass(frozen=True)
class Floor:
    """The n grains that touch the floor, off the side wall. (n,): normal `forces` on them and their `weights` (N), `sectors` around the
    axis; (m, 2): `pairs` of neighbours; `change`: root mean square of what the forces change from the first frame to the last, over their
    mean; `cover`: share of the floor that they cover as seen from above."""

    forces: Array
    weights: Array
    sectors: NDArray[np.int64]
    pairs: NDArray[np.int64]
    change: float
    cover: float


def exponential_slope(f: Array, low: float = 1.0) -> float:
    """beta of P(f) ~ exp(-beta f) for f > `low`, the largest likelihood; NaN where no f is."""
    above = f[f > low]
    return 1.0 / float(above.mean() - low) if len(above) else math.nan


def power_exponent(f: Array) -> float:
    """alpha of P(f) ~ f^alpha for LOW < f < 1, the largest likelihood: the mean of ln f is that of the law; NaN where too few f, almost
    alike, leave it open."""
    logs = np.log(f[(f > LOW) & (f < 1.0)])
    if not len(logs):
        return math.nan
    low, mean = math.log(LOW), float(logs.mean())

    def excess(power: float) -> float:
        """Mean of ln f of the law with exponent `power` - 1, less the one found."""
        if abs(power) < 1e-6:
            return 0.5 * low - mean
        return -low / math.expm1(-power * low) - 1.0 / power - mean

    return float(brentq(excess, -400.0, 400.0)) - 1.0 if excess(-400.0) < 0.0 < excess(400.0) else math.nan


def law(f: Array) -> Array:
    """P(f) of the two laws of the abstract, joined at f = 1, with the integral 1."""
    height = 1.0 / (1.0 / (1.0 + ALPHA) + 1.0 / BETA)
    return np.asarray(height * np.where(f < 1.0, np.minimum(f, 1.0) ** ALPHA, np.exp(-BETA * (np.maximum(f, 1.0) - 1.0))))


@cached_per_replica
def read(replica: Replica) -> Floor:
    """Measure one run folder: its last frame, and what has changed since the first."""
    given, frames = replica.parameters, replica.grains()
    first, last, d = frames[0], frames[len(frames) - 1], float(given["grain_diameter"])
    reach = float(given["cylinder_radius"]) - MARGIN * d
    force, place = last.wall_forces["base"][:, 2], last.positions[:, :2]
    off = np.hypot(*place.T) < reach
    counted = off & (force > 0.0)
    place, radii, push = place[counted], last.radii[counted], force[counted]
    turn = np.arctan2(place[:, 1], place[:, 0]) / (2.0 * np.pi) % 1.0
    change = np.sqrt(np.mean((push - first.wall_forces["base"][counted, 2]) ** 2)) / push.mean()
    pairs = cKDTree(place).query_pairs(NEIGHBOURS * d, output_type="ndarray")
    return Floor(push, last.masses[counted] * float(given["gravity"]), (turn * _SECTORS).astype(np.int64), pairs, float(change),
                 float((radii**2).sum() / reach**2))


@cached_per_replica
def scalars(one: Floor) -> dict[str, Estimate]:
    """Quantities of one packing by name; their intervals come from sectors of the floor."""
    idle = one.forces < 1.01 * one.weights

    def of(measure: Callable[[Array], float], chosen: NDArray[np.bool_]) -> Estimate:
        forces = one.forces[chosen]
        return jackknife(lambda keep: measure(forces[keep] / forces[keep].mean()), one.sectors[chosen], name="sectors")

    def correlation(keep: NDArray[np.bool_]) -> float:
        f = one.forces / one.forces[keep].mean() - 1.0
        here, there = one.pairs[keep[one.pairs].all(axis=1)].T
        return float((f[here] * f[there]).mean() / (f[keep] ** 2).mean())

    every = np.ones(len(idle), bool)
    alpha = of(power_exponent, every)
    return {
        "floor_beta": of(exponential_slope, every),
        "floor_alpha": alpha,
        "floor_uniformity": alpha,
        "floor_beta_loaded": of(exponential_slope, ~idle),
        "floor_alpha_loaded": of(power_exponent, ~idle),
        "floor_beta_large": of(lambda f: exponential_slope(f, 2.0), every),
        "floor_idle": jackknife(lambda keep: float(idle[keep].mean()), one.sectors, name="sectors"),
        "floor_correlation": jackknife(correlation, one.sectors, name="sectors"),
        "floor_cover": Estimate(one.cover, math.inf, "only other packings show how much this varies"),
        "floor_change": exact(one.change),
    }


def measured(replicas: Replicas) -> Measurement:
    """Values and curves of all packings of a series."""
    floors = [read(replica) for replica in replicas]
    found = [scalars(one) for one in floors]
    references = {"floor_beta": exact(BETA), "floor_beta_loaded": exact(BETA), "floor_alpha": exact(ALPHA),
                  "floor_uniformity": exact(UNIFORM)}
    values = {name: Value(pooled(found, name), references.get(name)) for name in found[0]}
    forces = [one.forces / one.forces.mean() for one in floors]
    edges, tail = np.linspace(0.0, 5.0, 26), np.linspace(1.0, 4.0, 13)
    middle = 0.5 * (edges[1:] + edges[:-1])
    density = [np.histogram(f, edges)[0] / (len(f) * np.diff(edges)) for f in forces]
    together = np.concatenate(forces)
    beyond = np.array([np.mean(together > f) for f in tail])
    with np.errstate(divide="ignore"):
        logs = np.log(beyond / beyond[0])
    return Measurement(values, [
        profile("floor_forces", "Forces on the floor", "force over mean force f", "P(f)", middle, density, reference=law(middle),
                reference_label=f"f^{ALPHA:g} below, exp(−{BETA:g} f) above 1"),
        profile("floor_tail", "Large forces on the floor", "force over mean force f", "ln(share above f / share above 1)", tail, [logs],
                reference=-BETA * (tail - 1.0), reference_label=f"exp(−{BETA:g} f)"),
    ], [f"{len(together) / len(forces):.0f} grains a packing touch the floor {MARGIN:g} d or more off the side wall."])
