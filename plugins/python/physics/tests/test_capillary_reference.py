"""The shooting solver checked on its own, and the force law of the engines checked against it."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dembark.physics import capillary_force, rupture_distance
from dembark.physics.young_laplace import NoBridge, bridge, rupture, rupture_gap

ANGLES = [0.0, np.radians(25.0), np.radians(60.0)]


@pytest.mark.parametrize(("volume", "angle"), [*zip((1e-5, 3e-2, 1e-5), ANGLES, strict=True)])
def test_force_is_the_derivative_of_the_surface_energy(volume, angle):
    end = rupture_gap(volume, angle)
    for part in (0.05, 0.5, 0.9):
        gap, step = part * end, 2e-4 * end
        energies = [bridge(volume, gap + k * step, angle).energy for k in (-2, -1, 1, 2)]
        slope = (energies[0] - 8.0 * energies[1] + 8.0 * energies[2] - energies[3]) / (12.0 * step)
        assert bridge(volume, gap, angle).force == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize("angle", ANGLES[::2])
def test_small_touching_bridge(angle):
    limit = 2.0 * np.pi * np.cos(angle)
    coarse, fine = (limit - bridge(v, 0.0, angle).force for v in (1.6e-6, 1e-7))
    # The deviation goes with the half-filling angle, volume^(1/4).
    assert 0.0 < coarse < 0.1 * limit
    assert coarse / fine == pytest.approx(2.0, rel=0.05)


def test_solution_is_what_was_asked_for():
    b = bridge(2e-3, 0.05, 0.4)
    assert (b.volume, b.gap) == pytest.approx((2e-3, 0.05), rel=1e-7)
    assert b.force == pytest.approx(2.0 * np.pi * b.neck_radius - np.pi * b.neck_radius**2 * b.pressure)


@pytest.mark.parametrize(("volume", "angle", "fit_error"), [(1e-6, 0.0, 0.01), (1e-3, 0.0, 0.01), (1e-4, np.radians(20.0), 0.04)])
def test_rupture_is_near_lians_fit(volume, angle, fit_error):
    """Lian, Thornton & Adams (1993) fitted a straight line in the angle to their solutions of the same equation."""
    assert rupture_gap(volume, angle) == pytest.approx((1.0 + 0.5 * angle) * volume ** (1.0 / 3.0), rel=fit_error)


def test_rupture_is_a_fold():
    """Two branches meet like a parabola: the force goes with the root of the distance to rupture."""
    end = rupture(1e-3, 0.3)
    far, near = (bridge(1e-3, end.gap * (1.0 - d), 0.3).force - end.force for d in (4e-4, 1e-4))
    assert far / near == pytest.approx(2.0, rel=0.02)
    with pytest.raises(NoBridge, match="beyond rupture"):
        bridge(1e-3, 1.0001 * end.gap, 0.3)


@pytest.mark.parametrize(("volume", "gap", "angle", "message"), [
    (0.0, 0.0, 0.0, "volume"), (float("nan"), 0.0, 0.0, "volume"), (1e-3, -1e-9, 0.0, "gap"), (1e-3, 0.0, 1.5, "contact_angle"),
])
def test_ranges(volume, gap, angle, message):
    with pytest.raises(ValueError, match=message):
        bridge(volume, gap, angle)


@settings(max_examples=2, deadline=None, derandomize=True)
@given(volume=st.floats(-6.0, -1.0).map(lambda e: 10.0**e), degrees=st.floats(0.0, 60.0))
@example(volume=0.1, degrees=29.0)
def test_engines_force_law_against_the_reference(volume, degrees):
    """0.1 % up to 0.99 of the rupture distance, 1 % from there to rupture: about 30 degrees the two ways in which a bridge ends cross, and
    the table with its corner there is 0.4 % off beyond 0.99."""
    angle, radius, tension = np.radians(degrees), 1.7e-3, 0.0728
    end = rupture(volume, angle)
    assert rupture_distance(volume * radius**3, angle, radius, radius) == pytest.approx(end.gap * radius, rel=2e-5)
    parts = np.array([0.0, 0.01, 0.2, 0.5, 0.8, 0.95, 0.99, 0.999, 0.9999])
    law = capillary_force(radius, radius, parts * end.gap * radius, volume * radius**3, tension, angle) / (tension * radius)
    reference = np.array([bridge(volume, p * end.gap, angle).force for p in parts])
    near = parts > 0.99
    np.testing.assert_allclose(law[~near], reference[~near], rtol=1e-3)
    np.testing.assert_allclose(law[near], reference[near], rtol=1e-2)
    last = capillary_force(radius, radius, rupture_distance(volume * radius**3, angle, radius, radius), volume * radius**3, tension, angle)
    assert last / (tension * radius) == pytest.approx(end.force, rel=1e-2)


@pytest.mark.parametrize(("ratio", "volume", "degrees"), [(0.7, 0.02, 35.0), (0.05, 3e-5, 10.0), (0.0, 0.1, 60.0)])
def test_engines_force_law_against_the_reference_for_unequal_spheres(ratio, volume, degrees):
    """0.1 % up to 0.9 of the rupture distance, 1 % up to 0.99, 0.2 % for the distance itself, in SI and from both sides."""
    angle, radius, tension = np.radians(degrees), 1.7e-3, 0.0728
    small = 0.5 * (1.0 + ratio) * radius
    large = small / ratio if ratio else np.inf
    end = rupture_gap(volume, angle, ratio)
    assert rupture_distance(volume * radius**3, angle, small, large) == pytest.approx(end * radius, rel=2e-3)
    assert rupture_distance(volume * radius**3, angle, large, small) == rupture_distance(volume * radius**3, angle, small, large)
    for part, bound in ((0.0, 1e-3), (0.1, 1e-3), (0.5, 1e-3), (0.9, 1e-3), (0.99, 1e-2)):
        expected = bridge(volume, part * end, angle, ratio).force * tension * radius
        assert capillary_force(small, large, part * end * radius, volume * radius**3, tension, angle) == pytest.approx(expected, rel=bound)


def test_small_bridge_to_a_wall():
    """4 pi R1 gamma cos(theta) in the limit (Orr, Scriven & Rivas 1975); R = 2 R1 here."""
    limit = 2.0 * np.pi * np.cos(0.5)
    coarse, fine = (limit - bridge(v, 0.0, 0.5, ratio=0.0).force for v in (1.6e-6, 1e-7))
    assert 0.0 < coarse < 0.1 * limit
    assert coarse / fine == pytest.approx(2.0, rel=0.05)


def test_force_between_unequal_spheres_is_the_derivative_of_the_surface_energy():
    """Also with two contact angles."""
    volume, gap, step, angles = 1e-2, 0.08, 5e-5, (0.3, 0.9)
    energies = [bridge(volume, gap + k * step, angles, 0.3).energy for k in (-2, -1, 1, 2)]
    slope = (energies[0] - 8.0 * energies[1] + 8.0 * energies[2] - energies[3]) / (12.0 * step)
    assert bridge(volume, gap, angles, 0.3).force == pytest.approx(slope, rel=1e-4)


def test_equal_spheres_lose_stability_to_asymmetric_bridges():
    """At 50 degrees almost equal spheres break nearly where equal ones do; the symmetric branch alone goes 6 % farther."""
    angle, volume = np.radians(50.0), 1e-3
    equal, other = rupture_gap(volume, angle), rupture_gap(volume, angle, ratio=0.99)
    assert 0.985 * equal < other < equal
    assert rupture_distance(volume, angle, 1.0, 1.0) == pytest.approx(equal, rel=1e-5)
    assert bridge(volume, 0.5 * equal, angle).force == pytest.approx(bridge(volume, 0.5 * equal, angle, ratio=0.99).force, rel=1e-5)


@pytest.mark.parametrize(("arguments", "message"), [((1e-3, 0.0, 0.1, 1.1), "ratio"), ((1e-3, 0.0, (0.1, 1.5)), "contact_angle")])
def test_ranges_of_unequal_spheres(arguments, message):
    with pytest.raises(ValueError, match=message):
        bridge(*arguments)
