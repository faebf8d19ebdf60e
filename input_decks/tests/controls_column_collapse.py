"""Wrong books of a collapse."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dembark.input_decks.tests.measuring import Control, judged
from dembark.input_decks.tests.test_collapse_measure import column_collapse, found, points, replica, spoiled


def controls(folder: Path) -> Iterator[Control]:
    right = found(replica(folder / "right"))
    for name, spoil in {
            "a hundredth of the damping missing from the account": spoiled(normal_viscous=lambda work: 0.99 * work),
            "gravity doubled in the potential energy": spoiled(potential_energy=lambda energy: 2.0 * energy),
            "damping that adds energy": spoiled(tangential_viscous=np.negative)}.items():
        yield Control(name, right, found(replica(folder / name, spoil)))
    yield Control("a step error of first order", *(judged("column_collapse", column_collapse.study("step", points(order, 0.05),
                                                                                              "time_step_fraction"))
                                                    for order in (2.0, 1.0)))
