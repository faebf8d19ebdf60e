"""What is read from an engine's output, and the lines about it."""

from __future__ import annotations

import io
import time
from pathlib import Path

from rich.console import Console

from dembark.common.units import duration
from dembark.validation.results import State
from dembark.validation.runs.executor import States
from dembark.validation.runs.monitor import Monitor, describe, headline, state_table
from dembark.validation.runs.outcome import OutputParser
from dembark.validation.runs.steps import Step


def test_steps_are_read_and_other_numbers_are_not() -> None:
    parser = OutputParser()
    assert not parser.read("      10  0.1 0.5")  # not announced yet
    assert parser.read("dembark: steps 2000 time_step 1.5e-06")
    assert (parser.steps, parser.time_step) == (2000, 1.5e-6)
    for line in ("  1 by 1 by 1 MPI processor grid", "500 atoms in group grains", "Step KinEng", "", "  3000 1 2", "nan"):
        assert not parser.read(line)
    assert parser.read("     500    0.00075  1.2e-3")
    assert parser.read("1000 nan")
    assert not parser.read("     500    0.00075  1.2e-3")
    assert parser.step == 1000 and not parser.finished
    assert not parser.feed(b"dembark: fin") and parser.feed(b"ished\n") and parser.finished


def test_remaining_time_follows_the_rate() -> None:
    state = State("a", "running", step=25, steps=100, time_step=1e-3, began=time.time() - 10)
    assert state.left is not None and 29 < state.left < 31
    assert "25 %" in describe(state) and "0.025/0.1 s" in describe(state) and "30 s left" in describe(state)
    assert State("a", "running").left is None
    assert [duration(s) for s in (5, 200, 7500)] == ["5 s", "3 min 20 s", "2 h 5 min"]


def table(*names: str) -> States:
    """Waiting steps."""
    return States((), [Step(name, "measure", (), Path(), str, print, ()) for name in names])


def test_plain_lines_tell_start_progress_and_end(tmp_path: Path) -> None:
    runs, text = table("one", "two"), io.StringIO()
    with Monitor(runs.all, Console(file=text, width=200), interval=0.1, log=tmp_path / "log") as monitor:
        runs.listener = monitor.event
        runs.change("one", state="running", steps=100, time_step=0.1)
        runs.change("one", step=50)
        time.sleep(0.3)
        runs.change("one", state="finished")
        runs.change("two", state="failed", message="no luck [here]")
    lines = text.getvalue().splitlines()
    assert lines[0] == "dembark: one: started"
    assert any("step 50/100 (50 %), 5/10 s simulated" in line for line in lines)
    assert "dembark: one: finished in 1 s" in lines or "dembark: one: finished in 0 s" in lines
    assert lines[-1].startswith("dembark: two: FAILED") and lines[-1].endswith("no luck [here]")
    logged = (tmp_path / "log").read_text()
    assert "one: started" in logged and "no luck [here]" in logged and "step 50" not in logged


def test_a_terminal_gets_a_table() -> None:
    text, runs = io.StringIO(), table("one", "two")
    with Monitor(runs.all, Console(file=text, width=120, force_terminal=True)):
        runs.change("one", state="running", step=50, steps=100, time_step=0.1)
        time.sleep(0.8)
    assert "50 % of 100" in text.getvalue() and "1 running, 1 waiting" in text.getvalue()


def test_a_long_table_leaves_out_what_says_least() -> None:
    states = [*(State(f"done {k}", "finished", ended=1.0) for k in range(50)), *(State(f"waits {k}") for k in range(50)),
              State("runs", "running"), State("fails", "failed"), State("stops", "stopped")]
    found = state_table(states, 10)
    names = list(found.columns[0].cells)
    assert len(names) == 10 and {"runs", "fails", "stops"} <= set(names) and names[-1] == "... and 94 more"
    assert headline(states) == "50 of 103 done, 1 running, 51 waiting, 1 failed"
    assert len(list(state_table(states).columns[0].cells)) == 103
