"""The decks of liquid_exchange: books that are the reference's in all engines, also after a restart."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.input_decks.tests.measuring import judged, module, names
from dembark.postproc import read_times
from dembark.validation.case.folders import find

ENGINES = ("liggghts", "yade")
SHORT = {"duration": 0.2, "rows": 200}


@pytest.mark.parametrize("engine", find("liquid_exchange").engines)
@pytest.mark.parametrize("variant", ["cap", "limited"])
def test_books_are_those_of_the_rule(tmp_path: Path, engine: str, variant: str, decks: Any) -> None:
    one = decks("liquid_exchange", engine, tmp_path, SHORT, variant)
    one.run()
    found = judged("liquid_exchange", module("liquid_exchange").measure([one.replica()]))
    assert names(found, "pass") == set(found), found
    times = read_times(tmp_path / "time.csv")
    assert len(times["step"]) == 200 and np.abs(np.diff(times["bridge_count"])).sum() > 5


@pytest.mark.parametrize("engine", ENGINES)
def test_resumed_run_has_the_same_books(tmp_path: Path, engine: str, decks: Any) -> None:
    whole, resumed = (decks("liquid_exchange", engine, tmp_path / name, SHORT) for name in ("whole", "resumed"))
    for one in (whole, resumed):
        one.run(restart_every=700)
    assert "dembark: resumed at step" in resumed.run(restart_every=700, resume="yes")
    assert (whole.folder / "time.csv").read_text() == (resumed.folder / "time.csv").read_text()


def test_more_than_all_of_the_liquid_is_refused(tmp_path: Path, decks: Any) -> None:
    with pytest.raises(DembarkError, match="liquid_share_factor"):
        decks("liquid_exchange", "liggghts", tmp_path, {"liquid_share": "fraction", "liquid_share_factor": 1.5})
