"""Wrong books of a drum."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_drum_measure import drum, measured, replica


def controls(folder: Path) -> Iterator[Control]:
    # The files here hold no logs to draw.
    with patch.object(drum, "fields", lambda _: None):
        right = measured(replica(folder / "right"))
        for name, change in {"a step that is not solved": {"certificate": 2e-10}, "a hundredth of the energy that vanishes": {"leak": 0.01},
                             "a drum with a twelfth too much power": {"leak": 0.08}, "gravity 3 % too weak": {"lift": 0.97}}.items():
            yield Control(name, right, measured(replica(folder / name, **change)))
