"""Wrong trajectories, a shut gap, a dry floor, particles where none can be, and a fluid that makes energy."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_dam_break_cubes import study, verdicts


def controls(_folder: Path) -> Iterator[Control]:
    three, six = verdicts("three"), verdicts("six")
    for right, cubes in ((three, "three"), (six, "six")):
        yield Control("cubes that the water carries along 0.12 m too far", right, verdicts(cubes, carried=0.08))
    yield Control("a stack that falls a tenth of a second late", three, verdicts("three", late=0.1))
    yield Control("a top cube that jumps", six, verdicts("six", jumps=0.075))
    yield Control("gaps that water does not enter", six, verdicts("six", shut=True))
    yield Control("a dry floor", three, verdicts("three", dry=True))
    yield Control("a particle in a cube", three, verdicts("three", within=1))
    yield Control("a particle that leaks out", three, verdicts("three", leaked=1))
    yield Control("a fall that the spacing decides", study(2.19), study(2.17, 1.0))
    yield Control("a scheme that makes energy", three, verdicts("three", made=0.05))
