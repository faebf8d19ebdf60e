"""Binary dumps of grains (`dump ... custom ... file.bin`)."""

from __future__ import annotations

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
_FACES = range(4)
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

    def __init__(
        self, path: str | Path, *, columns: Sequence[str] | None, skip_truncated: bool = False, stream: bool = False, units: str = ""
    ) -> None:
        """Open; DumpError for a missing, foreign or truncated file, or when the columns are not as many as are in it."""
        self._source = Source(Path(path))
        if any(self._source.begins_with(struct.pack("=q", -len(name)) + name) for name in _FOREIGN):
            raise DumpError(f"{path} is a binary dump of a format that is not read; write a text dump")
        try:
            with self._source.at(0) as handle:
                head = self._header(handle)
        except (DumpError, ValueError):
            head = None
        if head is None:
            raise DumpError(f"{path} does not begin with 'ITEM: TIMESTEP', nor as a binary dump does")
        if columns is None:
            advice = "give columns=, the words of the deck's dump command"
            raise ColumnsError(f"{path} is binary and does not name its {head.width} columns; {advice}")
        self._columns = tuple(columns)
        super().__init__(Path(path), skip_truncated=skip_truncated, stream=stream, units=units)

    def _words(self, handle: Handle, form: struct.Struct) -> tuple[Any, ...] | None:
        room = bytearray(form.size)
        read = self._source.fill(handle, memoryview(room))
        if read == 0:
            return None
        if read < form.size:
            raise CutOffError
        return form.unpack(room)

    def _header(self, handle: Handle) -> _Header | None:
        """The header at the handle, or None at the end of the file; ValueError when it is none."""
        start = self._words(handle, _START)
        if start is None:
            return None
        step, count, tilted, *rest = start
        if step < 0 or count < 0 or tilted not in (0, 1) or any(face not in _FACES for face in rest[:6]):
            raise ValueError
        tilt = self._words(handle, _TILT) if tilted else (0.0, 0.0, 0.0)
        end = self._words(handle, _END)
        if tilt is None or end is None:
            raise CutOffError
        width, blocks = end
        bounds = np.array(rest[6:]).reshape(3, 2)
        if width < 1 or blocks < 1 or not np.isfinite(bounds).all():
            raise ValueError
        periodic = np.array([rest[2 * axis] == rest[2 * axis + 1] == 0 for axis in range(3)])
        return _Header(step, count, periodic, (*before_tilt(bounds[:, 0], bounds[:, 1], np.array(tilt)), np.array(tilt)), width, blocks)

    def _find(self) -> Iterator[Entry]:
        with self._source.at(0) as handle:
            number, place = 1, 0
            while True:
                step, count, fault = -1, 0, f"truncated in its header ({HINT})"
                try:
                    head = self._checked(handle, number)
                    if head is None:
                        return
                    step, count, fault = head.step, head.count, f"truncated, not all of its {head.count} rows are there ({HINT})"
                    for _ in range(head.blocks):
                        length = self._words(handle, _BLOCK)
                        if length is None or not self._source.reach(handle, handle.tell() + 8 * length[0]):
                            raise CutOffError
                except CutOffError:
                    yield Entry(place, 0, 0, number, step, count, fault)
                    return
                yield Entry(place, 0, handle.tell() - place, number, step, count)
                number, place = number + 1, handle.tell()

    def _checked(self, handle: Handle, number: int) -> _Header | None:
        where = f"{self.path}, frame {number}"
        try:
            head = self._header(handle)
        except ValueError as error:
            if isinstance(error, CutOffError):
                raise
            raise DumpError(f"{where}: header cannot be read") from None
        if head is not None and head.width != len(self._columns):
            raise ColumnsError(f"{where}: has {head.width} columns, but columns= names {len(self._columns)}")
        return head

    def _read(self, entry: Entry, columns: Sequence[str] | None) -> RawFrame:
        with self._source.at(entry.place) as handle:
            try:
                frame = self._frame(handle, entry.number, columns)
            except CutOffError:
                frame = None
        if frame is None or frame.step != entry.step:
            raise DumpError(f"{self.path}, frame {entry.number}: the file was changed since it was opened")
        return frame

    def _frame(self, handle: Handle, number: int, columns: Sequence[str] | None = None) -> RawFrame | None:
        where = f"{self.path}, frame {number}"
        head = self._checked(handle, number)
        if head is None:
            return None
        values = np.empty((head.count, head.width))
        room, filled = values.data.cast("B") if values.size else memoryview(b""), 0
        for _ in range(head.blocks):
            length = self._words(handle, _BLOCK)
            if length is None:
                raise CutOffError
            end = filled + 8 * length[0]
            if not filled <= end <= len(room):
                raise DumpError(f"{where}: its blocks hold more than {head.count} rows")
            while filled < end:
                read = self._source.fill(handle, room[filled:end])
                if read == 0:
                    raise CutOffError
                filled += read
        if filled != len(room):
            raise DumpError(f"{where}: its blocks hold fewer than {head.count} rows")
        if not np.isfinite(values.sum()) and len(bad := np.argwhere(~np.isfinite(values))):
            row, column = bad[0]
            what = f"column {self._columns[column]} holds a number that is not finite, '{values[row, column]}'"
            raise DumpError(f"{where}, row {row + 1}: {what}")
        names = self._columns
        if columns is not None:
            values, names = values[:, numbered(names, columns, where)], tuple(columns)
        low, high, tilt = head.box
        return RawFrame(head.step, low, high, head.periodic, names, values, tilt)

    def _stream(self) -> Iterator[RawFrame]:
        with self._source.at(0) as handle:
            number = 1
            while True:
                try:
                    frame = self._frame(handle, number)
                except CutOffError:
                    self._cut_off(f"{self.path}, frame {number}: truncated ({HINT})")
                    return
                if frame is None:
                    return
                yield frame
                number += 1
