"""What a campaign will cost: numbers of particles and steps are those of the decks."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest
from harness import decks, stand_in  # noqa: F401

from dembark.common.errors import DembarkError
from dembark.validation import engines
from dembark.validation.campaigns.estimate import Rates, estimates
from dembark.validation.case.folders import discover, find
from dembark.validation.case.resolve import resolve
from dembark.validation.runs.plan import Resources, series


def test_every_case_says_how_many_particles_it_has() -> None:
    for case in discover().values():
        for profile in case.profiles:
            for variant in case.variants:
                count = case.particle_count(resolve(case, profile, variant))
                assert isinstance(count, int) and count > 0, (case.name, profile, variant)


def test_number_of_logs_follows_from_the_drum_when_that_is_given() -> None:
    case = find("debarking_drum")
    assert case.particle_count(resolve(case, "quick")) == 30
    values = resolve(case, "quick", changes={"drum_radius": 2.0, "filling": 0.25, "log_diameter_min": 0.2, "log_diameter_max": 0.2})
    assert case.particle_count(values) == round(0.25 * math.pi * 2.0**2 / (math.pi * 0.1**2))


def test_steps_are_those_of_the_deck() -> None:
    case = find("silo")
    try:
        engine = engines.find("liggghts")
    except DembarkError as error:
        pytest.skip(str(error))
    planned = series(case, "dry", "quick", engine, {"replicas": 2, "settle_time": 0.3, "measure_time": 0.2})
    plan = SimpleNamespace(series=[planned], resources={planned.place: Resources()})
    (found,) = estimates(plan, Rates())
    stride = math.ceil(0.2 / found.time_step / planned.runs[0].values["frames"])
    assert found.steps == math.ceil(0.3 / found.time_step) + stride * planned.runs[0].values["frames"]
