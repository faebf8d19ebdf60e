"""A run that is stopped, killed or interrupted continues from its last complete state; one that failed starts from its beginning."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from harness import decks, engine_pid, lives, stand_in, wait_for  # noqa: F401

from dembark.common.errors import DembarkError, Interrupted, Killed, RunError
from dembark.common.files import read_json
from dembark.validation import engines
from dembark.validation.campaigns.plan import Resources, Run, series
from dembark.validation.case import folders
from dembark.validation.case.folders import find, load
from dembark.validation.runs import restarts, simulate

# The stand-in has ten grains and a hundred steps; this is a state every twenty of them.
OFTEN = Resources(restart_interval=2e-4)

pytestmark = pytest.mark.usefixtures("decks", "stand_in")


def plan(engine: str = "liggghts", **changes: object) -> Run:
    engines.find.cache_clear()
    folders.load.cache_clear()
    return series(find("box"), "dry", "quick", engines.find(engine), changes).runs[0]


def run(below: Path, engine: str = "liggghts", used: Resources = OFTEN, **changes: object) -> dict[str, object]:
    if engine == "yade":
        used = Resources(restart_interval=10 * used.restart_interval)
    simulate.simulate(plan(engine, **changes), below / "out", threading.Event(), used)
    record = read_json(below / "out/replica-1/run.json")
    assert record
    return record


def works(below: Path) -> list[Path]:
    return list((below / "out").glob(".replica-1.work-*"))


def work(below: Path) -> Path:
    (found,) = works(below)
    return found


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_killed_run_goes_on_from_its_newest_state(tmp_path: Path, engine: str) -> None:
    with pytest.raises(Killed, match=r"killed by SIGKILL at step 50 of 100.*it continues from step 40 when it is started again"):
        run(tmp_path, engine, behaviour="kill")
    record = run(tmp_path, engine, behaviour="kill")
    assert (record["attempts"], record["resumed_at"], record["resume"], record["restart_every"]) == (2, [40], "exact", 20)
    assert sorted(path.name for path in (tmp_path / "out").iterdir() if "lock" not in path.name) == ["replica-1"]
    left = {path.name for path in (tmp_path / "out" / "replica-1").iterdir()}
    assert "run.json" in left and not [name for name in left if name.startswith(("state", "attempts"))]


def test_record_says_when_a_resumption_was_approximate_or_never_was(tmp_path: Path) -> None:
    with pytest.raises(Killed):
        run(tmp_path, behaviour="kill approximate")
    assert run(tmp_path, behaviour="kill approximate")["resume"] == "approximate"
    record = run(tmp_path)
    assert (record["attempts"], record["resumed_at"], record["resume"]) == (1, [], None)


@pytest.mark.parametrize("damage", ["cut", "changed", "unmarked"])
def test_state_that_is_not_whole_is_passed_over(tmp_path: Path, damage: str) -> None:
    with pytest.raises(Killed):
        run(tmp_path, behaviour="kill")
    state = work(tmp_path) / "state.40.restart"
    content = state.read_bytes()
    if damage == "unmarked":
        state.with_name(state.name + ".crc").unlink()
    else:
        state.write_bytes(content[:-1] if damage == "cut" else b"x" + content[1:])
    assert restarts.newest(work(tmp_path), "liggghts") == 20
    state.unlink()
    assert run(tmp_path, behaviour="kill")["resumed_at"] == [20]


def test_changed_inputs_begin_anew(tmp_path: Path) -> None:
    with pytest.raises(Killed):
        run(tmp_path, behaviour="kill")
    assert run(tmp_path, behaviour="ok", grain_diameter=0.006)["resumed_at"] == []
    assert not works(tmp_path)


def test_failure_of_the_run_itself_begins_anew(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="exit code 1") as caught:
        run(tmp_path, behaviour="exit")
    assert "goes on" not in str(caught.value)
    assert not works(tmp_path)


def test_full_disk_costs_no_state(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"disk is full.*continues from step 40"):
        run(tmp_path, behaviour="full")
    assert run(tmp_path, behaviour="full")["resumed_at"] == [40]


@pytest.mark.parametrize(("case", "deck", "states"), [
    ("silo", None, True), ("dam_break_cubes", None, True), ("dam_break", None, True), ("water_tank", None, True),
    ("silo", '{% include "deck.in" %}', False), ("silo", '{% include "resume.in" %}\nrun ${steps}', False)])
def test_states_are_written_where_the_deck_or_what_it_includes_has_the_fix(tmp_path: Path, case: str, deck: str | None,
                                                                          states: bool) -> None:
    found = load(folders.package_root() / case / "case.toml")
    if deck:
        (tmp_path / "liggghts.in").write_text(deck)
        (tmp_path / "deck.in").write_text("variable restart_every index 0\nrun ${steps}\n")
        found = replace(found, folder=tmp_path)
    run = replace(plan(), case=found)
    assert restarts.writes_restarts(run) is states


def test_deck_that_knows_no_states_is_asked_for_none(tmp_path: Path, decks: Path) -> None:
    (decks / "box" / "liggghts.in").write_text("# deck\n")
    with pytest.raises(Killed, match="it starts again from its beginning"):
        run(tmp_path, behaviour="kill")
    assert not works(tmp_path)


def test_interruption_says_where_the_run_goes_on(tmp_path: Path, engine_pid: Callable[[Path], int],
                                                 wait_for: Callable[..., object]) -> None:
    cancel, caught = threading.Event(), []

    def work_on() -> None:
        try:
            simulate.simulate(plan(behaviour="hang"), tmp_path / "out", cancel, OFTEN)
        except Interrupted as error:
            caught.append(str(error))

    thread = threading.Thread(target=work_on)
    thread.start()
    engine_pid(tmp_path)
    wait_for((work(tmp_path) / "state.40.restart.crc").exists)
    cancel.set()
    thread.join(20)
    assert caught == ["box dry liggghts 1 was interrupted, it continues from step 40 when it is started again"]
    assert run(tmp_path, behaviour="hang")["resumed_at"] == [40]


def test_killed_harness_leaves_what_the_next_attempt_needs(tmp_path: Path, engine_pid: Callable[[Path], int], lives: Callable[[int], bool],
                                                           wait_for: Callable[..., object]) -> None:
    text = ("import sys, threading; from pathlib import Path; from dembark.validation import engines; "
            "from dembark.validation.runs import simulate; "
            "from dembark.validation.case.folders import find; from dembark.validation.campaigns.plan import series; "
            "one = series(find('box'), 'dry', 'quick', engines.find('liggghts'), {'behaviour': 'hang'}).runs[0]; "
            "used = simulate.Resources(restart_interval=2e-4); "
            f"simulate.simulate(one, Path({str(tmp_path / 'out')!r}), threading.Event(), used)")
    process = subprocess.Popen([sys.executable, "-c", text])
    pid = engine_pid(tmp_path)
    wait_for((work(tmp_path) / "state.40.restart.crc").exists)
    with pytest.raises(DembarkError, match="by another process"):
        run(tmp_path, behaviour="hang")
    process.kill()
    process.wait()
    wait_for(lambda: not lives(pid))
    record = run(tmp_path, behaviour="hang")
    assert (record["attempts"], record["resumed_at"]) == (2, [40])


def test_what_an_attempt_said_is_heard_although_its_harness_was_killed(tmp_path: Path) -> None:
    with pytest.raises(Killed):
        run(tmp_path, behaviour="kill")
    told = restarts.attempts(work(tmp_path))
    (work(tmp_path) / "engine.log").write_text("dembark: steps 100 time_step 1e-5\ndembark: resumed at step 20 approximately: x\n 30 1 1\n")
    restarts.remember(work(tmp_path), restarts.Attempts(told.attempts + 1, told.resumed_at, told.resume, told.wall_time, False))
    record = run(tmp_path, behaviour="kill")
    assert (record["attempts"], record["resumed_at"], record["resume"]) == (3, [20, 40], "approximate")


def test_interval_in_steps_is_the_same_everywhere() -> None:
    assert restarts.steps_between(plan(), 600.0, 1) == 60_000_000
    assert restarts.steps_between(plan(), 600.0, 4) == 240_000_000
    assert restarts.steps_between(plan("yade"), 600.0, 1) == 6_000_000
    assert restarts.steps_between(plan(grain_count=10**9), 1.0, 1) == 1
    assert restarts.steps_between(plan(), 0.0, 1) == 0


def test_what_is_remembered_of_attempts_may_be_damaged(tmp_path: Path) -> None:
    restarts.remember(tmp_path, restarts.Attempts(3, (5, 7), "exact", 1.5, False))
    assert restarts.attempts(tmp_path) == restarts.Attempts(3, (5, 7), "exact", 1.5, False)
    for text in ("", "[]", "{}", '{"attempts": 1}', '{"resumed_at": 1, "x": 2}'):
        (tmp_path / "attempts.json").write_text(text)
        assert restarts.attempts(tmp_path) == restarts.Attempts()
