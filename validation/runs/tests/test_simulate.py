"""One run: what is kept, what is repeated, and what happens to engines that die, lie or never end."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from harness import decks, engine_pid, environment, lives, stand_in, wait_for  # noqa: F401

from dembark.common.errors import DembarkError, Interrupted, Killed, RunError
from dembark.common.files import read_json
from dembark.validation import engines
from dembark.validation.campaigns import plan as plans
from dembark.validation.campaigns.plan import Run, series
from dembark.validation.case import deck, folders
from dembark.validation.case.folders import find
from dembark.validation.judge.result import read
from dembark.validation.results import status_file
from dembark.validation.runs import outcome, simulate
from dembark.validation.runs.steps import measure_series

FindPid = Callable[[Path], int]
Lives = Callable[[int], bool]
Command = tuple[subprocess.Popen[str], Path]

pytestmark = pytest.mark.usefixtures("decks", "stand_in")


class Ended:
    """A process that writes its last line between two looks, and has ended at the second."""

    def __init__(self) -> None:
        out, self.into = os.pipe()
        self.stdout = os.fdopen(out, "rb")

    def poll(self) -> int:
        os.write(self.into, b"dembark: finished\n")
        os.close(self.into)
        return 0


def test_the_last_lines_of_a_process_are_read() -> None:
    ended = Ended()
    with ended.stdout:
        assert b"".join(simulate.chunks(ended, pause=0.01)) == b"dembark: finished\n"  # type: ignore[arg-type]


def plan(engine: str = "liggghts", **changes: object) -> Run:
    engines.find.cache_clear()
    folders.load.cache_clear()
    return series(find("box"), "dry", "quick", engines.find(engine), changes).runs[0]


def run(out: Path, engine: str = "liggghts", cancel: threading.Event | None = None, **changes: object) -> tuple[Path, str]:
    one = plan(engine, **changes)
    made = simulate.simulate(one, out, cancel or threading.Event())
    return out / one.folder_name, "finished" if made else "kept"


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_a_run_leaves_its_files_and_its_record(tmp_path: Path, engine: str) -> None:
    folder, state = run(tmp_path / "out", engine, static_friction=0.4)
    assert state == "finished"
    assert {"engine.log", "grains.dump", "contacts.dump", "time.csv", "run.json"} <= {path.name for path in folder.iterdir()}
    record = read_json(folder / "run.json")
    assert (record["steps"], record["time_step"], record["frames"], record["replica"]) == (100, 1e-5, 3, 1)
    assert record["parameters"]["static_friction"] == 0.4 and record["parameters"]["kinetic_friction"] is None
    assert record["provenance"]["versions"][engine].endswith("stand-in")
    assert record["provenance"]["particle_steps_per_second"] > 0
    assert "DISPLAY" not in engines.find(engine).environment() and engines.find(engine).environment()["OMP_NUM_THREADS"] == "1"
    passed = dict(line.split("=") for line in (folder / "values").read_text().splitlines())
    assert passed["strength"] == "1e+300" and passed["seed"] == "7" and "kinetic_friction" not in passed


def test_each_run_has_a_folder_of_its_own_for_temporary_files_which_goes_with_it(tmp_path: Path) -> None:
    """Two MPI programs that start at the same time must not make one session folder: one of them would fail."""
    own = [Path((run(tmp_path / name)[0] / "tmpdir").read_text()) for name in "ab"]
    assert own[0] != own[1] and all(path.is_absolute() and path.name.startswith("dembark-") and not path.exists() for path in own)


def test_a_result_holds_the_deck_that_made_it(tmp_path: Path, decks: Path, stand_in: Path) -> None:
    (decks / "box" / "lid").mkdir()
    (decks / "box" / "lid" / "lid.stl").write_text("solid lid\n")
    deck, case = (decks / "box" / "liggghts.in").read_text(), (decks / "box" / "case.toml").read_text()
    folder, _ = run(tmp_path / "out")
    (decks / "box" / "liggghts.in").write_text("# another deck\n")
    assert deck in (folder / "liggghts.in").read_text() and (folder / "case/case.toml").read_text() == case
    assert re.search(r"variable grain_count +string 10 # number of grains", (folder / "liggghts.in").read_text())
    assert (folder / "lid/lid.stl").is_file() and not (folder / "yade.py").exists()


def test_a_finished_run_is_not_repeated_unless_an_input_changes(tmp_path: Path, decks: Path, stand_in: Path) -> None:
    out = tmp_path / "out"
    folder, _ = run(out)
    made = (folder / "run.json").stat().st_mtime_ns
    assert run(out) == (folder, "kept")
    case = decks / "box" / "case.toml"
    case.write_text(case.read_text().replace("Grains in a box.", "Better words."))
    (decks / "box" / "yade.py").write_text("# the other engine's deck\np = dembark.parameters()\n")
    (decks / "box" / "README.md").write_text("words\n")
    (decks / "box" / "measure.py").write_text("# looks at results only\n")
    assert run(out) == (folder, "kept")
    assert (folder / "run.json").stat().st_mtime_ns == made
    assert run(out, grain_diameter="6 mm")[1] == "finished"
    assert run(out, grain_diameter=0.006)[1] == "kept"
    (decks / "box" / "liggghts.in").write_text("# another deck\n")
    assert run(out, grain_diameter=0.006)[1] == "finished"
    stand_in.write_text(stand_in.read_text(encoding="utf-8") + "# another build\n", encoding="utf-8")
    assert run(out, grain_diameter=0.006)[1] == "finished"


@pytest.mark.parametrize(("behaviour", "words"), [
    ("exit", ["exit code 1", "at step 50 of 100", "Lost atoms"]),
    ("abort", ["exit code 1", "at step 50 of 100", ", ERROR on proc 1: atoms 3 and 4 have the same centre"]),
    ("abort by signal", ["exit code 143", ", ERROR on proc 1: atoms 3 and 4 have the same centre"]),
    ("kill", ["killed by SIGKILL", "at step 50"]),
    ("full", ["disk is full"]),
    ("truncate", ["grains.dump is truncated"]),
    ("short", ["grains.dump holds 2 frames instead of 3"]),
    ("unstable", ["unstable", "step 100"]),
    ("silent", ["without 'dembark: finished'"]),
])
def test_failures_are_told_in_one_line_and_leave_earlier_results(tmp_path: Path, behaviour: str, words: list[str]) -> None:
    out = tmp_path / "out"
    folder, _ = run(out)
    before = {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(RunError) as caught:
        run(out, behaviour=behaviour)
    message, log = str(caught.value), out / "failed" / "replica-1.log"
    status = read_json(status_file(folder))
    assert status["state"] == ("stopped" if behaviour == "kill" else "failed") and status["message"] in message
    assert isinstance(caught.value, Killed) == (behaviour == "kill")
    assert "\n" not in message and str(log) in message and message.startswith("box dry liggghts 1 failed")
    for word in words:
        assert word in message
    assert "dembark: steps 100" in log.read_text()
    assert {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    assert not list(out.glob(".*work*"))
    run(out, pause=0.001)
    assert not (out / "failed").exists() and not status_file(folder).exists()


def test_cancelling_ends_the_engine_and_clears_up(tmp_path: Path, engine_pid: FindPid, lives: Lives) -> None:
    out, cancel, caught = tmp_path / "out", threading.Event(), []

    def work() -> None:
        try:
            run(out, cancel=cancel, behaviour="hang")
        except Interrupted as error:
            caught.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    pid = engine_pid(out)
    cancel.set()
    thread.join(20)
    assert caught and not lives(pid)
    assert [path.name for path in out.iterdir() if "lock" not in path.name] == [".replica-1.status.json"]


@pytest.fixture
def command(tmp_path: Path) -> Iterator[Command]:
    """`dembark run` of a run that hangs, in a process of its own."""
    out = tmp_path / "out"
    words = ["run", "box", "--engine", "liggghts", "--set", "behaviour=hang", "--out", str(out)]
    process = subprocess.Popen([sys.executable, "-m", "dembark.validation.cli", *words],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    yield process, out
    process.kill()
    process.communicate()


@pytest.mark.parametrize("number", [pytest.param(signal.SIGTERM, marks=pytest.mark.full), signal.SIGINT])
def test_a_signal_to_the_command_ends_the_engine(command: Command, number: int, engine_pid: FindPid, lives: Lives) -> None:
    process, out = command
    pid = engine_pid(out)
    process.send_signal(number)
    _, error = process.communicate(timeout=90)
    assert process.returncode == 130 and "interrupted" in error and "Traceback" not in error
    assert not lives(pid) and not list(out.glob(".*work*"))


def test_a_run_belongs_to_one_process_and_when_that_is_killed_the_next_clears_up(
        command: Command, engine_pid: FindPid, lives: Lives, wait_for: Callable[..., object]) -> None:
    process, out = command
    pid = engine_pid(out)
    with pytest.raises(DembarkError, match="by another process"):
        run(out)
    process.kill()
    process.wait()
    wait_for(lambda: not lives(pid))
    assert list(out.glob(".replica-1.work-*"))
    assert run(out)[1] == "finished"
    assert not list(out.glob(".replica-1.work-*"))


def test_too_little_room_is_told_before_the_start(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"disk is too full.*needs about"):
        run(tmp_path, grain_count=10**9, frames=10**6)
    assert not list(tmp_path.glob("replica-*"))


@pytest.mark.parametrize(("outputs", "expected"), [(("grains", "contacts", "times"), 800), (("grains", "times"), 200), (("times",), 0)])
def test_room_is_that_of_the_dumps_which_the_case_writes(outputs: tuple[str, ...], expected: int) -> None:
    case = SimpleNamespace(outputs=outputs, particle_count=lambda values: values["grain_count"])
    size = Run(cast(Any, case), "dry", "full", cast(Any, None), 1, {"grain_count": 1000, "frames": 10}).output_size
    assert size == 10000 * expected


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting a small disk needs root")
def test_a_disk_that_fills_up_is_named_as_the_cause(tmp_path: Path) -> None:
    out = tmp_path / "small"
    out.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=8m", "none", str(out)], capture_output=True, check=False).returncode:
        pytest.skip("this machine allows no mounts")
    try:
        (out / "filler").write_bytes(bytes(7 << 20))
        with pytest.raises(RunError, match=r"disk is full|disk is too full"):
            run(out, pause=0.5)
        assert not list(out.glob("replica-*")) and not list(out.glob(".*work*"))
    finally:
        subprocess.run(["umount", str(out)], check=True)


def test_mpi_ranks_are_for_liggghts() -> None:
    deck = Path("deck")
    assert engines.find("liggghts").command(deck, {}, ranks=2)[:3] == ["mpirun", "-np", "2"]
    with pytest.raises(DembarkError, match="--threads"):
        engines.find("yade").command(deck, {}, ranks=2)
    assert engines.find("yade").command(deck, {}, threads=2)[1] == "-j2"


def test_a_line_about_the_steps_has_two_numbers() -> None:
    parser = outcome.OutputParser()
    assert not parser.read("dembark: steps 10 time_step 1e-5,") and parser.read("dembark: steps 10 time_step 1e-5")
    assert (parser.steps, parser.time_step) == (10, 1e-5)


def test_a_state_outlives_a_mistake_in_the_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    work = tmp_path / ".replica-1.work-x"
    work.mkdir()

    def wrong(*_: object) -> None:
        raise DembarkError("setup.py is being edited")

    monkeypatch.setattr(simulate.restarts, "work_folder", lambda *_: work)
    monkeypatch.setattr(simulate.restarts, "begin", lambda *_: 500)
    monkeypatch.setattr(simulate.restarts, "newest", lambda *_: 500)
    monkeypatch.setattr(simulate.deck, "prepare", wrong)
    with pytest.raises(DembarkError, match="edited"):
        run(tmp_path)
    assert work.is_dir()


def test_the_engines_own_word_is_found() -> None:
    assert outcome.reason(["Traceback (most recent call last):", "  x", "ValueError: no", "bye"]) == "ValueError: no"
    assert outcome.reason(["ERROR: Unknown pair style (force.cpp:1)", "Last command: x"]).startswith("ERROR: Unknown pair")
    assert outcome.reason(["dembark: steps 3", "only this"]) == "its last line: only this"
    assert outcome.reason([]) == "it printed nothing"


def test_a_result_is_written_once_with_all_that_is_known_of_it(tmp_path: Path) -> None:
    folders.load.cache_clear()
    runs = series(find("box"), "dry", "quick", engines.find("liggghts"), {"replicas": 3}).runs
    for one in (runs[0], runs[2]):
        simulate.simulate(one, tmp_path, threading.Event())
    found = measure_series(tmp_path, "box", {run.folder_name: run.inputs for run in runs})
    assert read(tmp_path / "metrics.json") == found
    assert found.inputs == (runs[0].inputs, runs[2].inputs) and found.replicas_missing == (2,) and found.parameters["replicas"] == 3
    assert found.provenance["seeds"] == [7, 9] and "at" in found.measured


def test_the_inputs_of_a_run_are_worked_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr(plans, "sources", lambda case, engine: asked.append(engine) or {})
    one = plan()
    assert one.inputs == one.inputs and asked == ["liggghts"]


def test_the_numbers_of_a_run_are_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made, prepare = list[str](), deck.prepare
    monkeypatch.setattr(deck, "prepare", lambda case, values: made.append(case.name) or prepare(case, values))
    folder, _ = run(tmp_path)
    assert made == ["box"] and read_json(folder / "run.json")["derived"] == {"steps": 100, "time_step": 1e-5}


def test_what_the_integration_monitor_found_is_read_from_the_log(tmp_path):
    log = tmp_path / "engine.log"
    log.write_text("dembark: steps 10 time_step 1e-5\ndembark: integration position 1e-7 velocity 0.002 contact_steps 31.5\n"
                   "dembark: finished\n")
    assert outcome.integration(tmp_path) == {"position": 1e-7, "velocity": 0.002, "contact_steps": 31.5}
    for text in ("dembark: finished\n", "dembark: integration position 1e-7 velocity", "dembark: integration position low\n"):
        log.write_text(text)
        assert outcome.integration(tmp_path) == {}
    assert outcome.reason(["ERROR: no", "dembark: integration position 1"]) == "ERROR: no"
