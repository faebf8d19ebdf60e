"""The guide's table is that of the measured data, and what it concludes from them is in them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from benchmarks import drum_penalty

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "docs/figures/drum_penalty.json"


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    return json.loads(DATA.read_text(encoding="utf-8"))


def test_table_is_that_of_the_data(found: dict[str, Any]) -> None:
    page = (ROOT / "docs/how-to/log_impact_guide.md").read_text(encoding="utf-8")
    assert page.split("<!-- drum_penalty.py -->\n")[1].split("\n<!-- end -->")[0] == drum_penalty.markdown(found)


def test_largest_steps_and_costs_of_many_logs_are_those_of_the_data(found: dict[str, Any]) -> None:
    page = (ROOT / "docs/how-to/log_impact_guide.md").read_text(encoding="utf-8")
    found = dict(found)
    drum_penalty.conclude(found)
    assert found["usable_many"] == {"theta 1": {"motion": 8.0, "forces": 0.2}, "theta 0.5": {"motion": 4.0, "forces": 1.0},
                                    "penalty": {"motion": 1.0, "forces": 1.0}, "theta 1 sweeps 5": {"motion": 16.0, "forces": None}}
    cost = {(one["law"], one["turn"]): one.get("cost") for one in found["many"] if one["stiffer"] == 1.0}
    assert f"{cost['theta 1', 8.0]:.2f} and {cost['penalty', 1.0]:.2f} s for 1000" in " ".join(page.split())


def test_data_of_the_pair_are_those_of_the_code(found: dict[str, Any]) -> None:
    for entry in found["pair"][::7]:
        wanted = pytest.approx((entry["mean"], entry["half_range"]), rel=1e-9, abs=1e-12)
        assert drum_penalty.restitution(entry["turn"], entry["law"]) == wanted


def test_no_run_with_theta_1_gained_energy(found: dict[str, Any]) -> None:
    assert all(entry["change"] < 0.0 for entry in found["closed"] if entry["law"] == "theta 1")


def test_energy_error_without_numerical_loss_is_of_second_order(found: dict[str, Any]) -> None:
    for law in ("theta 0.5", "penalty"):
        small, large = (next(one["error"] for one in found["closed"] if one["law"] == law and one["turn"] == turn) for turn in (0.05, 0.5))
        assert 1.5 < math.log10(large / small) < 2.5


def test_penalty_law_ends_where_the_fix_goes_on(found: dict[str, Any]) -> None:
    moment = {(one["law"], one["turn"]): one.get("moment", [math.nan])[0] for one in found["turning"]}
    reference = moment["theta 0.5", 0.1]
    assert math.isnan(moment["penalty", 4.0]) or abs(moment["penalty", 4.0] / reference - 1.0) > 0.2
    for turn in (4.0, 8.0, 16.0):
        assert moment["theta 1", turn] == pytest.approx(reference, rel=0.1)


def test_penalty_law_is_cheaper_where_impacts_are_resolved(found: dict[str, Any]) -> None:
    cost = {(one["law"], one["turn"]): one.get("cost") for one in found["turning"]}
    assert all(1.5 < cost["theta 0.5", turn] / cost["penalty", turn] < 10.0 for turn in (0.1, 0.2, 0.5))
