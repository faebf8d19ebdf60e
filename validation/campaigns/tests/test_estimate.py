"""What a campaign will cost: numbers of particles and steps are those of the decks."""

from __future__ import annotations

import json
import math
import socket
from pathlib import Path
from types import SimpleNamespace

import pytest
from harness import decks, stand_in  # noqa: F401

from dembark.common.errors import DembarkError
from dembark.validation import engines
from dembark.validation.campaigns.estimate import Rates, estimates
from dembark.validation.campaigns.plan import Resources, series
from dembark.validation.case.folders import discover, find
from dembark.validation.case.resolve import resolve


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


def test_rates_are_those_of_the_folder_before_those_of_the_case(tmp_path: Path, decks: Path, stand_in: Path) -> None:
    none, facts = Rates(tmp_path / "nothing"), engines.facts("yade")
    silo, box = SimpleNamespace(name="silo", rates={"yade": 2e5}), SimpleNamespace(name="box", rates={})
    assert none.of(silo, "yade").value == silo.rates["yade"] and none.of(box, "yade").value == facts.typical_rate
    for number, (speed, cores, host) in enumerate([(400.0, 4, "a"), (300.0, 1, "a"), (50.0, 1, "b")], start=1):
        place = tmp_path / f"box/dry/yade/replica-{number}"
        place.mkdir(parents=True)
        told = {"host": host, "ranks": 1, "threads": cores, "particle_steps_per_second": speed}
        (place / "run.json").write_text(json.dumps({"inputs": "", "provenance": told}))
    rates = Rates(tmp_path)
    assert rates.of(box, "yade", 4).value == 100.0 and rates.of(box, "yade", 1).value == 175.0
    assert "2 runs measured on other hosts" in rates.of(box, "yade", 1).source and rates.of(silo, "yade") == none.of(silo, "yade")
    (place / "run.json").write_text(json.dumps({"inputs": "", "provenance": told | {"host": socket.gethostname()}}))
    assert Rates(tmp_path).of(box, "yade", 1).value == 50.0
