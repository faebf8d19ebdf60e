"""Wrong physics in what columns of three widths leave, carried on to those of the experiments."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control, Verdicts
from dembark.input_decks.tests.test_heaps import beads, exponents


def controls(_folder: Path) -> Iterator[Control]:
    right = beads(2.0, 3.6, 1.13)
    yield Control("a column that spreads almost like a fluid", right, beads(2.0, 12.0, 0.4))
    yield Control("a column that only slumps", right, beads(2.0, 1.5, 1.7))

    def both(low: float, high: float) -> Verdicts:
        return exponents("low", low) | exponents("high", high)

    yield Control("run-out that grows as the square root of the height, and a height that does not grow", both(1.0, 0.37), both(0.5, 0.0))
