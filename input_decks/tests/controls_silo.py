"""Wrong physics in a silo."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control, dried, measured
from dembark.input_decks.tests.synthetic import silo, told
from dembark.input_decks.tests.test_silo_measures import study


def controls(folder: Path) -> Iterator[Control]:
    right = measured(silo(folder / "right", noise=0.01))
    for name, change in {"an almost liquid: hardly any friction of the wall": {"friction": 0.005, "stated": 0.25},
                         "K of the contacts 20 % too high": {"inner": 1.2}, "K of the contacts 20 % too low": {"inner": 0.8},
                         "a wall ten times as smooth in its lower half": {"smooth": 0.1},
                         "a lost contact in each layer": {"lost_contacts": 1},
                         "a fiftieth of the wall's force lost": {"lost_wall_force": 0.02}}.items():
        yield Control(name, right, measured(silo(folder / name, noise=0.01, **change)))
    yield Control("gravity doubled", right, measured(told(silo(folder / "gravity", noise=0.01), gravity=2.0 * 9.81)))
    one_calibrates = study()[0]
    for name, change in {"other silos that are almost liquid": {"others": 1e-3},
                         "gravity doubled in other silos": {"heavier": 2.0}}.items():
        yield Control(name, one_calibrates, study(**change)[0])
    yield dried("silo")
