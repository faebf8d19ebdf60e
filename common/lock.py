"""A lock that one process at a time holds, on whatever host of a shared file system, and that a dead process cannot keep."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import SoftFileLease, Timeout

from .errors import DembarkError, Interrupted
from .files import disk_error

BEAT = 10.0
# Longer than a beat and what a network file system may hold back.
DEAD_AFTER = 90.0


class Busy(DembarkError):
    """The lock is held by another process that lives."""


@contextmanager
def lock(path: Path, message: str, cancel: threading.Event | None = None, beat: float = BEAT,
         dead_after: float = DEAD_AFTER) -> Iterator[threading.Event]:
    """Hold the lock `path`; Busy(message) when a process that lives has it.

    A lock whose holder has ended on this host is taken at once. The holder touches the file every `beat` (s): one of another host
    that does not change for `dead_after` (s) is that of a dead process. To see that may take as long; `cancel` ends the wait with
    Interrupted. Gives an event that is set if another process takes the lock, because this one was held up for so long.
    """
    lost, ended = threading.Event(), cancel or threading.Event()
    lease = SoftFileLease(path, lease_duration=dead_after, heartbeat_interval=beat, on_compromise=lambda _: lost.set())
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _acquire(lease, path, ended, beat, dead_after)
    except Timeout:
        raise Busy(message, f"its lock is {path}", "wait for it to end or stop it") from None
    except OSError as error:
        raise disk_error(error, path) from None
    try:
        yield lost
    finally:
        lease.release()


def _acquire(lease: SoftFileLease, path: Path, cancel: threading.Event, beat: float, dead_after: float) -> None:
    """Take the lock, or see by the first beat of its holder that it lives: Timeout."""
    try:
        lease.acquire(timeout=0.5, poll_interval=0.05)
        return
    except Timeout:
        first = _touched(path)
        if _of_this_host(path):
            raise

    def over() -> bool:
        return cancel.is_set() or _touched(path) not in (first, None)

    try:
        lease.acquire(timeout=dead_after + 2.0 * beat, poll_interval=min(1.0, 0.2 * beat), cancel_check=over)
    except Timeout:
        if cancel.is_set():
            raise Interrupted("interrupted", f"while it waited for {path}") from None
        raise


def is_held(path: Path, dead_after: float = DEAD_AFTER) -> bool:
    """Whether a living process seems to hold the lock `path`; for one on another host by its last beat."""
    lease = SoftFileLease(path, lease_duration=dead_after, heartbeat_interval=min(BEAT, 0.5 * dead_after))
    touched = _touched(path)
    if touched is None:
        return False
    try:
        lease.acquire(timeout=0)
    except (Timeout, OSError):
        return time.time() - touched < dead_after
    lease.release()
    return False


def _of_this_host(path: Path) -> bool:
    """Whether the holder is a process of this host; then it lives, or its lock would have been taken."""
    try:
        return f"\nhost={socket.gethostname()}\n" in path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False


def _touched(path: Path) -> float | None:
    try:
        return path.stat().st_mtime
    except OSError:
        return None
