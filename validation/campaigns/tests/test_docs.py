"""What the documentation shows of the store works on a store."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dembark.validation.campaigns import store
from dembark.validation.campaigns.spec import shipped
from dembark.validation.runs import schema
from dembark.validation.runs.schema import TABLES

PAGE = (Path(__file__).resolve().parents[3] / "docs/how-to/campaigns.md").read_text(encoding="utf-8")


def blocks(kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A campaign's folder with a store of two quantities of two points."""
    folder = tmp_path / "results/campaigns/silo-small"
    folder.mkdir(parents=True)
    with schema.writing(folder / store.FILE) as connection:
        for friction, value in ((0.2, 0.8), (0.4, 0.6)):
            common = {"campaign": "silo-small", "case_name": "silo", "variant": f"dry_wall_friction={friction}", "engine": "liggghts",
                      "commit_hash": "c", "engine_version": "3.8.0", "measured_at": "2026", "value": value, "low": value - 0.1,
                      "high": value + 0.1, "parameters_json": f'{{"wall_friction": {friction}, "bridge_volume": 0.0}}'}
            schema.put(connection, "quantities", [{**common, "name": "apparent_mass_ratio", "label": "share", "verdict": "fail"},
                                                  {**common, "name": "stress_ratio_k", "verdict": "pass"}])
            schema.put(connection, "runs", [{**common, "run_id": str(friction), "state": "finished", "attempts": 2, "wall_time": 10.0,
                                             "ranks": 2, "threads": 1}])
    return folder


def test_sql(results: Path) -> None:
    statements = [text for block in blocks("sql") for text in re.sub(r"--.*", "", block).split(";") if text.strip()]
    found = [store.query(results, text) for text in statements]
    assert [len(rows) for rows in found] == [2, 2, 2, 2, 2]
    assert [(row["wall_friction"], row["value"]) for row in found[0]] == [(0.2, 0.8), (0.4, 0.6)]


def test_python(results: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(results.parents[2])
    (text,) = blocks("py")
    known: dict[str, object] = {}
    exec(text, known)
    assert list(known["friction"]) == [0.2, 0.4] and list(known["share"]) == [0.8, 0.6] and known["half_width"] == pytest.approx(0.1)
    assert len(known["history"]) == 1 and known["costs"] == [{"engine": "liggghts", "core_seconds": 40.0}]
    assert capsys.readouterr().out.splitlines()[0].startswith("dry_wall_friction=0.2 liggghts share 0.8")


def test_every_column_and_campaign_is_named() -> None:
    names = {name for table in ("runs", "steps", "quantities", "points") for name in TABLES[table]}
    assert {name for name in names if f"`{name}`" not in PAGE} == set()
    for name in shipped():
        assert f"`{name}`" in PAGE or f"`{name.removesuffix('-full')}-standard`, `-full`" in PAGE
