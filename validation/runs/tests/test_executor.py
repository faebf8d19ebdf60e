"""The executor with backends and steps that stand in: order, limits, retries, what is done again, and that everything comes to an end."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import pytest
from harness import decks, stand_in  # noqa: F401

from dembark.common.errors import Interrupted, Killed, RunError
from dembark.common.files import write_json
from dembark.validation.judge.inputs import KEY, content, digest, stored
from dembark.validation.runs import schema
from dembark.validation.runs.executor import Executor, Local, Task
from dembark.validation.runs.plan import Resources, Run, of_profile
from dembark.validation.runs.simulate import Progress
from dembark.validation.runs.steps import Step
from dembark.validation.runs.table import Table

pytestmark = pytest.mark.usefixtures("decks", "stand_in")


@dataclass
class Scripted:
    """A backend whose runs end as `script` says, one exception (or None) an attempt; at most `at_once` at a time."""

    script: dict[str, list[Exception | None]] = field(default_factory=dict)
    at_once: int = 2
    here: bool = True
    started: list[str] = field(default_factory=list)
    busy: list[int] = field(default_factory=list)

    def fits(self, used: Resources, busy: Sequence[Resources]) -> bool:
        self.busy.append(len(busy))
        return len(busy) < self.at_once

    def start(self, run: Run, out: Path, used: Resources, progress: Progress) -> Future[object]:
        progress(state="running")
        self.started.append(run.name)
        future: Future[object] = Future()
        error = self.script[run.name].pop(0) if self.script.get(run.name) else None
        threading.Timer(0.05, (lambda: future.set_exception(error)) if error else (lambda: future.set_result(None))).start()
        return future

    def start_step(self, step: Step) -> Future[object] | None:
        return None

    def close(self) -> None:
        pass


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
    return Step(name, "measure", Path(), tuple(needs), target, partial(of, sources), call or write, arguments or (target, sources))


def executor(folder: Path, backend: object, work: Sequence[Task], steps: Sequence[Step], retries: int = 2,
             cancel: threading.Event | None = None, table: Table | None = None) -> tuple[Executor, Table]:
    found = table or Table(folder)
    found.enter({f"{task.name}": task.run for task in work}, folder, {one.name: one.kind for one in steps})
    made = Executor(found, backend, cancel or threading.Event(), retries, cores=2)  # type: ignore[arg-type]
    made.execute(work, steps)
    return made, found


def test_what_was_killed_is_started_again_and_what_failed_is_not(tmp_path: Path) -> None:
    work = tasks(tmp_path)
    one, two, three = (task.name for task in work)
    backend = Scripted({one: [Killed("power"), None], two: [RunError(f"{two} failed, it blew up")], three: [Killed("x")] * 3})
    measure = step("m", tmp_path, [one, two, three])
    made, table = executor(tmp_path, backend, work, [measure])
    assert {name: backend.started.count(name) for name in (one, two, three)} == {one: 2, two: 1, three: 3}
    assert backend.started[:2] == [one, two]
    states = {state.name: (state.state, state.message) for state in table.states()}
    assert states == {one: ("finished", ""), two: ("failed", "it blew up"), three: ("failed", "x"), "m": ("finished", "")}
    assert list(made.errors) == [two, three] and stored(tmp_path / "m.json")
    assert max(backend.busy) <= 2


def test_steps_are_made_again_when_what_they_read_has_changed(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_text("1")
    first, second = step("a", tmp_path, [], sources=[source]), step("b", tmp_path, ["a"], sources=[tmp_path / "a.json"])

    def made() -> set[str]:
        before = {name: (tmp_path / f"{name}.json").stat().st_mtime_ns for name in "ab" if (tmp_path / f"{name}.json").exists()}
        executor(tmp_path, Scripted(), [], [first, second])
        return {name for name in "ab" if (tmp_path / f"{name}.json").stat().st_mtime_ns != before.get(name)}

    assert made() == {"a", "b"} and made() == set()
    (tmp_path / "b.json").unlink()
    assert made() == {"b"}
    source.write_text("2")
    assert made() == {"a", "b"}
    (tmp_path / schema.FILE).unlink()  # the files hold the hashes of their inputs, not the store
    assert made() == set()
    (tmp_path / "a.json").write_text(json.dumps({KEY: "other"}))
    assert made() == {"a"}  # which was made as before, so that nothing follows from it


def test_a_step_that_fails_stops_only_what_is_inputs_hash_it(tmp_path: Path) -> None:
    once = tmp_path / "once"
    steps = [step("bad", tmp_path, [], fail, "no number"), step("killed", tmp_path, ["bad"], die, once), step("good", tmp_path, ["killed"])]
    made, table = executor(tmp_path, Scripted(), [], steps)
    assert {state.name: state.state for state in table.states()} == {"bad": "failed", "killed": "finished", "good": "finished"}
    assert [str(error) for error in made.errors.values()] == ["no number"]


def test_an_interruption_ends_runs_and_steps_at_once(tmp_path: Path) -> None:
    cancel, table = threading.Event(), Table(tmp_path)
    threading.Timer(3.0, cancel.set).start()
    began = time.monotonic()
    with pytest.raises(Interrupted):
        executor(tmp_path, Local(2, None, cancel), [], [step("long", tmp_path, [], time.sleep, 600)], cancel=cancel, table=table)
    assert time.monotonic() - began < 60 and table.state("long").state == "stopped"


def test_cores_and_memory_of_this_machine_are_kept_to() -> None:
    local = Local(4, 8e9, threading.Event())
    assert local.fits(Resources(ranks=2), [Resources(threads=2)]) and not local.fits(Resources(ranks=2), [Resources(threads=3)])
    assert local.fits(Resources(memory=4e9), [Resources(memory=4e9)]) and not local.fits(Resources(memory=5e9), [Resources(memory=4e9)])
    assert local.fits(Resources(ranks=9, memory=1e12), [])  # one alone is let in, whatever it wants
    local.close()


def test_a_defect_is_not_hidden(tmp_path: Path) -> None:
    work = tasks(tmp_path)[:1]
    with pytest.raises(ZeroDivisionError):
        executor(tmp_path, Scripted({work[0].name: [ZeroDivisionError()]}), work, [])
