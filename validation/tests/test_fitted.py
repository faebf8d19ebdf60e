"""Runs at draws of a posterior, with a stand-in for the engine: what they run, how they are judged, and mistakes."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from dembark.common.files import read_json
from dembark.validation.campaigns import fitted
from dembark.validation.cli import main

pytestmark = pytest.mark.usefixtures("stand_in")
Command = Callable[..., tuple[int, str, str]]

QUANTITIES = """
[quantities]
repose = { unit = "deg", evidence = "experiment", tolerance = 5.0, absolute = true, why = "reading", label = "angle", source = "Heap" }
width = { unit = "m", evidence = "experiment", tolerance = 5.0, absolute = true, why = "reading", label = "width", source = "Heap" }
[controls]
"friction off" = ["repose", "width"]
"""
MEASURE = """
from dembark.postproc.measurement import Estimate, Measurement, Value, exact, over_replicas
def measure(replicas):
    wet = replicas[0].record["variant"] == "wet"
    found = over_replicas([Estimate(1e4 * one.parameters["grain_diameter"], 0.1) for one in replicas])
    return Measurement({"repose": Value(found, exact(47.0 if wet else 50.0)), "width": Value(found, exact(49.0))})
"""
FITTED = """
[campaign]
name = "fit-fitted"
[[sweeps]]
case = "box"
profile = "quick"
variant = "dry"
engines = ["liggghts"]
list = [{ grain_diameter = 0.005 }]
fixed = { grain_count = 12 }
[posterior]
file = "posterior.csv"
sha256 = "SUM"
[posterior.targets]
repose = { value = 50.0, uncertainty = 1.0 }
"""


@pytest.fixture
def file(decks: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """fitted.toml and its samples: a diameter of 5 mm, known to 0.05 mm."""
    monkeypatch.chdir(tmp_path)
    with (decks / "box/case.toml").open("a", encoding="utf-8") as case:
        case.write(QUANTITIES)
    (decks / "box/measure.py").write_text(MEASURE, encoding="utf-8")
    table = pd.DataFrame({"grain_diameter": np.random.default_rng(1).normal(0.005, 5e-5, 400), "log_density": 0.0}).to_csv(index=False)
    Path("posterior.csv").write_text(table, encoding="utf-8")
    Path("fitted.toml").write_text(FITTED.replace("SUM", fitted.checksum(table.encode())), encoding="utf-8")
    return Path("fitted.toml")


def run(command: Command, variant: str, out: str, *words: str) -> dict:
    code, text, error = command("run", "box", "--engine", "liggghts", "--variant", variant, "--out", out, *words)
    assert code == 0, error
    return {"text": text, **(read_json(Path(out, "metrics.json")) or {})}


def test_members_are_draws_of_the_posterior(file: Path, command: Command) -> None:
    found = run(command, "wet", "o", "--parameters", str(file), "--members", "6")
    records = [read_json(Path(f"o/replica-{k}/run.json")) or {} for k in range(1, 7)]
    diameters = np.array([one["parameters"]["grain_diameter"] for one in records])
    assert len(set(diameters)) == 6 and diameters.mean() == pytest.approx(0.005, abs=6e-5) and 1e-5 < diameters.std() < 1e-4
    assert set(diameters) <= set(pd.read_csv("posterior.csv")["grain_diameter"])
    assert len({one["parameters"]["seed"] for one in records}) == 6 and {one["parameters"]["grain_count"] for one in records} == {12}
    # More members begin with the same ones.
    more = run(command, "wet", "o", "--parameters", str(file), "--members", "7")
    assert [read_json(Path(f"o/replica-{k}/run.json")) for k in range(1, 7)] == records and len(more["inputs"]) == 7
    repose = found["quantities"][0]
    assert repose["basis"] == "prediction from 6 draws of the posterior"
    half = 0.5 * (repose["interval"][1] - repose["interval"][0])
    assert half == pytest.approx(2.571 * np.std(1e4 * diameters, ddof=1) * np.sqrt(7.0 / 6.0), rel=1e-3)
    assert found["provenance"]["fitted"]["names"] == ["grain_diameter"] and found["parameters"]["grain_diameter"] == pytest.approx(
        np.median(diameters))


def test_only_what_was_not_fitted_is_counted(file: Path, command: Command) -> None:
    there = run(command, "dry", "dry", "--parameters", str(file))
    assert [one.get("calibrated", "") for one in there["quantities"]] == ["fitted: a target of the calibration",
                                                                          "of the experiment that was fitted"]
    assert {one["verdict"] for one in there["quantities"]} == {"pass"} and "no checks; 2 calibrated, not counted" in there["text"]
    # In another set-up another angle was measured.
    elsewhere = run(command, "wet", "wet", "--parameters", str(file))
    assert "2 of 2 checks passed" in elsewhere["text"] and not any("calibrated" in one for one in elsewhere["quantities"])


def test_the_check_of_a_fit_in_the_engine_is_no_evidence(file: Path, command: Command) -> None:
    code, out, error = command("submit", str(file), "--out", "o")
    assert code == 0, error
    assert "no checks; 2 calibrated, not counted" in out
    assert "2 calibrated" in Path("o/report.html").read_text(encoding="utf-8")
    assert tomllib.loads(Path("o/campaign.toml").read_text(encoding="utf-8"))["posterior"]["targets"]["repose"]["value"] == 50.0


@pytest.mark.parametrize(("words", "expected"), [
    (["--parameters", "fitted.toml"], "--out is missing, with --parameters"),
    (["--members", "5", "--out", "o"], "there is no posterior to draw from"),
    (["--parameters", "fitted.toml", "--out", "o", "--members", "500"], "fitted.toml has 400 samples"),
    (["--parameters", "fitted.toml", "--out", "o", "--set", "grain_diameter=4mm"], "grain_diameter is set and fitted"),
    (["--parameters", "posterior.csv", "--out", "o"], "posterior.csv cannot be read"),
    (["--parameters", "other.toml", "--out", "o"], "other.toml has no table [posterior]"),
])
def test_a_mistake_gets_one_line(file: Path, words: list[str], expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("other.toml").write_text("[campaign]\n", encoding="utf-8")
    assert main(["run", "box", "--engine", "liggghts", *words]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and expected in error, error


def test_samples_that_were_changed_or_are_gone(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["run", "box", "--engine", "liggghts", "--parameters", str(file), "--out", "o"]
    Path("posterior.csv").write_text("grain_diameter,log_density\n0.004,0.0\n", encoding="utf-8")
    assert main(words) == 2 and "its checksum is not that in fitted.toml" in capsys.readouterr().err
    Path("posterior.csv").unlink()
    assert main(words) == 2 and "the samples of fitted.toml cannot be read" in capsys.readouterr().err
