"""The tables of docs/theory/time_steps.md are those of docs/figures/schemes.json, and the rule is that of the set-ups."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest
from blocks import ROOT

from benchmarks import schemes_tables
from dembark.input_decks.common.setup import rayleigh_time
from dembark.input_decks.common.vibration import impact

PAGE = (ROOT / "docs/theory/time_steps.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(("name", "rows"), schemes_tables.tables(json.loads(schemes_tables.FILE.read_text(encoding="utf-8"))).items())
def test_table(name: str, rows: list[str]) -> None:
    assert rows and "\n".join(rows) in PAGE, name


@pytest.mark.parametrize(("poisson", "speed"), [(0.3, 1.0), (0.2, 0.01)])
def test_an_impact_lasts_as_the_page_says(poisson: float, speed: float) -> None:
    p = SimpleNamespace(grain_diameter=5e-3, grain_diameter_spread=0.0, grain_density=2500.0, youngs_modulus=5e6, poisson_ratio=poisson)
    wave = (p.youngs_modulus / (2.0 * (1.0 + poisson)) / p.grain_density) ** 0.5
    assert impact(p, speed)[1] / rayleigh_time(p) == pytest.approx(schemes_tables.duration(poisson) * (wave / speed) ** 0.2, rel=1e-12)


def test_cost_between_two_points_and_where_there_is_none() -> None:
    rows = [{"cost": 10.0, "error": 1e-1}, {"cost": 100.0, "error": 1e-3}]
    assert schemes_tables.cost_of(rows, 1e-2) == pytest.approx(10.0**1.5)
    assert schemes_tables.cost_of(rows, 1e-4) == float("inf")
    assert schemes_tables.cost_of(rows, 1.0) == 10.0
