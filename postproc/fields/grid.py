"""The regular grid of cells that fields live on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError

from ..dumps.frames import cell
from ..grains import GrainFrame

Array = NDArray[np.float64]

_MOST_CELLS = 1e15  # no memory holds them; their number is still exact


@dataclass(frozen=True, eq=False)
class Grid:
    """`shape` = (nx, ny, nz) equal cells between the corners `low` and `high` (3,) in m; one cell along an axis averages over it.

    `periodic` says along which axes the grid spans exactly one period of the simulation box, so that what leaves on one side enters
    on the other.
    """

    low: Array
    high: Array
    shape: tuple[int, int, int]
    periodic: tuple[bool, bool, bool] = (False, False, False)

    def __post_init__(self) -> None:
        """Refuse (DembarkError) corners that are not finite or not in order, and shapes that are not three positive integers."""
        low, high = np.array(self.low, float), np.array(self.high, float)
        if low.shape != (3,) or high.shape != (3,) or not np.isfinite([low, high]).all() or not (low < high).all():
            raise DembarkError(f"no grid can reach from {self.low} to {self.high} m", "its corners",
                               "give three finite coordinates each, low < high")
        shape = tuple(int(count) for count in self.shape)
        if len(shape) != 3 or min(shape) < 1 or any(count != given for count, given in zip(shape, self.shape, strict=True)):
            raise DembarkError(f"no grid can have {self.shape} cells", "its shape", "give three integers of at least 1")
        low.flags.writeable = high.flags.writeable = False
        for name, value in (("low", low), ("high", high), ("shape", shape), ("periodic", tuple(bool(flag) for flag in self.periodic))):
            object.__setattr__(self, name, value)

    @classmethod
    def around(cls, frame: GrainFrame, spacing: float | Sequence[float] | Array, margin: float = 0.0) -> Grid:
        """Grid of cells of at most `spacing` (m; one number or three) around all grains of `frame`.

        On a periodic axis it spans the box exactly. Elsewhere it reaches `margin` (m) beyond the grains' surfaces; with a margin of
        the kernel's reach (see Kernel.reach) nothing of any grain is lost.
        """
        wanted = np.broadcast_to(np.asarray(spacing, float), 3)
        if not (np.isfinite(wanted).all() and (wanted > 0.0).all() and 0.0 <= margin < np.inf):
            raise DembarkError(f"no grid can have cells of {spacing} m and a margin of {margin} m", "grid",
                               "give a positive size and a margin of at least 0")
        low, high, periodic = extent(frame, margin)
        if not np.isfinite([low, high]).all():
            raise DembarkError("no grains", f"step {frame.step}", "a grid around them needs at least one, or a periodic box")
        return cls(low, high, cell_counts(low, high, wanted), (bool(periodic[0]), bool(periodic[1]), bool(periodic[2])))

    @property
    def spacing(self) -> Array:
        """Edge lengths of a cell (3,) in m."""
        return (self.high - self.low) / np.array(self.shape)

    @property
    def cell_volume(self) -> float:
        """Volume of a cell in m3."""
        return float(np.prod(self.spacing))

    @property
    def cells(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    def edges(self, axis: int) -> Array:
        """Faces of the cells (n + 1,) in m along `axis`."""
        return np.linspace(self.low[axis], self.high[axis], self.shape[axis] + 1)

    def centres(self, axis: int) -> Array:
        """Centres of the cells (n,) in m along `axis`."""
        edges = self.edges(axis)
        return 0.5 * (edges[1:] + edges[:-1])

    def points(self) -> Array:
        """Centres of all cells (nx, ny, nz, 3) in m."""
        return np.stack(np.meshgrid(*(self.centres(axis) for axis in range(3)), indexing="ij"), axis=-1)

    def same(self, other: Grid) -> bool:
        """Whether both have the same cells."""
        return (
            self.shape == other.shape
            and self.periodic == other.periodic
            and np.array_equal(self.low, other.low)
            and np.array_equal(self.high, other.high)
        )


def extent(frame: GrainFrame, margin: float = 0.0) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Corners (3,) in m of the region around all grains of `frame` and `margin` (m) beyond their surfaces, and its periodic axes, on which
    it is that of the box; infinite, the lower one above the upper, where there is no grain."""
    periodic, reach = np.asarray(frame.periodic, bool), np.asarray(frame.radii)[:, None] + margin
    low = np.where(periodic, frame.low, (frame.wrapped - reach).min(axis=0, initial=np.inf))
    high = np.where(periodic, frame.high, (frame.wrapped + reach).max(axis=0, initial=-np.inf))
    return low, high, periodic


def cell_counts(low: Array, high: Array, spacing: float | Array) -> tuple[int, int, int]:
    """Numbers of cells of at most `spacing` (m; one number or three) between two corners (3,) in m; DembarkError for too many to count."""
    # A share of 1e-9 keeps a length that is an integer multiple of the spacing from getting one cell more by round-off.
    count = np.maximum(1.0, np.ceil((high - low) / spacing * (1.0 - 1e-9)))
    if not (count < _MOST_CELLS).all() or not count.prod() < _MOST_CELLS:
        raise DembarkError(f"{' × '.join(f'{one:.3g}' for one in count)} cells are too many", "grid", "take larger ones")
    return int(count[0]), int(count[1]), int(count[2])


def periodic_images(low: Array, high: Array, reach: float, grid: Grid, frame: GrainFrame) -> tuple[NDArray[np.int64], Array]:
    """All images of n boxes from `low` to `high` (n, 3) in m that come within `reach` (m) of `grid`: indices (k,) and shifts (k, 3) in m.

    The images are those of the periodic axes of `frame`, whose own box may be triclinic. A box across several borders has an image for
    each.
    """
    lattice = cell(frame.low, frame.high, frame.tilt)
    length = np.diag(lattice)
    index, shift = np.arange(len(low)), np.zeros((len(low), 3))
    # From z to x: a later edge vector no longer moves an image along the axes done before.
    for axis in (2, 1, 0):
        if len(index) == 0:
            break
        least, most = low[index, axis] + shift[:, axis] - reach, high[index, axis] + shift[:, axis] + reach
        numbers: Sequence[int] = [0]
        if frame.periodic[axis]:
            begin = np.ceil((grid.low[axis] - most.max()) / length[axis])
            end = np.floor((grid.high[axis] - least.min()) / length[axis])
            numbers = range(int(begin), int(end) + 1)
        found = []
        for number in numbers:
            away = number * length[axis]
            near = (most + away > grid.low[axis]) & (least + away < grid.high[axis])
            found.append((index[near], shift[near] + number * lattice[axis]))
        index, shift = (np.concatenate(parts) for parts in zip(*found, strict=True)) if found else (index[:0], shift[:0])
    return index, shift


def check_periods(grid: Grid, frame: GrainFrame) -> None:
    """DembarkError unless each periodic axis of `grid` spans one period of the box of `frame`."""
    for axis in range(3):
        period = float(frame.high[axis] - frame.low[axis])
        if grid.periodic[axis] and not (frame.periodic[axis] and abs(grid.high[axis] - grid.low[axis] - period) <= 1e-9 * period):
            flag = "" if frame.periodic[axis] else "not "
            raise DembarkError(f"the grid is periodic along {'xyz'[axis]} over {grid.high[axis] - grid.low[axis]:.9g} m",
                               f"the box at step {frame.step} is {flag}periodic there, {period:.9g} m long", "both must agree")
