"""Wrong adhesion."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_adhesive_impact import verdicts


def controls(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("work of adhesion a fifth larger", right, verdicts(work=1.2))
    yield Control("half the modulus", right, verdicts(modulus=0.5))
    yield Control("spheres half as fast", right, verdicts(pace=0.5))
