"""One replica of a run: its record, its parameters and what it wrote."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dembark.common.choices import Known, nearest
from dembark.common.errors import DembarkError
from dembark.common.parallel import cores_here

from . import ContactFrame, ContactsDump, DumpError, GrainFrame, GrainsDump, read_times
from .impacts import COLUMNS, read_impacts

Array = NDArray[np.float64]
Source = TypeVar("Source")
Measured = TypeVar("Measured")


@dataclass(frozen=True)
class Replica:
    """A finished run: its folder, the record in run.json, and its outputs."""

    folder: Path
    record: Mapping[str, Any]

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Resolved parameters in SI units; KeyError with near matches for another name."""
        return Known(self.record["parameters"])

    def number(self, name: str) -> float:
        """The parameter `name`, in SI units; DembarkError with near matches when the run has no such number."""
        numbers = {one: float(value) for one, value in self.record.get("parameters", {}).items()
                   if isinstance(value, int | float) and not isinstance(value, bool)}
        if name not in numbers:
            raise DembarkError(f"the run in {self.folder} has no number of the name {name!r}", nearest(name, numbers))
        return numbers[name]

    @property
    def derived(self) -> Mapping[str, Any]:
        """Numbers that the case's setup derived from the parameters: friction, geometry, steps; empty where none were recorded."""
        return self.record.get("derived", {})

    @property
    def time_step(self) -> float:
        """Simulated time of one step in s."""
        return float(self.record["time_step"])

    def grains(self) -> GrainsDump:
        """Frames of the measuring window."""
        return GrainsDump(self.folder / "grains.dump")

    def contacts(self) -> ContactsDump:
        """Contacts of the same frames."""
        return ContactsDump(self.folder / "contacts.dump")

    def times(self) -> dict[str, Array]:
        """The complete run, a row for each output interval."""
        return read_times(self.folder / "time.csv")

    def impacts(self) -> Array:
        """Impacts that have ended, (n, 17), in the columns of `dembark.postproc.impacts.COLUMNS`; SI units.

        Bodies are counted from 1, by the offset that the record holds for engines that count from 0; id_b < 0 is a wall. DumpError when the
        file cannot be read.
        """
        table = read_impacts(self.folder / "impacts.txt").view(float).reshape(-1, len(COLUMNS))
        table[:, :2] += int(self.record.get("impact_id_offset", 0)) * (table[:, :2] >= 0)
        return table

    def paired_frames(self) -> Iterator[tuple[GrainFrame, ContactFrame]]:
        """(grains, contacts) of every frame; DumpError when the two files do not hold the same steps."""
        grains, contacts = self.grains(), self.contacts()
        if len(grains) != len(contacts):
            raise DumpError(f"{self.folder}: grains.dump has {len(grains)} frames, contacts.dump {len(contacts)}")
        for one, other in zip(grains, contacts, strict=True):
            if one.step != other.step:
                raise DumpError(f"{self.folder}: grains.dump has step {one.step} where contacts.dump has step {other.step}")
            yield one, other

    def mapped(self, work: Callable[[GrainFrame, ContactFrame], Measured]) -> Iterator[tuple[GrainFrame, Measured]]:
        """Every frame in order with `work(grains, contacts)`, done in as many threads as there are cores: most of what is done with arrays
        leaves the interpreter to others. Few frames are in memory at a time."""
        threads = cores_here()
        with ThreadPoolExecutor(threads) as pool:
            ahead = deque[tuple[GrainFrame, Future[Measured]]]()
            for grains, contacts in self.paired_frames():
                ahead.append((grains, pool.submit(work, grains, contacts)))
                if len(ahead) > 2 * threads:
                    first, done = ahead.popleft()
                    yield first, done.result()
            yield from ((first, done.result()) for first, done in ahead)


def cached_per_replica(read: Callable[[Source], Measured]) -> Callable[[Source], Measured]:
    """`read(replica)`, done once for each Replica object, or for what was read of it: quantities of a case and its fields share that."""

    @wraps(read)
    def kept(source: Source) -> Measured:
        found: dict[Any, Measured] = source.__dict__.setdefault("_read", {})
        if read not in found:
            found[read] = read(source)
        return found[read]

    return kept
