"""Wrong motions in a trough for finishing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.synthetic_bed import trough
from dembark.input_decks.tests.test_vibro_finishing import GRAIN, measured, sense_study, step_study


def controls(folder: Path) -> Iterator[Control]:
    folder.mkdir(exist_ok=True)
    run = trough(folder, noise=5e-5)
    right = measured(run, **GRAIN)
    yield Control("a hundredth of the damping that is not booked", right, measured(run, 0.99, **GRAIN))
    yield Control("a part that is held", right, measured(trough(folder, noise=5e-5, still=True), **GRAIN))
    yield Control("a bed that turns the same way whatever the drive", sense_study(), sense_study(0.01, 0.01, 0.01))
    yield Control("a bed that turns faster with every halving of the step",
                  step_study(0.01, 0.0101, 0.0102), step_study(0.01, 0.012, 0.014))
