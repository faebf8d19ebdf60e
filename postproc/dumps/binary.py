"""Binary dumps of grains (`dump ... custom ... file.bin`)."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .frames import HINT, Array, ColumnsError, CutOffError, Dump, DumpError, Entry, RawFrame, before_tilt, numbered
from .source import Handle, Source

# Step, rows, whether the box is tilted, six words about its faces (0: periodic), its corners; the tilt; numbers a row, blocks.
_START, _TILT, _END = struct.Struct("=qqi6i6d"), struct.Struct("=3d"), struct.Struct("=2i")
_BLOCK = struct.Struct("=i")
# Another format begins with a name and its length, negative.
_FOREIGN = (b"DUMPCUSTOM", b"DUMPATOM")


@dataclass(frozen=True)
class _Header:
    step: int
    count: int
    periodic: np.ndarray
    box: tuple[Array, Array, Array]
    width: int
    blocks: int


class BinaryDump(Dump):
    """The frames of a binary dump; see Dump. It holds numbers only: `columns` names them in the order of the deck's `dump` command."""

    def __init__(self, path: str | Path, *, columns: Sequence[str] | None, skip_truncated: bool = False, stream: bool = False,
                 units: str = "") -> None:
        """Open; DumpError for a missing, foreign or truncated file, or when the columns are not as many as are in it."""
        self._source = Source(Path(path))
        if any(self._source.begins_with(struct.pack("=q", -len(name)) + name) for name in _FOREIGN):
            raise DumpError(f"{path} is a binary dump in a format that cannot be read; write a text dump")
        try:
            with self._source.at(0) as handle:
                width = self._words(handle).width
        except ValueError:
            raise DumpError(f"{path} is neither a text dump, which begins with 'ITEM: TIMESTEP', nor a binary one") from None
        if columns is None:
            advice = "give columns=, the words of the deck's dump command"
            raise ColumnsError(f"{path} is binary and does not name its {width} columns; {advice}")
        self._columns = tuple(columns)
        super().__init__(Path(path), skip_truncated=skip_truncated, stream=stream, units=units)

    def _take(self, handle: Handle, form: struct.Struct) -> tuple[Any, ...]:
        room = bytearray(form.size)
        if self._source.fill(handle, memoryview(room)) < form.size:
            raise CutOffError
        return form.unpack(room)

    def _words(self, handle: Handle) -> _Header:
        """The header at the handle; ValueError when it is none, CutOffError when it is cut off."""
        step, count, tilted, *rest = self._take(handle, _START)
        faces, bounds = np.array(rest[:6]).reshape(3, 2), np.array(rest[6:]).reshape(3, 2)
        if step < 0 or count < 0 or tilted not in (0, 1) or not ((faces >= 0) & (faces < 4)).all() or not np.isfinite(bounds).all():
            raise ValueError
        tilt = np.array(self._take(handle, _TILT) if tilted else (0.0, 0.0, 0.0))
        width, blocks = self._take(handle, _END)
        if width < 1 or blocks < 1:
            raise ValueError
        return _Header(step, count, (faces == 0).all(axis=1), (*before_tilt(bounds[:, 0], bounds[:, 1], tilt), tilt), width, blocks)

    def _header(self, handle: Handle, where: str) -> _Header:
        try:
            head = self._words(handle)
        except CutOffError:
            raise
        except ValueError:
            raise DumpError(f"{where}: header cannot be read") from None
        if head.width != len(self._columns):
            raise ColumnsError(f"{where}: has {head.width} columns, but columns= names {len(self._columns)}")
        return head

    def _find(self) -> Iterator[Entry]:
        with Source(self.path).at(0) as handle:
            for number in itertools.count(1):
                place, step, count, fault = handle.tell(), -1, 0, f"truncated in its header ({HINT})"
                try:
                    head = self._header(handle, f"{self.path}, frame {number}")
                    step, count, fault = head.step, head.count, f"truncated, fewer than its {head.count} rows ({HINT})"
                    for _ in range(head.blocks):
                        (length,) = self._take(handle, _BLOCK)
                        if length < 0:
                            raise DumpError(f"{self.path}, frame {number}: a block of {length} numbers; is this a binary dump?")
                        if not self._source.reach(handle, handle.tell() + 8 * length):
                            raise CutOffError
                except CutOffError:
                    if step >= 0 or handle.tell() > place:
                        yield Entry(place, 0, 0, number, step, count, fault)
                    return
                yield Entry(place, 0, handle.tell() - place, number, step, count)

    def _read(self, entry: Entry, columns: Sequence[str] | None) -> RawFrame:
        where, names = f"{self.path}, frame {entry.number}", self._columns
        with self._source.at(entry.place) as handle:
            try:
                head = self._header(handle, where)
                values = np.empty((head.count, head.width))
                room, filled = values.data.cast("B") if values.size else memoryview(b""), 0
                for _ in range(head.blocks):
                    (length,) = self._take(handle, _BLOCK)
                    part = room[filled : filled + 8 * length]
                    if len(part) < 8 * length:
                        raise DumpError(f"{where}: its blocks hold more than {head.count} rows")
                    if self._source.fill(handle, part) < len(part):
                        raise CutOffError
                    filled += len(part)
            except CutOffError:
                head = None
        if head is None or head.step != entry.step:
            raise DumpError(f"{where}: the file was changed since it was opened")
        if filled != len(room):
            raise DumpError(f"{where}: its blocks hold fewer than {head.count} rows")
        if not np.isfinite(values.sum()) and len(bad := np.argwhere(~np.isfinite(values))):
            row, column = bad[0]
            raise DumpError(f"{where}, row {row + 1}: column {names[column]} holds a number that is not finite, '{values[row, column]}'")
        if columns is not None:
            values, names = values[:, numbered(names, columns, where)], tuple(columns)
        low, high, tilt = head.box
        return RawFrame(head.step, low, high, head.periodic, names, values, tilt)
