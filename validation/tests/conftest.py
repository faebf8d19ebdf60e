"""A small case with a stand-in engine, for tests of the harness itself."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from dembark.validation import engines
from dembark.validation.case import folders
from dembark.validation.cli import main
from dembark.validation.runs import executor

sys.path.insert(0, str(Path(__file__).parent))

CASE = """
[case]
title = "A box"
description = "Grains in a box."
source = ["nobody"]
engines = ["liggghts", "yade"]

[parameters]
grain_count = { value = 10, min = 1, doc = "number of grains" }
contact_angle = { value = 0.35, unit = "rad", min = 0.0, max = 1.5707963267948966, doc = "angle" }
static_friction = { optional = true, min = 0.0, doc = "static friction; not set = that of the material" }
kinetic_friction = { optional = true, min = 0.0, doc = "kinetic friction" }
strength = { value = inf, unit = "Pa", min = 0.0, doc = "strength" }
pause = { value = 0.0, unit = "s", min = 0.0, doc = "rest between steps" }
frames = { value = 3, min = 1, doc = "number of frames" }
seed = { value = 7, doc = "seed" }
replicas = { value = 1, min = 1, doc = "number of packings" }

[parameters.grain_diameter]
value = 0.005
unit = "m"
above = 0.0
doc = "diameter"

[parameters.behaviour]
value = "ok"
values = ["ok", "exit", "abort", "abort by signal", "kill", "kill approximate", "hang", "full", "truncate", "short", "unstable", "silent"]
doc = "what the stand-in engine does"

[derived]
steps = "100"
time_step = "1e-5"

[profiles.standard]
replicas = 3
grain_count = 20

[variants.dry]
[variants.wet]
contact_angle = 0.1

[runs]
quick = [{variant = "dry"}, {variant = "wet", engines = ["liggghts"]}]
standard = [{variant = "dry"}]

[constraints]
"kinetic_friction <= static_friction" = "the kinetic friction exceeds the static one"
"""


@pytest.fixture
def decks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the case `box` for both engines; DEMBARK_DECKS points at it."""
    root = tmp_path / "decks"
    (root / "box").mkdir(parents=True)
    (root / "box" / "case.toml").write_text(CASE)
    (root / "box" / "liggghts.in").write_text("# A deck with fix resume/exact.\n")
    (root / "box" / "yade.py").write_text("p = dembark.parameters()\ndembark.run(p.steps)\n")
    # What measures stands in for the real thing, too.
    (root / "box" / "measure.py").write_text("from dembark.postproc.measurement import Measurement\ndef measure(replicas):\n"
                                             "    return Measurement({})\n")
    monkeypatch.setenv("DEMBARK_DECKS", str(root))
    folders.load.cache_clear()
    return root


@pytest.fixture
def stand_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The stand-in as both engines; returns its file, which may be edited to be "another version"."""
    program = tmp_path / "engine" / "bin" / "stand-in"
    program.parent.mkdir(parents=True)
    shutil.copy(Path(__file__).with_name("stand_in_engine.py"), program)
    monkeypatch.setenv("DEMBARK_LIGGGHTS", str(program))
    monkeypatch.setenv("DEMBARK_YADE", str(program))
    engines.find.cache_clear()
    yield program
    engines.find.cache_clear()


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """Environment in which Python processes use the stand-ins for measurement, comparison and report."""
    site = tmp_path / "site"
    site.mkdir()
    shutil.copy(Path(__file__).with_name("stand_in_analysis.py"), site / "sitecustomize.py")
    paths = [str(site), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths)), "XDG_CACHE_HOME": str(tmp_path / "cache")}


@pytest.fixture
def stand_in_analysis(monkeypatch: pytest.MonkeyPatch) -> None:
    """The stand-ins for measurement, comparison and report in this process."""
    for name, function in import_module("stand_in_analysis").STAND_INS:
        monkeypatch.setattr(import_module(f"dembark.validation.{name}"), function.__name__, function)


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[Callable[..., Any]]:
    """`command(*words, folder=tmp_path)`: the command `dembark` in this process and in the `folder`; its exit code, output and errors.
    Steps after the runs are made in threads instead of processes."""
    monkeypatch.setattr(executor, "ProcessPoolExecutor", lambda cores, *_: ThreadPoolExecutor(cores))
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def call(*words: str, folder: Path = tmp_path) -> tuple[int, str, str]:
        monkeypatch.chdir(folder)
        folders.load.cache_clear()
        engines.find.cache_clear()
        capsys.readouterr()
        code = main(list(words))
        return code, *capsys.readouterr()

    yield call
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.fixture
def wait_for() -> Callable[..., Any]:
    """`wait_for(question, seconds=20)`: ask until the answer is true, and return it."""
    def ask(question: Callable[[], Any], seconds: float = 20) -> Any:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            answer = question()
            if answer:
                return answer
            time.sleep(0.05)
        raise AssertionError("waited in vain")
    return ask


@pytest.fixture
def lives() -> Callable[[int], bool]:
    """`lives(pid)`: whether the process runs (an ended one that nobody waited for does not)."""
    def look(pid: int) -> bool:
        try:
            return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
        except OSError:
            return False
    return look


@pytest.fixture
def engine_pid(wait_for: Callable[..., Any]) -> Callable[[Path], int]:
    """`engine_pid(folder)`: process of the stand-in that works on a first replica somewhere below `folder`."""
    def look(folder: Path) -> int:
        return int(wait_for(lambda: next((path.read_text() for path in folder.glob("**/.replica-1.work-*/pid")), None), 60))
    return look
