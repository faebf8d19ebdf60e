"""Files that are either whole or not there, and what fields of any kind have in common when they are written."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from dembark.common.errors import DembarkError
from dembark.common.files import disk_error
from dembark.postproc.fields.grid import Grid
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Labelled(Protocol):
    """Fields on a grid, of coarse graining or of cell averages."""

    grid: Grid
    units: Mapping[str, str]
    long_names: Mapping[str, str]

    def arrays(self) -> dict[str, Array]:
        """The fields that are there, by name: (nx, ny, nz), (nx, ny, nz, 3) or (nx, ny, nz, 3, 3)."""


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
