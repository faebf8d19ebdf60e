"""What the dumps of grains and those of contacts have in common."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from .frames import Array, Dump, DumpWarning, RawFrame
from .units import unit_style

Frame = TypeVar("Frame")


class TypedDump(ABC, Generic[Frame]):
    """A dump as a sequence of frames of one kind, read one at a time; negative numbers count from the end."""

    def __init__(self, dump: Dump) -> None:
        self._dump = dump
        self._said: dict[str, str] = {}

    @property
    def path(self) -> Path:
        """The file, or the first of them."""
        return self._dump.path

    @property
    def truncated(self) -> str:
        """One line about a cut-off last frame that was left out, or ''."""
        return self._dump.truncated

    @property
    def remarks(self) -> tuple[str, ...]:
        """Lines about what was left out or put in order, and about what was found in the frames that were read."""
        return (*self._dump.remarks, *self._said.values())

    def _say(self, step: int, line: str) -> None:
        """Note `line` about a frame, as a DumpWarning and in `remarks`, unless that was done for an earlier one."""
        if line not in self._said:
            self._said[line] = f"{self.path}, from step {step} on: {line}"
            warnings.warn(self._said[line], DumpWarning, stacklevel=4)

    @property
    def units(self) -> str:
        """The unit style of the file, "" when it names none and none was given; the frames are in SI."""
        return self._dump.units

    @property
    def times(self) -> Array:
        """The time of every frame in s, NaN where the file does not say it."""
        return self._dump.times * unit_style(self.units, str(self.path)).time

    @property
    def steps(self) -> NDArray[np.int64]:
        """The step of every frame."""
        return self._dump.steps

    @property
    def counts(self) -> NDArray[np.int64]:
        """The number of grains or contacts of every frame."""
        return self._dump.counts

    def refresh(self) -> None:
        """Look at the file anew: an engine may have written more."""
        self._dump.refresh()

    def __len__(self) -> int:
        return len(self._dump)

    def __iter__(self) -> Iterator[Frame]:
        return map(self._frame, self._dump)

    def __getitem__(self, number: int) -> Frame:
        return self._frame(self._dump.frame(number + len(self) if number < 0 else number))

    @abstractmethod
    def _frame(self, raw: RawFrame) -> Frame:
        """The frame from the table of its numbers."""
