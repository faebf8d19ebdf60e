"""Bytes of a dump, plain or gzipped, and a window that moves over them."""

from __future__ import annotations

import gzip
import io
import os
import re
import sys
import weakref
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from .frames import CutOffError, DumpError

Handle = io.FileIO | gzip.GzipFile

_WINDOW = 1 << 22
# So much text is kept behind the place of reading, to find in it the start of a frame that a restarted run wrote into a cut-off line.
_BEHIND = 512
_ITEMS = rb"ITEM: (?:UNITS|TIME|TIMESTEP)\r?\n"
_FRAME = re.compile(rb"(?:" + _ITEMS + rb"[^\n]*\n)*" + _ITEMS)
_MARK = b"\xef\xbb\xbf"  # of UTF-8, which some editors put first
_FOREIGN = {b"(\xb5/\xfd": "zstd", b"BZh": "bzip2", b"\xfd7zXZ": "xz", b"PK\x03\x04": "zip"}


class Source:
    """A file of bytes that may be gzipped. A gzipped one stays open: going back in it means reading it from its beginning."""

    def __init__(self, path: Path) -> None:
        """DumpError unless there is something in the file."""
        self.path = path
        try:
            with path.open("rb") as handle:
                start = handle.read(8)
        except OSError as error:
            raise DumpError(f"{path} does not exist" if isinstance(error, FileNotFoundError) else
                            f"{path} cannot be read: {error.strerror}") from None
        if not start:
            raise CutOffError(f"{path} is empty")
        for magic, name in _FOREIGN.items():
            if start.startswith(magic):
                raise DumpError(f"{path} is compressed by {name}; unpack it first, or compress it by gzip")
        self.compressed = start.startswith(b"\x1f\x8b")
        self._gzip: gzip.GzipFile | None = None
        self._spare: list[bytearray] = []

    def begins_with(self, start: bytes) -> bool:
        """Whether these are its first bytes."""
        with self.at(0) as handle:
            return Window(self, handle, bytearray(len(start) + 1)).peek(len(start)) == start

    def is_text(self) -> bool:
        """Whether it begins as a text dump does, after lines that say nothing."""
        with self.at(0) as handle:
            window = Window(self, handle, bytearray(_BEHIND))
            return window.pass_blank() and window.peek(6) == b"ITEM: "

    @contextmanager
    def window(self, place: int = 0, line: int = 1, size: int | None = None) -> Iterator[Window]:
        """A window at `place`, where line `line` begins, that ends after `size` bytes."""
        # Memory that was used before costs no page faults.
        room = self._spare.pop() if self._spare else bytearray(_WINDOW)
        with self.at(place) as handle:
            yield Window(self, handle, room, place, line, size)
        self._spare[:] = [room]

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_gzip": None, "_spare": []}

    @contextmanager
    def at(self, place: int) -> Iterator[Handle]:
        """The bytes from `place` on."""
        if not self.compressed:
            with self.path.open("rb", buffering=0) as handle:
                handle.seek(place)
                yield handle
            return
        if self._gzip is None:
            self._gzip = gzip.open(self.path, "rb")  # noqa: SIM115 - it stays open for the next frame
            weakref.finalize(self, self._gzip.close)
        with self._damage():
            self._gzip.seek(place)
        yield self._gzip

    @contextmanager
    def _damage(self) -> Iterator[None]:
        try:
            yield
        except (zlib.error, gzip.BadGzipFile) as error:
            raise DumpError(f"{self.path}: its compression is damaged ({error})") from None

    def fill(self, handle: Handle, room: memoryview) -> int:
        """Read into `room`; how many bytes came, fewer at the end. A gzipped file that was cut off just ends."""
        filled, read = 0, handle.readinto if isinstance(handle, io.FileIO) else handle.readinto1
        with self._damage():
            try:
                while filled < len(room) and (more := read(room[filled:])):
                    filled += more
            except EOFError:
                pass
        return filled

    def reach(self, handle: Handle, place: int) -> bool:
        """Go on to `place`; whether the file is so long."""
        if isinstance(handle, io.FileIO):
            return handle.seek(place) <= os.fstat(handle.fileno()).st_size
        with self._damage():
            try:
                return handle.seek(place) == place
            except EOFError:
                return False


class Window:
    """The text of a source from a place on, a part at a time: bytes `begin` to `end` of `data` are in memory and unread.

    `line_number` is that of the line at `begin`.
    """

    def __init__(self, source: Source, handle: Handle, room: bytearray, place: int = 0, line: int = 1, size: int | None = None) -> None:
        """At `place`, where line `line` begins; `room` is memory to use, `size` (bytes) how much to read at most."""
        self._source, self._handle = source, handle
        self._offset, self.line_number = place, line
        self._stop = sys.maxsize if size is None else place + size
        self.begin = self.end = 0
        self._hold(room)

    def _hold(self, text: bytearray) -> None:
        self._text = text
        self.data = np.frombuffer(text, np.uint8)

    @property
    def place(self) -> int:
        """Where in the source `begin` is."""
        return self._offset + self.begin

    def more(self) -> bool:
        """Read on, keeping what is unread; False at the end of the source."""
        held = self.end - self.begin
        if self.begin + held == len(self._text) and self.begin <= _BEHIND:
            self._hold(self._text + bytes(len(self._text)))
        elif self.begin > _BEHIND:
            gone = self.begin - _BEHIND
            self.data[: _BEHIND + held] = self.data[gone : self.end].copy()
            self._offset += gone
            self.begin, self.end = _BEHIND, _BEHIND + held
        read = self._source.fill(self._handle, memoryview(self._text)[self.end : max(self.end, self._stop - self._offset)])
        self.end += read
        return read > 0

    def _line_end(self) -> int:
        """Where in `data` the next complete line ends, or -1 when there is none any more."""
        looked = 0
        while (found := self._text.find(b"\n", self.begin + looked, self.end)) < 0:
            looked = self.end - self.begin
            if not self.more():
                return -1
        return found

    def line(self) -> bytes | None:
        """The next complete line without its end, or None when there is none any more."""
        found = self._line_end()
        if found < 0:
            return None
        text = bytes(self._text[self.begin : found])
        self.pass_over(found + 1, 1)
        return text.rstrip(b"\r")

    def pass_blank(self) -> bool:
        """Pass over lines that are empty or begin with #, which some tools put between frames; whether anything follows."""
        if self.place == 0 and self.peek(len(_MARK)) == _MARK:
            self.begin += len(_MARK)
        while self.peek(1) in (b"\n", b"\r", b" ", b"\t", b"#"):
            found = self._line_end()
            text = self._text[self.begin : self.end if found < 0 else found].strip()
            if text and not text.startswith(b"#"):
                break
            self.pass_over(self.end if found < 0 else found + 1, 1)
        return self.begin < self.end

    def pass_over(self, begin: int, lines: int) -> None:
        """Go on to `begin` in `data`, so many lines further."""
        self.begin = begin
        self.line_number += lines

    def back_to_frame(self, floor: int) -> bool:
        """Where a cut-off line ran into the header of the next frame, go back to that header unless it lies before `floor`."""
        start = max(0, self.begin - _BEHIND, floor - self._offset)
        found = max((match.start() + start for match in _FRAME.finditer(self._text[start : self.begin])), default=-1)
        if found < 0:
            return False
        self.pass_over(found, -self._text.count(b"\n", found, self.begin))
        return True

    def peek(self, length: int) -> bytes:
        """The next `length` bytes, fewer at the end."""
        while self.end - self.begin < length and self.more():
            pass
        return bytes(self._text[self.begin : min(self.begin + length, self.end)])
