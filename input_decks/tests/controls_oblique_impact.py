"""Wrong physics in oblique impacts, by the scheme written down again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_oblique_impact import by_scheme


def controls(_folder: Path) -> Iterator[Control]:
    right = by_scheme()
    yield Control("friction off", right, by_scheme(lambda one: replace(one, friction=0.0 * one.friction)))
    yield Control("friction tripled", right, by_scheme(lambda one: replace(one, friction=3.0 * one.friction)))
    yield Control("a fifth of the restitution", right, by_scheme(lambda one: replace(one, restitution=0.2 * one.restitution)))
    yield Control("half the shear stiffness", right, by_scheme(lambda one: replace(one, g_star=0.5 * one.g_star)))
