"""Kernels: their integrals, and their shares of cells against closed forms."""

import numpy as np
import pytest
from packings import grain_frame
from scipy.special import erf

from dembark.common.errors import DembarkError
from dembark.postproc.fields.accumulators import MASS
from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import NAMES, Kernel, line_nodes
from dembark.postproc.spheres import slice_volumes, volume


def density(kernel, distance):
    """phi (1/m3) at the vectors `distance` (..., 3) in m; see the module of the kernels."""
    away = np.sqrt((distance**2).sum(axis=-1)) / kernel.width
    if kernel.name == "gaussian":
        inside = (np.abs(distance) < 3.0 * kernel.width).all(axis=-1)
        return np.where(inside, np.exp(-0.5 * away**2), 0.0) / (np.sqrt(2.0 * np.pi) * kernel.width * erf(3.0 / np.sqrt(2.0))) ** 3
    if kernel.name == "lucy":
        return 105.0 / (16.0 * np.pi * kernel.width**3) * (1.0 + 3.0 * away) * np.clip(1.0 - away, 0.0, None) ** 3
    return np.where(away < 1.0, 3.0 / (4.0 * np.pi * kernel.width**3), 0.0)


@pytest.mark.parametrize("name", NAMES)
def test_variance_is_the_second_moment(name):
    kernel = Kernel(name, 0.7)
    place, weight = np.polynomial.legendre.leggauss(60)
    place, weight = place * kernel.reach, weight * kernel.reach
    points = np.stack(np.meshgrid(place, place, place, indexing="ij"), axis=-1)
    mass = density(kernel, points) * weight[:, None, None] * weight[:, None] * weight
    # Heaviside's jump keeps the product rule from doing better.
    accuracy = {"gaussian": 1e-12, "lucy": 1e-4, "heaviside": 1e-2}[name]
    assert mass.sum() == pytest.approx(1.0, rel=accuracy)
    assert (mass * points[..., 0] ** 2).sum() == pytest.approx(kernel.variance, rel=2 * accuracy)


def shares(kernel: Kernel, grid: Grid, point: np.ndarray) -> np.ndarray:
    return coarse_grain(grain_frame(point), None, grid, kernel=kernel.name, width=kernel.width).grains[..., MASS]


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
    exact = (density(kernel, fine.points() - point) * fine.cell_volume).reshape(3, 20, 4, 15, 2, 30).sum(axis=(1, 3, 5))
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
