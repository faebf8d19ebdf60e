"""A lock that one process at a time holds, on whatever host of a shared file system, and that a dead process cannot keep."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import socket
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from dembark.common.errors import DembarkError, Interrupted

BEAT = 10.0
# Longer than a beat and what a network file system may hold back.
DEAD_AFTER = 90.0


@contextmanager
def claim(path: Path, message: str, cancel: threading.Event, beat: float = BEAT,
          dead_after: float = DEAD_AFTER) -> Iterator[threading.Event]:
    """Hold the lock `path`; DembarkError(message) when a process that lives has it.

    On one host the system's file lock decides. Elsewhere it may not reach, so the holder writes its name and a new number into the file
    every `beat` (s); a lock of another host whose number has not changed for `dead_after` (s) is that of a dead process, and is taken. To
    see that may take as long; `cancel` ends the wait with Interrupted. Gives an event that is set if another process takes the lock,
    because this one was held up for so long.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    refusal = DembarkError(message, f"its lock is {path}", "wait for it to end or stop it")
    with path.open("a+", encoding="utf-8") as handle:
        local = _flock(handle)
        if local is False or not _dead(path, local, cancel, beat, dead_after):
            raise refusal
        mine = uuid.uuid4().hex
        _write(path, mine)
        # Where no file lock reaches, two may have found the same lock dead; the one that wrote last has it.
        if local is None:
            cancel.wait(min(1.0, 0.1 * beat))
            if _read(path).get("key") != mine:
                raise refusal
        end, lost = threading.Event(), threading.Event()
        thread = threading.Thread(target=_keep, args=(path, mine, end, lost, beat), daemon=True)
        thread.start()
        try:
            yield lost
        finally:
            end.set()
            thread.join()
            if _read(path).get("key") == mine:
                path.write_text("", encoding="utf-8")


def _flock(handle: IO[str]) -> bool | None:
    """True: locked; False: a process of this host has it; None: this file system has no such locks."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno in (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL):
            return None
        raise
    return True


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _write(path: Path, key: str) -> None:
    content = {"key": key, "host": socket.gethostname(), "pid": os.getpid(), "beat": time.time()}
    path.write_text(json.dumps(content) + "\n", encoding="utf-8")


def _runs(pid: Any) -> bool:
    return isinstance(pid, int) and Path(f"/proc/{pid}").exists()


def _dead(path: Path, local: bool | None, cancel: threading.Event, beat: float, dead_after: float) -> bool:
    """Whether nobody who lives holds the lock; may watch it for `dead_after`."""
    if path.stat().st_size == 0:
        return True
    first = _read(path)
    if first.get("host") == socket.gethostname():
        # The file lock of a process that ended on this host is free.
        return bool(local) or not _runs(first.get("pid"))
    deadline = time.monotonic() + dead_after
    while time.monotonic() < deadline:
        if cancel.wait(min(1.0, 0.2 * beat)):
            raise Interrupted("interrupted", f"while it waited for {path}")
        now = _read(path)
        # A file that is being written may be empty or cut for a moment.
        if now and now != first:
            return False
    return True


def _keep(path: Path, mine: str, end: threading.Event, lost: threading.Event, beat: float) -> None:
    while not end.wait(beat):
        try:
            if _read(path).get("key", mine) == mine:
                _write(path, mine)
                continue
        except OSError:
            # A full disk or a network that is away for a while; the lock is lost only if another has it.
            continue
        lost.set()
        return
