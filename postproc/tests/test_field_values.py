"""Coarse-grained density, velocities, stress, fabric and power against closed forms."""

import numpy as np
import pytest
from packings import contact_frame, cubic_lattice, fcc_lattice, grain_frame

from dembark.common.errors import DembarkError
from dembark.postproc.fields.coarse_graining import coarse_grain, interpolate
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import NAMES, Kernel


@pytest.mark.parametrize("name", NAMES)
def test_line_integral_is_the_mean_over_many_points(name):
    grains = grain_frame([[0.2, 0.3, 0.5], [0.75, 0.6, 0.4]], omegas=None)
    contacts = contact_frame(grains, [[0, 1]], [[1.0, 2.0, 3.0]])
    grid = Grid((-1, -1, -1), (2, 2, 2), (12, 9, 10))
    found = coarse_grain(grains, contacts, grid, kernel=name, width=0.5).contacts[..., 19]
    place = contacts.first + (np.arange(400)[:, None] + 0.5) / 400 * contacts.branch
    mean = coarse_grain(grain_frame(place), None, grid, kernel=name, width=0.5).grains[..., 28] / 400
    # Gauss points do not see just where the Gaussian is cut and where Heaviside's kernel jumps.
    np.testing.assert_allclose(found, mean, atol={"gaussian": 5e-5, "lucy": 1e-5, "heaviside": 2e-3}[name] * mean.max())


@pytest.mark.parametrize("gradient",
                         [[[0, 0, 0], [0, 0, 0], [3, 0, 0]], [[0, -2, 0], [2, 0, 0], [0, 0, 0]], [[1, 2, 3], [4, 5, 6], [7, 8, -6]]])
def test_gradient_of_an_affine_velocity_is_exact_for_any_packing(gradient):
    gradient = np.array(gradient, float)
    place = np.random.default_rng(2).uniform(0, 1, (300, 3))
    grid = Grid((0, 0, 0), (1, 1, 1), (5, 4, 3))
    for name in NAMES:
        moving = grain_frame(place, velocities=place @ gradient.T + [5.0, -7.0, 9.0])
        fields = coarse_grain(moving, None, grid, kernel=name, width=0.3).fields(shear_corrected=True)
        np.testing.assert_allclose(fields.velocity_gradient, np.broadcast_to(gradient, (5, 4, 3, 3, 3)), atol=1e-8)
        np.testing.assert_allclose(fields.strain_rate, np.broadcast_to(0.5 * (gradient + gradient.T), (5, 4, 3, 3, 3)), atol=1e-8)
        curl = [gradient[2, 1] - gradient[1, 2], gradient[0, 2] - gradient[2, 0], gradient[1, 0] - gradient[0, 1]]
        np.testing.assert_allclose(fields.vorticity, np.broadcast_to(curl, (5, 4, 3, 3)), atol=1e-8)
        # Nothing fluctuates about an affine field.
        np.testing.assert_allclose(fields.temperature, 0.0, atol=1e-10)


def test_shear_counts_as_fluctuation_unless_it_is_corrected():
    grains, _ = cubic_lattice(12, (1.0, 1.0, 1.0))
    rate, noise = 0.7, np.random.default_rng(6).normal(0.0, 0.2, (len(grains.ids), 3))
    moving = grain_frame(grains.wrapped, velocities=noise + rate * grains.wrapped[:, [2]] * [1.0, 0.0, 0.0])
    grid = Grid((4, 4, 4), (8, 8, 8), (2, 2, 2))
    # Grains cut by the kernel's end are few: the spread seen is that of the kernel and of the cell within some percent.
    for width in (0.8, 1.2):
        sums = coarse_grain(moving, None, grid, width=width)
        spread = Kernel("gaussian", width).variance + grid.spacing[2] ** 2 / 12
        naive, corrected = sums.fields(), sums.fields(shear_corrected=True)
        assert (naive.kinetic_stress - corrected.kinetic_stress)[..., 0, 0].mean() == pytest.approx(rate**2 * spread, rel=0.05)
        assert corrected.temperature.mean() == pytest.approx(0.04, rel=0.15)
        known = np.zeros((2, 2, 2, 3))
        known[..., 0] = rate * grid.centres(2)
        about = coarse_grain(moving, None, Grid((4, 4, 4), (8, 8, 8), (2, 2, 2)), width=width, mean_velocity=known).fields()
        # The given field is constant beyond the outermost centres, so that only a part of the shear is taken off here.
        assert corrected.temperature.mean() < about.temperature.mean() < naive.temperature.mean()


def test_velocities_about_a_given_field():
    place = np.random.default_rng(1).uniform(0.2, 0.8, (50, 3))
    grid = Grid((0, 0, 0), (1, 1, 1), (5, 5, 5))
    given = grid.points() @ np.diag([1.0, -2.0, 0.5]) + 3.0
    np.testing.assert_allclose(interpolate(given, grid, place), place @ np.diag([1.0, -2.0, 0.5]) + 3.0, atol=1e-13)
    moving = grain_frame(place, velocities=place @ np.diag([1.0, -2.0, 0.5]) + 3.0)
    fields = coarse_grain(moving, None, grid, width=0.1, mean_velocity=given).fields()
    np.testing.assert_allclose(fields.kinetic_stress, 0.0, atol=1e-12)
    with pytest.raises(DembarkError, match="on the grid of the fields"):
        coarse_grain(moving, None, grid, width=0.1, mean_velocity=given[:2])


def test_kinetic_stress_of_two_streams():
    place = np.repeat(np.random.default_rng(3).uniform(0, 1, (30, 3)), 2, axis=0)
    speed = np.tile([[0.0, 0.0, 2.0], [0.0, 0.0, -2.0]], (30, 1)) + np.array([7.0, 0.0, 0.0])
    fields = coarse_grain(grain_frame(place, velocities=speed), None, Grid((0, 0, 0), (1, 1, 1), (3, 2, 2)), width=0.2).fields()
    np.testing.assert_allclose(fields.kinetic_stress[..., 2, 2], 4.0 * fields.density, rtol=1e-12)
    np.testing.assert_allclose(fields.temperature, 4.0 / 3.0, rtol=1e-12)


@pytest.mark.parametrize("forces", [(2.0, 2.0, 2.0), (0.0, 0.0, 5.0), (1.0, 3.0, 4.0)])
def test_simple_cubic_lattice_has_its_exact_stress_and_fabric(forces):
    grains, contacts = cubic_lattice(6, forces)
    fields = coarse_grain(grains, contacts, Grid((0, 0, 0), (6, 6, 6), (6, 3, 2), (True,) * 3), width=0.9).fields()
    np.testing.assert_allclose(fields.stress, np.broadcast_to(np.diag(forces), (6, 3, 2, 3, 3)), atol=1e-6 * max(forces))
    np.testing.assert_allclose(fields.coordination, 6.0, rtol=1e-12)
    np.testing.assert_allclose(fields.fabric, np.broadcast_to(np.eye(3) / 3, (6, 3, 2, 3, 3)), atol=1e-6)
    np.testing.assert_allclose(fields.solid_fraction, np.pi / 6, rtol=1e-12)
    # Anywhere, not only where cells fall on the lattice, up to the ripple that the cut of the kernel leaves.
    fields = coarse_grain(grains, contacts, Grid((0.3, 0.1, 0.2), (4, 5, 5.5), (7, 11, 13)), width=0.9).fields()
    np.testing.assert_allclose(fields.stress, np.broadcast_to(np.diag(forces), (7, 11, 13, 3, 3)), atol=0.012 * max(forces))


def test_fcc_lattice_under_pressure():
    grains, contacts = fcc_lattice(3, 2.0)
    fields = coarse_grain(grains, contacts, Grid((0, 0, 0), (3, 3, 3), (3, 3, 3), (True,) * 3), width=0.6).fields()
    # 24 contacts a cube of volume 1, each with f l = 2 sqrt(1/2), the trace of three times the pressure.
    pressure = 24 * 2.0 * np.sqrt(0.5) / 3.0
    np.testing.assert_allclose(fields.stress, np.broadcast_to(pressure * np.eye(3), (3, 3, 3, 3, 3)), atol=1e-4 * pressure)
    np.testing.assert_allclose(fields.coordination, 12.0, rtol=1e-12)


def pair(velocities, omegas, force, radii=0.5, extra=None):
    grains = grain_frame([[0.0, 0.0, 0.0], [0.98, 0.0, 0.0]], velocities=velocities, omegas=omegas, radii=radii)
    contacts = contact_frame(grains, [[0, 1]], [force], extra)
    grid = Grid((-3,) * 3, (4,) * 3, (2, 2, 2))
    fields = coarse_grain(grains, contacts, grid, width=0.3).fields()
    if fields.dissipated_power is None:
        return None
    return fields.dissipated_power.sum() * grid.cell_volume, fields.friction_power.sum() * grid.cell_volume


def test_power_of_a_sliding_a_rolling_and_an_approaching_pair():
    still = np.zeros((2, 3))
    # Sliding at 2 m/s against a friction of 3 N, under a normal force that does no work.
    assert pair([[0, 2.0, 0], [0, 0, 0]], still, [-10.0, -3.0, 0.0]) == pytest.approx((6.0, 6.0))
    # Rolling on each other: the surfaces move alike at the contact, 0.49 m from either centre.
    assert pair(still, [[0, 0, 1.0], [0, 0, -1.0]], [-10.0, -3.0, 0.0]) == pytest.approx((0.0, 0.0), abs=1e-12)
    # Spinning alike they slide at twice the speed of a surface.
    assert pair(still, [[0, 0, 1.0], [0, 0, 1.0]], [-10.0, -3.0, 0.0]) == pytest.approx((3.0 * 0.98, 3.0 * 0.98))
    # Approaching: the normal force takes up 10 N times 0.1 m/s, no friction.
    assert pair([[0.1, 0, 0], [0, 0, 0]], still, [-10.0, 0.0, 0.0]) == pytest.approx((1.0, 0.0), abs=1e-12)
    assert pair(still, None, [-10.0, 0.0, 0.0]) is None
    assert pair(still, still, [-10.0, 0.0, 0.0], extra={"dissipated_power": np.array([4.0])})[0] == pytest.approx(4.0)


def test_a_bridge_across_a_gap_carries_stress_but_is_no_contact():
    grains = grain_frame([[0, 0, 0], [1.1, 0, 0], [2.1, 0, 0]])
    contacts = contact_frame(grains, [[0, 1], [1, 2]], [[3.0, 0, 0], [-1.0, 0, 0]])
    grid = Grid((-3,) * 3, (5,) * 3, (1, 1, 1))
    sums = coarse_grain(grains, contacts, grid, width=0.3)
    fields = sums.fields()
    assert fields.coordination[0, 0, 0] == pytest.approx(2 / 3) and fields.contact_count.sum() == pytest.approx(2.0)
    assert fields.contact_stress[0, 0, 0, 0, 0] * grid.cell_volume == pytest.approx(1.0 - 3.3)
