"""Wrong fronts, and a fluid that makes energy or leaks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_dam_break import dam, study, verdicts


def controls(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a scheme that makes energy", right, verdicts(made=0.05))
    yield Control("a particle that leaks out", right, verdicts(leaked=1))
    yield Control("a front that spacing decides", study(0.01), study(0.2))
    # The second experiment contradicts the first by more than what is allowed: one that does not, of the same front.
    own = dam.published("martin_moyce")
    with patch.object(dam, "published", lambda _: own):
        agreed = study()
        yield Control("water that is a seventh faster", agreed, study(faster=8.0 / 7.0))
        yield Control("water that starts late", agreed, study(late=0.4))
