"""Wrong physics in a plug flow."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control, dried, measured
from dembark.input_decks.tests.synthetic import plug_flow, told


def controls(folder: Path) -> Iterator[Control]:
    flat = {"slip": 0.3, "decay": 0.8}
    right = measured(plug_flow(folder / "right", **flat))
    for name, change in {"a core that shears": {"tilt": 0.5},
                         "gravity 1 % too weak": {"lift": 0.99},
                         "velocities a twentieth above the displacements": {"faster": 1.05}}.items():
        yield Control(name, right, measured(plug_flow(folder / name, **flat, **change)))
    yield Control("a plate a tenth faster than prescribed", right, measured(told(plug_flow(folder / "plate", **flat), base_speed=0.018)))
    yield dried("plug_flow")
