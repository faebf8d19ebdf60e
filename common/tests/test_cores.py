"""Ranks that want the whole machine wait for the tests of other processes, and these for them."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import IO

import pytest

from dembark.common.tests import cores

OTHER = """
import os, sys
from dembark.common.tests import cores
with cores.shared():
    os.write(1, b"in\\n")
    sys.stdin.read()
    os.write(1, b"out\\n")
"""
# It leaves a process behind that was forked while it ran.
FORKS = """
import os, time
from dembark.common.tests import cores
with cores.shared():
    forked = os.fork()
    if forked == 0:
        time.sleep(60)
        os._exit(0)
os.write(1, f"{forked}\\n".encode())
os._exit(0)
"""


@pytest.fixture
def other(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Callable[[], tuple[IO[bytes], IO[bytes]]]]:
    """Starts another process that runs a test until its input is closed; its input and output."""
    monkeypatch.setenv("PYTEST_XDIST_TESTRUNUID", "a-run")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setattr(cores, "_held", [])
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1})
    with ExitStack() as ended:
        def start() -> tuple[IO[bytes], IO[bytes]]:
            one = subprocess.Popen([sys.executable, "-c", OTHER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
            ended.enter_context(one)
            ended.callback(one.kill)
            assert one.stdin and one.stdout
            return one.stdin, one.stdout

        yield start


def says_within(seconds: float, output: IO[bytes]) -> bool:
    return bool(select.select([output], [], [], seconds)[0])


def test_tests_run_beside_each_other_and_ranks_alone(other: Callable[[], tuple[IO[bytes], IO[bytes]]]) -> None:
    stop, output = other()
    with cores.shared():
        assert output.read(3) == b"in\n"
        with cores.alone(1):  # one rank waits for no other
            assert not says_within(0.0, output)
        stop.close()
        with cores.alone(2):
            assert output.read(4) == b"out\n"
            _, later = other()
            assert not says_within(1.0, later)
        assert later.read(3) == b"in\n"


def test_what_a_test_forked_does_not_hold_up_others(other: Callable[[], tuple[IO[bytes], IO[bytes]]]) -> None:
    with cores.shared(), subprocess.Popen([sys.executable, "-c", FORKS], stdout=subprocess.PIPE, bufsize=0) as one:
        assert one.stdout
        forked = int(one.stdout.read(20))
        try:
            with cores.alone(2), cores.alone(2):
                assert Path(f"/proc/{forked}/cmdline").read_bytes()  # it still sleeps
        finally:
            os.kill(forked, signal.SIGKILL)


def test_without_other_workers_nothing_is_locked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTEST_XDIST_TESTRUNUID", raising=False)
    monkeypatch.setattr(cores, "_held", [])
    with cores.shared(), cores.alone(64):
        assert not cores._held
