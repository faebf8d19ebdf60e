"""single_contact compared with the curves of Chung and Ooi (2011): what agrees with them passes."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.single_contact.published_curves import with_published
from dembark.input_decks.tests.measuring import judged, module, names
from dembark.postproc.measurement import Measurement
from dembark.postproc.resampling import profile
from dembark.validation.case.folders import find

ENGINES = ("liggghts", pytest.param("yade", marks=pytest.mark.full))
single_contact = module("single_contact")
# Of each test in which a curve was published, those that the law does not follow; README.md says why.
DIFFERENT = {
    variant: {"published_tangential_restitution"} if variant == "test_4" else set()
    for variant in ("test_1", "test_2", "test_4", "test_5", "test_5_partial_slip", "test_6", "test_8_a", "test_8_b")}


@pytest.fixture(scope="module")
def verdicts(simulate: Any) -> Any:
    """A run at eight times the step of the variant compared with the published curves, by (variant, engine); each is done once."""
    @cache
    def get(variant: str, engine: str) -> dict[str, dict[str, Any]]:
        step = 8.0 * float(find("single_contact").variants[variant]["time_step"])
        found = judged("single_contact", single_contact.measure([simulate("single_contact", engine, {"time_step": step}, variant)]))
        return {name: one for name, one in found.items() if name.startswith(("published_", "finite_elements_"))}

    return get


def published(variant: str) -> set[str]:
    with single_contact.PUBLISHED.open(encoding="utf-8") as file:
        return {f"{row['method']}_{row['quantity']}" for row in csv.DictReader(file) if row["variant"] == variant}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("variant", DIFFERENT)
def test_every_published_curve_has_a_verdict(variant: str, engine: str, verdicts: Any) -> None:
    found = verdicts(variant, engine)
    assert found.keys() == published(variant)
    assert names(found, "fail") == DIFFERENT[variant], found


@pytest.mark.parametrize(("shift", "verdict"), [(0.0, "pass"), (0.05, "pass"), (0.2, "fail")])
def test_the_tolerance_is_that_of_the_declaration(shift: float, verdict: str, tmp_path: Path) -> None:
    """A run whose curve is the published one, but for a `shift`; 0.1 is allowed."""
    place = np.linspace(0.0, 2.0, 41)
    table = tmp_path / "published.csv"
    table.write_text("variant,quantity,material,method,x,y,x_uncertainty,y_uncertainty,left_out\n" +
                     "".join(f"test_6,recoil,a,published,{x:g},{2.0 * x:g},0.006,0.03\n" for x in (-1.0, 0.5, 1.0, 1.5)) +
                     "test_6,recoil,a,published,1.7,9,0.006,0.03,misprint\n")
    curve = profile("recoil_a", "Recoil", "v", "v after", place, [2.0 * place + shift])
    measured = with_published(Measurement({}, [curve]), table, "test_6", single_contact.LABELS)
    (name, one), = judged("single_contact", measured).items()
    assert (name, one["verdict"]) == ("published_recoil", verdict)
    assert "3 points, 1 left out" in one["detail"]  # that outside of the run's range does not count
    assert measured.profiles[1]["reference"][-1] == 9.0
    assert measured.profiles[1]["reference_high"][0] - measured.profiles[1]["reference"][0] == pytest.approx(np.hypot(0.03, 0.012))


def test_curves_that_a_run_does_not_have_are_left_out() -> None:
    """test_7 has none published; spheres of test_4 without friction have none of their own."""
    found = Measurement({}, [])
    for variant in ("test_7", "test_4"):
        assert with_published(found, single_contact.PUBLISHED, variant, single_contact.LABELS) == found
