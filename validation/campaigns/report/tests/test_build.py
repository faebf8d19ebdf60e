"""A campaign's report as a whole, from a store with rows of a known law."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from dembark.common.errors import DembarkError
from dembark.validation.campaigns import report
from dembark.validation.campaigns.report.gather import gather
from dembark.validation.campaigns.store import path_of
from dembark.validation.runs import schema

FRICTIONS, RADII = (0.2, 0.4, 0.8), (0.02, 0.04)


def fill(folder: Path, commit: str = "a" * 40, shift: float = 0.0, measured: str = "2030-01-01T00:00:00", failed: str = "") -> Path:
    """A campaign folder whose quantity `k` is friction times radius plus `shift`, in both engines."""
    folder.mkdir(parents=True, exist_ok=True)
    points = {f"dry_f={friction}_r={radius}": {"wall_friction": friction, "cylinder_radius": radius} for friction in FRICTIONS for radius in RADII}
    sweep = {"case": "silo", "name": "grid", "title": "Friction and radius", "axes": ["wall_friction", "cylinder_radius"],
             "points": [{"variant": name, "base": "dry", "values": values, "changes": values} for name, values in points.items()]}
    (folder / "runs.json").write_text(json.dumps({"campaign": "test", "description": "a known law", "sweeps": [sweep], "runs": []}))
    rows: dict[str, list[dict[str, Any]]] = {"quantities": [], "runs": []}
    for name, values in points.items():
        for engine in ("liggghts", "yade"):
            place = {"campaign": "test", "case_name": "silo", "variant": name, "engine": engine}
            bad = name == failed
            rows["runs"].append({**place, "run_id": f"{engine}{name}{commit}", "replica": 1, "state": "failed" if bad else "finished",
                                 "message": "the engine was killed" if bad else None, "steps": 1000, "time_step": 1e-5, "wall_time": 2.0,
                                 "particle_steps_per_second": 1e6, "started": "2030-01-01"})
            value = values["wall_friction"] * values["cylinder_radius"] + shift
            common = {**place, "commit_hash": commit, "engine_version": "1.0", "measured_at": measured, "run_commit": commit,
                      "parameters_json": json.dumps(values)}
            if not bad:
                rows["quantities"].append({**common, "name": "k", "label": "K_ratio", "unit": "1", "value": value, "low": value - 1e-3,
                                           "high": value + 1e-3, "reference": value * 1.02, "deviation": -0.02, "deviation_kind": "relative",
                                           "tolerance": 0.1, "verdict": "pass", "basis": "", "compared": 1})
    with schema.writing(path_of(folder)) as connection:
        for table, entries in rows.items():
            schema.put(connection, table, entries)
    return folder


def test_a_whole_report_with_tables_and_comparison(tmp_path: Path) -> None:
    before = fill(tmp_path / "before")
    after = fill(tmp_path / "after", "b" * 40, shift=5e-3)
    page = report.build(after, against=before)
    text = page.read_text(encoding="utf-8")
    assert (after / "report.pdf").read_bytes().startswith(b"%PDF")
    names = {path.name for path in (after / "figures").iterdir()}
    assert {"silo-1.csv", "silo-1.tex", "silo-1-study.svg", "silo-1-map-yade.svg", "scatter.csv", "against.csv"} <= names
    assert "Friction and radius" in text and "12 changed" in text and "aaaaaaaaaaaa" in text and "bbbbbbbbbbbb" in text
    assert len((after / "figures/silo-1.csv").read_text().splitlines()) == 13


def test_runs_that_failed_are_missing_and_named(tmp_path: Path) -> None:
    folder = fill(tmp_path / "one", failed="dry_f=0.2_r=0.02")
    campaign = gather(folder)
    assert len(campaign.missing) == 2 and "the engine was killed" in campaign.missing[0]
    assert "not measured" in report.build(folder).read_text(encoding="utf-8")


def test_the_last_measurement_counts(tmp_path: Path) -> None:
    folder = fill(tmp_path / "one")
    fill(folder, "c" * 40, shift=1.0, measured="2031-01-01T00:00:00")
    values = {one["quantities"][0]["value"] for one in gather(folder).contents}
    assert min(values) > 1.0 and len(gather(folder).contents) == 12


def test_a_folder_without_a_store_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(DembarkError, match="no store"):
        report.build(tmp_path)
