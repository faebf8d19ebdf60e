"""Wrong physics in a channel."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dembark.input_decks.tests.measuring import Control, Verdicts, judged, measure, measured
from dembark.input_decks.tests.synthetic_slabs import gravity_channel
from dembark.input_decks.tests.test_slab_measures import CHANNEL


def widths(folder: Path, slips: tuple[float, ...]) -> Verdicts:
    """The study of three widths with these velocities at the wall."""
    points = [measure(gravity_channel(folder, cells=cells, variant=f"w{cells}", slip=slip, decay=0.1 * cells, noise=0.005, seed=cells))
              for cells, slip in zip((20, 30, 40), slips, strict=True)]
    return judged("gravity_channel", CHANNEL.study("width", points, "channel_width"))


def controls(folder: Path) -> Iterator[Control]:
    right = measured(gravity_channel(folder / "right"))
    yield Control("the parabolic profile of a fluid", right, measured(gravity_channel(folder / "fluid", slip=0.0, decay=6.0)))
    yield Control("walls with nine tenths of the friction", right, measured(gravity_channel(folder / "walls", friction=0.9)))
    yield Control("a slip that does not grow with the width", widths(folder / "grown", (2.0, 2.0, 2.0)),
                  widths(folder / "same", (2.4, 2.0, 1.6)))
