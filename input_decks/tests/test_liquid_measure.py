"""The rule of liquid_exchange against numbers worked out by hand, and verdicts on books that are right and wrong."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.common.liquid import liquid_values
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.physics.exact import liquid_row
from dembark.physics.exact.liquid_row import Books
from dembark.postproc.replica import Replica
from dembark.postproc.tests.dumps import write_times
from dembark.validation.case.folders import find

liquid_exchange = module("liquid_exchange")
VARIANTS = find("liquid_exchange").variants
STEPS = list(range(20, 8001, 20))


def values(variant: str, **changes: Any) -> dict[str, Any]:
    return defaults("liquid_exchange") | VARIANTS[variant] | changes


def by_the_rule(p: dict[str, Any], steps: list[int]) -> Books:
    return liquid_row.books(*liquid_exchange.case(p), p["time_step"], steps)


@cache
def due(variant: str) -> Books:
    return by_the_rule(values(variant), STEPS)


@pytest.mark.parametrize("variant", VARIANTS)
def test_reference_keeps_all_liquid_and_is_busy(variant: str) -> None:
    books = due(variant)
    assert np.abs(books.total / books.total[0] - 1.0).max() < 1e-14
    assert books.grains.min() >= 0.0
    assert np.abs(np.diff(books.count)).sum() > 40
    assert books.count.min() == 0 and books.count.max() >= 4


def test_first_bridge_by_hand() -> None:
    """Grain 4 (0.8 d) meets grain 3 (1.2 d) first: sin = 0.6, so the facing cap is half of 1 - 0.8 of it."""
    p, books = values("cap"), due("cap")
    first = int(np.argmax(books.count > 0))
    fourth = p["liquid_content"] * math.pi / 6.0 * (0.8 * p["grain_diameter"]) ** 3
    assert books.count[first] == 1.0
    assert books.bridges[first] == pytest.approx(0.1 * fourth, rel=1e-12)
    assert books.grains[first, 3] == pytest.approx(0.9 * fourth, rel=1e-12)


def test_what_is_asked_at_once_is_shared() -> None:
    """All overlap in the first step: both wet grains give all they have, halves to each side, and the wall its share."""
    p = values("all_of_it", gap=-0.01, time_step=1e-9)
    books = by_the_rule(p, [1])
    first, fourth = (p["liquid_content"] * math.pi / 6.0 * (size * p["grain_diameter"]) ** 3 for size in (1.0, 0.8))
    assert books.count[0] == 4.0  # of six; two dry sides make none
    assert books.grains[0].sum() == pytest.approx(0.0, abs=1e-24)
    assert books.wall[0] == pytest.approx(0.8 * p["wall_liquid"], rel=1e-12)
    assert books.bridges[0] == pytest.approx(first + fourth + 0.2 * p["wall_liquid"], rel=1e-12)


Table = dict[str, Any]


def replica(folder: Path, variant: str, spoil: Callable[[Table], None] = lambda _: None, books: Books | None = None) -> Replica:
    """A run with the `books`, those of the rule when left out; `spoil` changes columns of time.csv."""
    folder.mkdir(exist_ok=True)
    p, books, steps = values(variant), books or due(variant), np.array(STEPS)
    table: Table = {"step": steps, "time": steps * p["time_step"], "kinetic_energy": np.ones(len(steps)),
                    "liquid_grains": books.grains.sum(axis=1), "liquid_bridges": books.bridges, "liquid_walls": books.wall,
                    "liquid_lost": np.zeros(len(steps)), "bridge_count": books.count,
                    **{f"liquid_{k + 1}": column for k, column in enumerate(books.grains.T)}}
    spoil(table)
    write_times(folder / "time.csv", table)
    return Replica(folder, {"parameters": p, "time_step": p["time_step"], "engine": "liggghts"})


def of_run(run: Replica) -> dict[str, dict[str, Any]]:
    return judged("liquid_exchange", liquid_exchange.measure([run]))


@pytest.mark.parametrize("variant", VARIANTS)
def test_right_books_pass(tmp_path: Path, variant: str) -> None:
    measured = liquid_exchange.measure([replica(tmp_path, variant)])
    found = judged("liquid_exchange", measured)
    assert len(found) == 17 and names(found, "pass") == set(found)
    assert len(measured.profiles) == 6 and measured.remarks


def test_a_bridge_too_many_fails_the_count_alone(tmp_path: Path) -> None:
    assert names(of_run(replica(tmp_path, "cap", lambda table: table.update(bridge_count=table["bridge_count"] + 1))), "fail") == {
        "bridge_count_error"}


def dried(table: Table) -> None:
    """A share of the liquid of each grain goes over the run, and nobody books it."""
    kept = np.linspace(1.0, 1.0 - 1e-9, len(STEPS))
    for name in ("liquid_grains", *(f"liquid_{k}" for k in range(1, 6))):
        table[name] = table[name] * kept


def drained(table: Table) -> None:
    table["liquid_lost"] = table["liquid_lost"] + 1e-9 * table["liquid_grains"]


def twice(table: Table) -> None:
    table["liquid_grains"] = table["liquid_grains"] + table["liquid_1"]


def test_carried_liquid_of_any_case(tmp_path: Path) -> None:
    steps = np.arange(1, 401)
    bridges = 0.3 + 0.01 * np.sin(steps)
    for drift, conserved in ((0.0, True), (1e-11, False)):
        write_times(tmp_path / "time.csv", {
            "step": steps, "time": 1e-3 * steps, "kinetic_energy": 0.0 * steps, "liquid_grains": 0.7 - bridges + drift * steps,
            "liquid_bridges": bridges, "liquid_walls": 0.0 * steps + 0.25, "liquid_lost": 0.0 * steps + 0.05,
            "bridge_count": 300 + steps % 3})
        found = liquid_values([Replica(tmp_path, {"parameters": {"liquid_content": 0.01, "grain_count": 100}})])
        assert (found["liquid_total"].estimate.value < 1e-12) == conserved
        assert found["bridge_count"].estimate.value == pytest.approx(3.01, abs=0.01)
        assert found["liquid_in_bridges"].estimate.value == pytest.approx(0.3, abs=0.002)
    assert liquid_values([Replica(tmp_path, {"parameters": {"liquid_content": 0.0}})]) == {}


def controls_liquid_exchange(folder: Path) -> Iterator[Control]:
    right = of_run(replica(folder / "right", "limited"))
    for name, spoil in {"liquid that dries up": dried, "liquid that drains": drained, "a grain that is counted twice": twice}.items():
        yield Control(name, right, of_run(replica(folder / name, "limited", spoil)))
    for name, change in {"paths half as wide": {"amplitude": 0.5 * values("limited")["amplitude"]},
                         "halves returned instead of what was taken": {"liquid_return": "equal"}}.items():
        wrong = by_the_rule(values("limited", **change), STEPS)
        yield Control(name, right, of_run(replica(folder / name, "limited", books=wrong)))
