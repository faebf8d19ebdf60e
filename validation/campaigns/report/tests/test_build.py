"""A campaign's complete report, from results of a known law."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.validation.campaigns.report.build import build
from dembark.validation.judge import result
from dembark.validation.judge.result import QuantityRecord, Result

FRICTIONS, RADII = (0.2, 0.4, 0.8), (0.02, 0.04)


def fill(folder: Path, shift: float = 0.0, killed: str = "", broken: str = "") -> Path:
    """A campaign folder whose quantity `k` is friction times radius plus `shift`, in both engines.

    At the point `killed` the runs failed, at `broken` YADE's quantity `contacts`, which has no tolerance, failed.
    """
    points = {f"dry_f={friction}_r={radius}": {"wall_friction": friction, "cylinder_radius": radius}
              for friction in FRICTIONS for radius in RADII}
    sweep = {"case": "silo", "name": "grid", "title": "Friction and radius", "axes": ["wall_friction", "cylinder_radius"],
             "points": [{"variant": name, "base": "dry", "values": values, "changes": values} for name, values in points.items()]}
    runs = []
    for name, values in points.items():
        for engine in ("liggghts", "yade"):
            runs.append({"folder": f"silo/{name}/{engine}/replica-1", "inputs": "a"})
            place = folder / "silo" / name / engine
            (place / "replica-1").mkdir(parents=True)
            if name == killed:
                (place / ".replica-1.status.json").write_text('{"state": "failed", "inputs": "a", "message": "the engine was killed"}')
            else:
                (place / "replica-1/run.json").write_text('{"inputs": "a"}')
            value = values["wall_friction"] * values["cylinder_radius"] + shift
            verdict = "fail" if engine == "yade" and name == broken else "pass"
            quantities = (QuantityRecord("k", value, "pass", "K_ratio", "1", (value - 1e-3, value + 1e-3), "", value * 1.02, None, -0.02,
                                         tolerance=0.1, evidence="theory", control="friction off"),
                          QuantityRecord("contacts", 2.0, verdict, "contacts of a log", compared=False, evidence="theory",
                                         control="a lost contact"))
            if name != killed:
                result.write(place / "metrics.json", Result("silo", name, engine, quantities, parameters=values, provenance={
                    "commit": "a" * 40, "replicas": 1, "steps": 1000, "time_step": 1e-5, "wall_time": 2.0, "versions": {engine: "1.0"}}))
    (folder / "plan.json").write_text(json.dumps({"campaign": "test", "description": "a known law", "sweeps": [sweep], "runs": runs}))
    return folder


def test_a_whole_report_with_tables(tmp_path: Path) -> None:
    folder = fill(tmp_path / "one", shift=5e-3)
    page = build(folder)
    text = page.read_text(encoding="utf-8")
    assert (folder / "report.pdf").read_bytes().startswith(b"%PDF")
    names = {path.name for path in (folder / "figures").iterdir()}
    assert {"silo-1.csv", "silo-1.tex", "silo-1-study.svg", "silo-1-map-yade.svg", "scatter.csv", "quantities.csv"} <= names
    assert "Friction and radius" in text and "aaaaaaaaaaaa" in text
    assert "24 of 24 checks passed, none failed" in text
    assert len((folder / "figures/silo-1.csv").read_text().splitlines()) == 25


def test_runs_that_failed_are_missing_and_named(tmp_path: Path) -> None:
    text = build(fill(tmp_path / "one", killed="dry_f=0.2_r=0.02")).read_text(encoding="utf-8")
    assert text.count("the engine was killed") >= 2 and "2 results are missing" in text and "not measured" in text


def test_a_quantity_without_tolerance_that_failed_is_shown(tmp_path: Path) -> None:
    text = build(fill(tmp_path / "one", broken="dry_f=0.8_r=0.04")).read_text(encoding="utf-8")
    assert "23 of 24 checks passed, 1 FAILED" in text and "YADE: contacts of a log" in text


def test_a_folder_without_results_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(DembarkError, match="nothing to report"):
        build(tmp_path)
