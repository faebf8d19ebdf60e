"""Known parameters of stand-ins are found again, what cannot be known is said, and the comparison measures what it says."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import calibration
from benchmarks.calibration_stand_ins import STAND_INS, StandIn
from dembark.common.errors import RunError


@pytest.mark.parametrize("name", STAND_INS)
def test_known_parameters_are_found_again(name: str) -> None:
    found = calibration.recovered(STAND_INS[name], range(3))
    assert found.repetitions == 3 and found.joint >= 2


@pytest.mark.full
@pytest.mark.parametrize("name", STAND_INS)
def test_known_parameters_are_within_the_stated_region_as_often_as_it_says(name: str) -> None:
    found = calibration.recovered(STAND_INS[name], range(100))
    assert found.joint >= 90
    # Young's modulus follows from the oedometer, and neither coefficient from the angle of one heap.
    assert (found.identified[0] >= 90) if name == "oedometer" else (max(found.identified) <= 50)


@pytest.mark.full
def test_uncertainties_that_are_too_small_are_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of targets that scatter by twice their uncertainty the truth is outside more often than one in ten."""
    honest = StandIn.experiment

    def careless(one: StandIn, seed: int) -> tuple[np.ndarray, np.ndarray]:
        truth, targets = honest(one, seed)
        return truth, one.model(truth) + 2.0 * (targets - one.model(truth))

    monkeypatch.setattr(StandIn, "experiment", careless)
    assert calibration.recovered(STAND_INS["shear_cell"], range(40)).joint < 36


def test_the_exact_posterior_of_a_linear_model_is_known() -> None:
    linear = StandIn(lambda place: place * [2.0, 5.0], (0.1, 0.1))
    mean, deviation = linear.exact(np.array([1.0, 2.5]))
    np.testing.assert_allclose(mean, 0.5, atol=1e-6)
    np.testing.assert_allclose(deviation, 0.1 / np.sqrt(5.0) / np.array([2.0, 5.0]), rtol=1e-3)


def exact(name: str, shift: float, factor: float) -> dict[str, object]:
    mean, deviation = STAND_INS[name].exact(STAND_INS[name].experiment(0)[1])
    return {"runs": 40, "mean": (mean + shift * deviation).tolist(), "deviation": (factor * deviation).tolist(), "reached": True}


def test_errors_are_counted_in_deviations_of_the_exact_posterior() -> None:
    found = calibration.row("heap", "any", [exact("heap", 0.5, 0.8)], [0])
    assert found["error"] == pytest.approx(0.5) and found["width"] == pytest.approx(0.8)
    assert found["runs"] == 40 and found["reached"] == 1.0
    # One that failed reached nothing, and has no error.
    found = calibration.row("heap", "any", [exact("heap", 0.5, 0.8), None], [0, 1])
    assert found["error"] == pytest.approx(0.5) and found["reached"] == 0.5
    with pytest.raises(RunError, match="no calibration of heap came to its end"):
        calibration.row("heap", "any", [None], [0])


def python(folder: Path, says: str) -> Path:
    """A Python that stands in for one with GrainLearning, whatever it is given."""
    path = folder / "python"
    path.write_text(f"#!/bin/sh\n{says}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


def test_grainlearning_is_asked_in_its_own_python(tmp_path: Path) -> None:
    answer = {name: [exact(name, 1.0, 0.5)] for name in STAND_INS}
    (tmp_path / "answer.json").write_text(json.dumps(answer), encoding="utf-8")
    rows = calibration.of_grainlearning(python(tmp_path, f"cat {tmp_path / 'answer.json'}"), 20, [0])
    assert [one["stand_in"] for one in rows] == list(STAND_INS)
    assert all(one["error"] == pytest.approx(1.0) and one["width"] == pytest.approx(0.5) for one in rows)


@pytest.mark.parametrize(("path", "expected"), [
    ("/no/python", "--grainlearning /no/python cannot be started"), (sys.executable, "has no GrainLearning")])
def test_a_python_without_it_gets_one_line(path: str, expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert calibration.main(["--grainlearning", path]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and expected in error


def test_it_is_left_out_where_it_is_not_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(calibration, "SURROGATE", (10,))
    assert calibration.main(["--rounds", "1", "--targets", "1", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr()
    assert "GrainLearning is left out: give --grainlearning PYTHON" in said.err and "GrainLearning," not in said.out
    assert "| heap | surrogate | 10 |" in said.out and (tmp_path / "calibration.json").is_file()
    assert calibration.main(["--targets", "0"]) == 2
