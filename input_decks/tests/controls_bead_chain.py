"""Wrong spheres in a row."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_bead_chain import study, verdicts


def controls(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("spheres a fiftieth too heavy", right, verdicts(heavier=1.02))
    yield Control("a contact that dissipates part of its energy", right, verdicts(lost=1e-3))
    yield Control("a spring of Hooke's law", study(1.0 / 6.0), study(0.0))
