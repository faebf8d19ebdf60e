"""Runs that write a file a step: dump*.dump, grains*.vtk."""

from __future__ import annotations

import glob
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from .frames import HINT, CutOffError, Dump, DumpError, Entry, RawFrame
from .vtk import BOX


def files_of(path: str | Path | Sequence[str | Path]) -> Path | list[Path]:
    """The files of a pattern or list, in the order of the numbers in their names; the path of one file as it is."""
    if isinstance(path, str | Path):
        if Path(path).exists() or not glob.has_magic(str(path)):
            return Path(path)
        found = [Path(name) for name in glob.glob(str(path)) if BOX not in Path(name).name]  # noqa: PTH207 - it may be absolute
    else:
        found = [Path(name) for name in path]
    if not found:
        raise DumpError(f"no file matches {path}" if isinstance(path, str | Path) else "the list of files is empty")
    return sorted(found, key=lambda name: [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", str(name))])


def _fault(one: Dump, entry: Entry) -> str:
    try:
        one._read(entry, None)
    except CutOffError as error:
        return str(error).removeprefix(f"{one.path}: ")
    return ""


def listed(path: str | Path | Sequence[str | Path]) -> list[Path]:
    """The files of files_of(), one file too."""
    found = files_of(path)
    return [found] if isinstance(found, Path) else found


class SeriesDump(Dump):
    """The frames of several files as one trajectory; see Dump. `path` is a pattern or a list, as files_of() takes it; `open_one` opens a
    file without making its index."""

    def __init__(self, path: str | Path | Sequence[str | Path], open_one: Callable[[Path], Dump], *, skip_truncated: bool = False,
                 stream: bool = False, units: str = "") -> None:
        """Open; DumpError for a missing, foreign or truncated file."""
        self._pattern, self._open_one = path, open_one
        self._files = listed(path)
        super().__init__(self._files[0], skip_truncated=skip_truncated, stream=stream, units=units)

    def _file(self, entry: Entry) -> Path:
        return self._files[entry.file]

    def _find(self) -> Iterator[Entry]:
        files: dict[tuple[int, ...], Path] = {}
        self._files = listed(self._pattern)  # a run may have written more of them
        for number, path in enumerate(self._files):
            try:
                one, steps = self._open_one(path), []
            except CutOffError:
                yield Entry(0, 1, 0, 1, -1, 0, f"empty ({HINT})", number)
                continue
            for entry in one._find():
                # Only reading all of it shows whether a file of VTK is complete.
                unknown = entry.count < 0 and not entry.fault and number == len(self._files) - 1
                steps.append(entry.step)
                yield replace(entry, file=number, fault=_fault(one, entry) if unknown else entry.fault)
            if steps and files.setdefault(tuple(steps), path) != path:
                raise DumpError(f"{path} and {files[tuple(steps)]} hold the same steps: they are copies, or parts that different processes "
                                "wrote (% in the name of the dump), which are not joined; name files of different steps")

    def _read(self, entry: Entry, columns: Sequence[str] | None) -> RawFrame:
        return self._filled(self._open_one(self._files[entry.file])._read(entry, columns), columns)

    def _filled(self, raw: RawFrame, columns: Sequence[str] | None) -> RawFrame:
        """The frame; one without rows whose file names no columns has those of the others."""
        if raw.columns or len(raw.values):
            return raw
        names = self._columns if columns is None else tuple(columns)
        return replace(raw, columns=names, values=np.empty((0, len(names))))

    @cached_property
    def _columns(self) -> tuple[str, ...]:
        """The columns of the first file that names them; () when none does."""
        for path in self._files:
            with suppress(CutOffError):
                one = self._open_one(path)
                for entry in one._find():
                    if columns := one._read(entry, None).columns:
                        return columns
        return ()
