"""Wrong physics in a plane silo."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control, measured
from dembark.input_decks.tests.synthetic import told
from dembark.input_decks.tests.synthetic_slabs import plane_silo


def controls(folder: Path) -> Iterator[Control]:
    right = measured(plane_silo(folder / "right", noise=0.01))
    for name, change in {"an almost liquid: hardly any friction of the wall": {"friction": 0.004, "stated": 0.2},
                         "a wall ten times as smooth in its lower half": {"smooth": 0.1},
                         "a lost contact in each layer": {"lost_contacts": 1},
                         "a fiftieth of the wall's force lost": {"lost_wall_force": 0.02}}.items():
        yield Control(name, right, measured(plane_silo(folder / name, noise=0.01, **change)))
    yield Control("gravity doubled", right, measured(told(plane_silo(folder / "gravity", noise=0.01), gravity=2.0 * 9.81)))
    # A column deep enough to feel K.
    deep = measured(plane_silo(folder / "deep", noise=0.01, friction=0.5))
    for name, inner in (("K of the contacts 20 % too high", 1.2), ("K of the contacts 20 % too low", 0.8)):
        yield Control(name, deep, measured(plane_silo(folder / name, noise=0.01, friction=0.5, inner=inner)))
