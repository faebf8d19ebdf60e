"""Fields of many frames: in which groups, on which grid, with which walls, and the summary in lines."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from functools import reduce
from itertools import islice
from operator import add

import numpy as np
import xarray
from numpy.typing import NDArray

from dembark.common.choices import pick
from dembark.common.errors import DembarkError
from dembark.common.memory import check_memory

from ..cli_options import counts, length, span
from ..contacts import ContactFrame
from ..grains import GrainFrame
from ..output.netcdf import dataset, joined
from ..sources import Selection, Sizes
from ..walls import Inclusion, wall_contacts
from ..walls.run import WallLoads, wall_lines
from ..walls.stress import WallStress
from .accumulators import MASS, MOMENTUM
from .cells import FIELDS, LEAST_CONTACTS, cell_grid, cell_totals
from .coarse_graining import WallContacts, coarse_grain
from .field_set import FieldSet
from .grid import Grid, cell_counts, extent
from .kernels import Kernel

Array = NDArray[np.float64]
Attributes = Mapping[str, str | float | int]
Show = Callable[[str, int], AbstractContextManager[Callable[[], None]]]
Loaded = tuple[GrainFrame, ContactFrame | None, list[WallContacts]]

_PATCH = 2.0  # size of a wall's patches in mean diameters
# Most memory (bytes) that a cell of the grid takes, by (averages by cell?, several frames?); and for each time in the results.
_BYTES = {(True, False): 700.0, (True, True): 800.0, (False, False): 1250.0, (False, True): 1700.0}
_HELD = 1500.0


@dataclass
class _Sample:
    """Frames that are averaged: `times` (s), and `totals` (5,) of all grains of each: mass, momentum along x, y, z, and sum of m |v|."""

    times: list[float] = field(default_factory=list)
    totals: list[Array] = field(default_factory=list)

    def add(self, grains: GrainFrame, time: float) -> None:
        momenta = grains.masses[:, None] * grains.velocities
        self.times.append(time)
        self.totals.append(np.array([grains.masses.sum(), *momenta.sum(axis=0), np.linalg.norm(momenta, axis=1).sum()]))


class FieldAverages:
    """Averages of groups of the `chosen` frames, by coarse graining or, with `cells`, by cells; texts are those of the command line.

    `kernel` and its `width`; numbers of cells (`grid`) or their size (`spacing`), and the region (`box`), by default around all grains;
    `average` "all" frames, or so many at a time; `walls` whose part of the stress counts; `only` names of the fields to keep, by
    default all. Cells with fewer than `least_contacts` are masked. `show` reports how far the reading of all frames is. DembarkError for
    what cannot be, before any frame is averaged.
    """

    def __init__(self, chosen: Selection, *, kernel: str = "gaussian", width: str = "1.5d", grid: str | None = None,
                 spacing: str | None = None, box: str | None = None, average: str = "all", walls: Iterable[str] = (), cells: bool = False,
                 least_contacts: int = LEAST_CONTACTS, only: str | None = None, threads: int | None = None,
                 show: Show | None = None) -> None:
        if grid is not None and spacing is not None:
            raise DembarkError("--grid and --spacing are both given", "", "give one of them")
        self.chosen, self.cells, self.least_contacts, self.threads = chosen, cells, least_contacts, threads
        self.only = _names(only, FIELDS if cells else FieldSet.units)
        self.groups, self.left_over = _groups(list(chosen.numbers), average)
        self.kernel = None if cells else Kernel(kernel, length(width, chosen.diameter, "--width"))
        self.walls = WallLoads(list(walls), chosen)
        if cells and chosen.source.contacts is None:
            raise DembarkError("cell averages need contacts", f"{chosen.source.path} has none", "name their dump with --contacts")
        self.grid = self._grid(grid, spacing, box, show)
        # What `run` finds out: loads of the walls, masses (kg) in the fields and of the grains in each group, error of the momentum over
        # the sum of m |v|, share of the cells that are not masked, walls in an unknown place, whether a frame had a wall or a free axis.
        self.loads: list[WallStress] = []
        self.masses: list[tuple[float, float]] = []
        self.momentum_error, self.seen = 0.0, 1.0
        self.unplaced: list[str] = []
        self.walled = self.bounded = False
        self.sizes = Sizes()
        self.last: FieldSet | None = None

    def run(self, done: Callable[[GrainFrame, float], None] = lambda _frame, _time: None) -> xarray.Dataset:
        """The fields of all groups, see `output.dataset`; `done` is called with each frame that was used and its time (s).

        `last` are the fields of the last group, `loads` those of the walls.
        """
        self.walls.record(_PATCH * self.chosen.diameter)
        stream = self.chosen.source.frames([number for group in self.groups for number in group])
        found = []
        for group in self.groups:
            sample = _Sample()
            self.last = self._average(self._sampled(islice(stream, len(group)), sample, done), sample)
            span = sample.times[0], sample.times[-1]
            found.append(self._kept(dataset(self.last, 0.5 * sum(span), span, self.method(), timed=self.chosen.source.timed)))
        self.loads = self.walls.results()
        return joined(found)

    def _kept(self, data: xarray.Dataset) -> xarray.Dataset:
        """The chosen fields; DembarkError for one that the frames do not give."""
        for name in self.only:
            if name not in data:
                there = ", ".join(str(one) for one in data if not str(one).endswith("_bounds"))
                raise DembarkError(f"there is no {name}", "the dumps do not hold what it needs", f"there are {there}")
        return data[[*self.only, *(name for name in data if str(name).endswith("_bounds"))]] if self.only else data

    def _sampled(self, frames: Iterable[tuple[GrainFrame, ContactFrame | None]], sample: _Sample, done: Callable[[GrainFrame, float], None]
                 ) -> Iterator[Loaded]:
        """The frames with the contacts of their walls; each is noted in `sample` and `done` once it was used."""
        for grains, contacts in frames:
            self.walls.check(grains)
            time = self.chosen.source.time(grains)
            self.unplaced += [name for name in grains.wall_forces if name not in (*self.walls.names, *self.unplaced)]
            self.walled |= bool(grains.wall_forces)
            self.bounded |= not grains.periodic.all()
            walls = [one.wall for one in self.walls.walls]
            yield grains, contacts, [wall_contacts(grains, one, time) for one in walls if not isinstance(one, Inclusion)]
            sample.add(grains, time)
            self.sizes.add(grains)
            self.walls.add(grains, contacts, time)
            done(grains, time)

    def _average(self, frames: Iterator[Loaded], sample: _Sample) -> FieldSet:
        """The average of a group of frames; keeps what of its mass and momentum is in the cells, masked or not."""
        if self.kernel is None:
            totals = reduce(add, (cell_totals(grains, contacts, self.grid, touched) for grains, contacts, touched in frames))
            average = totals.average(self.least_contacts)
            self.seen = min(self.seen, float((totals.contacts >= self.least_contacts).mean()))
            self._balance(totals.mass, totals.momentum, sample)
            return average
        name, width = self.kernel.name, self.kernel.width
        sums = reduce(add, (coarse_grain(grains, contacts, self.grid, kernel=name, width=width, walls=touched, threads=self.threads)
                            for grains, contacts, touched in frames))
        self._balance(sums.grains[..., MASS], sums.grains[..., MOMENTUM], sample)
        return sums.fields()

    def _balance(self, mass: Array, momentum: Array, sample: _Sample) -> None:
        """Keep mass and error of the momentum of all cells, summed over frames."""
        expected, frames = np.mean(sample.totals, axis=0), len(sample.totals)
        self.masses.append((float(mass.sum()) / frames, float(expected[0])))
        if expected[4] > 0.0:
            error = np.abs(momentum.sum(axis=(0, 1, 2)) / frames - expected[1:4]).max() / expected[4]
            self.momentum_error = max(self.momentum_error, float(error))

    def method(self) -> Attributes:
        """How the fields are made, as attributes of a file."""
        method: dict[str, str | float | int] = {"method": "cell averages", "least_contacts": self.least_contacts}
        if self.kernel is not None:
            method = {"method": "coarse graining", "kernel": self.kernel.name, "kernel_width": self.kernel.width}
        record = self.chosen.source.record
        return {**method, "mean_diameter": self.chosen.diameter, "frames": sum(map(len, self.groups)),
                "walls": ", ".join(self.walls.names) or "none",
                **{name: str(record[name]) for name in ("case", "engine") if name in record}}

    def summary(self) -> list[str]:
        """What was computed and checked, in lines."""
        lines = [*self.chosen.averaging_notes(self.sizes), *self.chosen.lines(self.sizes), *self.walls.mesh_notes()]
        if self.left_over:
            lines.append(f"note: the last {self.left_over} frames do not fill a group and were left out")
        size = " × ".join(f"{1e3 * one:.4g}" for one in self.grid.spacing)
        how = f"{100.0 * self.seen:.3g} % of them have at least {self.least_contacts} contacts, the others are masked"
        if self.kernel is not None:
            how = f"{self.kernel.name} kernel of width {1e3 * self.kernel.width:.4g} mm ({self.kernel.width / self.chosen.diameter:.3g} d)"
        many = f"{len(self.groups)} times" if len(self.groups) > 1 else "1 time"
        lines.append(f"{' × '.join(map(str, self.grid.shape))} cells of {size} mm, {how}; {many}")
        if self.chosen.source.contacts is None:
            lines.append("note: without contacts there is no contact stress; name their dump with --contacts")
        elif self.bounded and not self.walled:
            lines.append("note: the dump has no forces of walls (columns f_force_NAME[1..3]); their part of the stress is missing, which "
                         "fades to 0 next to a wall")
        if self.unplaced:
            lines.append(f"note: the position of the wall {', '.join(self.unplaced)} is unknown; its part of the stress is missing, "
                         "add --wall")
        lines += [f"note: {one}; add --wall" for one in self.walls.notes]
        inside, there = max(self.masses, key=lambda one: abs(one[0] - one[1]))
        lines.append(f"mass: {inside:.9g} kg in the fields, {there:.9g} kg of grains, difference {abs(inside - there) / (there or 1.0):.1e}"
                     f"; momentum: difference {self.momentum_error:.1e} of the sum of m |v|")
        if there - inside > 1e-6 * there:
            lines.append(f"note: {100.0 * (1.0 - inside / there):.3g} % of the mass lie outside the region of --box")
        return lines + [line for one in self.loads for line in wall_lines(one, self.chosen.source)]

    def _grid(self, cells: str | None, spacing: str | None, box: str | None, show: Show | None) -> Grid:
        """Cells over the region the user wrote, or around the grains of all frames and as far as the kernel reaches."""
        source, diameter, numbers = self.chosen.source, self.chosen.diameter, [number for group in self.groups for number in group]
        size = length(spacing, diameter, "--spacing") if spacing else diameter
        measured = self.kernel is None and not spacing and not cells
        if box is None or measured:
            region = _Region(self.kernel.reach if self.kernel else 0.0, measured)
            with show("region", len(numbers)) if show else nullcontext() as advance:
                for number in numbers:
                    region.add(source.grains[number])
                    if advance:
                        advance()
            low, high, periodic, size = region.low, region.high, region.periodic, min(size if not measured else np.inf, region.size)
        if box is not None:
            parts = box.split(",")
            if len(parts) != 6:
                raise DembarkError(f"{box!r} is not a region", "in --box", "give x0,x1,y0,y1,z0,z1")
            spans = np.array([span(",".join(parts[2 * axis : 2 * axis + 2]), diameter, "--box") for axis in range(3)])
            # Only a grid over all of the period goes on at its other side.
            first = source.grains[numbers[0]]
            low, high = spans.T
            same = np.abs(spans - np.column_stack([first.low, first.high])).max(axis=1) <= 1e-9 * (first.high - first.low)
            periodic = first.periodic & same
        where = " × ".join(f"{1e3 * one:.4g}" for one in high - low)
        shape = counts(cells) if cells else cell_counts(low, high, size)
        per_cell = _BYTES[self.cells, len(numbers) > 1] + _HELD * len(self.groups)
        check_memory(per_cell * math.prod(map(float, shape)), f"{' × '.join(map(str, shape))} cells over {where} mm",
                     "take fewer with --grid, larger ones with --spacing, a smaller region with --box, or a narrower kernel with --width")
        return Grid(low, high, shape, (bool(periodic[0]), bool(periodic[1]), bool(periodic[2])))


def _names(text: str | None, known: Collection[str]) -> list[str]:
    """Names of fields, separated by commas; DembarkError for one that does not exist."""
    return [pick(name.strip(), known, "field", "in --fields") for name in text.split(",")] if text else []


def _groups(numbers: list[int], average: str) -> tuple[list[list[int]], int]:
    """Frames to be averaged together, and how many are left over."""
    if average == "all":
        return [numbers], 0
    if not average.isdecimal() or not 1 <= int(average) <= len(numbers):
        raise DembarkError(f"cannot average {average!r} frames", "in --average",
                           f"give 'all' or 1 to {len(numbers)}, the number of the chosen frames")
    size = int(average)
    used = len(numbers) // size * size
    return [numbers[start : start + size] for start in range(0, used, size)], len(numbers) - used


class _Region:
    """What the grains of all frames take up, with `margin` (m); and the smallest `size` (m) of cells about them, when it is `measured`."""

    def __init__(self, margin: float, measured: bool) -> None:
        self._margin, self._measured = margin, measured
        self.low, self.high, self.periodic = np.full(3, np.inf), np.full(3, -np.inf), np.zeros(3, bool)
        self.size = np.inf
        self._first: GrainFrame | None = None

    def add(self, frame: GrainFrame) -> None:
        """Take the next frame; DembarkError where its box has other periods than that of the first."""
        if not len(frame.radii):
            return
        low, high, periodic = extent(frame, self._margin)
        if self._first is None:
            self._first, self.periodic = frame, periodic
        first = self._first
        period = first.high - first.low
        changed = (periodic != self.periodic) | periodic & (np.abs([low - first.low, high - first.high]).max(axis=0) > 1e-9 * period)
        if changed.any():
            axis = int(np.argmax(changed))
            ends = [f"{one.low[axis]:.6g} to {one.high[axis]:.6g} m at step {one.step}" for one in (first, frame)]
            raise DembarkError(f"the periodic box changes along {'xyz'[axis]}", ", ".join(ends),
                               "choose frames of one box with --frames, or a part of it with --box")
        self.low, self.high = np.minimum(self.low, low), np.maximum(self.high, high)
        if self._measured:
            self.size = min(self.size, float(cell_grid(frame).spacing.max()))
