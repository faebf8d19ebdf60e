"""The table of runs: which state may follow which, what the folders decide, and that it is made again when it is lost."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import pytest
from harness import decks, stand_in  # noqa: F401

from dembark.common.errors import DembarkError
from dembark.validation.runs import schema
from dembark.validation.runs.plan import Run, of_profile
from dembark.validation.runs.table import ALLOWED, State, Table, read

pytestmark = pytest.mark.usefixtures("decks", "stand_in")


def planned() -> dict[str, Run]:
    return {str(one.place / run.folder_name): run for one in of_profile("quick") for run in one.runs}


def entered(results: Path, whole: bool = True, **steps: str) -> Table:
    table = Table(results, "boxes")
    table.enter(planned(), results, steps, whole)
    return table


def finish(results: Path, folder: str, inputs: str) -> None:
    (results / folder).mkdir(parents=True, exist_ok=True)
    (results / folder / "run.json").write_text(json.dumps({"inputs": inputs, "steps": 100, "attempts": 2, "resumed_at": [40]}))


def stored(results: Path) -> dict[str, str]:
    return {state.name: state.state for state in read(results)}


@pytest.mark.parametrize("before", ALLOWED)
def test_only_what_is_allowed_may_follow(before: str) -> None:
    for after in ALLOWED:
        table = Table()
        table._states["a"] = State("a", before, kind="measure")
        if after in ALLOWED[before]:
            assert table.transition("a", after).state == after
        else:
            with pytest.raises(ValueError, match=f"a is {before} and cannot become {after}"):
                table.transition("a", after)
            assert table.state("a").state == before


def test_a_change_is_in_the_store_with_its_times(tmp_path: Path) -> None:
    table = entered(tmp_path, measure="measure")
    name = table.runs()[0].name
    table.transition(name, "running", host="here")
    table.note(name, step=10, steps=100)
    table.transition(name, "stopped", message="killed")
    (row,) = [state for state in read(tmp_path) if state.name == name]
    assert (row.state, row.step, row.steps, row.message, row.host) == ("stopped", 10, 100, "killed", "here")
    assert 0 < row.began <= row.ended and set(stored(tmp_path).values()) == {"stopped", "waiting"}


def test_what_is_finished_is_decided_by_the_folders(tmp_path: Path) -> None:
    table = entered(tmp_path)
    (folder, run), (other, second), *_ = planned().items()
    for state in table.runs():
        table.transition(state.name, "running")
    table.transition(second.name, "finished")
    finish(tmp_path, folder, run.inputs)
    finish(tmp_path, other, "of other inputs")
    # As after a kill: nothing attends to what was running, one has finished nevertheless, another one's result has gone.
    assert set(stored(tmp_path).values()) == {"running", "finished"}
    entered(tmp_path)
    states = stored(tmp_path)
    assert states.pop(run.name) == "finished" and set(states.values()) == {"waiting"}
    before = read(tmp_path)
    (tmp_path / schema.FILE).unlink()
    entered(tmp_path)
    assert stored(tmp_path) == {state.name: state.state for state in before}
    with sqlite3.connect(tmp_path / schema.FILE) as connection:
        sql = "SELECT attempts, resumed_from_step, steps FROM runs WHERE state = 'finished'"
        assert connection.execute(sql).fetchall() == [(2, 40, 100)]


def test_a_store_that_cannot_be_written_costs_no_run(tmp_path: Path) -> None:
    table = entered(tmp_path)
    name = table.runs()[0].name
    (tmp_path / schema.FILE).write_bytes(b"no data base" * 100)
    table.transition(name, "running")
    table.transition(name, "finished")
    assert table.state(name).state == "finished" and "store.sqlite cannot be written" in table.problem


def test_a_store_of_the_first_version_is_taken_over(tmp_path: Path) -> None:
    (folder, run), *_ = planned().items()
    finish(tmp_path, folder, run.inputs)
    old = {key: kind for key, kind in schema.TABLES["runs"].items() if key not in ("began", "ended", "job", "step", "estimated_time")}
    columns = {**schema.TABLES, "runs": old}
    with sqlite3.connect(tmp_path / schema.FILE) as connection:
        for table in ("runs", "quantities", "comparisons", "points"):
            body = ", ".join(f"{key} {kind}" for key, kind in columns[table].items())
            connection.execute(f"CREATE TABLE {table} ({body}, PRIMARY KEY ({schema.KEYS[table][0]}))")
        for inputs, state in ((run.inputs, "finished"), ("gone", "finished"), ("never", "missing")):
            connection.execute("INSERT INTO runs (run_id, campaign, case_name, variant, engine, replica, state, folder) VALUES "
                               "(?, 'boxes', 'box', 'dry', 'yade', 1, ?, ?)", (inputs, state, folder))
        connection.execute("INSERT INTO quantities (campaign, case_name, variant, engine, name, value, commit_hash, engine_version) "
                           "VALUES ('boxes', 'box', 'dry', 'yade', 'k', 1.5, 'c1', '1')")
        connection.execute("PRAGMA user_version = 1")
    entered(tmp_path)
    rows = schema.rows(tmp_path / schema.FILE, "SELECT run_id, state FROM runs")
    states = {row["run_id"]: row["state"] for row in rows}
    assert states[run.inputs] == "finished" and states["gone"] == "superseded" and "never" not in states
    assert [row["value"] for row in schema.rows(tmp_path / schema.FILE, "SELECT value FROM quantities")] == [1.5]


def test_a_newer_store_is_refused(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / schema.FILE) as connection:
        connection.execute(f"PRAGMA user_version = {schema.VERSION + 1}")
    with pytest.raises(DembarkError, match="use a newer dembark"):
        entered(tmp_path)
