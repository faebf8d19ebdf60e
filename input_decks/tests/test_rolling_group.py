"""The group `rolling`: a case that includes it has rolling resistance in both engines, and without it the deck that it had before."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.postproc import GrainsDump
from dembark.validation.case.folders import VARIABLE, find

TINY = {"grain_count": 20, "cylinder_radius": 0.018, "settle_time": 0.08, "measure_time": 0.02, "frames": 2}
ROLLING = {"rolling_resistance": "elastic_plastic", "rolling_friction": 0.3}


@pytest.fixture
def rough(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The silo with the group, as a case of the user's own."""
    folder = tmp_path / "cases" / "rough_silo"
    shutil.copytree(find("silo").folder, folder)
    text = (folder / "case.toml").read_text(encoding="utf-8")
    (folder / "case.toml").write_text(text.replace('"interface", ', '"interface", "rolling", '), encoding="utf-8")
    monkeypatch.setenv(VARIABLE, str(folder.parent))
    return folder.name


def body(one: Any) -> str:
    """The deck below its numbers."""
    name, end = (one.engine.facts.deck, "\n\n" if one.engine.facts.deck.endswith(".in") else "\n)\n")
    return (one.folder / name).read_text(encoding="utf-8").split(end, 1)[1]


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_group_makes_grains_resist_rolling_and_off_changes_nothing(rough: str, engine: str, decks: Any, tmp_path: Path) -> None:
    plain, off = decks("silo", engine, tmp_path / "plain", TINY), decks(rough, engine, tmp_path / "off", TINY)
    assert body(off) == body(plain)
    spins = []
    for name, values in (("free", ROLLING | {"rolling_friction": 0.0}), ("rough", ROLLING)):
        one = decks(rough, engine, tmp_path / name, TINY | values)
        one.run()
        frame = GrainsDump(one.folder / "grains.dump")[-1]
        spins.append(float(np.sqrt((frame.omegas**2).sum(axis=1).mean())))
    assert spins[1] < 0.5 * spins[0], spins


def test_walls_have_the_resistance_of_grains_or_their_own(rough: str, decks: Any, tmp_path: Path) -> None:
    for own, wall in ((None, 0.3), (0.0, 0.0), (0.7, 0.7)):
        values = TINY | ROLLING | ({} if own is None else {"wall_rolling_friction": own})
        numbers = decks(rough, "liggghts", tmp_path / str(own), values).setup.numbers
        assert (numbers["grain_rolling"], numbers["wall_rolling"]) == (0.3, wall)
