"""The lock: exclusive on one host and between hosts, never kept by a dead process, and whoever loses it learns that."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from dembark.common.errors import DembarkError, Interrupted
from dembark.common.lock import Busy, is_held, lock

TIMES = {"beat": 0.1, "dead_after": 0.6}
HOLDER = ("import sys, time; from pathlib import Path; from dembark.common.lock import lock\n"
          "with lock(Path(sys.argv[1]), 'x'): print('held', flush=True); time.sleep(60)")


def elsewhere(path: Path, host: str = "another-host") -> None:
    """A lock as a process of another host leaves it."""
    with lock(path, "busy", **TIMES):
        text = path.read_text(encoding="utf-8")
    lines = [f"host={host}" if line.startswith("host=") else line for line in text.splitlines()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.fixture
def beating(tmp_path: Path) -> Iterator[Path]:
    """A lock that a process of another host keeps alive."""
    path, end = tmp_path / "lock", threading.Event()
    elsewhere(path)

    def beat() -> None:
        while not end.wait(0.05):
            os.utime(path)

    thread = threading.Thread(target=beat)
    thread.start()
    yield path
    end.set()
    thread.join()


def test_it_is_exclusive_and_ends_with_its_block(tmp_path: Path) -> None:
    with lock(tmp_path / "a/l", "busy"), pytest.raises(Busy, match="busy"), lock(tmp_path / "a/l", "busy"):
        pass
    with lock(tmp_path / "a/l", "busy"):
        assert is_held(tmp_path / "a/l")
    assert not is_held(tmp_path / "a/l") and not is_held(tmp_path / "none")


def test_it_ends_with_its_process(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path / "l")], stdout=subprocess.PIPE)
    assert process.stdout and process.stdout.readline()
    began = time.monotonic()
    with pytest.raises(DembarkError, match="busy"), lock(tmp_path / "l", "busy"):
        pass
    assert time.monotonic() - began < 5.0 and is_held(tmp_path / "l")
    process.kill()
    process.communicate()
    assert not is_held(tmp_path / "l")
    with lock(tmp_path / "l", "busy"):
        pass


def test_that_of_a_live_process_of_another_host_is_respected(beating: Path) -> None:
    assert is_held(beating, 0.6)
    with pytest.raises(Busy, match="taken"), lock(beating, "taken", threading.Event(), **TIMES):
        pass


def test_that_of_a_dead_process_of_another_host_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    elsewhere(path)
    with lock(path, "taken", threading.Event(), **TIMES) as lost:
        assert "another-host" not in path.read_text() and not lost.is_set()
    elsewhere(path)
    os.utime(path, (time.time() - 10, time.time() - 10))
    assert not is_held(path, 0.6)


def test_a_host_is_known_by_its_full_name(tmp_path: Path) -> None:
    """node10 is not node1."""
    path = tmp_path / "lock"
    elsewhere(path, socket.gethostname() + "0")
    with lock(path, "taken", threading.Event(), **TIMES):
        assert f"host={socket.gethostname()}\n" in path.read_text()


def test_its_holder_learns_that_it_was_taken(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    with lock(path, "taken", **TIMES) as lost:
        path.unlink()
        path.write_text("another's\n")
        assert lost.wait(20)


def test_waiting_for_it_can_be_interrupted(tmp_path: Path) -> None:
    cancel = threading.Event()
    cancel.set()
    elsewhere(tmp_path / "lock")
    with pytest.raises(Interrupted), lock(tmp_path / "lock", "taken", cancel, **TIMES):
        pass
