"""Parameters that made synthetic targets are found again, and what cannot be known is said."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import qmc

from dembark.common.errors import DembarkError
from dembark.postproc.statistics import replica_mean
from dembark.validation.campaigns.expand import _sweeps, points
from dembark.validation.campaigns.report import calibration
from dembark.validation.campaigns.report.build import build
from dembark.validation.campaigns.report.posterior import posterior
from dembark.validation.campaigns.report.sweeps import sweeps
from dembark.validation.campaigns.spec import CampaignSpec, read
from dembark.validation.campaigns.targets import CurveTarget
from dembark.validation.case import folders
from dembark.validation.judge.result import QuantityRecord, Result, write
from dembark.validation.report.gather import Page

CAMPAIGN = """
[campaign]
name = "fit"
profile = "quick"
replicas = 5
[[sweeps]]
case = "silo"
variant = "sliding"
engines = ["liggghts"]
fixed = { grain_diameter = "6 mm" }
[sweeps.sample]
design = "sobol"
samples = 32
[sweeps.sample.parameters]
wall_friction = { min = 0.2, max = 0.8 }
youngs_modulus = { distribution = "loguniform", min = "5 MPa", max = "500 MPa" }
[sweeps.sample.targets]
apparent_mass_ratio = { value = 0.6, uncertainty = 0.02 }
stress_ratio_k = { value = 0.5, uncertainty = 0.02 }
"""
Place = np.ndarray
Model = Callable[[Place], tuple[float, float]]


def measured(folder: Path, model: Model, text: str = CAMPAIGN) -> tuple[CampaignSpec, dict, list[Result]]:
    """The campaign with results of `model`, whose packings scatter by 0.02."""
    (folder / "campaign.toml").write_text(text)
    spec, random, found = read(folder / "campaign.toml"), np.random.default_rng(3), []
    all_points = points(spec)
    for point in all_points:
        quantities = []
        for name, value in zip(("apparent_mass_ratio", "stress_ratio_k"), model(np.array(point.quantiles)), strict=True):
            estimate = replica_mean(list(value + 0.02 * random.standard_normal(5)))
            quantities.append(QuantityRecord(name, estimate.value, "info", interval=(estimate.value - estimate.half,
                                                                                     estimate.value + estimate.half), basis=estimate.basis))
        found.append(Result("silo", point.variant, "liggghts", tuple(quantities), parameters=dict(point.values), provenance={
            "commit": "a" * 40, "replicas": 5, "steps": 9, "time_step": 1.0, "wall_time": 2.0}))
    return spec, {"campaign": "fit", "sweeps": _sweeps(spec, all_points), "runs": []}, found


def fit(folder: Path, model: Model, text: str = CAMPAIGN, keep: int = 1000) -> calibration.Fit:
    spec, facts, found = measured(folder, model, text)
    pages = [Page(one.case, one.variant, Path(), results={one.engine: one}) for one in found[:keep]]
    (result,) = calibration.fits(sweeps(facts["sweeps"], pages, folders.discover())[0], spec.sweeps[0])
    return result


def test_what_two_targets_tell_of_two_parameters(tmp_path: Path) -> None:
    found = fit(tmp_path, lambda x: (0.2 + 0.8 * x[0], x[1]))
    friction, modulus = found.parameters
    # Half of the range of one, the geometric mean of that of the other.
    assert friction.low < 0.5 < friction.high and friction.high - friction.low < 0.1
    assert modulus.low < 5e7 < modulus.high < 5e7 * 1.5
    assert found.words == ["Identified: wall friction, youngs modulus.", "The posterior predictive 95 % intervals contain 2 of 2 targets.",
                           "Cost: 32 points, 160 runs."]
    assert found.best_run.startswith("sliding_wall_friction=0.") and all(one.predicted > 0.99 for one in found.targets)
    # The posterior has the uncertainty of the target once, a repeated measurement once more.
    for one in found.targets:
        assert one.high - one.low == pytest.approx(2 * 1.96 * np.sqrt(2.0) * one.uncertainty, rel=0.1)


def test_a_parameter_without_effect_is_not_identified(tmp_path: Path) -> None:
    found = fit(tmp_path, lambda x: (0.2 + 0.8 * x[0], x[0]))
    assert found.words[:2] == ["Identified: wall friction.", "Not identified: youngs modulus."]


def test_what_acts_in_the_same_way_is_known_in_combination_only(tmp_path: Path) -> None:
    found = fit(tmp_path, lambda x: (0.1 + 0.5 * (x[0] + x[1]), 0.5 * (x[0] + x[1])))
    assert any("Only a combination of wall friction and youngs modulus is known" in line for line in found.words)
    assert found.combined[0][2] < -0.8


def test_a_target_out_of_reach_is_said(tmp_path: Path) -> None:
    found = fit(tmp_path, lambda x: (0.1 * x[0], x[1]))
    assert "No parameters within the ranges reach the target of apparent mass ratio." in found.words
    assert "The posterior predictive 95 % intervals contain 1 of 2 targets." in found.words


def test_too_few_points_and_a_constant_are_not_fitted(tmp_path: Path) -> None:
    assert fit(tmp_path, lambda x: (x[0], x[1]), keep=9).why == "9 points with all targets were measured, 10 are needed"


def test_a_fit_keeps_the_conditions_of_the_case(tmp_path: Path) -> None:
    """The kinetic friction may not exceed the static one; without this the target would be reached beyond."""
    text = CAMPAIGN.replace("wall_friction =", "static_friction =").replace(
        'youngs_modulus = { distribution = "loguniform", min = "5 MPa", max = "500 MPa" }', "kinetic_friction = { min = 0.2, max = 0.8 }")
    text = text.replace("stress_ratio_k = { value = 0.5, uncertainty = 0.02 }", "")
    found = fit(tmp_path, lambda x: (0.4 + x[1] - x[0], 0.5), text)
    assert found.values is not None and (found.values[:, 1] <= found.values[:, 0] + 1e-12).all()


def lines(slope: float, level: float) -> np.ndarray:
    """A curve at the places of CURVE."""
    return level + slope * PLACES + 0.3 * slope * PLACES**2


PLACES = np.linspace(-1.0, 1.0, 21)


def test_a_curve_is_fitted_as_few_numbers() -> None:
    """Of curves that two parameters make, two components are fitted; the distance of the target from what they express is left."""
    random = np.random.default_rng(1)
    truth = lines(0.4, 0.7)
    target = CurveTarget(tuple(PLACES), tuple(truth), (0.05,) * 21, 0.3, Path("own.csv"))
    places = qmc.Sobol(2, seed=1).random(32)
    measured = [{"place": list(PLACES), "value": list(lines(*place) + 0.01 * random.standard_normal(21))} for place in places]
    outputs, distance = calibration.of_curve("surface", target, places, measured)
    assert [one.name for one in outputs] == ["surface, component 1", "surface, component 2"]
    assert distance(np.array([one.target for one in outputs])) < 0.2 < distance(np.zeros(2))
    found = posterior(places, outputs)
    low, high = np.quantile(found.quantiles, [0.025, 0.975], axis=0)
    assert low[0] < 0.4 < high[0] and low[1] < 0.7 < high[1] and (high - low).max() < 0.4
    # Independent errors say more than correlated ones.
    free = posterior(places, calibration.of_curve("surface", replace(target, correlation=0.0), places, measured)[0])
    assert free.quantiles.std(axis=0)[1] < 0.7 * found.quantiles.std(axis=0)[1]
    wavy = replace(target, values=tuple(truth + 0.2 * np.sin(9.0 * PLACES)))
    outputs, distance = calibration.of_curve("surface", wavy, places, measured)
    assert distance(np.array([one.target for one in outputs])) > 2.5


def test_a_curve_as_target(tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text("x,y\n" + "".join(f"{x},{y}\n" for x, y in zip(PLACES, lines(0.4, 0.7), strict=True)))
    targets = CAMPAIGN[CAMPAIGN.index("apparent_mass_ratio"):]
    text = CAMPAIGN.replace(targets, 'surface = { file = "own.csv", at = "x", value = "y", uncertainty = 0.03, correlation = 0.2 }\n')
    spec, facts, found = measured(tmp_path, lambda x: (x[0], x[1]), text)

    def fitted(name: str = "surface", width: float = 1.0, short: int = 0, empty: int = 0) -> calibration.Fit:
        """`short`: how many points have half of this `width`; `empty`: how many have no value at the last place."""
        pages = []
        for number, (one, point) in enumerate(zip(found, points(spec), strict=True)):
            place, value = width * (0.5 if number < short else 1.0) * PLACES, list(lines(*point.quantiles))
            curve = {"name": name, "place": list(place), "value": [*value[:-1], None if number < empty else value[-1]]}
            pages.append(Page(one.case, one.variant, Path(), results={one.engine: replace(one, profiles=(curve,))}))
        return calibration.fits(sweeps(facts["sweeps"], pages, folders.discover())[0], spec.sweeps[0])[0]

    right = fitted()
    assert right.parameters[0].low < 0.2 + 0.6 * 0.4 < right.parameters[0].high
    assert right.curves[0][1] < 0.5 and "standard uncertainties" in right.words[-2] and "reach" not in right.words[-2]
    assert fitted("outline").why == "the case measures no curve surface, but outline"
    assert "reaches from -1 to 1, what is measured at all points from -0.5 to 0.5" in fitted(width=0.5).why
    # One point is enough: its curve would go on with its last value.
    assert "what is measured at all points from -0.5 to 0.5" in fitted(short=1).why
    assert "what is measured at all points from -1 to 0.9" in fitted(empty=1).why


def test_the_report_has_the_fit_and_its_files(tmp_path: Path) -> None:
    spec, facts, found = measured(tmp_path, lambda x: (0.2 + 0.8 * x[0], x[1]))
    for one in found:
        place = tmp_path / one.case / one.variant / one.engine
        place.mkdir(parents=True)
        write(place / "metrics.json", one)
    (tmp_path / "plan.json").write_text(json.dumps(facts))
    text = build(tmp_path).read_text(encoding="utf-8")
    assert "Identified: wall friction, youngs modulus." in text and (tmp_path / "figures/silo-1-posterior-sliding-liggghts.svg").is_file()
    place = tmp_path / "calibration/silo-1/sliding/liggghts"
    table = pd.read_csv(place / "posterior.csv")
    assert list(table) == ["wall_friction", "youngs_modulus", "log_density"] and 0.45 < table["wall_friction"].median() < 0.55
    fitted = tomllib.loads((place / "fitted.toml").read_text())
    (point,) = points(read(place / "fitted.toml"))
    assert point.values == fitted["sweeps"][0]["list"][0] and 0.45 < point.values["wall_friction"] < 0.55
    assert point.resolved["grain_diameter"] == spec.sweeps[0].fixed["grain_diameter"] and point.resolved["replicas"] == 5
    # Other targets than those of the plan are not reported as its own.
    kept = facts["sweeps"][0]["sample"]["targets"]
    kept[next(iter(kept))]["value"] += 1.0
    (tmp_path / "plan.json").write_text(json.dumps(facts))
    with pytest.raises(DembarkError, match=r"began with other targets, sweeps 1: .* was .*, now"):
        build(tmp_path)
