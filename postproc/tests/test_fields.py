"""Fields against closed forms and conservation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dembark.postproc import profiles, stress
from dembark.postproc.spheres import slice_volumes, volume, volume_below


@given(st.floats(1e-4, 1.0), st.floats(-2.0, 2.0))
def test_cap_volume_matches_its_integral(radius, share):
    height = share * radius
    grid = np.linspace(-radius, np.clip(height, -radius, radius), 2001)
    area = np.pi * (radius**2 - grid**2)
    assert volume_below(np.array(height), np.array(radius)) == pytest.approx(np.trapezoid(area, grid), rel=1e-5, abs=1e-6 * radius**3)


@given(st.lists(st.floats(-0.9, 0.9), min_size=1, max_size=20))
def test_slices_add_up_to_whole_spheres(centres):
    radii = np.full(len(centres), 0.1)
    parts = slice_volumes(np.array(centres), radii, np.linspace(-1.0, 1.0, 14))
    np.testing.assert_allclose(parts.sum(axis=1), volume(radii), rtol=1e-12)
    assert (parts >= 0.0).all()


def test_surface_of_a_simple_cubic_packing():
    axis = np.arange(10) + 0.5
    place = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    assert profiles.surface_height(place[:, 2], np.full(1000, 0.5), 100.0) == pytest.approx(10.0, abs=0.6)


def test_surface_of_a_filling_of_one_density():
    """Spheres that lie anywhere: half of those at the surface reach beyond it."""
    heights = np.random.default_rng(1).uniform(0.0, 20.0, 200_000)
    assert profiles.surface_height(heights, np.full(200_000, 0.5), 200_000 / 20.0) == pytest.approx(20.0, abs=0.02)


def test_lagrangian_velocity_is_displacement_over_time():
    paths = np.array([[[0.0, 0.0, 0.0]], [[5.0, 5.0, 5.0]], [[1.0, 0.0, -2.0]]])
    np.testing.assert_allclose(profiles.lagrangian_velocities(paths, np.array([0.0, 0.1, 0.5])), [[2.0, 0.0, -4.0]])
    with pytest.raises(ValueError, match="two frames"):
        profiles.lagrangian_velocities(paths[:1], np.array([0.0]))


def test_inertial_number():
    assert profiles.inertial_number(-2.0, 400.0, 0.005, 2500.0) == pytest.approx(2.0 * 0.005 * 2.5)


@given(st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1, max_size=12))
def test_segment_shares_add_up_to_one_inside(ends):
    start, end = (np.array(column) for column in zip(*ends, strict=True))
    share = stress.overlap_fractions(start, end, np.linspace(-2.5, 2.5, 8))
    np.testing.assert_allclose(share.sum(axis=1), 1.0, rtol=1e-9)


def column(weights, base_height=0.0):
    """A vertical chain of unit-diameter grains that carry each other's weight down to a base; contacts, base force."""
    count = len(weights)
    place = np.column_stack([np.zeros(count), np.zeros(count), base_height + 0.5 + np.arange(count)])
    carried = np.cumsum(weights[::-1])[::-1]
    first, branch = place[1:], place[:-1] - place[1:]
    forces = np.zeros((count - 1, 3))
    forces[:, 2] = carried[1:]
    base = np.zeros((count, 3))
    base[0, 2] = carried[0]
    return place, first, branch, forces, base


def test_field_stress_equals_balance_stress_at_every_height():
    weights = np.random.default_rng(2).uniform(0.5, 2.0, 12)
    place, first, branch, forces, base = column(weights)
    edges, area = np.linspace(0.0, 12.0, 31), 3.0
    lines = [(first, branch, forces), stress.wall_branches(place, base, stress.on_plane(place, 2, 0.0))]
    field = sum(stress.pair_stress(*line, axis=2, edges=edges, area=area)[:, 2, 2] for line in lines)
    np.testing.assert_allclose(field, stress.mean_load_above(place[:, 2], weights, edges) / area, rtol=1e-12, atol=1e-12)
    # Without the wall's contacts the lowest half grain would carry nothing.
    assert stress.pair_stress(first, branch, forces, 2, edges, area)[0, 2, 2] == 0.0


def test_integrated_stress_is_the_moment_of_the_external_forces():
    weights = np.ones(7)
    place, first, branch, forces, base = column(weights, base_height=0.3)
    edges, area = np.linspace(0.0, 8.0, 5), 2.0
    lines = [(first, branch, forces), stress.wall_branches(place, base, stress.on_plane(place, 2, 0.3))]
    total = sum(stress.pair_stress(*line, axis=2, edges=edges, area=area)[:, 2, 2].sum() for line in lines) * area * 2.0
    assert total == pytest.approx(float(np.sum(weights * (place[:, 2] - 0.3))))


def test_stress_of_a_periodic_chain_does_not_care_where_the_border_is():
    first = np.column_stack([np.arange(5) + 0.5, np.zeros(5), np.zeros(5)])
    branch, forces = np.tile([1.0, 0.0, 0.0], (5, 1)), np.tile([-3.0, 0.0, 0.0], (5, 1))
    found = stress.pair_stress(first, branch, forces, 0, np.linspace(0, 5, 11), 2.0, length=5.0)
    np.testing.assert_allclose(found[:, 0, 0], 1.5)


def test_plane_wall_stress_has_the_side_it_presses():
    heights, forces = np.array([0.5, 0.5]), np.array([[4.0, 0.0, 1.0], [4.0, 0.0, 1.0]])
    normal, shear = stress.plane_wall_stress(heights, forces, 0, 1, np.array([0.0, 1.0]), 2.0)
    assert (normal[0], shear[0]) == (4.0, 1.0)
    normal, _ = stress.plane_wall_stress(heights, -forces, 0, -1, np.array([0.0, 1.0]), 2.0)
    assert normal[0] == 4.0


def test_kinetic_stress_of_opposite_velocities():
    place, speed = np.zeros((2, 3)), np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    found = stress.kinetic_stress(place, speed + 7.0, np.array([2.0, 2.0]), 2, np.array([-1.0, 1.0]), 1.0)
    assert found[0, 2, 2] == pytest.approx(2.0)


@given(st.lists(st.tuples(st.floats(0, 10), st.floats(-1, 3)), min_size=1, max_size=30))
def test_mean_load_above_is_the_mean_over_levels(grains):
    heights, loads = (np.array(column) for column in zip(*grains, strict=True))
    exact = stress.mean_load_above(heights, loads, np.array([2.0, 5.0]))[0]
    levels = np.linspace(2.0, 5.0, 30001)
    assert exact == pytest.approx(stress.load_above(heights, loads, levels).mean(), abs=3e-3)
