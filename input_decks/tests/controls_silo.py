"""Wrong physics in a silo."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control, dried, judged, measured
from dembark.input_decks.tests.synthetic import silo, told
from dembark.input_decks.tests.test_silo_measures import SILO, filling, filling_points


def controls(folder: Path) -> Iterator[Control]:
    right = measured(silo(folder / "right", noise=0.01))
    for name, change in {"a wall ten times as smooth in its lower half": {"smooth": 0.1},
                         "a lost contact in each layer": {"lost_contacts": 1},
                         "a fiftieth of the wall's force lost": {"lost_wall_force": 0.02}}.items():
        yield Control(name, right, measured(silo(folder / name, noise=0.01, **change)))
    yield Control("gravity doubled", right, measured(told(silo(folder / "gravity", noise=0.01), gravity=2.0 * 9.81)))
    points = list(filling_points(2.1, half=0.01))
    for point in points:
        point["quantities"][-1] |= {"value": 4.2, "interval": [4.1, 4.3]}
    yield Control("a base that feels half as much as Janssen's law of the walls", filling(2.1, half=0.01)[0],
                  judged("silo", SILO.study("filling", points, "grain_count")))
    yield dried("silo")
