"""A run that is stopped, killed or interrupted goes on from its last whole state; one that failed, or has other inputs, begins anew."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from dembark.common.errors import DembarkError, Interrupted, Killed, RunError
from dembark.common.files import read_json
from dembark.validation import cases, claim, engines, restarts, simulate
from dembark.validation.cases import find
from dembark.validation.plan import Run, series
from dembark.validation.progress import Board
from dembark.validation.simulate import Resources

# The stand-in has ten grains and a hundred steps; this is a state every twenty of them.
OFTEN = Resources(restart_interval=2e-4)

pytestmark = pytest.mark.usefixtures("decks", "stand_in")


def plan(engine: str = "liggghts", **changes: object) -> Run:
    engines.find.cache_clear()
    cases.load.cache_clear()
    return series(find("box"), "dry", "quick", engines.find(engine), changes).runs[0]


def run(below: Path, engine: str = "liggghts", used: Resources = OFTEN, **changes: object) -> dict[str, object]:
    if engine == "yade":
        used = Resources(restart_interval=10 * used.restart_interval)
    folder = simulate.simulate(plan(engine, **changes), below / "out", Board(), threading.Event(), used)
    record = read_json(folder / "run.json")
    assert record
    return record


def works(below: Path) -> list[Path]:
    return list((below / "out").glob(".replica-1.work-*"))


def work(below: Path) -> Path:
    (found,) = works(below)
    return found


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_killed_run_goes_on_from_its_newest_state(tmp_path: Path, engine: str) -> None:
    with pytest.raises(Killed, match="killed by SIGKILL at step 50 of 100.*it goes on from step 40 when it is started again"):
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
    with pytest.raises(RunError, match="disk is full.*goes on from step 40"):
        run(tmp_path, behaviour="full")
    assert run(tmp_path, behaviour="full")["resumed_at"] == [40]


def test_deck_that_knows_no_states_is_asked_for_none(tmp_path: Path, decks: Path) -> None:
    (decks / "box" / "liggghts.in").write_text("# deck\n")
    with pytest.raises(Killed, match="it begins anew"):
        run(tmp_path, behaviour="kill")
    assert not works(tmp_path)


def test_interruption_says_where_the_run_goes_on(tmp_path: Path, engine_pid: Callable[[Path], int],
                                                 wait_for: Callable[..., object]) -> None:
    cancel, caught = threading.Event(), []

    def work_on() -> None:
        try:
            simulate.simulate(plan(behaviour="hang"), tmp_path / "out", Board(), cancel, OFTEN)
        except Interrupted as error:
            caught.append(str(error))

    thread = threading.Thread(target=work_on)
    thread.start()
    engine_pid(tmp_path)
    wait_for(lambda: (work(tmp_path) / "state.40.restart.crc").exists())
    cancel.set()
    thread.join(20)
    assert caught == ["box dry liggghts 1 was interrupted, it goes on from step 40 when it is started again"]
    assert run(tmp_path, behaviour="hang")["resumed_at"] == [40]


def test_killed_harness_leaves_what_the_next_attempt_needs(tmp_path: Path, engine_pid: Callable[[Path], int], lives: Callable[[int], bool],
                                                           wait_for: Callable[..., object]) -> None:
    text = ("import sys, threading; from pathlib import Path; from dembark.validation import simulate, engines; "
            "from dembark.validation.cases import find; from dembark.validation.plan import series; "
            "from dembark.validation.progress import Board; "
            "one = series(find('box'), 'dry', 'quick', engines.find('liggghts'), {'behaviour': 'hang'}).runs[0]; "
            "used = simulate.Resources(restart_interval=2e-4); "
            f"simulate.simulate(one, Path({str(tmp_path / 'out')!r}), Board(), threading.Event(), used)")
    process = subprocess.Popen([sys.executable, "-c", text])
    pid = engine_pid(tmp_path)
    wait_for(lambda: (work(tmp_path) / "state.40.restart.crc").exists())
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


# --- the lock ----------------------------------------------------------------------------------------------------------

def elsewhere(path: Path, key: str) -> None:
    """A lock as a process of another host writes it."""
    path.write_text(json.dumps({"key": key, "host": "another-host", "pid": 1, "beat": time.time()}) + "\n")


@pytest.fixture
def beating(tmp_path: Path) -> Iterator[Path]:
    """A lock that a process of another host keeps alive."""
    path, end = tmp_path / "lock", threading.Event()

    def beat() -> None:
        while not end.wait(0.05):
            elsewhere(path, "theirs")

    elsewhere(path, "theirs")
    thread = threading.Thread(target=beat)
    thread.start()
    yield path
    end.set()
    thread.join()


def test_lock_of_a_live_process_of_another_host_is_respected(beating: Path) -> None:
    with pytest.raises(DembarkError, match="taken"), claim.claim(beating, "taken", threading.Event(), beat=0.1, dead_after=5.0):
        pass


def test_lock_of_a_dead_process_of_another_host_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    elsewhere(path, "theirs")
    with claim.claim(path, "taken", threading.Event(), beat=0.1, dead_after=0.3) as lost:
        content = read_json(path)
        assert content and content["key"] != "theirs" and not lost.is_set()
    assert path.read_text() == ""


def test_holder_learns_that_its_lock_was_taken(tmp_path: Path, wait_for: Callable[..., object]) -> None:
    path = tmp_path / "lock"
    with claim.claim(path, "taken", threading.Event(), beat=0.05) as lost:
        wait_for(lambda: elsewhere(path, "theirs") or lost.is_set())
    assert json.loads(path.read_text())["key"] == "theirs"


def test_waiting_for_a_lock_can_be_interrupted(tmp_path: Path) -> None:
    cancel = threading.Event()
    cancel.set()
    elsewhere(tmp_path / "lock", "theirs")
    with pytest.raises(Interrupted), claim.claim(tmp_path / "lock", "taken", cancel):
        pass


def test_lock_where_the_file_system_has_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claim, "_flock", lambda handle: None)
    never = threading.Event()
    with claim.claim(tmp_path / "lock", "taken", never, beat=0.1):
        with pytest.raises(DembarkError, match="taken"), claim.claim(tmp_path / "lock", "taken", never, beat=0.1):
            pass
    with claim.claim(tmp_path / "lock", "taken", never, beat=0.1):
        pass
