"""The console script: how it ends, and what it does of a series while the engine still runs."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dembark.common.files import read_json

pytestmark = pytest.mark.usefixtures("decks", "stand_in")

LAST = "import atexit, sys; atexit.register(print, 'last words'); from dembark.validation import cli; "
SCRIPT, PLAIN = LAST + "cli.script()", LAST + "sys.exit(cli.main())"
# Of each replica it looks at something that needs no other one, and tells when: as `replica:is the third one finished`.
MEASURE = """
import os, time
from pathlib import Path
import numpy as np
from dembark.postproc.measurement import Measurement, exact, Value
from dembark.postproc.replica import once

@once
def look(replica):
    with Path(os.environ["TOLD"]).open("a") as file:
        file.write(f"{replica.record['replica']}:{(replica.folder.parent / 'replica-3/run.json').exists()} ")
    np.float64(0.0) / np.float64(replica.record["seed"] - 8)
    if os.environ.get("BROKEN") == "look":
        raise ValueError("no such thing")
    return float(replica.record["seed"])

def measure(replicas):
    return Measurement({"warmth": Value(exact(sum(map(look, replicas))), exact(24.0))})
"""
PREPARE = """
def prepare(replica):
    look(replica)
    time.sleep(float(os.environ.get("REST", "0")))
"""
QUANTITY = '\n[quantities]\nwarmth = { label = "warmth", evidence = "theory", tolerance = 0.1, why = "none" }\n'
WORDS = ("run", "box", "--engine", "liggghts", "--profile", "standard", "--jobs", "1", "--out")


@pytest.fixture
def call(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    def run(code: str, *words: str, **more: Any) -> subprocess.CompletedProcess[str]:
        given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | more
        return subprocess.run([sys.executable, "-c", code, *words], cwd=tmp_path, text=True, timeout=60, check=False, **given)
    return run


@pytest.mark.parametrize(("words", "code"), [(["cases", "box"], 0), (["rnu"], 2), (["report", "--results", "nowhere"], 2),
                                             (["run", "box", "--engine", "liggghts", "--set", "behaviour=exit", "--out", "o"], 1)])
def test_it_ends_as_the_interpreter_would(call: Callable[..., Any], words: list[str], code: int) -> None:
    ended, plain = call(SCRIPT, *words), call(PLAIN, *words)
    assert ended.returncode == plain.returncode == code
    assert ended.stdout == plain.stdout and ended.stdout.endswith("last words\n")
    assert ended.stderr.splitlines()[-1:] == plain.stderr.splitlines()[-1:]


def test_a_pipe_that_was_closed_and_a_full_disk_are_told_as_ever(call: Callable[..., Any]) -> None:
    codes = []
    for code in (SCRIPT, PLAIN):
        read, write = os.pipe()
        os.close(read)
        with os.fdopen(write, "w") as closed, Path("/dev/full").open("w", encoding="utf-8") as full:
            codes.append([call(code, "cases", stdout=out).returncode for out in (closed, full)])
    assert codes[0] == codes[1] and all(codes[0])


@pytest.fixture
def measured(decks: Path, tmp_path: Path) -> Callable[[bool], dict[str, str]]:
    """Gives the box a measure.py, with a function `prepare` or without; returns the environment of its processes."""
    def write(early: bool) -> dict[str, str]:
        (decks / "box/measure.py").write_text(MEASURE + PREPARE * early)
        case = decks / "box/case.toml"
        case.write_text(case.read_text().split("\n[quantities]")[0] + QUANTITY)
        (tmp_path / "told").unlink(missing_ok=True)
        return {**os.environ, "TOLD": str(tmp_path / "told")}
    return write


def told(folder: Path) -> list[str]:
    """What `look` was called for, in its order."""
    return (folder / "told").read_text().split() if (folder / "told").exists() else []


def test_replicas_are_read_while_others_run_and_the_result_is_the_same(
        call: Callable[..., Any], measured: Callable[[bool], dict[str, str]], tmp_path: Path) -> None:
    found = []
    for early, out in ((False, "late"), (True, "early")):
        # The third run does not end before something was looked at.
        done = call(SCRIPT, *WORDS, out, env=measured(early) | ({"GATE": str(tmp_path / "told")} if early else {}))
        assert done.returncode == 0, done.stderr
        content = read_json(tmp_path / out / "metrics.json")
        found.append({key: content[key] for key in ("quantities", "remarks", "parameters", "profiles")})
        order = told(tmp_path)
        # Each is looked at once; those that are finished before the last one do not wait for it.
        assert [one.split(":")[0] for one in order] == ["1", "2", "3"]
        assert (order[0] == "1:False") == early
    assert found[0] == found[1] and found[0]["quantities"][0]["verdict"] == "pass"
    assert sum("invalid value" in remark for remark in found[0]["remarks"]) == 1


def test_what_goes_wrong_early_is_told_once_when_it_is_measured(
        call: Callable[..., Any], measured: Callable[[bool], dict[str, str]], tmp_path: Path) -> None:
    lines = [call(SCRIPT, *WORDS, out, env=measured(early) | {"BROKEN": "look"}).stderr.splitlines()
             for early, out in ((False, "late"), (True, "early"))]
    last = [one[-1].replace(str(tmp_path / out), "") for one, out in zip(lines, ("late", "early"), strict=True)]
    assert last[0] == last[1] and "ValueError: no such thing" in last[0]
    assert not any("Traceback" in line for one in lines for line in one)
    assert not (tmp_path / "early/metrics.json").exists()


def test_an_interruption_while_a_replica_is_read_waits_for_nothing_and_leaves_a_series_that_goes_on(
        call: Callable[..., Any], measured: Callable[[bool], dict[str, str]], wait_for: Callable[..., Any], tmp_path: Path) -> None:
    environment = measured(True)
    process = subprocess.Popen([sys.executable, "-c", SCRIPT, *WORDS, "o"], cwd=tmp_path, text=True, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, env=environment | {"REST": "600", "GATE": str(tmp_path / "never")})
    wait_for(lambda: told(tmp_path), 60)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130 and "Traceback" not in error
    assert (tmp_path / "o/replica-1/run.json").is_file() and not (tmp_path / "o/metrics.json").exists()
    before = (tmp_path / "o/replica-1/run.json").read_bytes()
    done = call(SCRIPT, *WORDS, "o", env=environment)
    assert done.returncode == 0, done.stderr
    assert "box dry liggghts 1: already finished; reusing" in done.stderr
    assert (tmp_path / "o/replica-1/run.json").read_bytes() == before
    assert read_json(tmp_path / "o/metrics.json")["quantities"][0]["value"] == 24.0
