"""Targets of a calibration from tables of the user's, and that a calibration goes on with those it began with."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from harness import command, decks, stand_in, stand_in_analysis  # noqa: F401

from dembark.common.files import read_json
from dembark.validation.campaigns.spec import read
from dembark.validation.campaigns.targets import CurveTarget, Target, changed
from dembark.validation.cli import main

pytestmark = pytest.mark.usefixtures("decks", "stand_in")

CAMPAIGN = """
[campaign]
name = "fit"
profile = "quick"
[[sweeps]]
case = "box"
engines = ["liggghts"]
[sweeps.sample]
design = "sobol"
samples = 4
[sweeps.sample.parameters]
grain_diameter = { min = "4 mm", max = "8 mm" }
[sweeps.sample.targets]
"""
TABLE = "\ufeffspeed,angle,error,x,y\n1,30,0.5,0.0,0.1\n2,40 deg,0.7,0.2,0.3\n2.0,41,0.8,0.1,0.2\n3,,0,0.1,0.5\n"
ROW = 'repose = { file = "own.csv", where = { speed = 1 }, value = "angle", uncertainty = "error" }'
CURVE = 'surface = { file = "own.csv", where = { speed = 2 }, at = "x", value = "y", uncertainty = "error", correlation = 0.1 }'


@pytest.fixture(autouse=True)
def measured(decks: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A case that measures an angle, and a table."""
    with (decks / "box/case.toml").open("a") as file:
        file.write('[quantities]\nrepose = { label = "angle of repose", unit = "deg" }\n')
    (tmp_path / "own.csv").write_text(TABLE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)


def targets(line: str) -> dict[str, Target | CurveTarget]:
    Path("campaign.toml").write_text(CAMPAIGN + line + "\n", encoding="utf-8")
    sample = read(Path("campaign.toml").resolve()).sweeps[0].sample
    assert sample is not None
    return dict(sample.targets)


def test_a_number_is_a_row_of_a_table() -> None:
    found = targets(ROW)["repose"]
    assert isinstance(found, Target) and (found.value, found.uncertainty) == (30.0, 0.5) and found.file == Path("own.csv").resolve()
    assert targets(ROW.replace('"error"', "0.2"))["repose"].facts() == {"value": 30.0, "uncertainty": 0.2}


def test_a_curve_is_a_table_sorted_by_place() -> None:
    found = targets(CURVE)["surface"]
    assert found == CurveTarget((0.1, 0.2), (0.2, 0.3), (0.8, 0.7), 0.1, Path("own.csv").resolve())


def test_a_reference_of_the_case_needs_no_copy(decks: Path) -> None:
    (decks / "box/reference").mkdir()
    (decks / "box/reference/angles.csv").write_text("angle,error\n33,1\n", encoding="utf-8")
    found = targets('repose = { file = "angles.csv", value = "angle", uncertainty = "error" }')["repose"]
    assert found.facts() == {"value": 33.0, "uncertainty": 1.0}


@pytest.mark.parametrize(("line", "expected"), [
    (ROW.replace(', uncertainty = "error"', ""), "the target repose has no uncertainty"),
    (ROW.replace(', uncertainty = "error"', "").replace(', value = "angle"', ""), "the target repose has no value and no uncertainty"),
    (CURVE.replace(", correlation = 0.1", ""), "the target surface has no correlation"),
    (CURVE.replace("0.1 }", "-1 }"), "correlation of surface = -1 is out of range"),
    (CURVE.replace("0.1 }", "inf }"), "correlation of surface"), (ROW.replace('"error"', "inf"), "uncertainty of repose"),
    (ROW.replace("own.csv", "owm.csv"), "there is no file owm.csv"),
    (ROW.replace('"angle"', '"angel"'), "has no column 'angel'"),
    (ROW.replace('"angle"', "30"), "value = 30 is not the name of a column"),
    (ROW.replace("speed = 1", "sped = 1"), "has no column 'sped'"),
    (ROW.replace("speed = 1", "speed = 7"), "has no row with speed = 7"),
    (ROW.replace("where = { speed = 1 }, ", ""), "has 4 rows: a quantity is one number"),
    (ROW.replace("speed = 1", "speed = 3"), "angle is empty"),
    (ROW.replace('value = "angle"', 'value = "x"').replace("speed = 1", "speed = 3"), "uncertainty of repose = 0 is out of range"),
    (CURVE.replace("where = { speed = 2 }, ", ""), "x = 0.1 stands in two rows"),
    (CURVE.replace('"error"', "0.0"), "uncertainty = 0 is out of range"),
    (ROW.replace("repose", "reposed"), "unknown quantity 'reposed'"),
    ("repose = { value = 30, uncertainty = 1, where = { speed = 1 } }", "where without a file"),
    ("repose = { value = 30, uncertainty = 1, weight = 2 }", "unknown key 'weight'"),
])
def test_a_mistake_gets_one_line(line: str, expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("campaign.toml").write_text(CAMPAIGN + line + "\n", encoding="utf-8")
    assert main(["calibrate", "campaign.toml", "--dry-run"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and expected in error.replace(", a quantity", ": a quantity"), error


@pytest.mark.parametrize(("table", "expected"), [
    ("angle,error\n30,5,0,5\n", "line 2, has 4 fields: the header 2"), ("angle;error\n30,5;0,5\n", "has 3 fields: the header 1"),
    ("angle;error\n30;0.5\n", "has no column 'angle'"), ("angle,error,angle\n30,1,40\n", "has two columns 'angle'"),
])
def test_a_table_that_would_be_misread_gets_one_line(table: str, expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.csv").write_text(table, encoding="utf-8")
    Path("campaign.toml").write_text(CAMPAIGN + ROW.replace("where = { speed = 1 }, ", "") + "\n", encoding="utf-8")
    assert main(["calibrate", "campaign.toml", "--dry-run"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and expected in error.replace(", the", ": the"), error


@pytest.mark.parametrize(("given", "expected"), [
    ("grain_diameter = 5", "5 is not a range"), ('grain_diameter = { min = "4 mm" }', "grain_diameter has no max"),
    ('grain_diameter = { min = "8 mm", max = "4 mm" }', "min = 0.008 of grain_diameter is not below max = 0.004")])
def test_a_parameter_needs_a_range(given: str, expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = CAMPAIGN.replace('grain_diameter = { min = "4 mm", max = "8 mm" }', given)
    Path("campaign.toml").write_text(text + ROW + "\n", encoding="utf-8")
    assert main(["calibrate", "campaign.toml", "--dry-run"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and expected in error, error


@pytest.mark.usefixtures("stand_in_analysis")
def test_a_calibration_goes_on_with_the_targets_that_it_began_with(command: Callable[..., tuple[int, str, str]]) -> None:
    Path("campaign.toml").write_text(f"{CAMPAIGN}{ROW}\n{CURVE}\n", encoding="utf-8")
    assert command("calibrate", "campaign.toml", "--out", "o")[0] == 0
    plan = read_json(Path("o/plan.json")) or {}
    kept = plan["sweeps"][0]["sample"]["targets"]
    assert kept == {"repose": {"value": 30.0, "uncertainty": 0.5},
                    "surface": {"at": [0.1, 0.2], "values": [0.2, 0.3], "uncertainties": [0.8, 0.7], "correlation": 0.1}}
    # A copy that was changed does not pass for what was begun.
    copy = Path("o/targets/own.csv")
    text = copy.read_text(encoding="utf-8")
    copy.write_text(text.replace("1,30,", "1,31,"), encoding="utf-8")
    code, _, error = command("resume", "o")
    assert code != 0 and "o began with other targets" in error and "repose was 30 ± 0.5, now 31 ± 0.5" in error
    copy.write_text(text, encoding="utf-8")
    # What changes outside of the folder does not change what was begun.
    Path("own.csv").write_text(TABLE.replace("1,30,", "1,31,"), encoding="utf-8")
    assert command("resume", "o")[0] == 0
    assert (read_json(Path("o/plan.json")) or {})["sweeps"][0]["sample"]["targets"] == kept
    code, _, error = command("calibrate", "campaign.toml", "--out", "o")
    assert code == 2 and error.count("\n") == 1 and "repose was 30 ± 0.5, now 31 ± 0.5" in error and "--out" in error
    Path("campaign.toml").write_text(CAMPAIGN + ROW.replace("speed = 1", "speed = 2, x = 0.1") + "\n", encoding="utf-8")
    code, _, error = command("calibrate", "campaign.toml", "--out", "o")
    assert code == 2 and "repose was 30 ± 0.5, now 41 ± 0.8, surface is gone" in error
    assert (read_json(Path("o/plan.json")) or {})["sweeps"][0]["sample"]["targets"] == kept


def test_a_plan_of_version_1_has_pairs() -> None:
    now = {"repose": {"value": 30.0, "uncertainty": 1.0}}
    assert not list(changed({"repose": [30.0, 1.0]}, now)) and list(changed({"repose": [31.0, 1.0]}, now)) == [
        "repose was 31 ± 1, now 30 ± 1"]


def test_two_tables_of_one_name(capsys: pytest.CaptureFixture[str]) -> None:
    Path("other").mkdir()
    Path("other/own.csv").write_text(TABLE, encoding="utf-8")
    Path("campaign.toml").write_text(f"{CAMPAIGN}{ROW}\n{CURVE.replace('own.csv', 'other/own.csv')}\n", encoding="utf-8")
    assert main(["calibrate", "campaign.toml", "--dry-run"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "have one name" in error
