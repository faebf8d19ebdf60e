"""The templates of `dembark new-case`: each runs in each engine, passes, and its control fails."""

from __future__ import annotations

from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.common.files import read_json
from dembark.validation import engines
from dembark.validation.case import folders
from dembark.validation.cli import main

CHECKS = {"sphere": "rebound", "packing": "floor_force"}
# What the control of each template changes in measure.py.
WRONG = {"sphere": ('Estimate(p["restitution"], 0.0)', 'Estimate(0.9 * p["restitution"], 0.0)'),
         "packing": ('run.parameters["gravity"]', '2.0 * run.parameters["gravity"]')}


def verdict(check: str) -> str:
    quantities = read_json(Path("out/metrics.json"))["quantities"]  # type: ignore[index]
    return next(one["verdict"] for one in quantities if one["name"] == check)


@pytest.mark.parametrize("engine", ["liggghts", pytest.param("lammps", marks=pytest.mark.full),
                                    pytest.param("yade", marks=pytest.mark.full)])
@pytest.mark.parametrize("template", CHECKS)
def test_a_template_runs_and_its_control_fails(template: str, engine: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        engines.find(engine)
    except DembarkError as error:
        pytest.skip(str(error))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(folders.VARIABLE, "")
    assert main(["new-case", "mine", "--in", "cases", "--template", template]) == 0
    words = ["--cases", "cases", "run", "mine", "--engine", engine, "--out", "out", "--strict"]
    assert main(words) == 0
    assert verdict(CHECKS[template]) == "pass"
    file = tmp_path / "cases/mine/measure.py"
    text = file.read_text(encoding="utf-8")
    assert text.count(WRONG[template][0]) == 1
    file.write_text(text.replace(*WRONG[template]), encoding="utf-8")
    assert main(words) == 1
    assert verdict(CHECKS[template]) == "fail"


def test_an_unknown_template_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new-case", "mine", "--in", str(tmp_path), "--template", "pakcing"]) == 2
    assert "did you mean packing" in capsys.readouterr().err and not list(tmp_path.iterdir())
