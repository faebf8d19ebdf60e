"""What is said of runs that go on: the time left, and states of runs that were ended without a word."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

from dembark.common.lock import lock
from dembark.validation.campaigns import folder
from dembark.validation.campaigns.folder import look
from dembark.validation.cli import main
from dembark.validation.judge.result import QuantityRecord, Result, write
from dembark.validation.runs import schema
from dembark.validation.runs.perform import LOCK
from dembark.validation.runs.steps import CAMPAIGN_FILE

CAMPAIGN = '[campaign]\nname = "boxes"\nprofile = "quick"\n'


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A campaign of four runs of two series, each estimated to take 100 s; the first one is finished and took 200 s."""
    (tmp_path / CAMPAIGN_FILE).write_text(CAMPAIGN)
    (tmp_path / folder.FACTS).write_text(json.dumps({"name": "boxes"}))
    rows = [{"run_id": f"{n}{k}", "campaign": "boxes", "case_name": "box", "variant": f"n={n}", "engine": "yade", "replica": k,
             "folder": f"box/n={n}/yade/replica-{k}", "state": "waiting", "estimated_time": 100.0} for n in (1, 2) for k in (1, 2)]
    rows[0] |= {"state": "finished", "began": 1000.0, "ended": 1200.0, "step": 100, "steps": 100}
    rows[1] |= {"state": "running", "began": time.time() - 50.0, "step": 60, "steps": 100, "resumed_from_step": 10, "attempts": 2}
    old = {**rows[0], "run_id": "old", "state": "superseded"}
    with schema.writing(tmp_path / schema.FILE) as connection:
        schema.put(connection, "runs", [*rows, old])
    done = tmp_path / str(rows[0]["folder"])
    done.mkdir(parents=True)
    (done / "run.json").write_text(json.dumps({"inputs": "11"}))
    return tmp_path


def test_time_left_is_what_the_finished_ones_took_over_their_estimate(results: Path) -> None:
    with lock(results / LOCK, "held"):
        found = look(results)
    assert found.running and [state.state for state in found.states] == ["finished", "running", "waiting", "waiting"]
    # Half of its own steps in 50 s: 40 s more; then two runs of twice their estimate, one at a time.
    assert found.left == pytest.approx(40.0 + 2 * 200.0, abs=3.0)


def test_without_a_submitter_nothing_runs(results: Path) -> None:
    found = look(results)
    assert not found.running and [state.state for state in found.states] == ["finished", "waiting", "waiting", "waiting"]
    assert found.left is None and found.headline == "boxes: 1 of 4 done, 0 running, 3 waiting, 0 failed; nobody runs it now"


def test_status_counts_checks_by_kind_of_evidence(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    checks = (QuantityRecord("a", 1.0, "pass", tolerance=0.1, evidence="identity", control="friction off"),
              QuantityRecord("b", 1.0, "fail", tolerance=0.1, evidence="experiment"))
    write(results / "box/n=1/yade/metrics.json", Result("box", "n=1", "yade", checks))
    assert main(["status", str(results)]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[told.index("1 series measured; 1 of 2 checks passed, 1 FAILED") + 1 :][:2] == [
        "  experiment (measured values): 0 of 1 check passed, 1 FAILED",
        "  identity (conservation laws, the scheme against itself): 1 of 1 check passed, none failed"]


def test_a_result_of_other_inputs_does_not_count(results: Path) -> None:
    (results / "box/n=1/yade/replica-1/run.json").write_text(json.dumps({"inputs": "another"}))
    assert [state.state for state in look(results).states].count("waiting") == 4
