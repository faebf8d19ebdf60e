"""What `dembark fields` does: frames to fields to files, with memory for one frame and one set of sums."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass, field
from functools import reduce
from itertools import islice
from operator import add
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.memory import check_memory
from dembark.postproc.contacts import ContactFrame
from dembark.postproc.fields.cells import CellAverage, cell_grid, cell_totals
from dembark.postproc.fields.coarse_graining import WallContacts, coarse_grain
from dembark.postproc.fields.grid import Grid, cell_counts, extent
from dembark.postproc.fields.kernels import Kernel
from dembark.postproc.fields.sums import MASS, MOMENTUM, Fields
from dembark.postproc.grains import GrainFrame
from dembark.postproc.output.netcdf import FieldsNetcdf
from dembark.postproc.output.vtkhdf import FieldsVtkhdf, GrainsVtkhdf
from dembark.postproc.output.whole import Labelled, Selection
from dembark.postproc.sources import Reading, Source
from dembark.postproc.walls import Inclusion, wall_contacts
from dembark.postproc.walls.run import (
    begin,
    check_inclusions,
    check_meshes,
    check_outputs,
    checked_frames,
    choose_walls,
    mean_diameter,
    mesh_notes,
    recorders_of,
    source_lines,
    wall_lines,
)
from dembark.postproc.walls.stress import WallStress
from dembark.postproc.words import WallWord, counts, length, near, span

Array = NDArray[np.float64]
Frame = tuple[GrainFrame, ContactFrame | None]
Attributes = Mapping[str, str | float | int]

Show = Callable[[str, int], AbstractContextManager[Callable[[], None]]]

_PATCH = 2.0  # size of a wall's patches in mean diameters
# Most memory (bytes) that a cell takes: with averages by cell or without, of several frames or of one.
_BYTES = {(True, False): 700.0, (True, True): 800.0, (False, False): 1250.0, (False, True): 1700.0}


@dataclass(frozen=True)
class Words:
    """What the user wrote; the texts are those of the options of these names."""

    source: Path
    reading: Reading
    contacts: Path | None
    kernel: str
    width: str
    grid: str | None
    spacing: str | None
    box: str | None
    frames: str
    average: str
    walls: Sequence[str]
    cells: bool
    least_contacts: int
    fields: str | None
    out: Path | None
    vtkhdf: Path | None
    grains: Path | None
    plot: Path | None
    threads: int | None


@dataclass
class _Sample:
    """Frames that are averaged: `times` (s), and `totals` (5,) of all grains of each: mass, momentum along x, y, z, and sum of m |v|."""

    times: list[float] = field(default_factory=list)
    totals: list[Array] = field(default_factory=list)

    def add(self, grains: GrainFrame, time: float) -> None:
        momenta = grains.masses[:, None] * grains.velocities
        self.times.append(time)
        self.totals.append(np.array([grains.masses.sum(), *momenta.sum(axis=0), np.linalg.norm(momenta, axis=1).sum()]))


@dataclass
class FieldJob:
    """Fields that were planned and can be computed: frames in groups to be averaged, grid, kernel (None: averages by cell), walls.

    `only` are the fields to write, [] for all. What `run` leaves: loads of walls, files, mass in the fields and of the grains in each group
    (kg), largest error of the momentum over the sum of m |v|, the share of cells that are not masked, the walls of the frames whose place
    is not known (`unplaced`), whether any frame had a wall (`walled`) or an axis that is not periodic (`bounded`), and the mean diameter of
    each frame (m).
    """

    words: Words
    source: Source
    groups: list[list[int]]
    left_over: int
    diameter: float
    grid: Grid
    kernel: Kernel | None
    walls: list[WallWord]
    only: list[str]
    loads: list[WallStress] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)
    masses: list[tuple[float, float]] = field(default_factory=list)
    momentum_error: float = 0.0
    seen: float = 1.0
    unplaced: list[str] = field(default_factory=list)
    diameters: list[float] = field(default_factory=list)
    walled: bool = False
    bounded: bool = False

    @property
    def numbers(self) -> list[int]:
        """All frames that are used."""
        return [number for group in self.groups for number in group]

    @classmethod
    def plan(cls, words: Words, show: Show | None = None) -> FieldJob:
        """Check everything the user wrote; DembarkError or DumpError before any work is done. `show` reports how far the reading is."""
        files = (words.out, words.vtkhdf, words.grains)
        if not any((*files, words.plot)):
            raise DembarkError("there is nothing to write", "", "name a file with --out or --vtkhdf, or a folder with --plot")
        check_outputs(*files, plot=words.plot)
        if words.grid is not None and words.spacing is not None:
            raise DembarkError("--grid and --spacing are both given", "", "give one of them")
        only = _names(words.fields, (CellAverage if words.cells else Fields).units)
        source, numbers, first, diameter = begin(words.source, words.contacts, words.frames, words.reading)
        groups, rest = _groups(numbers, words.average)
        kernel = None if words.cells else Kernel(words.kernel, length(words.width, diameter, "--width"))
        walls = choose_walls(words.walls, source, first, diameter)
        check_inclusions(walls, source)
        check_meshes(walls, source, first)
        if words.cells and source.contacts is None:
            raise DembarkError("cell averages need contacts", f"{words.source} has none", "name their dump with --contacts")
        grid = _grid(source, numbers[: len(numbers) - rest], words, diameter, kernel.reach if kernel else 0.0, show)
        return cls(words, source, groups, rest, diameter, grid, kernel, walls, only)

    def run(self, advance: Callable[[], None], provenance: Attributes) -> None:
        """Compute and write; `advance` is called after each frame."""
        attributes = {**provenance, **self._method()}
        recorders = recorders_of(self.walls, self.source, self.numbers, _PATCH * self.diameter)
        stream = checked_frames(self.walls, self.source, self.numbers)
        with ExitStack() as stack:
            netcdf = stack.enter_context(FieldsNetcdf(self.words.out, attributes, timed=self.source.timed)) if self.words.out else None
            vtkhdf = stack.enter_context(FieldsVtkhdf(self.words.vtkhdf, attributes)) if self.words.vtkhdf else None
            points = stack.enter_context(GrainsVtkhdf(self.words.grains, attributes)) if self.words.grains else None

            def seen(grains: GrainFrame, contacts: ContactFrame | None, time: float) -> None:
                for recorder in recorders:
                    recorder.add(grains, contacts, time)
                if points:
                    points.add(grains, time)
                advance()

            for group in self.groups:
                sample = _Sample()
                last = self._average(self._sampled(islice(stream, len(group)), sample, seen), sample)
                chosen, (begin, end) = Selection(last, self.only) if self.only else last, (sample.times[0], sample.times[-1])
                if netcdf:
                    netcdf.add(chosen, 0.5 * (begin + end), (begin, end))
                if vtkhdf:
                    vtkhdf.add(chosen, 0.5 * (begin + end))
            self.loads = [recorder.result() for recorder in recorders]
            if netcdf:
                netcdf.add_walls(self.loads)
        self.written = [path for path in (self.words.out, self.words.vtkhdf, self.words.grains) if path]
        if self.words.plot:
            from dembark.postproc.plots import field_figures, save, wall_figures
            figures = field_figures(last) | {name: figure for one in self.loads for name, figure in wall_figures(one).items()}
            self.written += save(self.words.plot, figures)

    def _sampled(self, frames: Iterable[Frame], sample: _Sample, seen: Callable[[GrainFrame, ContactFrame | None, float], None]
                 ) -> Iterator[tuple[GrainFrame, ContactFrame | None, list[WallContacts]]]:
        """The frames with the contacts of their walls; each is noted in `sample` and `seen` once it was used."""
        placed = [one.wall.name for one in self.walls]
        for grains, contacts in frames:
            time = self.source.time(grains)
            self.unplaced += [name for name in grains.wall_forces if name not in (*placed, *self.unplaced)]
            self.walled |= bool(grains.wall_forces)
            self.bounded |= not grains.periodic.all()
            yield grains, contacts, [wall_contacts(grains, one.wall, time) for one in self.walls if not isinstance(one.wall, Inclusion)]
            sample.add(grains, time)
            self.diameters += mean_diameter(grains)
            seen(grains, contacts, time)

    def _average(self, frames: Iterator[tuple[GrainFrame, ContactFrame | None, list[WallContacts]]], sample: _Sample) -> Labelled:
        """The average of a group of frames; keeps what of its mass and momentum is in the cells, masked or not."""
        if self.kernel is None:
            totals = reduce(add, (cell_totals(grains, contacts, self.grid, touched) for grains, contacts, touched in frames))
            average = totals.average(self.words.least_contacts)
            self.seen = min(self.seen, float(1.0 - average.mask.mean()))
            self._check(totals.mass, totals.momentum, sample)
            return average
        name, width, threads = self.kernel.name, self.kernel.width, self.words.threads
        sums = reduce(add, (coarse_grain(grains, contacts, self.grid, kernel=name, width=width, walls=touched, threads=threads)
                            for grains, contacts, touched in frames))
        self._check(sums.grains[..., MASS], sums.grains[..., MOMENTUM], sample)
        return sums.fields()

    def _check(self, mass: Array, momentum: Array, sample: _Sample) -> None:
        """Keep mass and error of the momentum of all cells, summed over frames."""
        expected, frames = np.mean(sample.totals, axis=0), len(sample.totals)
        self.masses.append((float(mass.sum()) / frames, float(expected[0])))
        if expected[4] > 0.0:
            error = np.abs(momentum.sum(axis=(0, 1, 2)) / frames - expected[1:4]).max() / expected[4]
            self.momentum_error = max(self.momentum_error, float(error))

    def _method(self) -> Attributes:
        method: dict[str, str | float | int] = {"method": "cell averages", "least_contacts": self.words.least_contacts}
        if self.kernel is not None:
            method = {"method": "coarse graining", "kernel": self.kernel.name, "kernel_width": self.kernel.width}
        known: dict[str, str | float | int] = {"mean_diameter": self.diameter, "frames": len(self.numbers),
                 "walls": ", ".join(one.wall.name for one in self.walls) or "none",
                 "case": str(self.source.record.get("case", "")), "engine": str(self.source.record.get("engine", ""))}
        return {**method, **{name: value for name, value in known.items() if value != ""}}

    def summary(self) -> list[str]:
        """What was computed, checked and written, in lines."""
        lines = source_lines(self.source, self.numbers, self.diameter, self.diameters)
        lines += mesh_notes(self.walls, self.source, self.numbers)
        if self.left_over:
            lines.append(f"note: the last {self.left_over} frames fill no group of their own and were left out")
        size = " × ".join(f"{1e3 * one:.4g}" for one in self.grid.spacing)
        how = f"{100.0 * self.seen:.3g} % of them saw at least {self.words.least_contacts} contacts, the others are masked"
        if self.kernel is not None:
            how = f"{self.kernel.name} kernel of width {1e3 * self.kernel.width:.4g} mm ({self.kernel.width / self.diameter:.3g} d)"
        many = f"{len(self.groups)} times" if len(self.groups) > 1 else "1 time"
        lines.append(f"{' × '.join(map(str, self.grid.shape))} cells of {size} mm, {how}; {many}")
        if self.source.contacts is None:
            lines.append("note: without contacts there is no contact stress; name their dump with --contacts")
        elif self.bounded and not self.walled:
            lines.append("note: the dump has no forces of walls (columns f_force_NAME[1..3]); their part of the stress is missing, which "
                         "fades to 0 next to a wall")
        if self.unplaced:
            lines.append(f"note: where the wall {', '.join(self.unplaced)} is, is not known; its part of the stress is missing, add --wall")
        inside, there = max(self.masses, key=lambda one: abs(one[0] - one[1]))
        lines.append(f"mass: {inside:.9g} kg in the fields, {there:.9g} kg of grains, difference {abs(inside - there) / (there or 1.0):.1e}"
                     f"; momentum: difference {self.momentum_error:.1e} of the sum of m |v|")
        if there - inside > 1e-6 * there:
            lines.append(f"note: {100.0 * (1.0 - inside / there):.3g} % of the mass lie outside the region of --box")
        for one in self.loads:
            lines += wall_lines(one, self.source)
        return [*lines, *(f"written: {path}" for path in self.written)]


def _names(text: str | None, known: Mapping[str, str]) -> list[str]:
    """Names of fields, separated by commas; DembarkError for one that does not exist."""
    names = [name.strip() for name in text.split(",")] if text else []
    for name in names:
        if name not in known:
            raise DembarkError(f"{name!r} is no field", "in --fields", f"there are {', '.join(known)}{near(name, known)}")
    return names


def _groups(numbers: list[int], average: str) -> tuple[list[list[int]], int]:
    """Frames to be averaged together, and how many are left over."""
    if average == "all":
        return [numbers], 0
    if not average.isdecimal() or not 1 <= int(average) <= len(numbers):
        raise DembarkError(f"{average!r} frames", "in --average", f"give 'all' or 1 to {len(numbers)}, the number of the chosen frames")
    size = int(average)
    whole = len(numbers) // size * size
    return [numbers[start : start + size] for start in range(0, whole, size)], len(numbers) - whole


def _grid(source: Source, numbers: Sequence[int], words: Words, diameter: float, margin: float, show: Show | None) -> Grid:
    """Cells over the region the user wrote, or around the grains of all frames and as far as the kernel reaches, `margin` (m)."""
    size = length(words.spacing, diameter, "--spacing") if words.spacing else diameter
    measured = words.cells and not words.spacing and not words.grid
    if words.box is None or measured:
        region = _Region(margin, measured)
        with show("region", len(numbers)) if show else nullcontext() as advance:
            for number in numbers:
                region.add(source.grains[number])
                if advance:
                    advance()
        low, high, periodic, size = region.low, region.high, region.periodic, min(size if not measured else np.inf, region.size)
    if words.box is not None:
        parts = words.box.split(",")
        if len(parts) != 6:
            raise DembarkError(f"{words.box!r} is no region", "in --box", "give x0,x1,y0,y1,z0,z1")
        spans = np.array([span(",".join(parts[2 * axis : 2 * axis + 2]), diameter, "--box") for axis in range(3)])
        # Only a grid over all of the period goes on at its other side.
        first = source.grains[numbers[0]]
        low, high = spans.T
        same = np.abs(spans - np.column_stack([first.low, first.high])).max(axis=1) <= 1e-9 * (first.high - first.low)
        periodic = first.periodic & same
    where = " × ".join(f"{1e3 * one:.4g}" for one in high - low)
    shape = counts(words.grid) if words.grid else cell_counts(low, high, size)
    per_cell = _BYTES[words.cells, len(numbers) > 1]
    check_memory(per_cell * math.prod(map(float, shape)), f"{' × '.join(map(str, shape))} cells over {where} mm",
                 "take fewer with --grid, larger ones with --spacing, a smaller region with --box, or a narrower kernel with --width")
    return Grid(low, high, shape, (bool(periodic[0]), bool(periodic[1]), bool(periodic[2])))


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
