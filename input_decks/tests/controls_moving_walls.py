"""Walls that are not where, or not as fast, as prescribed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_moving_walls import bed, bounce, shaken, strip, vessels


def controls(_folder: Path) -> Iterator[Control]:
    yield Control("a plate that starts a step late", shaken(), shaken(late=1e-4))
    yield Control("a contact that uses the velocity of the middle of the plate", strip(), strip(arm=0.0))
    yield Control("a contact that is not counted", bed(), bed(missed=0.01))
    yield Control("a vessel whose walls do not transfer their velocity", vessels(), vessels(speed=0.1, push=0.1))
    yield Control("a plate with another phase", bounce(), bounce(phase=0.3))
