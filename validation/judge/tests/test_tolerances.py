"""Tolerances are fixed before the run: nothing that a run shows, its noise above all, changes what it is allowed."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.input_decks.tests.test_log_measures import cradle_run, of_cradle, of_pair, pair_run
from dembark.input_decks.tests.test_single_contact_measure import flown, parameters, verdicts
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.statistics import Estimate, exact
from dembark.validation.case.folders import discover, find
from dembark.validation.judge import verdict


def noisy(run: Any) -> Any:
    """The same run with 1 % of noise on all that was measured after its first frame."""
    random = np.random.default_rng(1)

    def shaken(value: Any) -> Any:
        if not isinstance(value, np.ndarray):
            return value
        noise = 1.0 + 0.01 * random.standard_normal(value.shape)
        noise[:1] = 1.0
        return value * noise

    measured = {one.name: getattr(run, one.name) for one in fields(run) if one.name not in ("times", "masses", "radii")}
    return replace(run, **{name: {key: shaken(one) for key, one in value.items()} if name == "history" else shaken(value)
                           for name, value in measured.items()})


def tolerances(found: dict[str, dict[str, Any]]) -> dict[str, float | None]:
    return {name: one["tolerance"] for name, one in found.items()}


@pytest.mark.parametrize(("run", "judged"), [(pair_run, of_pair), (cradle_run, of_cradle)])
def test_bounds_of_logs_are_the_same_for_a_noisy_run(run: Any, judged: Any) -> None:
    one = run(time_step=1e-5)
    found, shaken = judged(one), judged(noisy(one))
    assert tolerances(found) == tolerances(shaken) and any(one["tolerance"] for one in found.values())
    assert {one["value"] for one in found.values()} != {one["value"] for one in shaken.values()}


@pytest.mark.parametrize("variant", ["test_1", "test_4"])
def test_bounds_of_single_contacts_are_the_same_for_a_noisy_run(variant: str) -> None:
    p = parameters(variant)
    p |= {"points": min(p["points"], 3), "time_step": 8.0 * p["time_step"]}
    flight = flown(p)
    shaken = replace(flight, forces=1.01 * flight.forces, after=replace(flight.after, normal=0.99 * flight.after.normal))
    assert tolerances(verdicts(p, flight)) == tolerances(verdicts(p, shaken))


def test_a_tolerance_from_the_run_s_own_interval_is_refused() -> None:
    """The negative control: a measurement that allows what its noise needs, under each of the names that it could take."""
    case = find("log_pair")
    noise = Estimate(1.3, 0.4, "5 replicas")
    with pytest.raises(DembarkError, match="quantity peak_force has a bound and an interval"):
        verdict.quantities(case, Measurement({"peak_force": Value(noise, exact(1.0), bound=noise.half)}))
    with pytest.raises(DembarkError, match='quantity momentum_error has a bound, its tolerance is not the word "bound"'):
        verdict.quantities(case, Measurement({"momentum_error": Value(noise, exact(0.0), bound=noise.half)}))


def test_declared_tolerances_are_numbers_with_a_reason() -> None:
    for case in discover().values():
        for one in case.quantities.values():
            if one.tolerance not in (None, "bound", 0.0):
                assert isinstance(one.tolerance, float) and math.isfinite(one.tolerance) and one.why, f"{case.name}: {one.name}"
