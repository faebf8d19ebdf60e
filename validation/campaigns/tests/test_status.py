"""The state of runs, from files alone: plan.json, run.json, status files and locks."""

from __future__ import annotations

import json
import os
import shlex
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest

from dembark.common.lock import lock
from dembark.validation import results as tables
from dembark.validation.cli import main
from dembark.validation.judge.result import QuantityRecord, Result, write
from dembark.validation.results import State, lock_file, status_file
from dembark.validation.runs.folder import look
from dembark.validation.runs.steps import CAMPAIGN_FILE
from dembark.validation.runs.workflow import LOCK


def status(results: Path, number: int, **facts: Any) -> None:
    """Write a status file, as that of the run with this number."""
    place = results / f"box/n={number // 10}/yade/replica-{number % 10}"
    place.parent.mkdir(parents=True, exist_ok=True)
    status_file(place).write_text(json.dumps(State("x", inputs=str(number), **facts).as_json()))


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A campaign of four runs of two series, each estimated to take 100 s; the first one is finished and took 200 s, the second one has
    begun."""
    (tmp_path / CAMPAIGN_FILE).write_text('[campaign]\nname = "boxes"\nprofile = "quick"\n')
    runs = [{"folder": f"box/n={n}/yade/replica-{k}", "inputs": f"{n}{k}", "estimate": 100.0} for n in (1, 2) for k in (1, 2)]
    (tmp_path / "plan.json").write_text(json.dumps({"campaign": "boxes", "runs": runs}))
    done = tmp_path / "box/n=1/yade/replica-1"
    done.mkdir(parents=True)
    facts = {"wall_time": 200.0, "host": "n1", "ranks": 1, "threads": 1, "particle_steps_per_second": 50.0}
    (done / "run.json").write_text(json.dumps({"inputs": "11", "steps": 100, "attempts": 2, "resumed_at": [40], "provenance": facts,
                                               "case": "box", "parameters": {"n": 1}}))
    status(tmp_path, 12, state="running", began=time.time() - 50.0, step=60, steps=100, resumed_from=10, attempt=2)
    return tmp_path


def test_a_run_whose_lock_is_held_is_running_and_the_time_left_follows_the_finished_ones(results: Path) -> None:
    record = json.loads((results / "box/n=1/yade/replica-1/run.json").read_text())
    (results / "box/n=1/yade/replica-1/run.json").write_text(json.dumps(record | {"resumed_at": []}))
    with lock(lock_file(results / "box/n=1/yade/replica-2"), "held"):
        found = look(results)
    assert found.running and [state.state for state in found.states] == ["finished", "running", "waiting", "waiting"]
    assert (found.states[1].step, found.states[1].attempt, found.states[0].attempt) == (60, 2, 2)
    # Half of its own steps in 50 s: 40 s more; then two runs of twice their estimate, one at a time.
    assert found.left == pytest.approx(40.0 + 2 * 200.0, abs=3.0)


def test_without_a_lock_nothing_runs_and_reasons_are_kept(results: Path) -> None:
    status(results, 21, state="failed", message="it blew up")
    status(results, 22, state="stopped", message="killed")
    found = look(results)
    assert not found.running and [state.state for state in found.states] == ["finished", "stopped", "failed", "stopped"]
    assert found.left is None and found.headline == "boxes: 1 of 4 done, 0 running, 2 waiting, 1 failed; no process runs it now"
    assert [state.message for state in found.states] == ["", "its process was ended", "it blew up", "killed"]
    with lock(results / LOCK, "held"):
        assert look(results).running


def test_files_of_other_inputs_do_not_count(results: Path) -> None:
    (results / "box/n=1/yade/replica-1/run.json").write_text(json.dumps({"inputs": "another"}))
    for number in (11, 12, 21, 22):
        place = results / f"box/n={number // 10}/yade/replica-{number % 10}"
        place.parent.mkdir(parents=True, exist_ok=True)
        status_file(place).write_text(json.dumps({"inputs": "old", "state": "failed", "message": "x"}))
    assert [(state.state, state.message) for state in look(results).states] == [("waiting", "")] * 4
    status_file(results / "box/n=1/yade/replica-1").write_text("{")
    assert look(results).states[0].state == "waiting"


CHECKS = (QuantityRecord("a", 1.0, "pass", interval=(0.5, 1.5), tolerance=0.1, evidence="identity", control="friction off"),
          QuantityRecord("b", None, "fail", tolerance=0.1, evidence="experiment"))


def test_status_counts_checks_by_kind_of_evidence(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(results / "box/n=1/yade/metrics.json", Result("box", "n=1", "yade", CHECKS))
    assert main(["status", str(results)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[lines.index("1 series measured; 1 of 2 checks passed, 1 FAILED") + 1 :][:2] == [
        "  experiment (measurements, formulas fitted to them): 0 of 1 check passed, 1 FAILED",
        "  identity (conservation laws, the scheme against itself): 1 of 1 check passed, none failed"]


def test_status_says_that_measurements_or_the_report_are_missing(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number in (12, 21, 22):
        place = results / f"box/n={number // 10}/yade/replica-{number % 10}"
        place.mkdir(parents=True)
        (place / "run.json").write_text(json.dumps({"inputs": str(number), "steps": 100, "case": "box"}))
    hint = f"measurements or the report are missing: go on with 'dembark resume {results}'"
    for n in (1, 2):
        assert main(["status", str(results)]) == 0 and hint in capsys.readouterr().out
        write(results / f"box/n={n}/yade/metrics.json", Result("box", f"n={n}", "yade", CHECKS))
    assert look(results).complete and main(["status", str(results)]) == 0 and hint in capsys.readouterr().out
    (results / "report.html").touch()
    assert main(["status", str(results)]) == 0 and "resume" not in capsys.readouterr().out


def test_jobs_that_wait_in_a_queue_need_no_second_submission(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = json.loads((results / "plan.json").read_text())
    for executor in ("local", "slurm"):
        (results / "plan.json").write_text(json.dumps(plan | {"submitted": {"options": {"executor": executor}}}))
        assert main(["status", str(results)]) == 0
        assert ("unless its jobs wait in the queue of the cluster, go on with" in capsys.readouterr().out) == (executor == "slurm")


def test_the_command_of_a_hint_can_be_pasted(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    moved = tmp_path / "with a space"
    moved.mkdir()
    for name in (CAMPAIGN_FILE, "plan.json"):
        (results / name).rename(moved / name)
    assert main(["status", str(moved)]) == 0
    hint = capsys.readouterr().out.partition("go on with ")[2].strip()
    assert shlex.split(hint[1:-1]) == ["dembark", "resume", str(moved)]


def test_a_clock_that_is_ahead_leaves_no_negative_time(results: Path) -> None:
    status(results, 12, state="running", began=time.time() + 500.0, step=60, steps=100, resumed_from=10)
    with lock(lock_file(results / "box/n=1/yade/replica-2"), "held"):
        assert look(results).states[1].left == 0.0


def test_a_result_that_was_cut_off_is_not_left_out_of_a_table(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for n in (1, 2):
        (results / f"box/n={n}/yade").mkdir(parents=True, exist_ok=True)
        write(results / f"box/n={n}/yade/metrics.json", Result("box", f"n={n}", "yade", CHECKS))
    path = results / "box/n=2/yade/metrics.json"
    path.write_text(path.read_text()[:100])
    assert main(["export", str(results)]) == 1
    assert f"{path} cannot be read, it holds no JSON, measure it again" in capsys.readouterr().err


def test_a_folder_below_superseded_is_read_and_one_below_it_is_not(results: Path, tmp_path: Path) -> None:
    for place in ("superseded/own/replica-1", "superseded/own/superseded/replica-2", "superseded/own/.old/yade/replica-3"):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "run.json").write_text(json.dumps({"inputs": "1", "case": "box"}))
    assert list(tables.runs(tmp_path / "superseded/own")["folder"]) == ["replica-1"]


def test_tables_hold_every_run_and_quantity(results: Path) -> None:
    write(results / "box/n=1/yade/metrics.json", Result("box", "n=1", "yade", CHECKS, parameters={"n": 1, "name": "x"}))
    runs, quantities = tables.runs(results), tables.quantities(str(results))
    assert list(runs["state"]) == ["finished", "stopped", "waiting", "waiting"] and list(runs["replica"]) == [1, 2, 1, 2]
    assert runs["provenance.wall_time"][0] == 200.0 and runs["parameters.n"][0] == 1 and runs["resumed_from"][0] == 40
    assert list(quantities["name"]) == ["a", "b"] and list(quantities["parameters.name"]) == ["x", "x"]
    assert quantities["low"][0] == 0.5 and quantities["value"].isna().tolist() == [False, True]
    assert tables.comparisons(results).empty
    # A single series has neither plan nor case in its path.
    single = tables.quantities(results / "box/n=1/yade")
    assert list(single["case"]) == ["box", "box"] and list(tables.runs(results / "box/n=1/yade")["state"]) == ["finished"]


def test_export(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(results / "box/n=1/yade/metrics.json", Result("box", "n=1", "yade", CHECKS))
    assert main(["export", str(results), "--table", "comparisons"]) == 2
    assert f"no comparisons in {results}" in capsys.readouterr().err
    assert main(["export", str(results)]) == 0
    assert capsys.readouterr().out.splitlines()[1].startswith("box,n=1,yade,")
    assert main(["export", str(results), "--table", "runs", "--out", str(tmp_path / "runs.json")]) == 0
    assert [row["state"] for row in json.loads((tmp_path / "runs.json").read_text())] == ["finished", "stopped", "waiting", "waiting"]
    capsys.readouterr()
    empty = tmp_path / "empty"
    empty.mkdir()
    for words, expected in (((str(results), "--out", "x.xls"), ".csv, .json, .parquet"), ((str(results), "--table", "run"), "runs"),
                            (("nowhere",), "nowhere"), ((str(empty), "--out", str(tmp_path / "x.csv")), "no results in")):
        assert main(["export", *words]) == 2
        error = capsys.readouterr().err
        assert expected in error and error.count("\n") == 1
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.skipif(not os.access("/", os.W_OK), reason="needs a folder below the root")
def test_runs_of_a_folder_directly_below_the_root() -> None:
    """As in containers: `/out` with `/out/replica-1`."""
    with tempfile.TemporaryDirectory(prefix="dembark-", dir="/") as folder:
        place = Path(folder, "replica-1")
        place.mkdir()
        (place / "run.json").write_text('{"inputs": "a", "steps": 10}')
        found = tables.runs(folder)
    assert found.loc[0, ["folder", "case", "replica"]].tolist() == ["replica-1", "", 1]
