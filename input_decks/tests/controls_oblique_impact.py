"""Wrong physics in oblique impacts, by the scheme written down again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from dembark.input_decks.tests.measuring import Control, defaults
from dembark.input_decks.tests.test_oblique_impact import by_scheme, impacts, oblique, seen, studied
from dembark.physics.exact.impacts import partial_slip


def controls(_folder: Path) -> Iterator[Control]:
    right = by_scheme()
    yield Control("friction off", right, by_scheme(lambda one: replace(one, friction=0.0 * one.friction)))
    yield Control("friction tripled", right, by_scheme(lambda one: replace(one, friction=3.0 * one.friction)))
    yield Control("a fifth of the restitution", right, by_scheme(lambda one: replace(one, restitution=0.2 * one.restitution)))
    # The measurement leaves open more than the tolerance at small angles and for the spin: data that close, of the theory of partial slip.
    found, data = oblique.rebounds(_slipping(1.0)[0]), oblique.measured()
    closed = [replace(datum, value=float(found[datum.quantity][k]), scatter=0.003 * _scale(datum), common=0.0)
              for k, datum in enumerate(data)]
    with patch.object(oblique, "measured", lambda: closed):
        right = studied(_slipping(1.0))
        yield Control("a contact that sticks and gives all back", right, by_scheme())
        yield Control("friction off", right, by_scheme(lambda one: replace(one, friction=0.0 * one.friction)))
        yield Control("friction tripled", right, by_scheme(lambda one: replace(one, friction=3.0 * one.friction)))
        yield Control("half the shear stiffness", right, studied(_slipping(0.5)))


def _slipping(stiffness: float) -> list[Any]:
    """Runs with two time steps of the theory of partial slip, which has none, and of this factor of the shear stiffness."""
    p = defaults("oblique_impact")
    one = impacts(p)
    one = replace(one, g_star=stiffness * one.g_star)
    after = partial_slip(one, 100, 600)
    return [seen(p | {"time_step": step}, one, after) for step in (1e-8, 2e-8)]


def _scale(datum: Any) -> float:
    """What an uncertainty of 1 in e_t is in the unit of the `datum`."""
    of_spin = oblique.SPEED * np.sin(np.radians(datum.angle)) / (0.4 * oblique.RADIUS)
    return {"tangential_restitution": 1.0, "spin": float(of_spin)}.get(datum.quantity, 60.0)
