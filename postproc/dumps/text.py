"""Text dumps: `ITEM: ATOMS` (grains) and `ITEM: ENTRIES` (contacts), as numpy arrays in double precision."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark._dumps import parse, skip

from .frames import HINT, Array, CutOffError, Dump, DumpError, Entry, RawFrame, before_tilt, numbered
from .source import Source, Window

_ITEM = b"ITEM: "
# Faults of a line, as the parser numbers them; the last begins the next frame.
_FEW, _MANY, _WORD, _HEADER = 1, 2, 3, 5
_SKIPPED = ("element", "typelabel")
_FLAGS = re.compile(rb"[pfsm]{2}")
# Numbers in a line of the box, by what stands before its flags.
_BOXES = {(): 2, (b"xy", b"xz", b"yz"): 3, (b"abc", b"origin"): 4}


class _HeaderError(DumpError):
    """A header that cannot be read."""


@dataclass
class _Header:
    """What stands before the rows of a frame."""

    step: int = -1
    count: int = -1
    label: bytes = b""
    box: tuple[Array, Array, Array] = field(default_factory=lambda: (np.zeros(3), np.zeros(3), np.zeros(3)))
    periodic: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(3, bool))
    flagged: bool = False
    columns: tuple[str, ...] = ()
    time: float | None = None
    units: str = ""


def _read_box(head: _Header, words: list[bytes], lines: list[list[bytes]]) -> None:
    flags = [word for word in words if _FLAGS.fullmatch(word)]
    width = _BOXES.get(tuple(words[: len(words) - len(flags)]))
    table = np.array([[float(word) for word in line] for line in lines])
    if len(flags) not in (0, 3) or table.shape != (3, width) or not np.isfinite(table).all():
        raise ValueError
    head.flagged, head.periodic = bool(flags), np.array([flag == b"pp" for flag in flags] or [False] * 3)
    low, high = table[:, 0], table[:, 1]
    if width == 4:
        head.box = _restricted(table[:, :3], table[:, 3])
    elif width == 3:
        head.box = (*before_tilt(low, high, table[:, 2]), table[:, 2])
    else:
        head.box = low, high, np.zeros(3)


def _restricted(edges: Array, origin: Array) -> tuple[Array, Array, Array]:
    """Corners and tilt of a box by its edges (3, 3) and its origin; DumpError when it is turned, as its vectors then are."""
    beyond, lengths = edges[[0, 0, 1], [1, 2, 2]], np.diag(edges)
    if np.abs(beyond).max() > 1e-12 * np.abs(edges).max() or not (lengths > 0.0).all():
        raise DumpError("its box is general triclinic, with a not along x or b not in the plane of x and y; "
                        "write the dump without triclinic/general")
    return origin, origin + lengths, edges[[1, 2, 2], [0, 0, 1]]


def _read_header(window: Window, head: _Header) -> None:
    """Read the header at the window's place into `head`; ValueError when it is none."""

    def line() -> bytes:
        text = window.line()
        if text is None:
            raise CutOffError
        return text

    while True:
        window.pass_blank()
        text = line()
        name = text[len(_ITEM) :].split()
        if not text.startswith(_ITEM) or not name:
            raise ValueError
        if name == [b"UNITS"]:
            head.units = line().decode("ascii").strip().lower()
        elif name == [b"TIME"]:
            head.time = float(line())
        elif name == [b"TIMESTEP"]:
            head.step = int(line())
        elif name[:2] == [b"NUMBER", b"OF"]:
            head.label, head.count = b" ".join(name[2:]), int(line())
        elif name[:2] == [b"BOX", b"BOUNDS"]:
            _read_box(head, name[2:], [line().split() for _ in range(3)])
        elif head.label and text[len(_ITEM) :].startswith(head.label):
            head.columns = tuple(word.decode() for word in text[len(_ITEM) + len(head.label) :].split())
            break
        else:
            raise ValueError
    known = head.time is None or np.isfinite(head.time)
    if head.step < 0 or head.count < 0 or not head.columns or not known or "ITEM:" in " ".join(head.columns):
        raise ValueError


class TextDump(Dump):
    """The frames of a text dump, gzipped or not; see Dump. A file may be larger than memory: one frame at a time is in it."""

    def __init__(self, path: str | Path, *, skip_truncated: bool = False, stream: bool = False, units: str = "") -> None:
        """Open; DumpError for a missing, foreign or truncated file. `units` is the unit style of a file that names none."""
        self._source = Source(Path(path))
        if not self._source.is_text():
            raise DumpError(f"{path} does not begin with 'ITEM: TIMESTEP'")
        super().__init__(Path(path), skip_truncated=skip_truncated, stream=stream, units=units)

    def _header(self, window: Window, number: int, into: _Header | None = None) -> _Header:
        """The header at the window's place; `into` takes what there is of one that is cut off."""
        where, head = f"{self.path}, frame {number}", _Header() if into is None else into
        try:
            _read_header(window, head)
        except CutOffError:
            raise CutOffError(f"{where}: truncated in its header ({HINT})") from None
        except ValueError as error:
            why = str(error) if isinstance(error, DumpError) else "header cannot be read"
            raise _HeaderError(f"{where}: {why}") from None
        return head

    def _find(self) -> Iterator[Entry]:
        # A source of its own: frames may be read meanwhile.
        with Source(self.path).window() as window:
            number = 1
            while window.pass_blank():
                entry = self._pass(window, number)
                yield entry
                if entry.fault and window.peek(len(_ITEM)) != _ITEM:
                    return
                number += 1

    def _pass(self, window: Window, number: int) -> Entry:
        """Pass over a frame. A run that was killed and restarted may have left a part of one before the next."""
        place, line, step, count = window.place, window.line_number, -1, 0
        fault, head = f"truncated in its header ({HINT})", _Header()
        try:
            self._header(window, number, head)
            step, count, body = head.step, head.count, window.line_number
            floor = window.place
            self._skip(window, count)
            window.back_to_frame(floor)
            rows = window.line_number - body
            if rows == count:
                window.pass_blank()
            if rows == count and window.peek(len(_ITEM)) not in (b"", _ITEM[: len(window.peek(len(_ITEM)))]):
                raise DumpError(f"{self.path}, line {window.line_number}: frame {number} has more than its {count} lines")
            fault = "" if rows == count else f"truncated, it has {rows} of {count} lines ({HINT})"
        except CutOffError:
            window.begin = window.end
        except _HeaderError:
            if not window.back_to_frame(place + 1):
                raise
        return Entry(place, line, window.place - place, number, step, count, fault, time=head.time, units=head.units)

    def _skip(self, window: Window, count: int) -> None:
        """Pass over `count` lines, fewer where a header or the end comes."""
        while count:
            begin, rows, fault, _ = skip(window.data, window.begin, window.end, count)
            window.pass_over(begin, rows)
            count -= rows
            if fault == _HEADER or (count and not window.more()):
                return

    def _read(self, entry: Entry, columns: Sequence[str] | None) -> RawFrame:
        with self._source.window(entry.place, entry.line, entry.size) as window:
            head = self._header(window, entry.number)
            if head.step != entry.step or head.count != entry.count:
                raise DumpError(f"{self.path}, frame {entry.number}: the file was changed since it was opened")
            return self._rows(window, head, entry.number, columns)

    def _rows(self, window: Window, head: _Header, number: int, columns: Sequence[str] | None = None) -> RawFrame:
        where = f"{self.path}, frame {number}"
        numeric = [index for index, name in enumerate(head.columns) if name not in _SKIPPED]
        names = tuple(head.columns[index] for index in numeric) if columns is None else tuple(dict.fromkeys(columns))
        chosen = numeric if columns is None else numbered(head.columns, names, where)
        place = [chosen.index(index) if index in chosen else -1 for index in range(len(head.columns))]
        values, rows = np.empty((head.count, len(names))), 0
        while rows < head.count:
            begin, more, fault, column = parse(window.data, window.begin, window.end, place, values, rows)
            window.pass_over(begin, more)
            rows += more
            if fault == _HEADER or (not fault and rows < head.count and not window.more()):
                raise CutOffError(f"{where}: truncated, it has {rows} of {head.count} lines ({HINT})")
            if fault:
                raise DumpError(self._message(window, where, fault, column, head.columns))
        low, high, tilt = head.box
        return RawFrame(head.step, low, high, head.periodic, names, values, tilt, head.time, head.units, head.flagged)

    def _message(self, window: Window, where: str, fault: int, column: int, columns: tuple[str, ...]) -> str:
        where = f"{where}, line {window.line_number}"
        words = (window.line() or b"").decode("ascii", "replace").split()
        if fault in (_FEW, _MANY):
            return f"{where}: a line does not hold {len(columns)} numbers but {len(words)}"
        what = "no number" if fault == _WORD else "a number that is not finite"
        return f"{where}: column {columns[column]} holds {what}, '{words[column]}'"
