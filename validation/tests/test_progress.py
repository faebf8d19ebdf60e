"""What is read from an engine's output, and what is told about it."""

from __future__ import annotations

import io
import time
from pathlib import Path

from dembark.validation.progress import Board, FileBoard, Monitor, OutputParser, State, describe, duration, watched
from rich.console import Console


def test_steps_are_read_and_other_numbers_are_not() -> None:
    parser = OutputParser()
    assert not parser.feed("      10  0.1 0.5")  # not announced yet
    assert parser.feed("dembark: steps 2000 time_step 1.5e-06")
    assert (parser.steps, parser.time_step) == (2000, 1.5e-6)
    for line in ("  1 by 1 by 1 MPI processor grid", "500 atoms in group grains", "Step KinEng", "", "  3000 1 2", "nan"):
        assert not parser.feed(line)
    assert parser.feed("     500    0.00075  1.2e-3")
    assert parser.feed("1000 nan")
    assert not parser.feed("     500    0.00075  1.2e-3")
    assert parser.step == 1000 and not parser.finished
    assert parser.feed("dembark: finished") and parser.finished


def test_remaining_time_follows_the_rate() -> None:
    state = State("a", "running", step=25, steps=100, time_step=1e-3, started=time.time() - 10)
    assert 29 < state.left < 31
    assert "25 %" in describe(state) and "0.025/0.1 s" in describe(state) and "30 s left" in describe(state)
    assert State("a", "running").left is None
    assert [duration(s) for s in (5, 200, 7500)] == ["5 s", "3 min 20 s", "2 h 5 min"]


def test_plain_lines_tell_start_progress_and_end() -> None:
    board, text = Board(["one", "two"]), io.StringIO()
    with Monitor(board.states, Console(file=text, width=200), interval=0.1):
        board.post("one", state="running", started=time.time(), steps=100, time_step=0.1)
        time.sleep(0.3)
        board.post("one", step=50)
        time.sleep(0.3)
        board.post("one", state="finished", ended=time.time())
        board.post("two", state="failed", message="no luck [here]")
    lines = text.getvalue().splitlines()
    assert lines[0] == "dembark: one: started"
    assert any("step 50/100 (50 %), 5/10 s simulated" in line for line in lines)
    assert "dembark: one: finished in 1 s" in lines or "dembark: one: finished in 0 s" in lines
    assert lines[-1].startswith("dembark: two: FAILED") and lines[-1].endswith("no luck [here]")


def test_a_terminal_gets_a_table() -> None:
    text = io.StringIO()
    board = Board(["one", "two"])
    with Monitor(board.states, Console(file=text, width=120, force_terminal=True)):
        board.post("one", state="running", step=50, steps=100, time_step=0.1, started=time.time() - 5)
        time.sleep(0.8)
    assert "50 % of 100" in text.getvalue() and "1 running, 1 waiting" in text.getvalue()


def test_states_pass_from_jobs_to_the_watcher(tmp_path: Path) -> None:
    FileBoard(tmp_path).post("silo dry yade 1", state="running", step=3)
    one, two = watched(tmp_path, ["silo dry yade 1", "silo dry yade 2"])()
    assert (one.state, one.step, two.state) == ("running", 3, "waiting")
    FileBoard(tmp_path / "missing").post("a", state="running")
