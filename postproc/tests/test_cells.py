"""Averages over cells, and the grid they are on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from packings import cubic_lattice, fcc_lattice, grain_frame, packing_at_rest, random_frame

from dembark.common.errors import DembarkError
from dembark.postproc.fields.cells import FIELDS, cell_average, cell_grid, cell_totals
from dembark.postproc.fields.grid import Grid


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.tuples(st.booleans(), st.booleans(), st.booleans()), st.floats(-0.4, 0.4))
def test_totals_are_the_sums_over_grains_and_contacts(seed, periodic, tilt):
    grains, contacts = random_frame(seed, periodic=periodic, tilt=(tilt if periodic[1] else 0.0, 0.0, 0.0))
    grid = Grid(np.where(periodic, 0.0, -1.0), np.where(periodic, 1.0, 2.0), (3, 4, 5), periodic)
    totals = cell_totals(grains, contacts, grid)
    assert totals.mass.sum() == pytest.approx(grains.masses.sum()) and totals.grains.sum() == len(grains.ids)
    moment = -(contacts.forces[:, :, None] * contacts.branch[:, None, :]).sum(axis=0)
    np.testing.assert_allclose(totals.moment.sum(axis=(0, 1, 2)).reshape(3, 3), moment, atol=1e-12)
    assert totals.contacts.sum() == len(contacts.ids)


def test_lattice_under_load_has_its_exact_stress():
    grains, contacts = cubic_lattice(6, (1.0, 2.0, 5.0))
    moving = grain_frame(grains.wrapped, velocities=[3.0, 0.0, 0.0], high=(6,) * 3, periodic=(True,) * 3)
    found = cell_average([(moving, contacts)] * 2, Grid((0, 0, 0), (6, 6, 6), (3, 2, 3), (True,) * 3), least_contacts=1)
    np.testing.assert_allclose(found.stress, np.broadcast_to(np.diag([1.0, 2.0, 5.0]), (3, 2, 3, 3, 3)), atol=1e-12)
    np.testing.assert_allclose(found.density, 1.0)
    np.testing.assert_allclose(found.velocity, np.broadcast_to([3.0, 0.0, 0.0], (3, 2, 3, 3)))
    assert (found.contact_count == 2 * 3 * 12).all() and (found.grain_count == 2 * 12).all() and not found.mask.any()


def test_streaming_part_is_about_the_mean_of_the_cell():
    grains, _ = random_frame(2)
    still = np.tile([[0.0, 0.0, 2.0], [0.0, 0.0, -2.0]], (6, 1)) + np.array([5.0, 0.0, 0.0])
    frame = grain_frame(grains.wrapped, velocities=still, masses=0.5)
    found = cell_average([(frame, None)], Grid((0, 0, 0), (1, 1, 1), (1, 1, 1)), least_contacts=0)
    np.testing.assert_allclose(found.stress[0, 0, 0], np.diag([0.0, 0.0, 4.0 * 6.0]), atol=1e-12)
    assert found.temperature[0, 0, 0] == pytest.approx(4.0 / 3.0)


def test_thin_cells_are_masked_and_their_counts_kept():
    grains, contacts = random_frame(3, count=30, contacts=60)
    found = cell_average([(grains, contacts)] * 4, Grid((0, 0, 0), (1, 1, 1), (2, 2, 2)), least_contacts=30)
    assert found.mask.any() and not found.mask.all()
    assert np.isnan(found.stress[found.mask]).all() and np.isfinite(found.stress[~found.mask]).all()
    assert (found.contact_count[found.mask] < 30).all() and (found.contact_count[~found.mask] >= 30).all()
    assert set(found.arrays()) == set(FIELDS)


def test_walls_count_as_contacts():
    grains, contacts, wall, _ = packing_at_rest()
    grid = Grid((0, 0, 0), (3, 3, 3), (1, 1, 1))
    totals = cell_totals(grains, contacts, grid, [wall])
    assert totals.contacts.sum() == len(contacts.ids) + len(wall.forces)
    moment = -(contacts.forces[:, :, None] * contacts.branch[:, None, :]).sum(axis=0)
    moment -= (wall.forces[:, :, None] * (wall.points - wall.positions)[:, None, :]).sum(axis=0)
    np.testing.assert_allclose(totals.moment.reshape(3, 3), moment, atol=1e-12)


@pytest.mark.parametrize("wanted", [5, 10, 20])
def test_cells_hold_about_the_grains_asked_for(wanted):
    grains, contacts = fcc_lattice(6, 1.0)
    cubes = cell_grid(grains, wanted)
    assert cubes.periodic == (True,) * 3 and np.ptp(cubes.spacing) < 1e-9
    inside = cell_totals(grains, contacts, cubes).grains.mean()
    # A whole number of cells has to fit into the box, so they are a bit smaller.
    assert 0.45 * wanted < inside <= wanted


def test_grains_on_the_faces_of_the_grid_and_outside():
    grains = grain_frame([[0, 0, 0], [1, 1, 1], [1.01, 0.5, 0.5], [0.5, 0.5, 0.5]])
    totals = cell_totals(grains, None, Grid((0, 0, 0), (1, 1, 1), (2, 2, 2)))
    assert totals.grains.sum() == 3 and totals.grains[0, 0, 0] == 1 and totals.grains[1, 1, 1] == 2


def test_wrong_input_is_refused_in_one_line():
    grid = Grid((0, 0, 0), (1, 1, 1), (1, 1, 1))
    with pytest.raises(DembarkError, match="no frames"):
        cell_average([], grid)
    with pytest.raises(DembarkError, match="different grids"):
        cell_totals(*random_frame(1), grid) + cell_totals(*random_frame(1), Grid((0, 0, 0), (1, 1, 2), (1, 1, 1)))
    with pytest.raises(DembarkError, match="5 to 20"):
        cell_grid(random_frame(1)[0], 0.5)
    with pytest.raises(DembarkError, match="no grains"):
        cell_grid(grain_frame(np.zeros((0, 3))))
