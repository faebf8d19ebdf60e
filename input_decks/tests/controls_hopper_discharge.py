"""Wrong discharges of a bin."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control, judged
from dembark.input_decks.tests.test_hopper_discharge import hopper, points, verdicts


def controls(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a discharge an eighth slower", right, verdicts(faster=0.875))
    yield Control("steeper slopes remain", right, verdicts(left=0.2))
    right = judged("hopper_discharge", hopper.study("outlet", points(), "outlet_width"))
    for name, change in {"the discharge rate of a liquid": {"exponent": 1.0},
                         "grains as wide as a third of their diameter": {"k": 0.5}}.items():
        yield Control(name, right, judged("hopper_discharge", hopper.study("outlet", points(**change), "outlet_width")))
