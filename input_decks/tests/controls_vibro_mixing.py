"""Wrong physics in a vibrated vessel."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_vibro_mixing import mixing, verdicts


def controls(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a billionth of the works that nothing explains", right, verdicts(lost=1e-9))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mixing, "sampled", lambda frame, _: np.arange(len(frame)) % 7)
        yield Control("samples of grains from everywhere", right, verdicts())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mixing, "shuffled", lambda _, kinds: kinds)
        yield Control("labels that follow the place", right, verdicts(swaps=0))
    weak = {"swaps": 0, "mixture": "two_sizes", "motion_gamma": 0.8}
    yield Control("large grains that rise in a vessel that never throws them", verdicts(**weak), verdicts(**weak, rising=0.02))
    smooth = {"swaps": 0, "wall_friction": 0.0}
    yield Control("smooth walls that drag", verdicts(**smooth), verdicts(**smooth, drift=-0.1))
