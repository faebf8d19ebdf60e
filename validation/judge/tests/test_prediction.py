"""Intervals of a prediction, and that what was fitted is no evidence."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from dembark.postproc.measurement import Measurement, Value, exact, number, profile
from dembark.postproc.statistics import Estimate
from dembark.validation.case.folders import find
from dembark.validation.judge import prediction
from dembark.validation.judge.result import QuantityRecord
from dembark.validation.judge.tally import tally

ANGLE = QuantityRecord("angle", 40.0, "pass", tolerance=2.0, reference=40.9, evidence="experiment", control="friction off", source="Drum")
BEND = replace(ANGLE, name="bend", reference=10.0)
OTHER = replace(ANGLE, name="angle_elsewhere", source="Another drum")
SUM = replace(ANGLE, name="sum", evidence="identity", source="Newton", reference=0.0)
FITTED: dict[str, Any] = {"case": "drum", "variant": "slow", "targets": {"angle": {"value": 40.9, "uncertainty": 1.0}},
                          "conditions": {"speed": 1.5, "seed": 3}}


def test_a_new_value_is_within_the_interval_as_often_as_it_says() -> None:
    random = np.random.default_rng(2)
    values = random.standard_normal((4000, 6))
    inside = [abs(row[5] - row[:5].mean()) <= prediction.half_width(list(row[:5])) for row in values]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.011)
    assert prediction.half_width([1.0]) == np.inf


def members(*values: float, reference: float | None = 1.0) -> list[Measurement]:
    place = np.array([0.0, 1.0])
    return [Measurement({"apparent_mass_ratio": number(one, reference)}, [profile("p", "", "x", "y", place, [one * place])])
            for one in values]


def test_intervals_are_those_of_the_members_not_of_their_mean() -> None:
    single = members(1.0, 1.1, 0.9, 1.05, 0.95)
    of_all = Measurement({"apparent_mass_ratio": Value(Estimate(1.0, 0.001, "5 replicas"), exact(1.0))}, single[0].profiles)
    found = prediction.over_members(find("silo"), of_all, single)
    value = found.values["apparent_mass_ratio"]
    assert value.estimate.half == pytest.approx(prediction.half_width([1.0, 1.1, 0.9, 1.05, 0.95])) and value.estimate.half > 0.2
    assert value.estimate.samples == (1.0, 1.1, 0.9, 1.05, 0.95) and "U_input = 0.24" in value.detail
    curve = found.profiles[0]
    assert curve["value"] == pytest.approx([0.0, 1.0]) and curve["high"][1] - 1.0 == pytest.approx(value.estimate.half)


def test_a_reference_that_follows_from_the_parameters_scatters_with_them() -> None:
    """What both share is in no deviation."""
    values = [1.0, 1.1, 0.9]
    single = [Measurement({"apparent_mass_ratio": number(2.0 * one, one)}) for one in values]
    value = prediction.over_members(find("silo"), single[0], single).values["apparent_mass_ratio"]
    assert value.reference is not None and value.reference.value == pytest.approx(1.0) and value.half is not None
    # Relative, and the differences are one in the mean.
    assert value.half == pytest.approx(prediction.half_width(values))


def test_what_some_members_lack_is_not_judged() -> None:
    single = [*members(1.0, 1.1), Measurement({})]
    found = prediction.over_members(find("silo"), single[0], single)
    assert found.values["apparent_mass_ratio"].reason == "1 of 3 members have no such value"


def standing(records: tuple[QuantityRecord, ...], parameters: dict[str, Any], variant: str = "fast", **changes: Any) -> dict[str, str]:
    return {one.name: one.standing for one in prediction.marked(records, "drum", variant, FITTED | changes, parameters)}


def test_a_fitted_quantity_that_agrees_is_no_pass() -> None:
    """The negative control: without the mark it would be one."""
    assert tally([ANGLE]).passed == 1
    found = tally(prediction.marked([ANGLE], "drum", "fast", FITTED, {"speed": 3.0}))
    assert (found.passed, found.open, found.checks, found.calibrated) == (0, 0, 0, 1)
    assert found.sentence == "no checks; 1 calibrated, not counted"
    # The same fact in another engine neither, nor one that could not be decided; a failure stays one.
    twice = [replace(ANGLE, family="angle"), replace(ANGLE, family="angle", verdict="info")]
    assert tally(prediction.marked(twice, "drum", "fast", FITTED, {})).calibrated == 1
    assert tally(prediction.marked([replace(ANGLE, verdict="fail")], "drum", "fast", FITTED, {})).failed == 1


def test_a_point_of_a_calibration_neither_passes_nor_fails() -> None:
    points = [replace(ANGLE, verdict=one) for one in ("pass", "fail", "info")]
    found = prediction.marked(points, "drum", "fast", FITTED | {"conditions": {}, "sampled": True}, {})
    assert [one.standing for one in found] == ["calibrated"] * 3 and found[1].reason == prediction.SAMPLED


def test_another_reference_is_evidence() -> None:
    """At another speed another angle was measured."""
    records = (replace(ANGLE, reference=37.6), BEND, OTHER, SUM)
    assert set(standing(records, {"speed": 1.0}).values()) == {"passed"}
    assert prediction.marked([ANGLE], "silo", "fast", FITTED, {}) == [ANGLE]


def test_what_else_was_seen_in_the_fitted_experiment_is_no_evidence() -> None:
    records = (ANGLE, BEND, OTHER, SUM)
    expected = {"angle": "calibrated", "bend": "calibrated", "angle_elsewhere": "passed", "sum": "passed"}
    assert standing(records, {"speed": 3.0}) == expected
    # The same conditions with another reference: a target of the user's.
    own = {"angle": {"value": 45.0, "uncertainty": 1.0}}
    assert standing(records, {"speed": 1.5, "seed": 9}, targets=own) == expected
    assert set(standing(records, {"speed": 3.0}, targets=own).values()) == {"passed"}
    # A step or a stiffness changed in the variant of the calibration makes no other experiment.
    assert standing(records, {"speed": 1.5, "step": 0.1}, "slow", targets=own) == expected
    # Of two targets one has no reference here.
    unknown = FITTED["targets"] | {"gone": {"value": 1.0, "uncertainty": 1.0}}
    assert standing((*records, replace(ANGLE, name="gone", reference=None)), {"speed": 3.0}, targets=unknown)["bend"] == "calibrated"
    # Two targets, of which one is elsewhere as well.
    both = FITTED["targets"] | {"bend": {"value": 20.0, "uncertainty": 1.0}}
    assert standing(records, {"speed": 3.0}, targets=both) == expected | {"bend": "passed"}


def test_a_fitted_curve_takes_the_experiment_with_it() -> None:
    curve = {"surface": {"at": [0.0, 1.0], "values": [0.0, 1.0], "uncertainties": [0.1, 0.1], "correlation": 0.0}}
    assert standing((ANGLE, OTHER, SUM), {"speed": 1.5}, targets=curve) == {"angle": "calibrated", "angle_elsewhere": "calibrated",
                                                                            "sum": "passed"}
    assert set(standing((ANGLE, SUM), {"speed": 3.0}, targets=curve).values()) == {"passed"}
