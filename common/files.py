"""Files that are either complete or absent: atomic writing, folders moved into place, and checks of an engine's output."""

from __future__ import annotations

import csv
import errno
import json
import math
import mmap
import os
import re
import shutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from .errors import DembarkError, RunError

DISK_FULL = "the disk is full"
_TIMESTEP = b"ITEM: TIMESTEP\n"
_IMPACT_COLUMNS = 17


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_atomic(path: Path, content: bytes) -> Path:
    """Write `content` so that a reader sees the old file or the complete new one, also after a crash; returns the path. DembarkError for
    a path that is no regular file, which would be replaced by one."""
    if path.exists() and not path.is_file():
        raise DembarkError(f"{path} is no regular file", "", "name another place")
    part = path.with_name(f".{path.name}.part-{os.getpid()}")
    try:
        part.write_bytes(content)
        _sync(part)
        part.replace(path)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        raise disk_error(error, path) from None
    _sync(path.parent)
    return path


def write_json(path: Path, content: Any) -> None:
    """Write `content` as JSON, see `write_atomic`."""
    write_atomic(path, (json.dumps(content, indent=1, allow_nan=False) + "\n").encode())


def read_json(path: Path) -> dict[str, Any] | None:
    """Content of a JSON file that holds an object; None when there is no such file or it is not readable as one."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def disk_error(error: OSError, path: Path) -> RunError:
    """One line for an operating system error while writing to `path`."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return RunError(DISK_FULL, f"writing {path}", "free some space and start again; what is finished is kept")
    return RunError(f"cannot write {path}", error.strerror or str(error))


def move_into_place(work: Path, target: Path) -> None:
    """Make the finished folder `work` to `target`; what was there goes only when the new one stands."""
    for path in work.rglob("*"):
        if path.is_file():
            _sync(path)
    old = target.with_name(f".{target.name}.old")
    shutil.rmtree(old, ignore_errors=True)
    if target.exists():
        target.rename(old)
    work.rename(target)
    _sync(target.parent)
    shutil.rmtree(old, ignore_errors=True)


def retire(path: Path) -> None:
    """Move a result that no longer belongs to the current runs into the folder `superseded` next to it."""
    if path.exists():
        aside = path.parent / "superseded" / path.name
        aside.parent.mkdir(exist_ok=True)
        if aside.is_dir():
            shutil.rmtree(aside)
        path.replace(aside)


def sweep(target: Path) -> None:
    """Bring back a result that a process was about to replace when it was killed, or clear it away when it had been replaced."""
    old = target.with_name(f".{target.name}.old")
    if old.is_dir() and not target.exists():
        old.rename(target)
    shutil.rmtree(old, ignore_errors=True)


def count_frames(path: Path, count_key: str) -> int:
    """Frames in a text dump whose size line is `ITEM: NUMBER OF <count_key>`; RunError unless every frame is complete."""
    if not path.is_file() or path.stat().st_size == 0:
        raise RunError(f"the engine wrote no {path.name}")
    pattern = re.compile(rb"\n\d+\nITEM: NUMBER OF " + count_key.encode() + rb"\n(\d+)\n")
    with path.open("rb") as handle, mmap.mmap(handle.fileno(), 0, access=mmap.ACCESS_READ) as data:
        frames, start = 0, 0
        if data[: len(_TIMESTEP)] != _TIMESTEP:
            raise RunError(f"{path.name} does not begin with a frame")
        while start < len(data):
            following = data.find(b"\n" + _TIMESTEP, start)
            end = len(data) if following < 0 else following + 1
            size = pattern.match(data, start + len(_TIMESTEP) - 1, end)
            # Nine header lines, then one line an entry.
            lines = data[start:end].count(b"\n")
            if not size or lines != 9 + int(size.group(1)) or data[end - 1] != 10:
                raise RunError(f"{path.name} is truncated in frame {frames + 1}")
            frames, start = frames + 1, end
    return frames


def _written(path: Path) -> str:
    if not path.is_file():
        raise RunError(f"the engine wrote no {path.name}")
    return path.read_text(encoding="utf-8", errors="replace")


def _finite(words: Iterable[str]) -> bool:
    """Whether all are finite numbers."""
    try:
        return all(math.isfinite(float(word)) for word in words)
    except ValueError:
        return False


def check_impacts(path: Path) -> int:
    """Number of impacts in an `impacts.txt`; RunError when it is missing, cut off or holds a line that is not seventeen finite numbers."""
    text = _written(path)
    if not text.startswith("#"):
        raise RunError(f"{path.name} does not begin with a header")
    rows = [line.split() for line in text.splitlines() if not line.startswith("#")]
    for number, row in enumerate(rows, start=1):
        if len(row) != _IMPACT_COLUMNS or not _finite(row):
            raise RunError(f"{path.name} is truncated, or holds no finite number, in line {number} of its {len(rows)} impacts")
    if not text.endswith("\n"):
        raise RunError(f"{path.name} is truncated after {len(rows)} impacts")
    return len(rows)


def check_times(path: Path) -> int:
    """Number of rows of a `time.csv`; RunError when it is missing, cut off or holds something that is not a finite number."""
    text = _written(path)
    rows = list(csv.reader(text.splitlines()))
    if len(rows) < 2 or rows[0][:3] != ["step", "time", "kinetic_energy"]:
        raise RunError(f"{path.name} has no rows, or no header step,time,kinetic_energy,...")
    if not text.endswith("\n"):
        raise RunError(f"{path.name} is truncated after {len(rows) - 2} rows")
    for number, row in enumerate(rows[1:], start=1):
        if len(row) != len(rows[0]):
            raise RunError(f"{path.name} has {len(row)} columns in row {number} of {len(rows) - 1}, its header {len(rows[0])}")
        if not _finite(row):
            raise RunError(f"the run became unstable: {path.name} holds no finite number at step {row[0]}")
    return len(rows) - 1
