"""Averages over cells: square or cubic cells with 5 to 20 grains each, averaged until several thousand contacts fell into a cell.

A grain belongs to the cell of its centre, a contact to that of the middle of its branch. The stress is, compression positive,

    sum m v' v' / V  -  sum f l / V,

with v' about the mean velocity of the cell over all frames, f the force on the grain at which the branch l begins. Averages over cells
with few contacts are masked, their counts are kept.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.memory import check_memory

from ..contacts import ContactFrame
from ..dumps.frames import cell
from ..grains import GrainFrame
from ..spheres import volume
from .accumulators import full_tensor, ratio, symmetric_parts
from .coarse_graining import WallContacts, check_contacts
from .field_set import FieldSet
from .grid import Grid, check_periods

Array = NDArray[np.float64]

FIELDS = ("density", "solid_fraction", "velocity", "kinetic_stress", "contact_stress", "stress", "temperature", "grain_count",
          "contact_count")
LEAST_CONTACTS = 3000
_BYTES = 400.0  # of the sums of a cell, and of what makes them


@dataclass(frozen=True, eq=False)
class CellTotals:
    """Sums over `frames` frames per cell of `grid`; `+` adds frames.

    `grains` (nx, ny, nz): number, `contacts`: number, `volume` (m3), `mass` (kg); `momentum` (nx, ny, nz, 3); `energy` (nx, ny, nz, 6):
    sum m v v as xx yy zz xy xz yz (J); `moment` (nx, ny, nz, 9): -sum f l (J).
    """

    grid: Grid
    frames: int
    grains: Array
    contacts: Array
    volume: Array
    mass: Array
    momentum: Array
    energy: Array
    moment: Array

    def __add__(self, other: CellTotals) -> CellTotals:
        """The sums of both; DembarkError when their grids differ."""
        if not self.grid.same(other.grid):
            raise DembarkError("the sums are on different grids", "averaging cells over frames", "use the same grid for all frames")
        added = {item.name: getattr(self, item.name) + getattr(other, item.name) for item in fields(self) if item.name != "grid"}
        return CellTotals(self.grid, **added)

    def average(self, least_contacts: int = LEAST_CONTACTS) -> FieldSet:
        """The averages FIELDS, masked where a cell has less than `least_contacts` contacts in all frames together."""
        all_volume = self.frames * self.grid.cell_volume
        velocity = ratio(self.momentum, self.mass)
        kinetic = (full_tensor(self.energy) - np.nan_to_num(self.momentum[..., :, None] * velocity[..., None, :])) / all_volume
        contact = self.moment.reshape(*self.grid.shape, 3, 3) / all_volume
        density = self.mass / all_volume
        thin = self.contacts < least_contacts

        def masked(values: Array) -> Array:
            return np.where(thin.reshape(*thin.shape, *(1,) * (values.ndim - 3)), np.nan, values)

        values = {"density": density, "velocity": velocity, "solid_fraction": self.volume / all_volume, "kinetic_stress": kinetic,
                  "temperature": ratio(np.maximum(np.trace(kinetic, axis1=-2, axis2=-1), 0.0), 3.0 * density), "contact_stress": contact,
                  "stress": kinetic + contact}
        counts = {"grain_count": self.grains, "contact_count": self.contacts}
        return FieldSet(self.grid, self.frames, {name: masked(one) for name, one in values.items()} | counts, thin)


def cell_totals(grains: GrainFrame, contacts: ContactFrame | None, grid: Grid, walls: Sequence[WallContacts] = ()) -> CellTotals:
    """Sums of one frame; a contact with a wall has the branch from the grain's centre to the wall."""
    check_periods(grid, grains)
    check_contacts(contacts, grains)
    check_memory(_BYTES * grid.cells, f"{' × '.join(map(str, grid.shape))} cells", "take fewer")
    starts = [wall.positions for wall in walls]
    branches = [wall.points - wall.positions for wall in walls]
    forces = [wall.forces for wall in walls]
    if contacts is not None:
        starts, branches, forces = [contacts.first, *starts], [contacts.branch, *branches], [contacts.forces, *forces]
    start, branch, force = (np.concatenate([np.zeros((0, 3)), *parts]) for parts in (starts, branches, forces))
    home, where = _cells(grains.wrapped, grains, grid), _cells(start + 0.5 * branch, grains, grid)
    mass, velocity = grains.masses, grains.velocities

    def summed(place: NDArray[np.int64], values: Array) -> Array:
        """Sums (nx, ny, nz[, c]) of `values` (n[, c]) by cell; number grid.cells is outside."""
        columns = values.T if values.ndim == 2 else [values]
        sums = [np.bincount(place, weights=column, minlength=grid.cells + 1)[: grid.cells] for column in columns]
        return np.stack(sums, axis=-1).reshape(*grid.shape, *values.shape[1:]).astype(float, copy=False)

    return CellTotals(grid, 1, summed(home, np.ones(len(home))), summed(where, np.ones(len(where))), summed(home, volume(grains.radii)),
                      summed(home, mass), summed(home, mass[:, None] * velocity),
                      summed(home, symmetric_parts(mass[:, None] * velocity, velocity)),
                      summed(where, -np.einsum("na,nb->nab", force, branch).reshape(len(force), 9)))


def cell_average(frames: Iterable[tuple[GrainFrame, ContactFrame | None]], grid: Grid, *, least_contacts: int = LEAST_CONTACTS) -> FieldSet:
    """Averages over `frames` of (grains, contacts), read one at a time; DembarkError when there are none."""
    total: CellTotals | None = None
    for grains, contacts in frames:
        one = cell_totals(grains, contacts, grid)
        total = one if total is None else total + one
    if total is None:
        raise DembarkError("no frames", "averaging over cells", "give at least one")
    return total.average(least_contacts)


def cell_grid(frame: GrainFrame, grains: float = 10.0) -> Grid:
    """Grid around the grains of `frame` whose cells, cubes, hold about `grains` of them where they are packed.

    The number density is the median over the grains of that in the cell of each, in cells of four mean diameters.
    """
    if not grains >= 1.0:
        raise DembarkError(f"cells of {grains} grains are too small", "averaging over cells", "give at least 1; 5 to 20 are usual")
    if len(frame.radii) == 0:
        raise DembarkError("no grains", f"step {frame.step}", "the size of cells follows from them")
    trial = Grid.around(frame, 8.0 * float(frame.radii.mean()))
    home = _cells(frame.wrapped, frame, trial)
    density = float(np.median(np.bincount(home, minlength=trial.cells)[home])) / trial.cell_volume
    return Grid.around(frame, (grains / density) ** (1.0 / 3.0))


def _cells(places: Array, frame: GrainFrame, grid: Grid) -> NDArray[np.int64]:
    """Numbers (n,) of the cells of `places` (n, 3) in m, folded into the box; grid.cells for those outside the grid."""
    places, edges = np.array(places), cell(frame.low, frame.high, frame.tilt)
    for axis in (2, 1, 0):
        if frame.periodic[axis]:
            places -= np.floor((places[:, axis] - grid.low[axis]) / edges[axis, axis])[:, None] * edges[axis]
    index = np.floor((places - grid.low) / grid.spacing)
    # What lies on an upper face belongs to the last cell; folding can round a place up to it.
    index[places == grid.high] -= 1.0
    inside = np.asarray(((index >= 0) & (index < grid.shape)).all(axis=1))
    safe = np.where(inside[:, None], index, 0.0).astype(np.int64)
    return np.where(inside, np.ravel_multi_index(tuple(safe.T), grid.shape), grid.cells)
