"""Contacts of a run: `contacts.dump` of either engine as numpy arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from dembark.postproc.dumptext import DumpError, TextDump
from numpy.typing import NDArray

Array = NDArray[np.float64]

_COLUMNS = 12


@dataclass(frozen=True)
class ContactFrame:
    """The m contacts and liquid bridges between grains at one step; SI units.

    `first` (m, 3) is the position of grain 1, `branch` (m, 3) points from it to grain 2 (nearest image on periodic axes),
    `forces` (m, 3) is the force on grain 1 (N), `ids` (m, 2).
    """

    step: int
    first: Array
    branch: Array
    forces: Array
    ids: NDArray[np.int64]


class ContactsDump:
    """`contacts.dump` as a sequence of ContactFrame, read one at a time.

    The twelve columns are x1 y1 z1 x2 y2 z2 id1 id2 periodic fx fy fz, whatever the header calls them.
    """

    def __init__(self, path: str | Path, *, skip_truncated: bool = False) -> None:
        """Open; DumpError for a missing, foreign or truncated file (see TextDump for `skip_truncated`)."""
        self._dump = TextDump(path, skip_truncated=skip_truncated)

    def __len__(self) -> int:
        return len(self._dump)

    def __iter__(self) -> Iterator[ContactFrame]:
        return (self[number] for number in range(len(self)))

    def __getitem__(self, number: int) -> ContactFrame:
        if not 0 <= number < len(self):
            raise IndexError(number)
        raw = self._dump.frame(number)
        values = raw.values
        if values.shape[1] != _COLUMNS:
            raise DumpError(f"{self._dump.path}, frame {number + 1}: has {values.shape[1]} columns instead of {_COLUMNS}")
        length = np.where(raw.periodic, raw.high - raw.low, np.inf)
        branch = values[:, 3:6] - values[:, 0:3]
        branch -= np.where(raw.periodic, length, 0.0) * np.round(branch / length)
        return ContactFrame(raw.step, values[:, 0:3], branch, values[:, 9:12], values[:, 6:8].astype(np.int64))
