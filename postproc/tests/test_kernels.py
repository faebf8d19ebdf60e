"""Kernels: their integrals, and their shares of cells against closed forms."""

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.postproc.fields.deposit import point_shares
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import NAMES, Kernel, cumulative, line_nodes
from dembark.postproc.spheres import slice_volumes, volume


@pytest.mark.parametrize("name", NAMES)
def test_integral_is_one_and_variance_is_the_second_moment(name):
    kernel = Kernel(name, 0.7)
    place, weight = np.polynomial.legendre.leggauss(60)
    place, weight = place * kernel.reach, weight * kernel.reach
    points = np.stack(np.meshgrid(place, place, place, indexing="ij"), axis=-1)
    density = kernel(points) * weight[:, None, None] * weight[:, None] * weight
    # Heaviside's jump keeps the product rule from doing better.
    accuracy = {"gaussian": 1e-12, "lucy": 1e-4, "heaviside": 1e-2}[name]
    assert density.sum() == pytest.approx(1.0, rel=accuracy)
    assert (density * points[..., 0] ** 2).sum() == pytest.approx(kernel.variance, rel=2 * accuracy)


def test_cumulative_gaussian_is_its_integral():
    kernel = Kernel("gaussian", 0.4)
    ends = np.linspace(-1.2, 1.2, 25)
    along = kernel(np.stack([np.linspace(-1.2, 1.2, 4001), *np.zeros((2, 4001))], axis=-1))
    # At y = z = 0 the other two factors are the same constant.
    sums = np.concatenate([[0.0], np.cumsum(0.5 * (along[1:] + along[:-1]))])
    np.testing.assert_allclose(cumulative(kernel, ends), np.interp(ends, np.linspace(-1.2, 1.2, 4001), sums / sums[-1]), atol=1e-6)
    assert cumulative(kernel, np.array([-1.3, 1.3])).tolist() == [0.0, 1.0]


def shares(kernel: Kernel, grid: Grid, point: np.ndarray) -> np.ndarray:
    return point_shares(point[None], np.zeros((1, 3), int), grid.shape, grid, kernel, False)[0]


def test_shares_of_a_ball_are_volumes_of_its_slices():
    point = np.array([0.53, 0.48, 0.51])
    for axis in range(3):
        shape = np.ones(3, int)
        shape[axis] = 7
        grid = Grid((0, 0, 0), (1, 1, 1), tuple(shape.tolist()))
        found = shares(Kernel("heaviside", 0.4), grid, point).ravel()
        exact = slice_volumes(point[[axis]], np.array([0.4]), grid.edges(axis))[0] / volume(np.array(0.4))
        np.testing.assert_allclose(found, exact, atol=2e-3)


def test_shares_of_lucys_kernel_are_its_integrals():
    kernel, point = Kernel("lucy", 0.45), np.array([0.53, 0.47, 0.5])
    grid = Grid((0, 0, 0), (1, 1, 1), (3, 4, 2))
    fine = Grid((0, 0, 0), (1, 1, 1), (60, 60, 60))
    exact = (kernel(fine.points() - point) * fine.cell_volume).reshape(3, 20, 4, 15, 2, 30).sum(axis=(1, 3, 5))
    np.testing.assert_allclose(shares(kernel, grid, point), exact, atol=5e-4)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("width", [1e-6, 0.01, 0.1])
def test_a_kernel_of_any_width_gives_away_all(name, width):
    grid = Grid((0, 0, 0), (1, 1, 1), (8, 5, 6))
    for point in ([0.5, 0.5, 0.5], [0.4, 0.6, 0.55]):
        found = shares(Kernel(name, width), grid, np.array(point))
        assert found.sum() == pytest.approx(1.0, rel=1e-13) and (found >= 0.0).all()


def test_line_nodes_are_a_mean():
    for width in (10.0, 0.3, 1e-9):
        place, weight = line_nodes(Kernel("gaussian", width), 1.0)
        assert weight.sum() == pytest.approx(1.0) and (place @ weight) == pytest.approx(0.5) and place.min() > 0.0 and place.max() < 1.0


@pytest.mark.parametrize("width", [0.0, -1.0, np.nan, np.inf])
def test_width_must_be_positive(width):
    with pytest.raises(DembarkError, match="positive width"):
        Kernel("gaussian", width)


def test_kernel_must_be_known():
    with pytest.raises(DembarkError, match="choose one of gaussian, lucy, heaviside"):
        Kernel("tophat", 1.0)
