"""The executor with runs and steps that stand in: order, limits, retries, what is done again, and that everything comes to an end."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from harness import decks, stand_in  # noqa: F401

from dembark.common.errors import Interrupted, Killed, RunError
from dembark.common.files import write_json
from dembark.validation.campaigns.plan import Resources, Run, of_profile
from dembark.validation.judge.inputs import KEY, content, digest, stored_hash
from dembark.validation.results import State
from dembark.validation.runs import executor as executor_module
from dembark.validation.runs.executor import Executor, States, Task
from dembark.validation.runs.steps import Step

pytestmark = pytest.mark.usefixtures("decks", "stand_in")


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[Exception | None]]:
    """How the attempts of each run end, by its name; `started` lists the attempts."""
    ends: dict[str, list[Exception | None]] = {}
    started: list[Exception | None] = ends.setdefault("started", [])

    def simulate(run: Run, *rest: object) -> None:
        started.append(run.name)  # type: ignore[arg-type]
        time.sleep(0.05)
        if error := (ends.get(run.name) or [None]).pop(0):
            raise error

    monkeypatch.setattr(executor_module, "simulate", simulate)
    return ends


def tasks(folder: Path) -> list[Task]:
    return [Task(run, folder / one.place, Resources()) for one in of_profile("quick") for run in one.runs]


def write(path: Path, sources: Sequence[Path]) -> None:
    write_json(path, {KEY: of(sources)})


def of(sources: Sequence[Path]) -> str:
    return digest([content(path) for path in sources])


def fail(text: str) -> None:
    raise RunError(text)


def die(once: Path) -> None:
    """The process is killed, but only the first time."""
    if not once.exists():
        once.touch()
        os.kill(os.getpid(), signal.SIGKILL)


def step(name: str, folder: Path, needs: Sequence[str], call: Callable[..., object] | None = None, *arguments: object,
         sources: Sequence[Path] = ()) -> Step:
    target = folder / f"{name}.json"
    return Step(name, "measure", tuple(needs), target, partial(of, sources), call or write, arguments or (target, sources))


def execute(work: Sequence[Task], steps: Sequence[Step], cancel: threading.Event | None = None) -> tuple[Executor, dict[str, State]]:
    states = States(work, steps)
    made = Executor(states, cancel or threading.Event(), cores=2, retries=2)
    try:
        made.execute(work, steps)
    finally:
        found = {state.name: state for state in states.all()}
        execute.last = found  # type: ignore[attr-defined]
    return made, found


def test_what_was_killed_is_started_again_and_what_failed_is_not(tmp_path: Path, script: dict[str, list[Exception | None]]) -> None:
    work = tasks(tmp_path)
    one, two, three = (task.name for task in work)
    script |= {one: [Killed("power"), None], two: [RunError(f"{two} failed, it blew up")], three: [Killed("x")] * 3}
    made, found = execute(work, [step("m", tmp_path, [one, two, three])])
    assert {name: script["started"].count(name) for name in (one, two, three)} == {one: 2, two: 1, three: 3}  # type: ignore[arg-type]
    assert set(script["started"][:2]) == {one, two}
    assert {name: (state.state, state.message) for name, state in found.items()} == {
        one: ("finished", ""), two: ("failed", "it blew up"), three: ("failed", "x"), "m": ("finished", "")}
    assert list(made.errors) == [two, three] and stored_hash(tmp_path / "m.json")


def test_steps_are_made_again_when_what_they_read_has_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executor_module, "ProcessPoolExecutor", lambda cores, *_: ThreadPoolExecutor(cores))
    source = tmp_path / "source"
    source.write_text("1")
    first, second = step("a", tmp_path, [], sources=[source]), step("b", tmp_path, ["a"], sources=[tmp_path / "a.json"])

    def made() -> set[str]:
        before = {name: (tmp_path / f"{name}.json").stat().st_mtime_ns for name in "ab" if (tmp_path / f"{name}.json").exists()}
        execute([], [first, second])
        return {name for name in "ab" if (tmp_path / f"{name}.json").stat().st_mtime_ns != before.get(name)}

    assert made() == {"a", "b"} and made() == set()
    (tmp_path / "b.json").unlink()
    assert made() == {"b"}
    source.write_text("2")
    assert made() == {"a", "b"}
    (tmp_path / "a.json").write_text(json.dumps({KEY: "other"}))
    assert made() == {"a"}  # which was made as before, so that nothing follows from it


def test_a_step_that_fails_or_is_killed_stops_no_other(tmp_path: Path) -> None:
    once = tmp_path / "once"
    steps = [step("bad", tmp_path, [], fail, "no number"), step("killed", tmp_path, ["bad"], die, once), step("good", tmp_path, ["killed"])]
    made, found = execute([], steps)
    assert {name: state.state for name, state in found.items()} == {"bad": "failed", "killed": "finished", "good": "finished"}
    assert [str(error) for error in made.errors.values()] == ["no number"]


def begin(path: Path) -> None:
    path.touch()
    time.sleep(600)


def test_an_interruption_ends_steps_at_once(tmp_path: Path) -> None:
    cancel, path = threading.Event(), tmp_path / "begun"

    def interrupt() -> None:
        while not path.exists():
            time.sleep(0.02)
        cancel.set()

    threading.Thread(target=interrupt, daemon=True).start()
    began = time.monotonic()
    with pytest.raises(Interrupted):
        execute([], [step("long", tmp_path, [], begin, path)], cancel)
    assert time.monotonic() - began < 60 and execute.last["long"].state == "stopped"  # type: ignore[attr-defined]


def test_cores_and_memory_of_this_machine_are_kept_to(tmp_path: Path) -> None:
    def fits(used: Resources, *busy: Resources) -> bool:
        one = Executor(States(()), threading.Event(), 4, 8e9)
        (task, *_) = tasks(tmp_path)
        one._under_way = {number: Task(task.run, task.out, each) for number, each in enumerate(busy)}  # type: ignore[misc]
        return one._fits(used)

    assert fits(Resources(ranks=2), Resources(threads=2)) and not fits(Resources(ranks=2), Resources(threads=3))
    assert fits(Resources(memory=4e9), Resources(memory=4e9)) and not fits(Resources(memory=5e9), Resources(memory=4e9))
    assert fits(Resources(ranks=9, memory=1e12))  # one alone is started whatever it needs


def test_a_defect_stops_no_other_run_and_is_named(tmp_path: Path, script: dict[str, list[Exception | None]]) -> None:
    work = tasks(tmp_path)
    script[work[0].name] = [ZeroDivisionError("by nought")]
    made, found = execute(work, [])
    assert str(made.errors[work[0].name]) == f"{work[0].name} failed, ZeroDivisionError: by nought"
    assert [state.state for state in found.values()] == ["failed", *["finished"] * (len(work) - 1)]


def test_what_a_step_reads_may_be_missing_for_a_moment(tmp_path: Path) -> None:
    def gone() -> str:
        raise FileNotFoundError("reference.csv")

    bad = replace(step("bad", tmp_path, []), inputs=gone)
    write(bad.target, [])
    made, found = execute([], [bad, step("good", tmp_path, [])])
    assert found["bad"].state == "failed" and found["good"].state == "finished" and list(made.errors) == ["bad"]
