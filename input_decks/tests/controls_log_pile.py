"""Wrong physics in a stack of logs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.input_decks.common.log_run import LogRun
from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_log_measures import of_pile, stack, unsolved


def controls(_folder: Path) -> Iterator[Control]:
    run = stack()
    right, walls = of_pile(run), run.touches[0].ids[:, 1]

    def kept(contacts: NDArray[np.bool_]) -> LogRun:
        """The run without some of its contacts."""
        return replace(run, touches=[replace(one, **{name: getattr(one, name)[contacts] for name in ("ids", "normals", "gaps", "forces",
                                                                                                     "friction", "places")})
                                     for one in run.touches])

    yield Control("a ground that carries a fiftieth too little", right, of_pile(stack(lift=0.98)))
    yield Control("a lost contact with a stake", right, of_pile(kept(walls != -3)))
    yield Control("half of the contacts lost", right, of_pile(kept(walls < 0)))
    yield Control("logs that creep", right, of_pile(replace(run, velocities=run.velocities + np.array([0.1, 0.0, 0.0]))))
    lossy = dict(run.history) | {"dissipated_energy": 0.9 * run.history["dissipated_energy"]}
    yield Control("a tenth of the dissipation missing from the account", right, of_pile(replace(run, history=lossy)))
    yield Control("a step that is not solved", right, of_pile(unsolved(run)))
