"""Stresses, compression positive: of the contacts in slabs, on walls, and from the balance of forces on what lies above a level.

The field stress of a slab of volume V is the sum over contacts of f_a l_b times the part of the branch vector inside the slab, plus
the kinetic part, over V (Irving-Kirkwood with a straight line between the centres; as in Goldhirsch, Granular Matter 12 (2010) 239).
A contact with a wall has the line from the grain's centre to the wall. With it the integral over the complete container equals the
moment of the external forces, and the stress at a level equals the force of what is above it on what is below.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def overlap_fractions(start: Array, end: Array, edges: Array) -> Array:
    """Share of each of m line segments from `start` to `end` (m,) that lies in each of k slabs between `edges` (k + 1,); (m, k).

    A segment within one plane counts for the slab that holds it.
    """
    low, high = np.minimum(start, end), np.maximum(start, end)
    length = high - low
    tiny = length <= 1e-12 * np.abs(edges[-1] - edges[0])
    inside = np.minimum(high[:, None], edges[None, 1:]) - np.maximum(low[:, None], edges[None, :-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.clip(inside, 0.0, None) / length[:, None]
    share[tiny] = (low[tiny, None] >= edges[None, :-1]) & (low[tiny, None] < edges[None, 1:])
    return share


def pair_stress(first: Array, branch: Array, forces: Array, axis: int, edges: Array, area: float, length: float | None = None) -> Array:
    """Stress (k, 3, 3) in Pa of contacts in k slabs between `edges` (m) along `axis` with cross-section `area` (m2).

    `first` (m, 3): where the lines begin, `branch` (m, 3): from there to the other end (m), `forces` (m, 3): on the grain at `first`
    (N). `length`: period (m) along `axis` when that axis is periodic; lines across the border then go on at the other side.
    """
    lines = forces[:, :, None] * -branch[:, None, :]
    start = first[:, axis]
    share = overlap_fractions(start, start + branch[:, axis], edges)
    if length is not None:
        for shift in (-length, length):
            share += overlap_fractions(start + shift, start + branch[:, axis] + shift, edges)
    return np.einsum("mk,mab->kab", share, lines) / (area * np.diff(edges))[:, None, None]


def wall_branches(positions: Array, wall_forces: Array, contact_points: Array) -> tuple[Array, Array, Array]:
    """(first, branch, forces) for `pair_stress` of grains that touch a wall: lines from their centres to `contact_points` (n, 3)."""
    touching = np.any(wall_forces != 0.0, axis=1)
    return positions[touching], (contact_points - positions)[touching], wall_forces[touching]


def on_plane(positions: Array, axis: int, place: Array | float) -> Array:
    """Feet (n, 3) of the perpendiculars from `positions` to the plane at `place` (m) along `axis`."""
    points = positions.copy()
    points[:, axis] = place
    return points


def kinetic_stress(positions: Array, velocities: Array, masses: Array, axis: int, edges: Array, area: float) -> Array:
    """Kinetic stress (k, 3, 3) in Pa, sum m v' v' / V with v' about the mean velocity (by mass) of the grains centred in each slab."""
    cell = np.searchsorted(edges, positions[:, axis], side="right") - 1
    result = np.zeros((len(edges) - 1, 3, 3))
    for number in np.unique(cell[(cell >= 0) & (cell < len(result))]):
        here = cell == number
        mass = masses[here]
        deviation = velocities[here] - np.average(velocities[here], axis=0, weights=mass)
        result[number] = np.einsum("n,na,nb->ab", mass, deviation, deviation)
    return result / (area * np.diff(edges))[:, None, None]


def load_above(heights: Array, loads: Array, levels: Array) -> Array:
    """Sum of `loads` (n,) over the grains whose centres are at or above each of `levels` (k,); (k,)."""
    order = np.argsort(heights)
    tail = np.concatenate([np.cumsum(loads[order][::-1])[::-1], [0.0]])
    return tail[np.searchsorted(heights[order], levels, side="left")]


def mean_load_above(heights: Array, loads: Array, edges: Array) -> Array:
    """The mean of `load_above` over each slab between `edges` (k + 1,), exactly; (k,)."""
    share = np.clip((heights[:, None] - edges[None, :-1]) / np.diff(edges)[None, :], 0.0, 1.0)
    return loads @ share


def plane_wall_stress(heights: Array, wall_forces: Array, axis: int, side: int, edges: Array, depth: float) -> tuple[Array, Array]:
    """Normal and shear stress in Pa ((k,), (k,)) on a vertical plane wall normal to `axis`, in bands of height between `edges` (k + 1,) in
    m, from the `heights` (n,) in m of grains and the `wall_forces` (n, 3) in N on them. `side` = +1 when the grains lie on its positive
    side, else -1; `depth` of the wall in m."""
    area = depth * np.diff(edges)
    return _binned(heights, side * wall_forces[:, axis], edges) / area, _binned(heights, wall_forces[:, 2], edges) / area


def _binned(heights: Array, weights: Array, edges: Array) -> Array:
    return np.histogram(heights, bins=edges, weights=weights)[0]
