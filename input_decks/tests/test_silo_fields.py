"""Fields of packings that are not equally high."""

import numpy as np
import pytest

from dembark.input_decks.silo.fields import Silo
from dembark.postproc.fields.rings import Fields, Rings
from dembark.postproc.statistics import exact

NAMES = ("mass", "volume", "net", "wall", "zz", "rr", "tt", "zr", "rz")


def silo(height: float) -> Silo:
    cells = Rings.around(0.02, height, 0.004, 0.002)
    rings, layers = len(cells.radii), len(cells.heights)
    sums = {name: np.full((rings, layers), 2.0) for name in NAMES}
    fields = Fields(3, **sums, through_rings=np.ones((rings + 1, layers)), through_layers=np.ones((rings, layers + 1)))
    return Silo(cells, fields, np.ones((3, 4, 5, rings, 2)), np.full((3, layers), 7.0), np.full((layers, 2), 5.0), exact(0.0), 1.0)


def test_a_lower_packing_gets_empty_layers_above():
    low, high = silo(0.04), silo(0.05)
    assert np.allclose(high.rings.vertical[: len(low.rings.vertical)], low.rings.vertical)
    grown = low.up_to(high.rings)
    both = grown.fields + high.fields
    assert both.frames == 6 and both.mass[0].tolist() == [4.0] * len(low.rings.heights) + [2.0] * 5
    assert grown.fields.mass.sum() == low.fields.mass.sum() and both.through_layers.shape == high.fields.through_layers.shape
    assert np.isnan(grown.wall[-5:]).all() and not np.isnan(grown.wall[:-5]).any()
    assert grown.section[:, :-5] == pytest.approx(low.section)
    assert (grown.section[:, -5:] == 0.0).all()
