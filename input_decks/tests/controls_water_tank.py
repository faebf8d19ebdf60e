"""Gravity, water and walls that are not what they should be, and a fluid that makes energy or leaks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_water_tank import study, verdicts


def controls(_folder: Path) -> Iterator[Control]:
    right = {scene: verdicts(scene) for scene in ("still", "floating", "falling", "cylinder", "slot", "drifting")}
    yield Control("gravity a fiftieth too strong", right["still"], verdicts("still", heavier=1.02))
    for scene in ("floating", "cylinder"):
        yield Control("water a tenth too light", right[scene], verdicts(scene, lighter=0.9))
    yield Control("a block that falls a seventh slower", right["falling"], verdicts("falling", slower=1.15))
    yield Control("walls that keep water half a spacing away", right["slot"], verdicts("slot", lost=1.0))
    yield Control("a block that loses a billionth of its momentum", right["drifting"], verdicts("drifting", braked=1e-9))
    for name in ("still", "still_wide", "floating", "cylinder", "slot"):
        yield Control("errors that grow with finer particles", study(name, 0.5), study(name, 2.0))
    yield Control("a scheme that makes energy", right["still"], verdicts("still", made=0.05))
    for scene, one in right.items():
        if scene == "drifting":
            # Without walls a particle can be missing, but not leak.
            continue
        yield Control("a particle that leaks out", one, verdicts(scene, leaked=1))
