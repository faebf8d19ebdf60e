"""Wrong drives of a bed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_drive_power import rise_study, shaken, spoiled, step_study, verdicts


def controls(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a plate slower than prescribed", right, verdicts(shaken(told=2.6)))
    yield Control("a fiftieth of the plate's force lost", right, verdicts(spoiled(plate_work=0.98)))
    yield Control("a thirtieth of the damping that is not booked", right, verdicts(spoiled(normal_viscous=0.97)))
    yield Control("a gap of first order", step_study(2.0), step_study(1.0))
    yield Control("a rise with the square of the speed", rise_study(2, 1.4), rise_study(2, 2.0))
    yield Control("a rise with the square of the speed", rise_study(3, 1.0), rise_study(3, 2.0))
