"""Ranks that want the whole machine wait for the tests of other processes, and these for them."""

from __future__ import annotations

import select
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import IO

import pytest

from dembark.common.tests import cores

OTHER = """
import sys
from dembark.common.tests import cores
with cores.shared():
    print("in", flush=True)
    sys.stdin.read()
    print("out", flush=True)
"""


@pytest.fixture
def other(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Callable[[], tuple[IO[bytes], IO[bytes]]]]:
    """Starts another process that runs a test until its input is closed; its input and output."""
    monkeypatch.setenv("PYTEST_XDIST_TESTRUNUID", "a-run")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setattr(cores, "_held", [])
    monkeypatch.setattr("os.cpu_count", lambda: 2)
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


def test_without_other_workers_nothing_is_locked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTEST_XDIST_TESTRUNUID", raising=False)
    monkeypatch.setattr(cores, "_held", [])
    with cores.shared(), cores.alone(64):
        assert not cores._held
