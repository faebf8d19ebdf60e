"""Which parameters matter, on functions whose effects are known: a linear one with noise, and that of Ishigami."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dembark.postproc.statistics import replica_mean
from dembark.validation.campaigns.report import figures
from dembark.validation.campaigns.report.build import build
from dembark.validation.campaigns.report.sensitivity import Sensitivity, negligible_everywhere, sensitivities, write_csv
from dembark.validation.campaigns.report.sweeps import Sweep, sweeps
from dembark.validation.campaigns.sampling import Sample, Variable
from dembark.validation.case import folders
from dembark.validation.case.model import Parameter
from dembark.validation.judge.result import QuantityRecord, Result, write
from dembark.validation.report.gather import Page

NAMES = ("wall_friction", "youngs_modulus", "grain_diameter")
Model = Callable[[Sequence[float]], float]


def linear(x: Sequence[float]) -> float:
    """Elementary effects 3, 1, 0 and Sobol indices 0.9, 0.1, 0."""
    return 1.0 + 3.0 * x[0] + x[1]


def ishigami(x: Sequence[float]) -> float:
    """T. Ishigami, T. Homma, Proc. ISUMA (IEEE, 1990) 398, with a = 7 and b = 0.1."""
    a, b, c = ((2.0 * one - 1.0) * math.pi for one in x)
    return math.sin(a) + 7.0 * math.sin(b) ** 2 + 0.1 * c**4 * math.sin(a)


def results(design: str, samples: int, model: Model, seed: int = 1, noise: float = 0.0,
            packings: int = 0) -> tuple[dict[str, Any], list[Result]]:
    """The facts of a sampled sweep, and its results: quantity y, with the scatter `noise` of each of `packings`, and a constant."""
    ranges = {name: Variable(Parameter(name, "", 1.0), "uniform", {"min": 0.0, "max": 1.0}) for name in NAMES}
    sample = Sample(design, samples, ranges, seed)
    drawn, random = sample.draw(lambda row: ""), np.random.default_rng(seed)
    points, found = [], []
    for number, (row, place) in enumerate(zip(drawn.rows, drawn.quantiles, strict=True)):
        estimate = replica_mean(list(model(place) + noise * random.standard_normal(packings))) if packings else None
        y = QuantityRecord("y", estimate.value if estimate else model(place), "info", "force", "N",
                           (estimate.value - estimate.half, estimate.value + estimate.half) if estimate else None,
                           estimate.basis if estimate else "")
        points.append({"variant": f"v{number}", "base": "dry", "values": row, "changes": row, "quantiles": place})
        found.append(Result("silo", f"v{number}", "yade", (y, QuantityRecord("grains", 5.0, "info")), parameters=row,
                            provenance={"commit": "a" * 40, "replicas": max(1, packings), "steps": 9, "time_step": 1.0, "wall_time": 2.0}))
    return {"case": "silo", "axes": list(NAMES), "points": points, "sample": sample.facts() | {"left_out": 0}}, found


def sweep(facts: dict[str, Any], found: Sequence[Result], missing: Collection[int] = ()) -> Sweep:
    pages = [Page(one.case, one.variant, Path(), results={one.engine: one}) for number, one in enumerate(found) if number not in missing]
    return sweeps([facts], pages, folders.discover())[0]


def effects(design: str, samples: int, model: Model, missing: Collection[int] = (), **more: Any) -> Sensitivity:
    one = sweep(*results(design, samples, model, **more), missing)
    return sensitivities(one, [quantity for quantity in one.quantities() if quantity.name == "y"])[0]


def test_elementary_effects_of_a_linear_function_are_its_slopes() -> None:
    found = effects("morris", 10, linear)
    assert [one.index for one in found.effects] == pytest.approx([3.0, 1.0, 0.0], abs=1e-12)
    assert [one.other for one in found.effects] == pytest.approx([0.0] * 3, abs=1e-12)
    assert (found.limit, found.used, found.incomplete, found.noise) == (pytest.approx(0.3), 10, 0, None)
    assert found.named("matters") == "wall friction, youngs modulus" and found.named("negligible") == "grain diameter"


def test_indices_of_ishigami_are_within_their_intervals() -> None:
    found = effects("saltelli", 512, ishigami)
    for one, total, first in zip(found.effects, (0.5576, 0.4424, 0.2437), (0.3139, 0.4424, 0.0), strict=True):
        assert abs(one.index - total) < one.half < 0.15 and abs(one.other - first) < one.other_half < 0.15
    assert found.named("matters").split(", ")[0] == "wall friction" and not found.named("negligible")


@pytest.mark.parametrize(("design", "samples"), [("morris", 10), ("saltelli", 64)])
@pytest.mark.parametrize("noise", [0.1, 0.5])
def test_words_are_right_in_spite_of_the_scatter_of_packings(design: str, samples: int, noise: float) -> None:
    """What matters is never called negligible, and what does not matter hardly ever the contrary."""
    said: Counter[tuple[str, str]] = Counter()
    for seed in range(40):
        found = effects(design, samples, linear, seed=seed, noise=noise, packings=5)
        said.update((one.parameter, one.standing) for one in found.effects)
    assert said["wall_friction", "matters"] == said["youngs_modulus", "matters"] == 40
    assert said["grain_diameter", "matters"] <= 4
    assert said["grain_diameter", "negligible"] == 40 if noise < 0.2 else said["grain_diameter", "undecided"] > 30
    # Of the last one: noise / sqrt(5) is the scatter of a mean, the step of a trajectory 2/3; the variance of the function is 10/12.
    scatter = noise / math.sqrt(5.0)
    due = 3.0 * scatter / math.sqrt(math.pi) if design == "morris" else scatter**2 / (10.0 / 12.0 + scatter**2)
    assert found.noise == pytest.approx(due, rel=0.25)


def test_groups_with_a_point_that_was_not_measured_are_left_out() -> None:
    found = effects("saltelli", 64, linear, missing=(3, 4, 200))
    assert (found.used, found.incomplete) == (62, 2) and found.named("negligible") == "grain diameter"
    few = effects("morris", 10, linear, missing=(7,))
    assert not few.effects and few.why == "only 9 complete groups of points, 10 are needed"


def test_what_does_not_vary_and_other_designs_are_not_analysed(tmp_path: Path) -> None:
    one = sweep(*results("morris", 10, linear))
    y, grains = sensitivities(one, one.quantities())
    assert y.effects and grains.why == "it is the same at all points"
    assert negligible_everywhere([y, grains]) == ["grain_diameter"] and negligible_everywhere([grains]) == []
    assert sensitivities(sweep(*results("sobol", 64, linear)), one.quantities()) == []
    write_csv(tmp_path / "s.csv", [y, grains])
    table = pd.read_csv(tmp_path / "s.csv")
    assert list(table["parameter"]) == list(NAMES) and list(table["mu_star"]) == pytest.approx([3.0, 1.0, 0.0], abs=1e-12)


def test_figures_of_a_sample_have_a_panel_for_each_parameter_or_quantity() -> None:
    one = sweep(*results("morris", 10, linear, packings=3, noise=0.1))
    points = figures.sample_figure(one, one.quantities())
    assert points is not None and [axes.get_xlabel() for axes in points.axes[:3]] == ["wall friction", "youngs modulus / Pa",
                                                                                       "grain diameter / m"]
    bars = figures.sensitivity_figure(sensitivities(one, one.quantities()), 9)
    assert bars is not None and len(bars.axes) == 1 and bars.axes[0].get_xlabel() == "μ*, N"
    assert [text.get_text() for text in bars.axes[0].get_yticklabels()] == ["wall friction", "youngs modulus", "grain diameter"]
    assert figures.study_figure(one, one.quantities()) is None and figures.map_axes(one) is None
    assert figures.sample_figure(sweep({"case": "silo", "axes": ["gravity"], "points": []}, []), one.quantities()) is None


@pytest.mark.parametrize(("design", "said"), [("morris", "These do not matter for any quantity: grain diameter."),
                                              ("sobol", "Design: sobol")])
def test_the_report_says_what_does_not_matter(tmp_path: Path, design: str, said: str) -> None:
    facts, found = results(design, 10, linear, noise=0.1, packings=4)
    facts["sample"]["left_out"] = 7
    for one in found:
        place = tmp_path / one.case / one.variant / one.engine
        place.mkdir(parents=True)
        write(place / "metrics.json", one)
    (tmp_path / "plan.json").write_text(json.dumps({"campaign": "test", "sweeps": [facts], "runs": []}))
    text = build(tmp_path).read_text(encoding="utf-8")
    assert said in text and "7 points that break a condition of the case are left out" in text
    assert (tmp_path / "figures/silo-1-sample.svg").is_file()
    assert (tmp_path / "figures/silo-1-sensitivity.csv").is_file() == (design == "morris")
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")
