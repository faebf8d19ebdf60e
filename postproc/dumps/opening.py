"""Any trajectory as a Dump, recognised by its content."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from .binary import BinaryDump
from .frames import ColumnsError, Dump
from .series import SeriesDump, files_of
from .source import Source
from .text import TextDump
from .vtk import VtkFile

Trajectory = str | Path | Sequence[str | Path]


def open_dump(path: Trajectory, skip_truncated: bool = False, *, stream: bool = False, columns: Sequence[str] | None = None,
              units: str = "") -> Dump:
    """Open text or binary dumps, gzipped or not, or VTK files of `dump custom/vtk`, `atom/vtk` and `local/gran/vtk`.

    `path` is a file or, where each step has its own, a pattern such as "post/dump*.dump" or "post/grains*.vtk", or a list of files.
    `columns` names the columns of a binary dump, which holds numbers only, in the order of the deck's `dump` command. `skip_truncated`
    leaves a cut-off last frame out, `stream` reads forward without an index (see Dump). `units` is the unit style of files that do not
    name it by `ITEM: UNITS`, by default si. DumpError for a missing, foreign or truncated file.
    """
    files = files_of(path)
    options: dict[str, Any] = {"skip_truncated": skip_truncated, "stream": stream, "units": units}
    if isinstance(files, Path):
        return _open_one(files, columns=columns, **options)
    return SeriesDump(path, partial(_open_one, columns=columns, stream=True), **options)


def _open_one(file: Path, *, columns: Sequence[str] | None, **options: Any) -> Dump:
    source = Source(file)
    vtk = any(source.begins_with(start) for start in (b"# vtk", b"<?xml", b"<VTKFile"))
    text = not vtk and source.is_text()
    if not text and not vtk:
        return BinaryDump(file, columns=columns, **options)
    if columns is not None:
        kind = "text dump, which names its columns" if text else "VTK file"
        raise ColumnsError(f"{file}: columns= is for binary dumps; this is a {kind}")
    return TextDump(file, **options) if text else VtkFile(file, units=options.get("units", ""))
