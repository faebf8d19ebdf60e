"""LAMMPS text dumps frame by frame: `ITEM: ATOMS` (grains) and `ITEM: ENTRIES` (contacts), as numpy arrays in double precision."""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_FRAME = b"ITEM: TIMESTEP\n"


class DumpError(ValueError):
    """A dump that cannot be read; the message is one line naming file and frame."""


@dataclass(frozen=True)
class RawFrame:
    """One frame: `step`, box corners (3,) in the file's length unit, periodic flags (3,), column names and `values` (rows, columns)."""

    step: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    periodic: NDArray[np.bool_]
    columns: tuple[str, ...]
    values: NDArray[np.float64]


class TextDump:
    """The frames of a dump file; they are found once and read one at a time, so that a file may be larger than memory.

    A last frame that was cut off (a run that was killed, a full disk) raises DumpError, or is left out with `skip_truncated=True`;
    `truncated` then says so in one line.
    """

    def __init__(self, path: str | Path, *, skip_truncated: bool = False) -> None:
        self.path = Path(path)
        self.truncated = ""
        if not self.path.is_file() or self.path.stat().st_size == 0:
            raise DumpError(f"{self.path} does not exist or is empty")
        self._spans = self._find()
        try:
            self.frame(len(self._spans) - 1)
        except DumpError as error:
            if not skip_truncated:
                raise
            self.truncated = f"{error}; it was left out"
            self._spans.pop()

    def _find(self) -> list[tuple[int, int]]:
        with self.path.open("rb") as handle, mmap.mmap(handle.fileno(), 0, access=mmap.ACCESS_READ) as data:
            if data[: len(_FRAME)] != _FRAME:
                raise DumpError(f"{self.path} does not begin with 'ITEM: TIMESTEP'")
            starts, at = [0], 0
            while (at := data.find(b"\n" + _FRAME, at)) >= 0:
                at += 1
                starts.append(at)
            return list(zip(starts, [*starts[1:], len(data)], strict=True))

    def __len__(self) -> int:
        return len(self._spans)

    def __iter__(self) -> Iterator[RawFrame]:
        return (self.frame(number) for number in range(len(self)))

    def frame(self, number: int) -> RawFrame:
        """Frame `number` (from 0); DumpError when it is not whole."""
        begin, end = self._spans[number]
        with self.path.open("rb") as handle:
            handle.seek(begin)
            block = handle.read(end - begin)
        where = f"{self.path}, frame {number + 1}"
        parts = block.split(b"\n", 9)
        if len(parts) < 10:
            raise DumpError(f"{where}: truncated in its header")
        try:
            step, count = int(parts[1]), int(parts[3])
            box = np.array([line.split()[:2] for line in parts[5:8]], float)
        except ValueError:
            raise DumpError(f"{where}: header cannot be read") from None
        flags = parts[4].split()[-3:]
        columns = tuple(word.decode() for word in parts[8].split()[2:])
        body = parts[9]
        rows = body.count(b"\n")
        if rows != count or (count and not body.endswith(b"\n")):
            raise DumpError(f"{where}: truncated, {rows} of {count} lines are there")
        try:
            values = np.fromstring(body.decode("ascii"), sep=" ") if count else np.empty(0)
            values = values.reshape(count, len(columns))
        except ValueError:
            raise DumpError(f"{where}: a line does not hold {len(columns)} numbers") from None
        if not np.isfinite(values).all():
            raise DumpError(f"{where}: holds a number that is not finite")
        return RawFrame(step, box[:, 0], box[:, 1], np.array([flag == b"pp" for flag in flags]), columns, values)
