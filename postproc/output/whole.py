"""Files that are either whole or not there, and what fields of any kind have in common when they are written."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.files import disk_error
from dembark.postproc.fields.grid import Grid

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer as Buffer
    from _typeshed import WriteableBuffer

Array = NDArray[np.float64]


@runtime_checkable
class Labelled(Protocol):
    """Fields on a grid, of coarse graining or of cell averages."""

    @property
    def grid(self) -> Grid:
        """Where they are."""

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of each field."""

    @property
    def long_names(self) -> Mapping[str, str]:
        """What each field is."""

    def arrays(self) -> dict[str, Array]:
        """The fields that are there, by name: (nx, ny, nz), (nx, ny, nz, 3) or (nx, ny, nz, 3, 3)."""


def timed(fields: Labelled | Iterable[tuple[float, Labelled]]) -> Iterable[tuple[float, Labelled]]:
    """Pairs (time in s, fields), also of fields without a time."""
    return [(0.0, fields)] if isinstance(fields, Labelled) else fields


@dataclass(frozen=True, eq=False)
class Selection:
    """Some of the fields, by `names`."""

    whole: Labelled
    names: Sequence[str]

    @property
    def grid(self) -> Grid:
        """Where they are."""
        return self.whole.grid

    @property
    def units(self) -> Mapping[str, str]:
        """Of all fields."""
        return self.whole.units

    @property
    def long_names(self) -> Mapping[str, str]:
        """Of all fields."""
        return self.whole.long_names

    def arrays(self) -> dict[str, Array]:
        """The fields that were chosen; DembarkError for one that the frames do not give."""
        there = self.whole.arrays()
        for name in self.names:
            if name not in there:
                raise DembarkError(f"there is no {name}", "the dumps do not hold what it needs", f"there are {', '.join(there)}")
        return {name: there[name] for name in self.names}


class SteadyFile(io.FileIO):
    """The file `part` for the HDF5 library to write into. The library cannot recover from an error: it would crash when it is closed.

    So the first error is kept for `check()` to raise, and what is written from then on stays in memory, from where it is read again.
    """

    def __init__(self, path: str | Path) -> None:
        """OSError when the file cannot be made."""
        super().__init__(path, "w+")
        self._error: OSError | None = None
        self._unwritten: list[tuple[int, bytes]] = []

    def write(self, data: Buffer) -> int:
        """Write all of `data`."""
        rest, place = memoryview(data).cast("B"), self.tell()
        size = len(rest)
        try:
            while rest and not self._error:
                written = super().write(rest) or 0
                rest, place = rest[written:], place + written
        except OSError as error:
            self._error = error
        if rest:
            self._unwritten.append((place, bytes(rest)))
            self.seek(place + len(rest))
        return size

    def readinto(self, buffer: WriteableBuffer) -> int:
        """Read as if everything had been written."""
        place, view = self.tell(), memoryview(buffer).cast("B")
        got = super().readinto(view) or 0
        if not self._unwritten:
            return got
        view[got:] = bytes(len(view) - got)
        for begin, data in self._unwritten:
            low, high = max(begin, place), min(begin + len(data), place + len(view))
            if low < high:
                view[low - place : high - place] = data[low - begin : high - begin]
        self.seek(place + len(view))
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """As of any file; the library reserves room with it."""
        try:
            return super().truncate(size)
        except OSError as error:
            self._error = self._error or error
            return size or 0

    def check(self) -> None:
        """Raise the first error."""
        if self._error:
            raise self._error


class WholeFile:
    """A file that is written under another name beside its place and moved there when it is finished.

    `part` is where to write. `keep()` makes it the file; `drop()` removes it. What was there before stays until `keep()`. As a context
    manager it keeps what a block has written to its end, and drops it when the block raises.
    """

    def __init__(self, path: str | Path) -> None:
        """DembarkError when the folder does not exist or `path` is a folder."""
        self.path = Path(path)
        if self.path.is_dir():
            raise DembarkError(f"{self.path} is a folder", "", "name a file")
        if not self.path.parent.is_dir():
            raise DembarkError(f"there is no folder {self.path.parent}", f"for {self.path.name}", "make it first")
        self.part = self.path.with_name(f".{self.path.stem}.part-{os.getpid()}{self.path.suffix}")

    def keep(self) -> None:
        """Move the finished file into its place; RunError when the disk refuses."""
        try:
            with self.part.open("rb") as handle:
                os.fsync(handle.fileno())
            self.part.replace(self.path)
        except OSError as error:
            self.drop()
            raise disk_error(error, self.path) from None

    def drop(self) -> None:
        """Remove what was written."""
        self.part.unlink(missing_ok=True)

    def settle(self, finish: Callable[[], None], good: bool) -> None:
        """Call `finish`, which writes the rest; then keep what is `good`, drop what is not, and drop it too when `finish` raises."""
        try:
            finish()
        except OSError as error:
            self.drop()
            raise disk_error(error, self.path) from None
        except BaseException:
            self.drop()
            raise
        if good:
            self.keep()
        else:
            self.drop()

    def __enter__(self) -> Path:
        return self.part

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        if kind is None:
            self.keep()
            return
        self.drop()
        if isinstance(error, OSError):
            raise disk_error(error, self.path) from None
