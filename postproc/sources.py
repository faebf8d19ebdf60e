"""What `dembark fields` and `dembark walls` read: a dump, or the folder of a run with its time step and walls."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.files import read_json

from .contacts import ContactFrame, ContactsDump
from .dumps import DumpError
from .dumps.frames import cell
from .grains import GrainFrame, GrainsDump
from .walls import CylinderWall, Motion, PlaneWall, Wall

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Source:
    """Frames to be averaged: `grains`, `contacts` (None: there are none), `time_step` (s; NaN: unknown), `record` of the run or {}.

    Times are those of the dump where it has them (`ITEM: TIME`): the step may change during a run.
    """

    path: Path
    grains: GrainsDump
    contacts: ContactsDump | None
    time_step: float
    record: Mapping[str, Any]

    @property
    def notes(self) -> list[str]:
        """Lines about what of the files was left out or put in order, and about what is odd in them."""
        lines = [line for one in (self.grains, self.contacts) if one is not None for line in one.remarks]
        known = np.isfinite(self.grains.times)
        apart = np.abs(self.grains.times - self.grains.steps * self.time_step)[known]
        if (apart > 1e-6 * np.abs(self.grains.times[known]).max(initial=0.0)).any():
            lines.append(f"the times are those of the dump, not its steps times {self.time_step:.6g} s")
        return lines

    @property
    def timed(self) -> bool:
        """Whether the times are known in s."""
        return not math.isnan(self.time_step) or bool(np.isfinite(self.grains.times).all())

    def time(self, frame: GrainFrame) -> float:
        """Simulated time (s) of a frame; its step where no time is known. DumpError where only other frames of the dump have a time."""
        if frame.time is not None:
            return frame.time
        if not math.isnan(self.time_step):
            return frame.step * self.time_step
        if np.isfinite(self.grains.times).any():
            raise DumpError(f"{frame.where}: the frame has no ITEM: TIME, but others have; give the time step")
        return frame.step

    def frames(self, numbers: Sequence[int]) -> Iterator[tuple[GrainFrame, ContactFrame | None]]:
        """Frames by their numbers, one at a time, each with the contacts of its step; DumpError when those are not there."""
        for number in numbers:
            grains = self.grains[number]
            yield grains, self.contacts.at_step(grains.step) if self.contacts is not None else None

    def walls(self, names: Sequence[str]) -> tuple[list[Wall], list[str]]:
        """Those walls of the run that carry one of `names`, as its record has them, and a line for each whose motion it does not know."""
        if names and "case" in self.record and "walls" not in self.record:
            return [], ["the run's record has no walls, for an earlier version wrote it"]
        known = {name: wall for name, wall in self.record.get("walls", {}).items() if name in names}
        moving = [name for name, wall in known.items() if wall.get("motion", "steady") != "steady"]
        return ([self._wall(name, wall) for name, wall in known.items() if name not in moving],
                [f"the wall {name} has a motion ({known[name]['motion']}) that is not known at each time" for name in moving])

    def _wall(self, name: str, wall: Mapping[str, Any]) -> Wall:
        since = float(wall.get("since", 0.0))
        if self.time_step > 0.0:
            # A motion begins with a step.
            since = math.ceil(since / self.time_step) * self.time_step
        motion = Motion(_vector(wall.get("velocity", (0.0, 0.0, 0.0))), since)
        origin = _vector(wall.get("origin", (0.0, 0.0, 0.0)))
        if wall["kind"] == "cylinder":
            return CylinderWall(name, float(wall["radius"]), _vector(wall.get("axis", (0.0, 0.0, 1.0))), origin, motion=motion)
        return PlaneWall(name, origin, _vector(wall.get("normal", (0.0, 0.0, 1.0))), motion)


def _vector(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = map(float, values)
    return x, y, z


def open_source(path: Path, contacts: Path | None = None, *, time_step: float | None = None, density: float | None = None,
                columns: Sequence[str] | None = None, contact_columns: Mapping[str, Sequence[int | str]] | None = None,
                units: str = "") -> Source:
    """Open a dump of grains, or a run folder with grains.dump; DembarkError or DumpError in one line when it is not there.

    For files that do not say it themselves: `time_step` (s), `density` (kg/m3) of grains without masses, names of the `columns` of a
    binary dump, what the columns of a foreign dump of contacts are (see ContactsDump), and the unit style. A last frame that was cut off
    is left out, as `notes` say.
    """
    folder = _run_folder(path)
    record = (read_json(folder / "run.json") or {}) if folder else {}
    file = folder / "grains.dump" if folder else path
    if contacts is None and folder and (folder / "contacts.dump").is_file():
        contacts = folder / "contacts.dump"
    if time_step is None:
        time_step = float(record.get("time_step", math.nan))

    def grains_in(units: str) -> GrainsDump:
        return GrainsDump(file, skip_truncated=True, columns=columns, density=density, units=units)

    grains = grains_in(units)
    if not len(grains):
        raise DumpError(f"{file} has no complete frame")
    if contacts is None:
        return Source(path, grains, None, time_step, record)
    # Both are of one run: where only one of them names the units, they hold for the other.
    touching = ContactsDump(contacts, skip_truncated=True, columns=contact_columns, units=units or grains.units)
    if touching.units and not grains.units:
        grains = grains_in(touching.units)
    return Source(path, grains, touching, time_step, record)


def frames_at(source: Source, times: Sequence[float]) -> list[int]:
    """Numbers of the frames nearest to `times` (s), each once; DembarkError where the run has no frame near one of them."""
    if not source.timed:
        raise DembarkError("the times of the frames are not known", f"{source.path}", "give --time-step")
    said, found = source.grains.times, []
    known = np.where(np.isfinite(said), said, source.grains.steps * source.time_step)
    between = float(np.median(np.diff(known))) if len(known) > 1 else 0.0
    for time in times:
        if not known.min() - 0.5 * between - 1e-9 <= time <= known.max() + 0.5 * between + 1e-9:
            raise DembarkError(f"there is no frame at {time:g} s", "in --at",
                               f"the frames are from {known.min():.6g} to {known.max():.6g} s")
        number = int(np.abs(known - time).argmin())
        found += [number] if number not in found else []
    return found


def _run_folder(path: Path) -> Path | None:
    if not path.is_dir():
        return None
    if (path / "grains.dump").is_file():
        return path
    inside = sorted(path.glob("replica-*/grains.dump"))
    if len(inside) == 1:
        return inside[0].parent
    advice = f"name one of its replicas, such as {inside[0].parent}" if inside else "name a dump file or the folder of a run"
    raise DembarkError(f"{path} has no grains.dump", "", advice)


@dataclass
class Sizes:
    """What may change from frame to frame: mean `diameters` (m) of the grains in each that has some, and whether a periodic edge of the box
    did (`reshaped`)."""

    diameters: list[float] = field(default_factory=list)
    reshaped: bool = False
    _edges: Array | None = None

    def add(self, frame: GrainFrame) -> None:
        """Take the next frame."""
        self.diameters += mean_diameter(frame)
        edges = cell(frame.low, frame.high, frame.tilt)
        if self._edges is None:
            self._edges = edges
        change = np.abs(edges - self._edges)[frame.periodic]
        self.reshaped = self.reshaped or bool(change.max(initial=0.0) > 1e-6 * self._edges.max())


@dataclass(frozen=True)
class Selection:
    """Frames of a source by their `numbers`, the `first` of them that has grains, and the mean `diameter` (m) of that."""

    source: Source
    numbers: Sequence[int]
    first: GrainFrame
    diameter: float

    @cached_property
    def ends(self) -> tuple[GrainFrame, GrainFrame]:
        """The first frame and the last one, with grains or without."""
        return self.source.grains[self.numbers[0]], self.source.grains[self.numbers[-1]]

    def averaging_notes(self, sizes: Sizes) -> list[str]:
        """Lines about what makes a mean over the frames, whose `sizes` are given, another than that over time, or fields wrong at faces of
        the box."""
        notes, grains = [], self.source.grains
        times = grains.times if np.isfinite(grains.times).all() else grains.steps
        between = np.diff(times[list(self.numbers)])
        if len(between) and np.ptp(between) > 0.01 * between.max():
            unit = "s" if times is grains.times else "steps"
            notes.append(f"note: frames lie {between.min():.4g} to {between.max():.4g} {unit} apart; means are over frames, not over time")
        if sizes.reshaped:
            notes.append("note: the periodic box changes its shape; velocities, and powers of contacts across its faces, lack the speed of "
                         "one face past the other, and fields are wrong up to a kernel's width from these")
        return notes

    def lines(self, sizes: Sizes | None = None) -> list[str]:
        """What was read; `sizes` of the frames, where all were."""
        source, numbers = self.source, self.numbers
        first, last = (int(source.grains.steps[number]) for number in (numbers[0], numbers[-1]))
        begin, end = map(source.time, self.ends)
        when = f"{begin:.6g} to {end:.6g} s" if source.timed else "times are steps: give --time-step"
        count = f"frame {numbers[0]}" if len(numbers) == 1 else f"{len(numbers)} frames, {numbers[0]} to {numbers[-1]}"
        diameters = sizes.diameters if sizes and sizes.diameters else [self.diameter]
        low, high = 1e3 * min(diameters), 1e3 * max(diameters)
        changes = f"the mean diameter of the frames is {low:.4g} to {high:.4g} mm; d is that of the first with grains"
        return [*(f"note: {one}" for one in (*source.notes, *([changes] if high > 1.01 * low else []))),
                f"{count} of {len(source.grains)}; steps {first} to {last}, {when}; mean diameter d = {1e3 * self.diameter:.4g} mm"]


def select(source: Source, numbers: Sequence[int]) -> Selection:
    """The frames of `source` with these numbers; DembarkError when there are no grains in any of them."""
    for number in numbers:
        if diameter := mean_diameter(frame := source.grains[number]):
            return Selection(source, numbers, frame, diameter[0])
    raise DembarkError(f"there are no grains in frames {numbers[0]} to {numbers[-1]}", "which are the chosen ones",
                       "choose others with --frames")


def mean_diameter(frame: GrainFrame) -> list[float]:
    """The mean diameter (m) of the grains of a frame, [] of none."""
    return [2.0 * float(frame.radii.mean())] if len(frame.radii) else []
