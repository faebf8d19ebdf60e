"""What is said of runs that go on: the time left, long tables, and states of jobs that were ended without a word."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import pytest
from dembark.common.files import lock
from dembark.validation.campaigns import folder
from dembark.validation.campaigns.status import look
from dembark.validation.campaigns.submit import ESTIMATES
from dembark.validation.runs.progress import FileBoard, State, headline, state_table, watched

CAMPAIGN = '[campaign]\nname = "boxes"\nprofile = "quick"\n'


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A campaign of four runs of two series, each estimated to take 100 s; the first one is finished and took 200 s."""
    entries = [{"case": "box", "variant": f"n={n}", "engine": "yade", "replica": k, "folder": f"box/n={n}/yade/replica-{k}",
                "inputs": f"{n}{k}", "state": "missing", "message": ""} for n in (1, 2) for k in (1, 2)]
    (tmp_path / folder.FILE).write_text(CAMPAIGN)
    (tmp_path / folder.FACTS).write_text(json.dumps({"name": "boxes"}))
    (tmp_path / "runs.json").write_text(json.dumps({"runs": entries}))
    (tmp_path / ESTIMATES).write_text(json.dumps({f"box/n={n}/yade": {"wall_time": 100.0} for n in (1, 2)}))
    done = tmp_path / entries[0]["folder"]
    done.mkdir(parents=True)
    (done / "run.json").write_text(json.dumps({"inputs": "11"}))
    (tmp_path / ".progress").mkdir()
    board = FileBoard(tmp_path / ".progress")
    board.post("box n=1 yade 1", state="finished", started=1000.0, ended=1200.0, step=99, steps=100)
    board.post("box n=1 yade 2", state="running", started=time.time() - 50.0, step=60, steps=100, resumed_from=10)
    return tmp_path


def test_time_left_is_what_the_finished_ones_took_over_their_estimate(results: Path) -> None:
    with lock(results / folder.LOCK, "held"):
        found = look(results)
    assert found.running and [state.state for state in found.states] == ["finished", "running", "waiting", "waiting"]
    # Half of its own steps in 50 s: 40 s more; then two runs of twice their estimate, one at a time.
    assert found.left == pytest.approx(40.0 + 2 * 200.0, abs=3.0)


def test_without_a_submitter_nothing_runs(results: Path) -> None:
    found = look(results)
    assert not found.running and [state.state for state in found.states] == ["finished", "waiting", "waiting", "waiting"]
    assert found.left is None and found.headline == "boxes: 1 of 4 done, 0 running, 3 waiting, 0 failed; nobody runs it now"


def test_a_result_of_other_inputs_does_not_count(results: Path) -> None:
    (results / "box/n=1/yade/replica-1/run.json").write_text(json.dumps({"inputs": "another"}))
    assert [state.state for state in look(results).states].count("waiting") == 4


def test_a_long_table_leaves_out_what_says_least() -> None:
    states = [*(State(f"done {k}", "finished", ended=1.0) for k in range(50)), *(State(f"waits {k}") for k in range(50)),
              State("runs", "running"), State("fails", "failed"), State("stops", "stopped")]
    table = state_table(states, 10)
    names = list(table.columns[0].cells)
    assert len(names) == 10 and {"runs", "fails", "stops"} <= set(names) and names[-1] == "... and 94 more"
    assert headline(states) == "50 of 103 done, 1 running, 51 waiting, 1 failed"
    assert len(list(state_table(states).columns[0].cells)) == 103


def test_what_a_job_told_is_read_again_when_it_changed(tmp_path: Path) -> None:
    states = watched(tmp_path, ["a b", "c"])
    assert [state.state for state in states()] == ["waiting", "waiting"]
    board = FileBoard(tmp_path)
    board.post("a b", state="running", started=1.0)
    assert [state.state for state in states()] == ["running", "waiting"]
    board.post("a b", state="finished")
    os.utime(tmp_path / "a-b.json", ns=(1, 1))
    assert [state.state for state in states()] == ["finished", "waiting"]
