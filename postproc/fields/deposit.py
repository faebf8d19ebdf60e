"""Spreads what points and lines carry over the cells of a grid, by the kernel's exact share in each cell."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark import _fields
from dembark.common.errors import DembarkError
from dembark.postproc.dumps.frames import cell
from dembark.postproc.fields.carried import Contacts, Grains
from dembark.postproc.fields.grid import Grid, periodic_images
from dembark.postproc.fields.kernels import NAMES, Kernel, ball_shares, cumulative, line_nodes, unit_gauss
from dembark.postproc.grains import GrainFrame

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_CHUNK = 4_000_000  # shares that numpy holds at once
_MOST_THREADS = 64
_LINES = 1 << 18  # lines whose columns numpy holds at once


@dataclass(frozen=True, eq=False)
class Spreader:
    """How one frame is spread over `grid`: with `kernel`, `closed` or not, by `backend` on `threads` (all cores when None).

    All periodic images in the box of `frame` count. With `closed`, the shares of each place on a line inside the grid are scaled to sum
    to 1 within it, and places outside have none; otherwise what lies beyond the grid is lost. `backend` is "native" or "numpy": the
    same to round-off, the first compiled.
    """

    grid: Grid
    kernel: Kernel
    frame: GrainFrame
    closed: bool = False
    threads: int | None = None
    backend: str = "native"

    def __post_init__(self) -> None:
        """Refuse (DembarkError) other backends and less than one thread."""
        if self.backend not in ("native", "numpy"):
            raise DembarkError(f"unknown backend '{self.backend}'", "coarse graining", "choose native or numpy")
        if self.threads is not None and self.threads < 1:
            raise DembarkError(f"{self.threads} threads", "coarse graining", "give at least 1")

    @property
    def workers(self) -> int:
        """The number of threads; more than a few for each core would only wait, and very many cannot be started."""
        cores = len(os.sched_getaffinity(0))
        return min(self.threads or cores, max(_MOST_THREADS, cores))

    def grains(self, grains: Grains, out: Array) -> None:
        """Add to `out` (nx, ny, nz, 32), made by `zeros`, what the grains carry times the kernel's shares about them."""
        # Moments are taken about the middle of the grid, so that the second ones lose few digits.
        middle = 0.5 * (self.grid.low + self.grid.high)
        if self.backend == "native":
            self._target().grains(**_all_plain(grains), middle=middle, out=_rows(out))
            return
        for index, shift in self._images(grains.places, None):
            place = grains.places[index] + shift
            self._add(place, None, grains.values(index, place - middle), line_nodes(self.kernel, 0.0), out)

    def contacts(self, contacts: Contacts, out: Array) -> None:
        """Add to `out` (nx, ny, nz, 20), made by `zeros`, what the contacts carry times the mean shares along their branches."""
        place, weight = line_nodes(self.kernel, _longest(contacts.branch))
        if self.backend == "native":
            self._target().contacts(**_all_plain(contacts), place=place, weight=weight, out=_rows(out))
            return
        for index, shift in self._images(contacts.first, contacts.branch):
            self._add(contacts.first[index] + shift, contacts.branch[index], contacts.values(index), (place, weight), out)

    def lines(self, first: Array, branch: Array, values: Array, out: Array) -> None:
        """Add to `out` (nx, ny, nz, c) the sum over lines from `first` to `first + branch` (m, 3) in m of `values` (m, c) times the mean
        share along the line."""
        place, weight = line_nodes(self.kernel, _longest(branch))
        if self.backend == "native":
            self._target().lines(_plain(first), _plain(branch), _plain(values), place, weight, _rows(out))
            return
        for index, shift in self._images(first, branch):
            self._add(first[index] + shift, branch[index], values[index], (place, weight), out)

    def points(self, places: Array, values: Array, out: Array) -> None:
        """The same for points at `places` (n, 3) in m."""
        self.lines(places, np.zeros_like(places), values, out)

    def _target(self) -> _fields.Target:
        grid, kernel, frame = self.grid, self.kernel, self.frame
        places, shares = unit_gauss(kernel.nodes_per_cell(grid))
        return _fields.Target(
            low=grid.low,
            high=grid.high,
            shape=np.array(grid.shape, float),
            edges=cell(frame.low, frame.high, frame.tilt),
            periodic=np.array(grid.periodic, float),
            box_periodic=np.array(frame.periodic, float),
            kind=NAMES.index(kernel.name),
            width=kernel.width,
            reach=kernel.reach,
            closed=self.closed,
            cell_place=places,
            cell_weight=shares,
            threads=self.workers,
        )

    def _images(self, first: Array, branch: Array | None) -> Iterator[tuple[Index, Array]]:
        """Indices (k,) and shifts (k, 3) in m of all images that reach the grid, in chunks."""
        last = first if branch is None else first + branch
        index, shift = periodic_images(np.minimum(first, last), np.maximum(first, last), self.kernel.reach, self.grid, self.frame)
        for begin in range(0, len(index), _LINES):
            yield index[begin : begin + _LINES], shift[begin : begin + _LINES]

    def _add(self, first: Array, branch: Array | None, values: Array, nodes: tuple[Array, Array], out: Array) -> None:
        branch = np.zeros_like(first) if branch is None else branch
        _deposit(first, branch, values, *nodes, self.grid, self.kernel, self.closed, out)


def zeros(grid: Grid, columns: int) -> Array:
    """Zeros (nx, ny, nz, columns), in memory as the compiled code fills them: a row of cells along z for each column."""
    nx, ny, nz = grid.shape
    return np.zeros((nx, ny, columns, nz)).transpose(0, 1, 3, 2)


def _rows(out: Array) -> Array:
    return out.transpose(0, 1, 3, 2)


def _all_plain(carried: Grains | Contacts) -> dict[str, Any]:
    """What grains or contacts carry, by name, as the compiled code takes it."""
    values = {item.name: getattr(carried, item.name) for item in fields(carried)}
    return {name: None if one is None else _plain(one) for name, one in values.items()}


def _plain(values: NDArray[Any]) -> NDArray[Any]:
    """`values` as the compiled code takes them: contiguous, of 8 bytes or flags."""
    kind = values.dtype if values.dtype in (np.bool_, np.int64) else np.float64
    return np.ascontiguousarray(values, kind)


def _longest(branch: Array) -> float:
    return float(np.sqrt(np.einsum("ij,ij->i", branch, branch).max())) if len(branch) else 0.0


def _deposit(
    first: Array, branch: Array, values: Array, nodes: Array, weights: Array, grid: Grid, kernel: Kernel, closed: bool, out: Array
) -> None:
    """What the compiled code does, in numpy: the mean of the shares at the places `nodes` (q,) of a line with `weights` (q,)."""
    for begin, end, window in _chunks(first, branch, grid, kernel):
        points = first[begin:end, None, :] + nodes[:, None] * branch[begin:end, None, :]
        start, counts = window
        share = np.zeros((end - begin, *counts))
        for node, weight in enumerate(weights):
            share += weight * point_shares(points[:, node], start, counts, grid, kernel, closed)
        cell = [start[:, axis, None] + np.arange(counts[axis]) for axis in range(3)]
        inside = [(index >= 0) & (index < grid.shape[axis]) for axis, index in enumerate(cell)]
        x, y, z = (np.clip(index, 0, grid.shape[axis] - 1) for axis, index in enumerate(cell))
        flat = (x[:, :, None, None] * grid.shape[1] + y[:, None, :, None]) * grid.shape[2] + z[:, None, None, :]
        share *= inside[0][:, :, None, None] & inside[1][:, None, :, None] & inside[2][:, None, None, :]
        pointers = np.arange(0, share.size + 1, share[0].size)
        from scipy.sparse import csr_matrix  # slow to import, and not needed before something is measured

        spread = csr_matrix((share.ravel(), flat.ravel(), pointers), shape=(end - begin, grid.cells))
        out += (spread.T @ values[begin:end]).reshape(out.shape)


def _chunks(
    first: Array, branch: Array, grid: Grid, kernel: Kernel
) -> Iterator[tuple[int, int, tuple[Index, tuple[int, int, int]]]]:
    """Ranges of lines with the first cell (n, 3) and the number of cells (3,) of a window that holds all that a line reaches."""
    per_line, begin = 1, 0
    while begin < len(first):
        end = min(len(first), begin + max(1, _CHUNK // (per_line * 4)))
        ends = np.stack([first[begin:end], first[begin:end] + branch[begin:end]])
        start = np.floor((ends.min(axis=0) - kernel.reach - grid.low) / grid.spacing)
        stop = np.ceil((ends.max(axis=0) + kernel.reach - grid.low) / grid.spacing)
        if kernel.name == "gaussian":
            # A factor of each axis needs no cells outside the grid; the others are normalised over the whole ball.
            start, stop = np.clip(start, 0, np.array(grid.shape) - 1), np.clip(stop, 1, grid.shape)
        counts = np.maximum(1, (stop - start).max(axis=0)).astype(int)
        needed = int(np.prod(counts)) * (1 if kernel.name == "gaussian" else kernel.nodes_per_cell(grid) ** 3)
        if end - begin > 1 and (end - begin) * needed > _CHUNK:
            per_line = max(needed, 2 * per_line)
            continue
        yield begin, end, (start.astype(int), tuple(counts.tolist()))
        begin = end


def point_shares(points: Array, start: Index, counts: tuple[int, int, int], grid: Grid, kernel: Kernel, closed: bool) -> Array:
    """Shares (p, a, b, c) of the kernel about `points` (p, 3) in the windows of `counts` = (a, b, c) cells from cell `start` (p, 3)."""
    edges = [grid.low[axis] + (start[:, axis, None] + np.arange(counts[axis] + 1)) * grid.spacing[axis] for axis in range(3)]
    edges = [edge - points[:, axis, None] for axis, edge in enumerate(edges)]
    if kernel.name == "gaussian":
        factors = [np.diff(cumulative(kernel, edge), axis=1) for edge in edges]
        if closed:
            factors = [_closed(factor, points[:, axis], axis, grid, kernel) for axis, factor in enumerate(factors)]
        return np.einsum("pa,pb,pc->pabc", *factors)
    share = ball_shares(kernel, tuple(edges), kernel.nodes_per_cell(grid))
    if closed:
        for axis in range(3):
            if grid.periodic[axis]:
                continue
            index = start[:, axis, None] + np.arange(counts[axis])
            inside = (index >= 0) & (index < grid.shape[axis]) & _within(points[:, axis], axis, grid)[:, None]
            share *= inside.reshape(len(points), *(counts[axis] if other == axis else 1 for other in range(3)))
    total = share.sum(axis=(1, 2, 3), keepdims=True)
    return np.divide(share, total, out=np.zeros_like(share), where=total > 0.0)


def _within(places: Array, axis: int, grid: Grid) -> NDArray[np.bool_]:
    return (places >= grid.low[axis]) & (places <= grid.high[axis])


def _closed(factor: Array, places: Array, axis: int, grid: Grid, kernel: Kernel) -> Array:
    if grid.periodic[axis]:
        return factor
    total = cumulative(kernel, grid.high[axis] - places) - cumulative(kernel, grid.low[axis] - places)
    scale = np.divide(1.0, total, out=np.zeros_like(total), where=_within(places, axis, grid) & (total > 0.0))
    return factor * scale[:, None]
