"""What every kind of dump gives: raw frames, in the order of their steps, and errors of one line."""

from __future__ import annotations

import itertools
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..grains import GrainFrame

Array = NDArray[np.float64]

HINT = "skip_truncated=True leaves it out"
NO_FLAGS = "the file does not say which axes are periodic (ITEM: BOX BOUNDS pp pp ff); it is read as if none were"


class DumpError(ValueError):
    """A dump that cannot be read; the message is one line naming file and frame."""


class ColumnsError(DumpError):
    """The parameter `columns` is needed, or does not fit the file. Whoever has another name for it, as the command line, says so by
    `parameter`."""

    parameter = "columns="

    def named(self, parameter: str) -> str:
        """The message with another name of the parameter."""
        return str(self).replace(self.parameter, parameter)


class DensityError(ColumnsError):
    """The parameter `density` is needed."""

    parameter = "density="


class CutOffError(DumpError):
    """A frame that ends too early."""


class DumpWarning(UserWarning):
    """A dump from which something was left out or put in order; the message is one line."""


@dataclass(frozen=True)
class RawFrame:
    """One frame: `step`, the box in the file's length unit, column names and `values` (rows, columns).

    `low`, `high` (3,) are the corners of the box before it is tilted by `tilt` = (xy, xz, yz): its edges are (Lx, 0, 0), (xy, Ly, 0)
    and (xz, yz, Lz) with L = high - low. `periodic` (3,) holds the flags of its axes, all false where the file has none (`flagged`).
    `time`, in the file's unit, is what the frame says, or None; `units` are those of the file (or of its series), or "". Columns named
    `element` or `typelabel` hold words that say what `type` says; they are left out.
    """

    step: int
    low: Array
    high: Array
    periodic: NDArray[np.bool_]
    columns: tuple[str, ...]
    values: Array
    tilt: Array = field(default_factory=lambda: np.zeros(3))
    time: float | None = None
    units: str = ""
    flagged: bool = True


@dataclass(frozen=True)
class Entry:
    """A frame in the index: its first byte and line, its length in bytes, which it is in the file (from 1), its step and rows.

    `fault` says what is wrong with it, or "". `file` counts the files of a series. `time` and `units` are what its header says, or None
    and "".
    """

    place: int
    line: int
    size: int
    number: int
    step: int
    count: int
    fault: str = ""
    file: int = 0
    time: float | None = None
    units: str = ""


def _resumed(own: Sequence[int], other: Sequence[int]) -> bool:
    """Whether a file with the steps `own` is of a run that was resumed between the steps `other` of a file before it. Files that were
    written in turn begin and end within one frame of each other."""
    if not other or not other[0] < own[0] < other[-1]:
        return False
    in_turn = other[1] > own[0] and other[-2] < own[-1] and (len(own) < 2 or own[-2] < other[-1])
    return not in_turn


def kept_entries(entries: Sequence[Entry]) -> tuple[list[Entry], Entry | None]:
    """The frames in the order of their steps, and the first one that stood at another place.

    A frame whose step was there before, or that goes back to a step between others of its file, is of a run that was resumed at an earlier
    state: it replaces that frame, and all later ones of the run before. So does the first frame of a file whose step lies between those of
    a file before, unless both were written in turn. Parts of a run that were only joined in another order begin before all others of the
    file.
    """
    back = next((other for one, other in itertools.pairwise(entries) if other.step <= one.step), None)
    if back is None:
        return list(entries), None
    steps: dict[int, list[int]] = {}
    for entry in sorted(entries, key=lambda entry: (entry.file, entry.step)):
        steps.setdefault(entry.file, []).append(entry.step)
    spans = {file: own for file, own in steps.items() if len(own) > 1}
    kept: dict[int, Entry] = {}
    before: Entry | None = None
    least = 0
    for entry in sorted(entries, key=lambda entry: (entry.file, entry.number)):
        own = steps[entry.file]
        if before is None or before.file != entry.file:
            least = entry.step
            around = [file for file, other in spans.items() if file < entry.file and other[0] < own[0] < other[-1]]
            if any(_resumed(own, [step for step in spans[file] if step in kept and kept[step].file == file]) for file in around):
                kept = {step: one for step, one in kept.items() if step < own[0]}
        elif least < entry.step < before.step:
            kept = {step: one for step, one in kept.items() if step < entry.step or one.file != entry.file}
        if entry.step in kept:
            kept = {step: one for step, one in kept.items() if step < entry.step}
        kept[entry.step], before, least = entry, entry, min(least, entry.step)
    return [kept[step] for step in sorted(kept)], back


class Dump(ABC):
    """The frames of a trajectory in the order of their steps, found once and read one at a time.

    A restarted run may write steps again: its frames replace those of the run before, which DumpWarning says. A last
    frame that was cut off is refused, or left out with `skip_truncated=True`; `truncated` then says so in one line. `remarks` holds all
    such lines. With `stream=True` nothing is searched beforehand: iterating yields the first frame at once and refuses steps that go
    back; any other use makes the index.

    `ITEM: UNITS` stands once in a file, or once in a series of files, and holds for all frames; `units` are those of a file without it.
    """

    def __init__(self, path: Path, *, skip_truncated: bool, stream: bool, units: str = "") -> None:
        """Make the index unless `stream`."""
        self.path = path
        self.skip_truncated = skip_truncated
        self._given = self._units = units.strip().lower()
        self.truncated = ""
        self.remarks: tuple[str, ...] = ()
        self._index: list[Entry] | None = None
        if not stream:
            self.refresh()

    def refresh(self) -> None:
        """Look at the file anew: it may have grown while an engine writes it."""
        self._index = self._search()

    def _search(self) -> list[Entry]:
        """The frames to be read; sets what is said about the others."""
        found = list(self._find())
        self._units = self._agreed_units(found)
        again = {entry.step for entry in found if not entry.fault}
        faulty = [entry for entry in found if entry.fault and entry.step not in again]
        self.truncated, self.remarks = "", ()
        for entry in faulty:
            self._cut_off(f"{self._where(entry)}: {entry.fault}")
        sound = [entry for entry in found if not entry.fault]
        kept, back = kept_entries(sound)
        self._check_times(found, kept)
        if back:
            said = f"{self._file(back)}: steps go back in frame {back.number}; frames were sorted by step"
            if dropped := len(sound) - len(kept):
                said += f", {dropped} that a resumed run replaces {'were' if dropped > 1 else 'was'} left out"
            self.remarks += (said,)
            warnings.warn(self.remarks[-1], DumpWarning, stacklevel=3)
        if 0 < (without := sum(entry.time is None for entry in kept)) < len(kept):
            self.remarks += (f"{self.path}: {without} of {len(kept)} frames have no ITEM: TIME",)
            warnings.warn(self.remarks[-1], DumpWarning, stacklevel=3)
        return kept

    def _agreed_units(self, found: Sequence[Entry]) -> str:
        """The units of all frames; DumpError when two of them name different ones, or others than were given."""
        named = [entry for entry in found if entry.units]
        units, source = self._given, "the option units, or another dump of the run,"
        if named and not units:
            units, source = named[0].units, self._where(named[0])
        for entry in named:
            if entry.units != units:
                raise DumpError(f"{self._where(entry)}: its units are {entry.units}, but {source} says {units}; all must be the same")
        return units

    def _check_times(self, found: Sequence[Entry], kept: Sequence[Entry]) -> None:
        """DumpError when times do not go with steps."""
        for order in (found, kept):
            timed = [(entry, entry.time) for entry in order if entry.time is not None and not entry.fault]
            for (one, before), (other, time) in itertools.pairwise(timed):
                if (other.step - one.step) * (time - before) < 0.0:
                    raise DumpError(f"{self._where(other)}: its step is {other.step} at time {time:.9g}, after step {one.step} at time "
                                    f"{before:.9g}; write what follows a reset of the steps into a file of its own")

    def _file(self, entry: Entry) -> Path:  # noqa: ARG002 - a series has several
        return self.path

    def _where(self, entry: Entry) -> str:
        return f"{self._file(entry)}, frame {entry.number}"

    def _cut_off(self, said: str) -> None:
        """A frame is not complete: refuse it, or note that it is left out."""
        if not self.skip_truncated:
            raise CutOffError(said)
        said = said.replace(f" ({HINT})", "") + "; it was left out"
        self.truncated = f"{self.truncated}; {said}" if self.truncated else said
        self.remarks = (self.truncated,)

    @property
    def _entries(self) -> list[Entry]:
        if self._index is None:
            self._index = self._search()
        return self._index

    @property
    def steps(self) -> NDArray[np.int64]:
        """The step of every frame."""
        return np.array([entry.step for entry in self._entries], np.int64)

    @property
    def times(self) -> Array:
        """The time of every frame in the unit of the file, NaN where it has none."""
        return np.array([np.nan if entry.time is None else entry.time for entry in self._entries])

    @property
    def units(self) -> str:
        """The unit style that the file names, or that was given, or ""."""
        _ = self._entries
        return self._units

    @property
    def counts(self) -> NDArray[np.int64]:
        """The number of rows of every frame; only VTK files are read for it."""
        return np.array([entry.count if entry.count >= 0 else len(self._read(entry, None).values) for entry in self._entries], np.int64)

    def __len__(self) -> int:
        return len(self._entries)

    def __iter__(self) -> Iterator[RawFrame]:
        if self._index is None:
            return self._forward()
        return (self.frame(number) for number in range(len(self)))

    def frame(self, number: int, columns: Sequence[str] | None = None) -> RawFrame:
        """Frame `number` (from 0) with all columns, or only with these; DumpError when it is cut off, IndexError when there is none."""
        if not 0 <= number < len(self._entries):
            raise IndexError(number)
        entry = self._entries[number]
        return replace(self._read(entry, columns), units=self._units)

    def _forward(self) -> Iterator[RawFrame]:
        last, units = None, self._given
        for entry in self._find():
            where = self._where(entry)
            if entry.fault:
                self._cut_off(f"{where}: {entry.fault}")
                continue
            if last is None:
                units = units or entry.units
            elif entry.step <= last.step:
                raise DumpError(f"{where}: step {entry.step} comes after step {last.step}; open it without stream=True")
            elif entry.time is not None and last.time is not None and entry.time < last.time:
                raise DumpError(f"{where}: time {entry.time:.9g} comes after time {last.time:.9g}, though the step is later")
            if entry.units not in ("", units):
                raise DumpError(f"{where}: its units are {entry.units}, but those before are {units or 'not named'}; "
                                "open it without stream=True")
            yield replace(self._read(entry, None), units=units)
            last = entry

    @abstractmethod
    def _find(self) -> Iterator[Entry]:
        """All frames as they stand in the file."""

    @abstractmethod
    def _read(self, entry: Entry, columns: Sequence[str] | None) -> RawFrame:
        """The frame of an entry."""


def numbered(columns: Sequence[str], wanted: Sequence[str] | None, where: str) -> list[int]:
    """Indices of the wanted columns, or of all; DumpError when one is missing."""
    if wanted is None:
        return list(range(len(columns)))
    missing = [name for name in wanted if name not in columns]
    if missing:
        raise DumpError(f"{where}: column {', '.join(missing)} is missing; there are {' '.join(columns)}")
    return [columns.index(name) for name in wanted]


def take(values: Array, columns: Sequence[int]) -> Array:
    """A copy of columns: (rows,) of one, (rows, k) of several, rows contiguous."""
    start, count = columns[0], len(columns)
    if count == 1:
        return values[:, start].copy()
    together = list(columns) == list(range(start, start + count))
    return np.array(values[:, start : start + count] if together else values[:, columns], order="C")


def integers(values: Array, where: str) -> NDArray[np.int64]:
    """Integers that were read as doubles; DumpError, begun by `where`, for fractions, for numbers beyond 2^53, where doubles do not
    distinguish all integers, and for those that were written with six digits."""
    if not values.size:
        return values.astype(np.int64)
    largest = np.abs(values).max()
    if largest > 2.0**53:
        raise DumpError(f"{where} holds numbers beyond 2^53, which double precision does not distinguish")
    exact = values.astype(np.int64)
    if not np.array_equal(exact, values):
        wrong = values[exact != values][0]
        raise DumpError(f"{where} holds {wrong:.9g}, which is not an integer")
    if largest >= 1e6:
        # %g, the format of `dump local` by default, makes 1234567 to 1.23457e+06.
        large = exact[np.abs(exact) >= 1e6]
        if len(large) > 2 and not (large % 10).any():
            raise DumpError(f"{where} holds large numbers that all end in 0: they were rounded to six digits; set the format of the dump")
    return exact


def check_periods(raw: RawFrame, where: str) -> None:
    """DumpError, begun by `where`, for a box without a length along an axis that is periodic: there is no nearest image in it."""
    for axis in np.flatnonzero(raw.periodic & ~(raw.high > raw.low)):
        raise DumpError(f"{where}: the box is periodic along {'xyz'[axis]}, but reaches from {raw.low[axis]:.9g} to {raw.high[axis]:.9g}")


def cell(low: Array, high: Array, tilt: Array) -> Array:
    """Edges (3, 3) of a box, one a row: (Lx, 0, 0), (xy, Ly, 0), (xz, yz, Lz)."""
    edges = np.diag(high - low)
    edges[[1, 2, 2], [0, 0, 1]] = tilt
    return edges


def before_tilt(low: Array, high: Array, tilt: Array) -> tuple[Array, Array]:
    """Corners of the untilted box, from those of the bounding box, which dumps hold."""
    xy, xz, yz = tilt
    least, most = ((*pick, 0.0) for pick in ((min(0.0, xy, xz, xy + xz), min(0.0, yz)), (max(0.0, xy, xz, xy + xz), max(0.0, yz))))
    return low - np.array(least), high - np.array(most)


def less_edges(vectors: Array, box: RawFrame | GrainFrame) -> Array:
    """The vectors (m, 3) less full edges of the box along its periodic axes: between nearest images."""
    edges, result = cell(box.low, box.high, box.tilt), vectors.copy()
    for axis in (2, 1, 0):
        if box.periodic[axis]:
            result -= np.round(result[:, axis] / edges[axis, axis])[:, None] * edges[axis]
    return result


def folded(places: Array, low: Array, high: Array, tilt: Array, periodic: NDArray[np.bool_]) -> Array:
    """The places (n, 3) moved by full edges of its periodic axes into the box, which may be tilted."""
    if not periodic.any():
        return places
    edges = cell(low, high, tilt)
    if not tilt.any():
        lengths = np.where(periodic, high - low, 1.0)
        return places - np.where(periodic, np.floor((places - low) / lengths), 0.0) * lengths
    share = np.linalg.solve(edges.T, (places - low).T).T
    return places - np.where(periodic, np.floor(share), 0.0) @ edges
