"""Wrong physics in a row of logs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_log_measures import cradle_run, of_cradle, unsolved


def controls(_folder: Path) -> Iterator[Control]:
    run = cradle_run(time_step=1e-5)
    right, p = of_cradle(run), run.parameters
    # Runs by the scheme whose deck had another number than it was asked for.
    for name, wrong in (("springs half as stiff", {"stiffness": 0.5 * p["stiffness"]}),
                        ("log 1 a tenth faster", {"velocity": 1.1 * p["velocity"]})):
        yield Control(name, right, of_cradle(replace(cradle_run(time_step=1e-5, **wrong), parameters=p)))
    lossless = replace(run, parameters=p | {"theta": 0.5})
    yield Control("the dissipation of θ = 1 where θ = ½ was set",
                  of_cradle(cradle_run(time_step=1e-5, theta=0.5)), of_cradle(lossless))
    pushed = run.velocities.copy()
    pushed[-1, :, 0] += 0.01
    yield Control("an external push", right, of_cradle(replace(run, velocities=pushed)))
    yield Control("a step that is not solved", right, of_cradle(unsolved(run)))
