"""What a campaign will cost: numbers of particles and steps are those of the decks."""

from __future__ import annotations

import math
import threading

import pytest
from dembark.common.errors import DembarkError, Interrupted
from dembark.validation import engines
from dembark.validation.campaigns.estimate import announced
from dembark.validation.cases import discover, find
from dembark.validation.runs.plan import series
from dembark.validation.resolve import resolve
from harness import decks, stand_in  # noqa: F401


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


def test_steps_are_those_that_the_deck_announces() -> None:
    case = find("silo")
    try:
        engine = engines.find("liggghts")
    except DembarkError as error:
        pytest.skip(str(error))
    (run,) = series(case, "dry", "quick", engine, {"replicas": 1, "settle_time": 0.3, "measure_time": 0.2}).runs
    steps, time_step = announced(run, threading.Event())
    stride = math.ceil(0.2 / time_step / run.values["frames"])
    assert steps == math.ceil(0.3 / time_step) + stride * run.values["frames"]


@pytest.mark.usefixtures("decks", "stand_in")
def test_a_deck_that_does_not_start_is_told(stand_in) -> None:  # noqa: F811
    (run,) = series(find("box"), "dry", "quick", engines.find("liggghts")).runs
    assert announced(run, threading.Event()) == (100, 1e-5)
    stand_in.write_text("#!/bin/sh\necho ERROR\n")
    with pytest.raises(DembarkError, match="box dry liggghts 1 does not start"):
        announced(run, threading.Event())
    stand_in.write_text("#!/bin/sh\nsleep 100\n")
    cancel = threading.Event()
    cancel.set()
    with pytest.raises(Interrupted):
        announced(run, cancel)
