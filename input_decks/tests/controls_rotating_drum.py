"""Wrong flows in a rotating drum."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_rotating_drum import verdicts


def controls(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a layer that slides as a plug", right, verdicts(power=0.2))
    yield Control("a wall that slips", right, verdicts(carried=0.85))
    yield Control("grains that vanish at the toe", verdicts(speed=0.41, variant="other"), verdicts(speed=0.25, variant="other"))
    right = verdicts(angle=26.1, variant="sunday_smooth")
    yield Control("grains carried over the top at a low speed", right, verdicts(ring=True, variant="sunday_smooth"))
    yield Control("grains that fall back at a high speed", verdicts(ring=True, variant="sunday_15"), verdicts(variant="sunday_15"))
