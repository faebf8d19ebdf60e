"""Vessels, Janssen's law and what is measured at a silo's wall."""

import types

import numpy as np
import pytest

from dembark.input_decks.silo import janssen
from dembark.input_decks.silo.column import wall_pull
from dembark.input_decks.silo.fields import Silo
from dembark.input_decks.silo.quantities import moving_mean
from dembark.input_decks.silo.silo_geometry import Cylinder, Slab
from dembark.postproc.fields.rings import Rings, RingSums
from dembark.postproc.statistics import exact

NAMES = ("mass", "volume", "net", "wall", "zz", "rr", "tt", "zr", "rz")


def silo(height: float) -> Silo:
    cells = Rings.around(0.02, height, 0.004, 0.002)
    rings, layers = len(cells.radii), len(cells.heights)
    sums = {name: np.full((rings, layers), 2.0) for name in NAMES}
    fields = RingSums(3, **sums, through_rings=np.ones((rings + 1, layers)), through_layers=np.ones((rings, layers + 1)))
    return Silo(cells, fields, np.ones((3, 4, 5, rings, 2)), np.full((3, layers), 7.0), np.full((layers, 2), 5.0), exact(0.0), 1.0)


@pytest.mark.parametrize("vessel", [Cylinder(0.025), Slab(0.05, 0.03)])
def test_sectors_share_out_everything(vessel):
    random = np.random.default_rng(1)
    place = np.column_stack([random.uniform(0.0026, 0.0224, 200), random.uniform(-0.02, 0.05, 200), random.uniform(0, 1, 200)])
    radii = random.uniform(0.002, 0.003, 200)
    sectors = vessel.sectors(0.005)
    np.testing.assert_allclose(vessel.wall_shares(place, sectors).sum(axis=1), 1.0)
    np.testing.assert_allclose(vessel.volume_shares(place, radii, sectors).sum(axis=1), 1.0)
    np.testing.assert_allclose(np.linalg.norm(vessel.inward(place), axis=1), 1.0)
    # A step inward leads away from the wall by as much.
    np.testing.assert_allclose(vessel.distance(place + 1e-4 * vessel.inward(place)) - vessel.distance(place), 1e-4, rtol=1e-6)


def test_walls_of_both_vessels_have_two_over_size_of_area_for_a_volume():
    assert Cylinder(0.02).area * 2.0 / Cylinder(0.02).size == pytest.approx(2.0 * np.pi * 0.02)
    assert Slab(0.05, 0.03).area * 2.0 / Slab(0.05, 0.03).size == pytest.approx(2.0 * 0.03)


def test_laws_of_the_silo():
    depth = np.array([0.0, 1e-6, 0.1, 10.0])
    np.testing.assert_allclose(janssen.stress(depth, 0.05, 1000.0)[:2], [0.0, 1e-3], rtol=1e-4)
    assert janssen.stress(depth, 0.05, 1000.0)[-1] == pytest.approx(50.0)
    np.testing.assert_allclose(janssen.two_parameter(depth, 0.05, 0.0, 1000.0), janssen.stress(depth, 0.05, 1000.0))
    assert janssen.two_parameter(np.array([0.02]), 0.05, 0.03, 1000.0)[0] == 20.0


def test_a_grain_off_the_wall_counts_with_the_bridge_it_has(tmp_path):
    radii, vessel = np.array([0.0025, 0.0025, 0.0025]), Cylinder(0.025)
    place = np.array([[0.0226, 0.0, 0.0], [0.0, 0.0224, 0.0], [0.0, -0.0224, 0.0]])  # touching; off with a bridge; off without
    side = np.array([[-0.1, 0.0, 0.0], [0.0, 3e-4, 1e-5], [0.0, 0.0, 0.0]])
    grains = types.SimpleNamespace(positions=place, radii=radii)
    pull = wall_pull(grains, side, vessel, lambda found: np.full(len(found), 7e-4))
    np.testing.assert_allclose(pull, [7e-4, 3e-4, 0.0], atol=1e-18)
    assert not wall_pull(grains, side, vessel, None).any()


@pytest.mark.parametrize("bands", range(1, 9))
def test_moving_mean_keeps_one_value_a_band(bands):
    # A column of 100 grains has four bands, fewer than the mean spans.
    assert moving_mean(np.full(bands, 3.0)) == pytest.approx(np.full(bands, 3.0))
    assert moving_mean(np.arange(float(bands)))[bands // 2] == pytest.approx(np.arange(bands)[max(0, bands // 2 - 2):bands // 2 + 3].mean())


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
