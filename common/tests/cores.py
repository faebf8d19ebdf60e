"""Processors of a small machine, shared by the tests that run at the same time.

Ranks of MPI wait for each other in circles. If another test has one of the processors that they need, each message waits until the
kernel takes it away again: a run of 2.6 s takes 15 s. So ranks that want most of the machine have it for themselves.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# The lock that this process holds while it runs a test; none without other workers of pytest-xdist.
_held: list[int] = []


def _folder() -> Path | None:
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID")
    return Path(tempfile.gettempdir(), f"dembark-cores-{run}") if run else None


def forget() -> None:
    """At the end of a worker: those that go on lock new files."""
    folder = _folder()
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _locked(folder: Path, kind: int) -> Iterator[int]:
    # Whoever waits for all processors holds the gate, so that nobody overtakes.
    gate, place = (os.open(folder / name, os.O_RDWR | os.O_CREAT, 0o600) for name in ("gate", "place"))
    try:
        fcntl.flock(gate, fcntl.LOCK_EX)
        fcntl.flock(place, kind)
        fcntl.flock(gate, fcntl.LOCK_UN)
        yield place
    finally:
        for lock in (place, gate):
            fcntl.flock(lock, fcntl.LOCK_UN)  # by itself: processes that were forked meanwhile have it open, too
            os.close(lock)


@contextmanager
def shared() -> Iterator[None]:
    """One test beside others."""
    folder = _folder()
    if folder is None:
        yield
        return
    folder.mkdir(exist_ok=True)
    with _locked(folder, fcntl.LOCK_SH) as place:
        _held.append(place)
        try:
            yield
        finally:
            _held.clear()


@contextmanager
def alone(ranks: int) -> Iterator[None]:
    """A run of `ranks` within a test, while no other test runs unless there are more than twice as many processors."""
    folder = _folder()
    if ranks == 1 or folder is None or not _held or 2 * ranks < len(os.sched_getaffinity(0)):
        yield
        return
    place = _held.pop()
    fcntl.flock(place, fcntl.LOCK_UN)
    try:
        with _locked(folder, fcntl.LOCK_EX):
            yield
    finally:
        with _locked(folder, fcntl.LOCK_SH):  # through the gate, and only then
            fcntl.flock(place, fcntl.LOCK_SH)
        _held.append(place)
