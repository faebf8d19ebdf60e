"""The decks of liquid_exchange: books that are the reference's in all engines, also after a restart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import judged, module, names
from dembark.validation.case.folders import find

ENGINES = ("liggghts", "yade")
SHORT = {"duration": 0.2, "rows": 200}


@pytest.mark.parametrize("engine", find("liquid_exchange").engines)
@pytest.mark.parametrize("variant", ["cap", "limited"])
def test_books_are_those_of_the_rule(engine: str, variant: str, simulate: Any) -> None:
    run = simulate("liquid_exchange", engine, {"duration": 0.2, "rows": 200}, variant)
    found = judged("liquid_exchange", module("liquid_exchange").measure([run]))
    assert names(found, "pass") == set(found), found
    times = run.times()
    assert len(times["step"]) == 200 and np.abs(np.diff(times["bridge_count"])).sum() > 5
