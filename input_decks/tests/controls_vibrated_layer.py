"""Wrong physics in a vibrated layer."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_vibrated_layer import FAST, lengths, panel, shifts, sweep, verdicts


def controls(_folder: Path) -> Iterator[Control]:
    waves = verdicts(motion_frequency=FAST)
    yield Control("a billionth of the works that nothing explains", waves, verdicts(lost=1e-9, motion_frequency=FAST))
    yield Control("waves on a layer that should be flat", verdicts(lambda _: 0.0, noise=0.1, motion_gamma=1.5),
                  verdicts(lambda _: 0.3, noise=0.1, motion_gamma=1.5))
    yield Control("a surface that answers each stroke alike", waves, verdicts(part=1.0, motion_frequency=FAST))
    yield Control("ordered waves that begin at the acceleration of free fall and a half", sweep(2.5), sweep(2.0))
    yield Control("waves twice as long, at another part of the frequency, than published", panel(5, 0.5), panel(2, 0.25))
    yield Control("one wave on any length", lengths(12.5, 12.5, 14.3), lengths(12.5, 18.75, 25.0))
    yield Control("changes that change nothing", shifts(sweep_smooth=-0.2), shifts())
