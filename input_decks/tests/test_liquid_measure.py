"""The rule of liquid_exchange against numbers worked out by hand, and verdicts on books that are right and wrong."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import defaults, judged, module, names
from dembark.physics.exact import liquid_row
from dembark.physics.exact.liquid_row import Books
from dembark.postproc.replica import Replica
from dembark.validation.case.folders import find

liquid_exchange = module("liquid_exchange")
VARIANTS = find("liquid_exchange").variants
STEPS = list(range(20, 8001, 20))
COLUMNS = "step,time,kinetic_energy,liquid_grains,liquid_bridges,liquid_walls,liquid_lost,bridge_count"


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


def replica(folder: Path, variant: str, spoil: str = "") -> Replica:
    p, books = values(variant), due(variant)
    grains = books.grains.copy()
    lost = np.zeros(len(STEPS))
    if spoil == "grain":
        grains[100, 2] *= 1.0 + 1e-9
    if spoil == "lost":
        lost += 1e-20
    table = np.column_stack([STEPS, np.array(STEPS) * p["time_step"], np.ones(len(STEPS)), grains.sum(axis=1), books.bridges, books.wall,
                             lost, books.count + (spoil == "count"), grains])
    np.savetxt(folder / "time.csv", table, delimiter=",", fmt="%.17g", comments="",
               header=COLUMNS + "".join(f",liquid_{k}" for k in range(1, 6)))
    return Replica(folder, {"parameters": p, "time_step": p["time_step"], "engine": "liggghts"})


@pytest.mark.parametrize("variant", VARIANTS)
def test_right_books_pass(tmp_path: Path, variant: str) -> None:
    measured = liquid_exchange.measure([replica(tmp_path, variant)])
    found = judged("liquid_exchange", measured)
    assert len(found) == 17 and names(found, "pass") == set(found)
    assert len(measured.profiles) == 6 and measured.remarks


@pytest.mark.parametrize(("spoil", "wrong"), [("grain", {"liquid_3_error", "total_liquid_error"}), ("lost", {"lost", "total_liquid_error"}),
                                              ("count", {"bridge_count_error"})])
def test_wrong_books_fail(tmp_path: Path, spoil: str, wrong: set[str]) -> None:
    found = judged("liquid_exchange", liquid_exchange.measure([replica(tmp_path, "cap", spoil)]))
    assert names(found, "fail") == wrong
