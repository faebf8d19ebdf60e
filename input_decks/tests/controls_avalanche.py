"""Wrong avalanches, single grains and beds."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control, judged
from dembark.input_decks.tests.test_avalanche import avalanche, bed, depths, flow, single


def controls(_folder: Path) -> Iterator[Control]:
    right = judged("avalanche", avalanche.measure([flow()]))
    yield Control("a hundredth of the damping that is not tallied", right, judged("avalanche", avalanche.measure([flow(lost=0.01)])))
    yield Control("a contact with the obstacle that is not counted", right, judged("avalanche", avalanche.measure([flow(missed=0.01)])))
    for kind in ("slides", "stops"):
        yield Control("friction a hundredth too strong", single(kind), single(kind, friction=0.505))
    yield Control("a hollow ball", single("rolls"), single("rolls", inertia=2.0 / 3.0))
    yield Control("a floor that lets the bed slide", bed(1.0, 0.002, 0.22), bed(1.0, 0.2, 0.22))
    yield Control("a viscous liquid on the chute", bed(1.5, 3.0, 0.4), bed(2.0, 3.0, 0.4))
    yield Control("a plug that slides down the chute", bed(1.0, 1.0, 0.32), bed(6.0, 1.0, 0.32))
    yield Control("speeds that grow as the square of the depth", depths(1.5), depths(2.0))
