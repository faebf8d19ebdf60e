"""Packings at the start of a run: bodies on sites of a lattice, chosen and shifted by the seed. All engines read the same file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace as Parameters

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark.common.errors import DembarkError

Array = NDArray[np.float64]
# Multiplication by a prime modulo the number of sites is a permutation.
_PRIME = 15485863
_OTHER_PRIMES = (32452843, 49979687, 67867967)
_TREND = 0.3  # largest correlation of a permutation with its index
# Sites of a lattice, and bodies of a packing: about 1 GB while it is made.
MOST_SITES = 1e7


@dataclass(frozen=True)
class Packing:
    """Bodies at the time zero: `box` (3, 2) in m, `positions` (n, 3) in m, `diameters` (n,) in m, `densities` (n,) in kg/m^3, `types` (n,)
    counted from 1; `velocities` (n, 3) in m/s and `spins` (n, 3) in rad/s where they are not zero; `type_count` if more
    types are needed."""

    box: Array
    positions: Array
    diameters: Array
    densities: Array
    types: NDArray[np.int64]
    velocities: Array | None = None
    spins: Array | None = None
    type_count: int = 2

    @property
    def volume(self) -> float:
        """Volume of all bodies (m^3)."""
        return float(np.pi / 6.0 * (self.diameters**3).sum())

    def joined(self, places: Array, diameter: float, density: float, kind: int) -> Packing:
        """With bodies of one `diameter` (m), `density` (kg/m^3) and type `kind` at `places` (n, 3) in m after those of this packing."""
        count = len(places)
        return replace(self, positions=np.vstack([self.positions, places]), diameters=np.append(self.diameters, np.full(count, diameter)),
                       densities=np.append(self.densities, np.full(count, density)), types=np.append(self.types, np.full(count, kind)))

    def text(self) -> str:
        """A LAMMPS data file of atom style granular, with all digits: id type diameter density x y z; id vx vy vz wx wy wz."""
        lines = ["dembark packing", "", f"{len(self.diameters)} atoms", f"{self.type_count} atom types"]
        lines += [f"{low:.17g} {high:.17g} {axis}lo {axis}hi" for axis, (low, high) in zip("xyz", self.box, strict=True)]
        lines += ["", "Atoms", ""]
        rows = np.column_stack((self.diameters, self.densities, self.positions))
        bodies = enumerate(zip(self.types, rows, strict=True), 1)
        lines += [f"{number} {kind} " + " ".join(f"{x:.17g}" for x in row) for number, (kind, row) in bodies]
        if self.velocities is not None or self.spins is not None:
            zero = np.zeros_like(self.positions)
            motion = np.column_stack((zero if self.velocities is None else self.velocities, zero if self.spins is None else self.spins))
            lines += ["", "Velocities", "", *(f"{number} " + " ".join(f"{x:.17g}" for x in row) for number, row in enumerate(motion, 1))]
        return "\n".join(lines) + "\n"


def uniform(numbers: NDArray[np.int64], seed: int, use: int) -> Array:
    """One number in [0, 1) for each body's number (counted from 1) and use: the fractional part of a large sine."""
    x = 43758.5453 * np.sin(12.9898 * numbers + 78.233 * seed + use)
    return x - np.floor(x)


def require_room(sites: float, spacing: float) -> None:
    """DembarkError when a lattice of this `spacing` (m) would have more `sites` than a packing may have, before any memory is used."""
    if not sites <= MOST_SITES:
        raise DembarkError(f"bodies {spacing:.3g} m apart fill a lattice of about {sites:.2g} sites",
                           f"a packing may have {MOST_SITES:.0e}", "take larger bodies, a smaller vessel or fewer bodies")


def lattice(counts: tuple[int, int, int], cell: tuple[float, float, float], origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Array:
    """Middles (n, 3) in m of the cells of a lattice, x fastest."""
    require_room(math.prod(counts), min(cell))
    k, j, i = np.meshgrid(*(np.arange(count) for count in reversed(counts)), indexing="ij")
    return np.asarray(origin) + (np.column_stack((i.ravel(), j.ravel(), k.ravel())) + 0.5) * np.asarray(cell)


def cylinder(radius: float, spacing: float, low: float, layers: int) -> Array:
    """Points (n, 3) in m of a cubic lattice of `spacing` (m) within `radius` (m) of the z axis, in `layers` from z = `low` (m) on."""
    require_room(math.pi * (radius / spacing) ** 2 * layers, spacing)
    reach = int(np.ceil(radius / spacing))
    side = spacing * np.arange(-reach, reach + 1)
    y, x = np.meshgrid(side, side, indexing="ij")
    # A hair wider than needed: round-off does not decide whether a point lies inside.
    inside = np.hypot(x, y) <= 1.000001 * radius
    plane = np.column_stack((x[inside], y[inside]))
    return np.vstack([np.column_stack((plane, np.full(len(plane), low + spacing * k))) for k in range(layers)])


def largest(p: Parameters) -> float:
    """Diameter (m) of the largest grain."""
    return float(p.grain_diameter * (1.0 + p.grain_diameter_spread))


def drag(p: Parameters, step: float) -> float:
    """Coefficient (kg/s) of a drag under which grains of one diameter slow down within ten steps of `step` (s)."""
    return float(math.pi / 6.0 * p.grain_density * p.grain_diameter**3 / (10.0 * step))


def grains(p: Parameters, sites: Array, box: object) -> Packing:
    """p.grain_count grains on some of the `sites` (n, 3), chosen by the seed, each shifted by up to 0.05 d_max an axis. Diameters are
    uniform within the spread about the mean. Grains do not touch when sites are 1.15 d_max apart. DembarkError when there are fewer sites
    than grains."""
    total, count = len(sites), p.grain_count
    if count > total:
        raise DembarkError(f"{count} grains have no room", f"the dilute column has {total} sites", "take fewer grains or a larger vessel")
    numbers = np.arange(1, total + 1)
    kept = numbers[((numbers + p.seed) * _PRIME) % total < count]
    shift = np.column_stack([2.0 * uniform(kept, p.seed, use) - 1.0 for use in (2, 3, 4)])
    sizes = p.grain_diameter * (1.0 + p.grain_diameter_spread * (2.0 * uniform(kept, p.seed, 1) - 1.0))
    return Packing(np.asarray(box, float), sites[kept - 1] + 0.05 * largest(p) * shift, sizes, np.full(count, p.grain_density),
                   np.ones(count, np.int64))


def bodies(box: ArrayLike, positions: ArrayLike, radii: ArrayLike, masses: ArrayLike, types: ArrayLike | None = None, type_count: int = 1,
           velocities: ArrayLike | None = None, spins: ArrayLike | None = None) -> Packing:
    """Bodies of given `masses` (n,) in kg, which need not be spheres: engines read the density of a sphere of that mass. See Packing."""
    size, mass = np.broadcast_arrays(np.asarray(radii, float), np.asarray(masses, float))
    velocity, spin = (None if given is None else np.asarray(given, float) for given in (velocities, spins))
    kinds = np.ones(len(size), np.int64) if types is None else np.asarray(types, np.int64)
    density = mass / (4.0 / 3.0 * np.pi * size**3)
    return Packing(np.asarray(box, float), np.asarray(positions, float), 2.0 * size, density, kinds, velocity, spin, type_count)


def slab(p: Parameters, width: float, depth: float, margin: float, foot: float, rows: int = 0, size: float = 0.0) -> tuple[Array, float]:
    """Sites (n, 3) in m of a dilute column in a slab and its height (m): 0 < x < `width` less `margin` at both walls, period `depth` in y,
    in which there are `rows` (0: as many as fit), for grains up to the `size` (m; 0: d_max). Cells are at least 1.15 of that wide, 1.3
    times more than grains, from z = `foot` on. With a shift of up to 0.05 d_max no two grains touch, nor does one a wall that is 0.15 d_max
    or more away from the cells."""
    least = 1.15 * (size or largest(p))
    n_x, n_y = int((width - 2.0 * margin) / least), rows or int(depth / least)
    layers = math.ceil(1.3 * p.grain_count / (n_x * n_y))
    cell = ((width - 2.0 * margin) / n_x, depth / n_y, least)
    return lattice((n_x, n_y, layers), cell, (margin, 0.0, foot)), layers * least


def rank(count: int, seed: int) -> NDArray[np.int64]:
    """A permutation of 0 ... count - 1 by the seed, which does not rise or fall with its index."""
    numbers = np.arange(count)
    found = [((numbers + 1 + seed) * prime) % count for prime in (_PRIME, *_OTHER_PRIMES)]
    if count < 3:
        return found[0]
    # For one count in a hundred a prime is close to a multiple of it, and the permutation is almost the order that it is to destroy.
    trends = [abs(float(np.corrcoef(numbers, each)[0, 1])) for each in found]
    return found[0] if trends[0] < _TREND else found[int(np.argmin(trends))]
