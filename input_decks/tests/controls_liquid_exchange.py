"""Wrong books of liquid that grains carry."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_liquid_measure import STEPS, Table, by_the_rule, of_run, replica, values


def dried(table: Table) -> None:
    """A share of the liquid of each grain goes over the run, and nobody books it."""
    kept = np.linspace(1.0, 1.0 - 1e-9, len(STEPS))
    for name in ("liquid_grains", *(f"liquid_{k}" for k in range(1, 6))):
        table[name] = table[name] * kept


def drained(table: Table) -> None:
    table["liquid_lost"] = table["liquid_lost"] + 1e-9 * table["liquid_grains"]


def twice(table: Table) -> None:
    table["liquid_grains"] = table["liquid_grains"] + table["liquid_1"]


def controls(folder: Path) -> Iterator[Control]:
    right = of_run(replica(folder / "right", "limited"))
    for name, spoil in {"liquid that dries up": dried, "liquid that drains": drained, "a grain that is counted twice": twice}.items():
        yield Control(name, right, of_run(replica(folder / name, "limited", spoil)))
    for name, change in {"paths half as wide": {"amplitude": 0.5 * values("limited")["amplitude"]},
                         "halves returned instead of what was taken": {"liquid_return": "equal"}}.items():
        wrong = by_the_rule(values("limited", **change), STEPS)
        yield Control(name, right, of_run(replica(folder / name, "limited", books=wrong)))
