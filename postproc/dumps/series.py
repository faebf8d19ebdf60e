"""Runs that write a file a step: dump*.dump, grains*.vtk."""

from __future__ import annotations

import glob
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from dembark.postproc.dumps.frames import CutOffError, Dump, DumpError, Entry, RawFrame
from dembark.postproc.dumps.vtk import BOX


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


class SeriesDump(Dump):
    """The frames of several files as one trajectory; see Dump. `open_one` opens a file without making its index."""

    def __init__(
        self, files: Sequence[Path], open_one: Callable[[Path], Dump], *, skip_truncated: bool = False, stream: bool = False
    ) -> None:
        """Open; DumpError for a missing, foreign or truncated file."""
        self._files, self._open_one = files, open_one
        super().__init__(files[0], skip_truncated=skip_truncated, stream=stream)

    def _where(self, entry: Entry) -> str:
        return f"{self._files[entry.file]}, frame {entry.number}"

    def _find(self) -> Iterator[Entry]:
        for number, path in enumerate(self._files):
            one = self._open_one(path)
            for entry in one._find():
                # Only by reading it all is it known that a file of VTK is whole.
                unknown = entry.count < 0 and not entry.fault and number == len(self._files) - 1
                yield replace(entry, file=number, fault=_fault(one, entry) if unknown else entry.fault)

    def _read(self, entry: Entry, columns: Sequence[str] | None) -> RawFrame:
        return self._open_one(self._files[entry.file])._read(entry, columns)

    def _stream(self) -> Iterator[RawFrame]:
        for path in self._files:
            yield from self._open_one(path)._stream()
