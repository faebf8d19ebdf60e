"""A bed of equal spheres in a box that lies at rest by its geometry: each sphere comes to lie where three others, or walls, carry it.

W. M. Visscher and M. Bolsterli (Nature 239 (1972) 504) let spheres fall one by one and roll to where three carry them; C. H. Bennett
(J. Appl. Phys. 43 (1972) 2727) put each into the lowest such place. Here each one takes the lowest of `choices` places that are drawn at
random: with more choices the bed is denser and its surface flatter. There are no overlaps, so nothing moves when an engine goes on.
"""

from __future__ import annotations

from functools import cache
from itertools import chain, product
from itertools import count as numbers

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.input_decks.common.packing import Array, uniform

# Relative to the diameter: contact is meant, round-off is not.
_TOUCH = 1e-9
# Part of the floor that spheres cover which fall on it at random before any is carried by others.
_COVERED = 0.3
# Of a drawing by random sequential addition, before the floor counts as full.
_MOST_TRIALS = 1000


@cache
def deposit(count: int, sides: tuple[float, float], choices: int, seed: int) -> Array:
    """Centres (count, 3) of spheres with the radius 1 in 0 < x < sides[0], 0 < y < sides[1], above the floor z = 0.

    They come in the order of small cells, so that neighbours in space are neighbours in memory. The array cannot be written to.
    DembarkError for a box in which no sphere is carried by others.
    """
    bed = _Bed(count, sides)
    middle = np.array([0.5 * sides[0], 0.5 * sides[1], 1.0])
    reach = np.array([middle[0] - 1.0, middle[1] - 1.0, 0.0])
    trials = iter(2.0 * uniform(np.arange(1, 3 * _MOST_TRIALS + 3 * count), seed, 0) - 1.0)
    failed = 0
    while bed.count < min(count, _COVERED * 4.0 * reach[0] * reach[1] / np.pi) and failed < _MOST_TRIALS:
        place = middle + reach * (next(trials), next(trials), 0.0)
        if bed.is_free(place):
            bed.add(place)
        else:
            failed += 1
    for draw in numbers(1):
        if bed.count == count:
            break
        if not len(bed.sites):
            raise DembarkError("the bed does not grow", f"no sphere finds three that carry it in {sides[0]:g} by {sides[1]:g} radii",
                               "take a wider box")
        drawn = (uniform(choices * draw + np.arange(choices), seed, 1) * len(bed.sites)).astype(np.int64)
        bed.add(bed.sites[drawn[np.argmin(bed.sites[drawn, 2])]])
    cell = np.floor(bed.centres / 3.0)
    found: Array = bed.centres[np.lexsort((cell[:, 2], cell[:, 1], cell[:, 0]))]
    found.setflags(write=False)
    return found


class _Bed:
    """Spheres of radius 1 and the `sites` (n, 3) where one more would be at rest."""

    def __init__(self, most: int, sides: tuple[float, float]) -> None:
        self.centres = np.empty((most, 3))
        self.count = 0
        self.sites = np.empty((0, 3))
        # Numbers of the spheres in cells as wide as two diameters.
        self.cells: dict[tuple[int, ...], list[int]] = {}
        # Where a centre may be, n·p >= d: two walls across x, two across y, the floor.
        self.normals = np.array([(1.0, 0, 0), (-1.0, 0, 0), (0, 1.0, 0), (0, -1.0, 0), (0, 0, 1.0)])
        self.offsets = np.array([1.0, 1.0 - sides[0], 1.0, 1.0 - sides[1], 1.0])

    def is_free(self, place: Array) -> bool:
        return not self.count or bool((((self.centres[: self.count] - place) ** 2).sum(axis=1) >= 4.0).all())

    def add(self, place: Array) -> None:
        """Put a sphere at `place` (3,): sites that it covers go, and those that it makes with two others, or walls, come."""
        own = tuple(int(x) for x in place // 4.0)
        around = product(*(range(x - 1, x + 2) for x in own))
        near = self.centres[sorted(chain.from_iterable(self.cells.get(cell, ()) for cell in around))]
        near = near[((near - place) ** 2).sum(axis=1) < 16.0]
        self.cells.setdefault(own, []).append(self.count)
        self.centres[self.count] = place
        self.count += 1
        kept = self.sites[((self.sites - place) ** 2).sum(axis=1) >= 4.0 - _TOUCH]
        self.sites = np.vstack([kept, self._sites(place, near)])

    def _sites(self, place: Array, near: Array) -> Array:
        """Sites (n, 3) on the sphere at `place` and two of its neighbours, the spheres `near` (m, 3) and walls.

        With q from `place`, |q| = 2, each neighbour is a plane, g·q = c: for a sphere at r from `place` |q − r| = 2 says 2 r·q = r². Two
        planes meet in a line, and the line in two points of the sphere. The weight is carried where it is a sum of pushes along the
        three normals n, Σ λ n = z with no λ below zero.
        """
        r, distance = near - place, self.normals @ place - self.offsets
        walls = distance < 2.0
        g = np.vstack([2.0 * r, self.normals[walls]])
        c = np.concatenate([(r * r).sum(axis=1), -distance[walls]])
        i, j = _pairs(len(g))
        along = np.cross(g[i], g[j])
        square = (along * along).sum(axis=1)
        i, j, along, square = (part[square > _TOUCH] for part in (i, j, along, square))
        foot = (c[i][:, None] * np.cross(g[j], along) + c[j][:, None] * np.cross(along, g[i])) / square[:, None]
        rest = 4.0 - (foot * foot).sum(axis=1)
        i, j, along, square, foot, rest = (part[rest > 0.0] for part in (i, j, along, square, foot, rest))
        step = np.sqrt(rest / square)[:, None] * along
        q, i, j = np.vstack([foot + step, foot - step]), np.tile(i, 2), np.tile(j, 2)
        second, third = (np.where((k < len(r))[:, None], q - 0.5 * g[k], g[k]) for k in (i, j))
        crossed = np.cross(second, third)
        volume = (q * crossed).sum(axis=1)
        pushes = np.array([crossed[:, 2], np.cross(third, q)[:, 2], np.cross(q, second)[:, 2]]) * np.sign(volume)
        found = q[(np.abs(volume) > _TOUCH) & (pushes >= -_TOUCH).all(axis=0)] + place
        inside = (found @ self.normals.T >= self.offsets - _TOUCH).all(axis=1)
        apart = ((found[:, None] - near[None]) ** 2).sum(axis=2) >= 4.0 - _TOUCH
        return found[inside & apart.all(axis=1)]


@cache
def _pairs(count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All pairs i < j."""
    first, second = np.triu_indices(count, 1)
    return first, second
