"""An engine's process: ended together with whoever started it, listened to while it speaks, and ended with all that it started."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from select import select

from dembark.validation.engines import end_with_parent

_GRACE = 5.0


@contextmanager
def running(command: Sequence[str], folder: Path, environment: Mapping[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    """The process of `command` in `folder`, with both its outputs in one pipe; at the end of the block it and its children are gone."""
    # It must not go on alone when this process is killed, and its lines must come when it writes them.
    words = [*end_with_parent("TERM"), *(["stdbuf", "-oL"] if shutil.which("stdbuf") else []), *command]
    process = subprocess.Popen(words, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, start_new_session=True)
    try:
        yield process
    finally:
        _end_group(process)


def chunks(process: subprocess.Popen[bytes], pause: float = 0.3) -> Iterator[bytes]:
    """What `process` writes, as it comes, until it ends; b"" whenever it was silent for `pause` (s)."""
    assert process.stdout
    while True:
        if select([process.stdout], [], [], pause)[0]:
            chunk = os.read(process.stdout.fileno(), 1 << 16)
            if not chunk:
                return
            yield chunk
        # A grandchild may hold the pipe open although the engine itself has ended.
        elif process.poll() is not None:
            return
        else:
            yield b""


def _end_group(process: subprocess.Popen[bytes]) -> None:
    """End the process and all that it started (its process group): politely first, after some seconds for good."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, number)
        except ProcessLookupError:
            break
        deadline = time.monotonic() + _GRACE
        while time.monotonic() < deadline and _group_lives(process):
            time.sleep(0.05)
    process.wait()
    if process.stdout:
        process.stdout.close()


def _group_lives(process: subprocess.Popen[bytes]) -> bool:
    process.poll()
    try:
        os.killpg(process.pid, 0)
    except ProcessLookupError:
        return False
    return True
