"""The decks of liquid_exchange: defaults of the case file, and books that are the reference's in both engines, also after a restart."""

from __future__ import annotations

import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.postproc import read_times
from dembark.validation import engines
from dembark.validation.checks import liquid_exchange
from dembark.validation.checks.run import Replica

CASE = Path(__file__).resolve().parents[1] / "liquid_exchange"
with (CASE / "case.toml").open("rb") as file:
    TABLES = tomllib.load(file)
DECKS = {"liggghts": "liggghts.in", "yade": "yade.py"}
SHORT = {"duration": 0.2, "rows": 200}


def values(variant: str) -> dict[str, Any]:
    return {key: table.get("value") for key, table in TABLES["parameters"].items()} | TABLES["variants"][variant] | SHORT


def start(engine: str, folder: Path, words: dict[str, Any]) -> Any:
    try:
        found = engines.find(engine)
    except DembarkError as error:
        pytest.skip(str(error))
    folder.mkdir(exist_ok=True)
    deck = folder / DECKS[engine]
    shutil.copy(CASE / DECKS[engine], deck)
    shutil.copy(CASE / "case.toml", folder)
    words = {key: str(value) for key, value in words.items() if value is not None}
    return engines.call(found.command(deck, words), folder, found.environment())


def test_liggghts_defaults_are_those_of_the_case_file() -> None:
    defaults = dict(re.findall(r"^variable\s+(\w+)\s+index\s+(\S+)\s*$", (CASE / "liggghts.in").read_text(), re.MULTILINE))
    assert (defaults.pop("restart_every"), defaults.pop("resume")) == ("0", "no")
    assert defaults.keys() == TABLES["parameters"].keys()
    for key, text in defaults.items():
        table = TABLES["parameters"][key]
        assert (text if table["type"] == "choice" else float(text)) == table.get("value", -1.0), key


@pytest.mark.parametrize("engine", DECKS)
@pytest.mark.parametrize("variant", ["cap", "limited"])
def test_books_are_those_of_the_rule(tmp_path: Path, engine: str, variant: str) -> None:
    p = values(variant)
    done = start(engine, tmp_path, p)
    assert done.returncode == 0 and "dembark: finished" in done.stdout, (done.stdout + done.stderr)[-2000:]
    found, _, _ = liquid_exchange.quantities([Replica(tmp_path, {"parameters": p, "time_step": p["time_step"], "engine": engine})])
    assert {one.name: one.judged() for one in found if one.judged()[0] != "pass"} == {}
    times = read_times(tmp_path / "time.csv")
    assert len(times["step"]) == 200 and np.abs(np.diff(times["bridge_count"])).sum() > 5


@pytest.mark.parametrize("engine", DECKS)
def test_resumed_run_has_the_same_books(tmp_path: Path, engine: str) -> None:
    words = SHORT | {"restart_every": 700}
    for folder, more in ((tmp_path / "whole", {}), (tmp_path / "resumed", {}), (tmp_path / "resumed", {"resume": "yes"})):
        done = start(engine, folder, words | more)
        assert done.returncode == 0, (done.stdout + done.stderr)[-2000:]
    assert (tmp_path / "whole/time.csv").read_text() == (tmp_path / "resumed/time.csv").read_text()


@pytest.mark.parametrize("engine", DECKS)
def test_more_than_all_of_the_liquid_is_refused(tmp_path: Path, engine: str) -> None:
    done = start(engine, tmp_path, {"liquid_share": "fraction", "liquid_share_factor": 1.5})
    assert done.returncode != 0
    assert "liquid_share_factor" in done.stdout + done.stderr
