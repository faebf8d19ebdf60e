"""Wrong physics in single impacts, by the scheme written down again."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from dembark.input_decks.single_contact.impacts import Flight
from dembark.input_decks.single_contact.published_curves import beside_published
from dembark.input_decks.tests.measuring import Control, Verdicts, judged
from dembark.input_decks.tests.test_single_contact_measure import flown, parameters, single_contact
from dembark.physics.exact.impacts import Impacts
from dembark.postproc.measurement import Measurement
from dembark.postproc.resampling import profile


def beside(variant: str, found: Measurement) -> Verdicts:
    return judged("single_contact", beside_published(found, single_contact.PUBLISHED, variant, single_contact.LABELS))


def of(variant: str, wrong: Callable[[Impacts], Impacts] = lambda one: one, spoil: Callable[[Flight], Flight] = lambda one: one,
       points: int = 17) -> Verdicts:
    """What a run at eight times the step is worth in whose impacts something is `wrong`, or in what it wrote."""
    p = parameters(variant)
    p |= {"points": min(p["points"], points), "time_step": 8.0 * p["time_step"]}
    return beside(variant, single_contact.measured(p, spoil(flown(p, wrong(single_contact.impacts(p))))))


def scaled(**factors: Any) -> Callable[[Impacts], Impacts]:
    """Impacts with other numbers."""
    return lambda one: replace(one, **{name: factor * getattr(one, name) for name, factor in factors.items()})


def published(variant: str, method: str) -> Verdicts:
    """What a run is worth that does what was published."""
    with single_contact.PUBLISHED.open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if (row["variant"], row["method"]) == (variant, method)]
    curves = []
    for name, points in groupby(rows, lambda row: f"{row['quantity']}_{row['material']}"):
        x, y = np.array(sorted((float(row["x"]), float(row["y"])) for row in points)).T
        curves.append(profile(name, name, "x", "y", x, [y]))
    return {name: one for name, one in beside(variant, Measurement({}, curves)).items() if name.startswith(method)}


def linear(variant: str) -> Verdicts:
    """What a run with linear springs is worth."""
    p = parameters(variant) | {"points": 17}
    return beside(variant, single_contact.measured(p, flown(p | {"presliding": "linear"})))


def controls(_folder: Path) -> Iterator[Control]:
    head_on = of("test_1")
    yield Control("a modulus a tenth too low", head_on, of("test_1", scaled(e_star=0.9)))
    yield Control("a force a thousandth off at its overlap", head_on,
                  of("test_1", spoil=lambda one: replace(one, forces=1.001 * one.forces)))
    yield Control("an external push", head_on, of("test_1", spoil=lambda one: replace(one, momentum_error=1e-9)))
    for variant in ("test_1", "test_3", "test_4", "test_7"):
        yield Control("restitution a tenth too low", of(variant), of(variant, scaled(restitution=0.9)))
    yield Control("no slip before all slides", of("test_5_partial_slip"), linear("test_5_partial_slip"))
    for variant in ("test_6", "test_8_a", "test_8_b"):
        wrong = of(variant, lambda one: replace(one, friction_limit="total"))
        yield Control("friction limited with the dashpot", published(variant, "published"), wrong)
    # Of two mirror images one turns less.
    yield Control("a partner that turns less", of("test_7"), of("test_7", scaled(spin=np.array([[1.0], [0.9]]))))
    for variant in ("test_4", "test_5", "test_5_partial_slip", "test_6", "test_8_a", "test_8_b"):
        lacking, right = of(variant, scaled(friction=0.0)), of(variant)
        yield Control("friction off", right, lacking)
        if variant != "test_5":
            # Where the law does not follow all points, what passes is the publication itself.
            method = "finite_elements" if variant == "test_5_partial_slip" else "published"
            yield Control("friction off", published(variant, method), lacking)
