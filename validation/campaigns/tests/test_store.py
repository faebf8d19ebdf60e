"""The store: every run and quantity exactly once, whole series, rows of other commits kept, and readers that say what is wrong."""

from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from harness import decks, stand_in  # noqa: F401

from dembark.common.errors import DembarkError, RunError
from dembark.validation import engines
from dembark.validation.campaigns import store
from dembark.validation.campaigns.estimate import Rates
from dembark.validation.runs import schema
from dembark.validation.runs.plan import Series, of_profile
from dembark.validation.runs.schema import KEYS, TABLES, VERSION
from dembark.validation.runs.table import Table

pytestmark = pytest.mark.usefixtures("decks", "stand_in")


def quantity(name: str, value: float | None, interval: list[float] | None = None) -> dict[str, Any]:
    return {"name": name, "label": name.upper(), "unit": "1", "value": value, "interval": interval, "reference": 2.0,
            "reference_interval": None, "deviation": None, "deviation_kind": "relative", "tolerance": 0.1, "verdict": "pass", "reason": "",
            "detail": "", "source": "", "evidence": "theory", "control": "friction off", "basis": "replicas",
            "compared": True, "agreement": None, "deviation_half_width": None}


def put(results: Path, one: Series, quantities: list[dict[str, Any]], commit: str = "c1", at: str = "2026-01-01T00:00:00+00:00",
        speed: float = 100.0, **facts: Any) -> None:
    """The files of a finished series."""
    for run in one.runs:
        folder = results / one.place / run.folder_name
        folder.mkdir(parents=True, exist_ok=True)
        told = {"commit": "run", "dirty": False, "host": "node1", "ranks": 1, "threads": 1, "particle_steps_per_second": speed}
        record = {"inputs": run.inputs, "steps": 100, "time_step": 1e-5, "attempts": 2, "resumed_at": [40], "resume": "exact"}
        (folder / "run.json").write_text(json.dumps(record | {"provenance": told | facts}))
    content = {"quantities": quantities, "parameters": {"grain_count": run.values["grain_count"]},
               "measured": {"commit": commit, "dirty": True, "at": at},
               "provenance": {"versions": {one.place.name: "3.8.0"}, "replicas": len(one.runs), "commit": "run", "host": "node1"}}
    (results / one.place / "metrics.json").write_text(json.dumps(content))


def collect(results: Path, label: str, planned: list[Series], messages: dict[str, str] | None = None, whole: bool = False,
            sweeps: list[dict[str, Any]] | None = None) -> None:
    """What the executor does with the store before and after the runs of `planned`."""
    table = Table(results, label)
    table.enter({str(one.place / run.folder_name): run for one in planned for run in one.runs}, results, {}, whole)
    for name, message in (messages or {}).items():
        table.transition(name, "failed", message=message)
    store.collect(results, label, [one.place for one in planned], sweeps)


def test_every_run_and_quantity_is_there_once_however_often_they_are_collected(tmp_path: Path) -> None:
    planned = of_profile("quick")
    for index, one in enumerate(planned):
        put(tmp_path, one, [quantity("k", 1.0 + index, [0.5, 1.5]), quantity("none", None)])
    (tmp_path / "box/dry/comparison.json").write_text(json.dumps(
        {"quantities": [{**quantity("k", 1.0), "engine": "yade", "reference_engine": "liggghts", "joint_half_width": 0.1}],
         "measured": {"commit": "c1", "dirty": None, "at": "2026"}}))
    point = {"variant": "dry", "base": "dry", "values": {"grain_count": 10, "variant": "dry"}}
    sweeps = [{"case": "box", "name": "sweep 1", "points": [point]}]
    collect(tmp_path, "boxes", planned, {}, True, sweeps)
    first = {table: store.read(tmp_path, table) for table in TABLES}
    for _ in range(2):
        for one in planned:
            collect(tmp_path, "boxes", [one])
        collect(tmp_path, "boxes", planned, {}, True, sweeps)
    assert {table: store.read(tmp_path, table) for table in TABLES} == first
    assert len(first["runs"]) == 3 and len(first["quantities"]) == 6 and len(first["comparisons"]) == 1 and len(first["points"]) == 2
    row = store.read_quantities(tmp_path, case_name="box", variant="dry", engine="yade", name="k")[0]
    assert (row["low"], row["high"], row["reference_low"], row["commit_hash"], row["dirty"]) == (0.5, 1.5, None, "c1", 1)
    assert row["parameters"] == {"grain_count": 10} and row["engine_version"] == "3.8.0"
    run = first["runs"][0]
    assert (run["state"], run["attempts"], run["resumed_from_step"], run["resume"], run["particles"]) == ("finished", 2, 40, "exact", 10)
    assert {row["value"] for row in first["points"]} == {10, "dry"}
    assert first["comparisons"][0]["engine_versions"] == "liggghts 3.8.0, yade 3.8.0"


def test_runs_that_are_not_finished_are_told_from_those_that_are(tmp_path: Path) -> None:
    planned = of_profile("quick")
    put(tmp_path, planned[0], [quantity("k", 1.0)])
    failed = planned[1].runs[0]
    collect(tmp_path, "boxes", planned, {failed.name: "it blew up"}, True)
    rows = {row["run_id"]: (row["state"], row["message"]) for row in store.read_runs(tmp_path)}
    assert rows[planned[0].runs[0].inputs] == ("finished", "") and rows[failed.inputs] == ("failed", "it blew up")
    assert [state for state, _ in rows.values()].count("waiting") == 1 and len(rows) == 3
    put(tmp_path, planned[1], [quantity("k", 1.0)])
    collect(tmp_path, "boxes", [planned[1]])
    assert len(store.read_runs(tmp_path, state=["finished", "waiting"])) == 3


def test_rows_of_several_commits_stay_and_the_same_commit_replaces_its_own(tmp_path: Path) -> None:
    (one,) = [one for one in of_profile("quick") if str(one.place) == "box/wet/liggghts"]
    for index, commit in enumerate(("c1", "c2", "c2")):
        others = [quantity("renamed", 1.0)] if index == 1 else []
        put(tmp_path, one, [quantity("k", 1.0 + index), *others], commit, f"2026-01-0{index + 1}")
        collect(tmp_path, "boxes", [one])
    rows = store.trend(tmp_path, "box", "wet", "liggghts", "k")
    assert [(row["commit_hash"], row["value"]) for row in rows] == [("c1", 1.0), ("c2", 3.0)]
    assert not store.read_quantities(tmp_path, name="renamed")


def test_runs_of_other_inputs_are_superseded_not_lost(tmp_path: Path, decks: Path) -> None:
    from dembark.validation.case import folders

    before = of_profile("quick")
    collect(tmp_path, "boxes", of_profile("standard"), {}, True)  # never finished: not to be kept
    for one in before:
        put(tmp_path, one, [quantity("k", 1.0)])
    collect(tmp_path, "boxes", before, {}, True)
    path = decks / "box/case.toml"
    path.write_text(path.read_text().replace("value = 0.35", "value = 0.36").replace(', {variant = "wet", engines = ["liggghts"]}', ""))
    folders.load.cache_clear()
    after = of_profile("quick")
    for one in after:
        put(tmp_path, one, [quantity("k", 2.0)])
    collect(tmp_path, "boxes", after, {}, True)
    rows = store.read_runs(tmp_path)
    assert {row["run_id"] for row in rows if row["state"] == "finished"} == {run.inputs for one in after for run in one.runs}
    assert {row["run_id"] for row in rows if row["state"] == "superseded"} == {run.inputs for one in before for run in one.runs}


def test_a_series_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    one = of_profile("quick")[0]
    put(tmp_path, one, [quantity("k", 1.0), quantity("l", 1.0)])
    collect(tmp_path, "boxes", [one])
    put(tmp_path, one, [quantity("k", 5.0), {**quantity("l", 5.0), "name": None}])
    with pytest.raises(RunError, match=r"store\.sqlite cannot be written"):
        collect(tmp_path, "boxes", [one])
    assert {row["name"]: row["value"] for row in store.read_quantities(tmp_path)} == {"k": 1.0, "l": 1.0}


def test_a_curve_is_that_of_the_last_measurement(tmp_path: Path, decks: Path) -> None:
    (tmp_path / "c.toml").write_text('[campaign]\nname = "c"\nprofile = "quick"\n[[sweeps]]\ncase = "box"\nengines = ["yade"]\n'
                                     'grid = { grain_count = [30, 10, 20] }\n')
    from dembark.validation.campaigns import expand

    planned = list(expand.plan(file=tmp_path / "c.toml").series)
    for commit in ("a", "b"):
        for one in planned:
            count = one.runs[0].values["grain_count"]
            interval = [count * 2 - 1, count * 2 + 1] if count > 10 else None
            put(tmp_path, one, [quantity("k", count * (2 if commit == "b" else 1), interval)], commit, commit)
        collect(tmp_path, "c", planned)
    places, measured, half = store.curve(tmp_path, "box", "yade", "k", "grain_count")
    assert list(places) == [10, 20, 30] and list(measured) == [20, 40, 60] and np.isnan(half[0]) and list(half[1:]) == [1, 1]
    assert list(store.curve(tmp_path, "box", "yade", "k", "grain_count", grain_count=20)[1]) == [40]
    assert store.curve(tmp_path, "box", "liggghts", "k", "grain_count")[0].size == 0


def test_verdicts_are_counted_by_kind_of_evidence_and_once_however_many_commits_measured_them(tmp_path: Path) -> None:
    planned = of_profile("quick")
    for commit, verdict in (("a", "pass"), ("b", "fail")):
        for one in planned:
            judged = [quantity("k", 1.0), quantity("m", 1.0) | {"verdict": verdict, "evidence": "identity"},
                      quantity("n", 1.0) | {"verdict": "info", "tolerance": None, "evidence": ""}]
            put(tmp_path, one, judged, commit, commit)
        collect(tmp_path, "boxes", planned)
    (tmp_path / "box/dry/comparison.json").write_text(json.dumps(
        {"quantities": [{**quantity("k", 1.0), "engine": "yade", "reference_engine": "liggghts", "evidence": "code"}]}))
    collect(tmp_path, "boxes", planned)
    found = store.tally(tmp_path)
    assert {kind: (one.passed, one.failed) for kind, one in found.by_evidence.items()} == {"theory": (3, 0), "code": (1, 0),
                                                                                         "identity": (0, 3)}
    assert found.information == 3 and store.tally(tmp_path, variant="wet").checks == 2
    assert [row["evidence"] for row in store.read(tmp_path, "comparisons")] == ["code"]


def test_a_store_of_the_version_before_gets_the_kind_of_evidence(tmp_path: Path) -> None:
    one = of_profile("quick")[0]
    put(tmp_path, one, [quantity("k", 1.0)])
    collect(tmp_path, "boxes", [one])
    with sqlite3.connect(tmp_path / store.FILE) as connection:
        for table in ("quantities", "comparisons"):
            connection.execute(f"ALTER TABLE {table} DROP COLUMN evidence")
        connection.execute(f"PRAGMA user_version = {VERSION - 1}")
    (tmp_path / one.place / "metrics.json").unlink()
    collect(tmp_path, "boxes", [one])
    assert [(row["value"], row["evidence"]) for row in store.read_quantities(tmp_path)] == [(1.0, None)]
    assert store.tally(tmp_path).by_evidence[""].passed == 1


def test_tables_go_to_csv(tmp_path: Path) -> None:
    one = of_profile("quick")[0]
    put(tmp_path, one, [quantity("k", 0.1 + 0.2)])
    collect(tmp_path, "boxes", [one])
    store.export(tmp_path, "quantities", tmp_path / "q.csv")
    header, row = (tmp_path / "q.csv").read_text().splitlines()
    assert header.split(",") == list(TABLES["quantities"]) and str(0.1 + 0.2) in row


def test_a_reader_says_what_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(DembarkError, match="there is no store"):
        store.read_runs(tmp_path)
    collect(tmp_path, "boxes", [])
    for wrong, words in ((lambda: store.read(tmp_path, "quantity"), "did you mean quantities"),
                         (lambda: store.read_runs(tmp_path, host_name="x"), "unknown column"),
                         (lambda: store.query(tmp_path, "SELECT nothing FROM runs"), "cannot be read"),
                         (lambda: store.query(tmp_path, "DELETE FROM runs"), "cannot be read")):
        with pytest.raises(DembarkError, match=words):
            wrong()
    with sqlite3.connect(tmp_path / store.FILE) as connection:
        assert connection.execute("PRAGMA user_version").fetchone() == (VERSION,)
        connection.execute(f"PRAGMA user_version = {VERSION + 1}")
    for use in (lambda: store.read_runs(tmp_path), lambda: collect(tmp_path, "boxes", [])):
        with pytest.raises(DembarkError, match="use a newer dembark"):
            use()
    (tmp_path / store.FILE).write_bytes(b"no data base" * 100)
    with pytest.raises(DembarkError, match="cannot be read"):
        store.read_runs(tmp_path)


def test_keys_are_columns() -> None:
    assert all(set(KEYS[table]) <= set(columns) for table, columns in TABLES.items())


def test_rates_are_those_of_the_store_before_those_of_the_table(tmp_path: Path) -> None:
    planned = of_profile("standard")
    none = Rates(tmp_path / store.FILE)
    facts = engines.facts("yade")
    assert none.of("silo", "yade").value == facts.rates["silo"] and none.of("box", "yade").value == facts.typical_rate
    for speed, one in zip((400.0, 100.0), planned, strict=True):
        put(tmp_path, one, [], speed=speed, ranks=4 if one.place.name == "yade" else 1)
    collect(tmp_path, "boxes", planned)
    rates = Rates(tmp_path / store.FILE)
    by_engine = {one.place.name: rates.of("box", one.place.name) for one in planned}
    assert by_engine["yade"].value == 100.0 and by_engine["liggghts"].value == 100.0 and "3 runs measured" in by_engine["yade"].source
    assert rates.of("silo", "yade") == none.of("silo", "yade")


KILLED = """
import os, sqlite3, sys
store = sqlite3.connect(sys.argv[1], isolation_level=None)
store.execute("PRAGMA synchronous = FULL")
store.execute("PRAGMA cache_size = 1")
store.execute("BEGIN IMMEDIATE")
store.execute("UPDATE steps SET message = 'half'")
store.executemany("INSERT INTO steps (campaign, name, kind, state, message) VALUES ('c', ?, 'k', 'running', ?)",
                  [(f"more{k}", "x" * 4000) for k in range(200)])
os.kill(os.getpid(), 9)
"""


def test_what_a_killed_writer_had_begun_is_taken_back_by_who_reads(tmp_path: Path) -> None:
    """Its journal is on the disk, and pages of its transaction are in the file."""
    path = tmp_path / schema.FILE
    with schema.writing(path) as store:
        schema.put(store, "steps", [{"campaign": "c", "name": "one", "kind": "k", "state": "waiting", "message": "whole"}])
    subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False, timeout=60)
    assert path.with_name(f"{schema.FILE}-journal").is_file()
    assert schema.rows(path, "SELECT name, message FROM steps") == [{"name": "one", "message": "whole"}]
    with pytest.raises(DembarkError, match="readonly database"):
        schema.rows(path, "DELETE FROM steps")
