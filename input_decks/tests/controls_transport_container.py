"""Wrong forces, energies and slopes of a container."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_transport_container import onset, pulses, verdicts


def controls(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a hundredth of the damping that is not tallied", right, verdicts(lost=0.01))
    yield Control("a wall's contact that is not counted", right, verdicts(missed=0.01))
    yield Control("a bed that resonates with a slow pulse", pulses(1.0), pulses(1.2))
    yield Control("a bed that begins to slide at half the slope", onset(0.4), onset(0.2))
