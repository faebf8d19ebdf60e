"""The grid of cells."""

import numpy as np
import pytest
from packings import grain_frame

from dembark.common.errors import DembarkError
from dembark.postproc.fields.grid import Grid, periodic_images


def test_cells_fill_the_box():
    grid = Grid((0, -1, 2), (1, 1, 5), (2, 4, 3))
    np.testing.assert_allclose(grid.spacing, [0.5, 0.5, 1.0])
    np.testing.assert_allclose(grid.edges(1), [-1.0, -0.5, 0.0, 0.5, 1.0])
    np.testing.assert_allclose(grid.centres(2), [2.5, 3.5, 4.5])
    np.testing.assert_allclose(grid.points()[1, 0, 2], [0.75, -0.75, 4.5])
    assert grid.cell_volume == pytest.approx(0.25) and grid.cells == 24 and grid.same(Grid((0, -1, 2), (1, 1, 5), (2, 4, 3)))


def test_around_the_grains():
    frame = grain_frame([[0.2, 0.3, 0.4], [0.7, 0.6, 0.9]], radii=[0.1, 0.05], periodic=(True, False, False))
    grid = Grid.around(frame, 0.1, margin=0.2)
    np.testing.assert_allclose(grid.low, [0.0, 0.0, 0.1], atol=1e-15)
    np.testing.assert_allclose(grid.high, [1.0, 0.85, 1.15])
    assert grid.periodic == (True, False, False) and grid.shape == (10, 9, 11)


def test_images_of_a_triclinic_box_tile_space():
    frame = grain_frame([[0.05, 0.05, 0.05]], periodic=(True,) * 3, tilt=(0.3, 0.2, -0.4))
    grid = Grid((0, 0, 0), (1, 1, 1), (1, 1, 1), (True,) * 3)
    index, shift = periodic_images(frame.wrapped, frame.wrapped, 0.0, grid, frame)
    assert index.tolist() == [0] and np.allclose(shift, 0.0)
    index, shift = periodic_images(frame.wrapped, frame.wrapped, 1.0, Grid((5.1, 5.2, 5.3), (5.4, 5.5, 5.6), (1, 1, 1)), frame)
    lattice = np.array([[1, 0, 0], [0.3, 1, 0], [0.2, -0.4, 1]])
    number = shift @ np.linalg.inv(lattice)
    np.testing.assert_allclose(number, np.round(number), atol=1e-12)
    # 2.3^3 = 12.2 volumes of the box lie within reach.
    assert len({tuple(row) for row in np.round(number).astype(int).tolist()}) == len(index) and 8 <= len(index) <= 27


@pytest.mark.parametrize(
    ("low", "high", "shape", "match"),
    [((0, 0, 0), (1, 1, 0), (1, 1, 1), "low < high"), ((0, 0, np.nan), (1, 1, 1), (1, 1, 1), "finite"),
     ((0, 0, 0), (1, 1, 1), (1, 0, 1), "at least 1"), ((0, 0, 0), (1, 1, 1), (1, 1.5, 1), "three integers")],
)
def test_wrong_grids_are_refused(low, high, shape, match):
    with pytest.raises(DembarkError, match=match):
        Grid(low, high, shape)


def test_a_grid_around_nothing_is_refused():
    with pytest.raises(DembarkError, match="no grains"):
        Grid.around(grain_frame(np.zeros((0, 3))), 0.1)
    with pytest.raises(DembarkError, match="positive size"):
        Grid.around(grain_frame([[0, 0, 0]]), 0.0)
