"""Wrong runs of hardening."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_vibro_hardening import amplitude_study, measured, step_study


def controls(folder: Path) -> Iterator[Control]:
    folder.mkdir(exist_ok=True)
    right = measured(folder / "right")
    yield Control("a hundredth of the damping that is not booked", right, measured(folder / "booked", 0.99))
    yield Control("a tenth of the touches lost", right, measured(folder / "lost", lost=6))
    yield Control("a bed that is calmer at 10 mm than at 2 mm", amplitude_study(1.0, 3.0), amplitude_study(1.0, 0.8))
    yield Control("impacts that grow with every halving of the step", step_study(0.01, 0.0101, 0.0102), step_study(0.01, 0.012, 0.014))
