"""Wrong physics in heaps of known slopes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_heaps import factor, heap, rolling


def controls(folder: Path) -> Iterator[Control]:
    yield Control("friction off", heap(folder / "right", 28.5), heap(folder / "smooth", 2.0))
    yield Control("rolling resistance off", heap(folder / "resisting", 28.5), heap(folder / "rolling", 17.0))
    yield Control("front and rear walls without friction", factor(1.49), factor(1.0))
    yield Control("rolling resistance without effect on the angle", rolling(0.4), rolling(0.0))
