"""The solutions that single impacts are compared with obey closed formulas and limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from dembark.physics.exact.contact_law import solved, stepped
from dembark.physics.exact.impacts import HERTZ_TIME, Impacts, partial_slip, sliding_throughout


def on_plane(count=1, *, angle=0.0, speed=1.0, youngs=7e10, poisson=0.3, density=2700.0, radius=0.01, **changes):
    """`count` spheres that come at `angle` (degrees) to the normal."""
    full, still = np.ones(count), np.zeros(count)
    a = np.radians(angle) * full
    one = Impacts(
        e_star=youngs / (1.0 - poisson**2) * full, g_star=youngs / (2.0 * (2.0 - poisson) * (1.0 + poisson)) * full, restitution=full,
        friction=still, radius=np.array([radius * full, np.inf * full]),
        mass=np.array([4.0 / 3.0 * math.pi * radius**3 * density * full, np.inf * full]), slide=np.array([speed * np.sin(a), still]),
        normal=np.array([-speed * np.cos(a), still]), spin=np.zeros((2, count)))
    return replace(one, **{name: value * full for name, value in changes.items()})


def on_sphere(count=1, *, size=5.0, **more):
    """The same against spheres at rest, `size` times as large."""
    one = on_plane(count, **more)
    return replace(one, radius=one.radius[:1] * [[1.0], [size]], mass=one.mass[:1] * [[1.0], [size**3]])


def patch(one, after):
    return after.numbers(one)["patch"]


@settings(max_examples=5, deadline=None)
@given(e=st.floats(0.1, 1.0), poisson=st.floats(0.0, 0.5), youngs=st.floats(6.0, 12.0), speed=st.floats(-2.0, 2.0))
@example(e=1.0, poisson=0.0, youngs=7.0, speed=1.0)
def test_head_on_the_restitution_coefficient_comes_out(e, poisson, youngs, speed):
    """Whatever the material: the damping is made for it."""
    one = on_plane(speed=10.0**speed, youngs=10.0**youngs, poisson=poisson, restitution=e)
    assume((one.peak_overlap < 0.5 * one.radius[0]).all())  # a grain whose centre goes through the plate does not come back
    after = solved(one, 200)
    np.testing.assert_allclose(after.normal[0] / one.closing, e, atol=2e-7)
    assert not after.slide.any() and not after.spin.any() and not after.normal[1].any()


@pytest.mark.parametrize("make", [on_plane, on_sphere])
def test_an_elastic_impact_is_that_of_hertz(make):
    one = make()
    after = solved(one, 300)
    np.testing.assert_allclose(after.duration, one.duration, rtol=1e-6)
    np.testing.assert_allclose(after.overlap, one.peak_overlap, rtol=1e-5)
    np.testing.assert_allclose(after.force, one.peak_force, rtol=2e-5)
    # Work of the force up to the largest overlap, 2/5 F d, is the energy of the approach.
    np.testing.assert_allclose(0.4 * one.peak_force * one.peak_overlap, 0.5 * one.reduced_mass * one.closing**2)
    times = np.linspace(-0.1, 1.1, 1201)[:, None] * one.duration
    pulse = one.pulse(times)
    np.testing.assert_allclose(pulse.max(axis=0), one.peak_force, rtol=1e-5)
    # The whole momentum goes, and comes back; before and after nothing acts.
    np.testing.assert_allclose(np.trapezoid(pulse, times, axis=0), 2.0 * one.reduced_mass * one.closing, rtol=1e-4)
    assert pulse[0] == pulse[-1] == 0.0


@pytest.mark.parametrize("make", [on_plane, on_sphere])
@pytest.mark.parametrize(("angle", "more"), [(45.0, {"friction": 0.3}), (70.0, {"friction": 0.4, "restitution": 0.5})])
def test_the_scheme_converges_to_the_exact_solution(make, angle, more):
    one = make(3, angle=np.array([5.0, angle, 80.0]), **more)
    due = patch(one, solved(one, 300))
    length = 1.5 * one.duration.max()
    errors = [np.abs(patch(one, stepped(one, step * one.duration.min(), 0.37, length)) - due).max() for step in (2e-2, 4e-3)]
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 0.01 * np.abs(due).max()


def test_an_impact_that_is_hardly_one_ends():
    """With an overlap of a millionth of the radius its share at the end is below the round-off of distances."""
    one = on_plane(speed=1e-5, restitution=0.5)
    np.testing.assert_allclose(solved(one, 100).normal[0] / one.closing, 0.5, atol=1e-5)


def test_spheres_keep_their_momentum():
    one = on_sphere(2, angle=np.array([30.0, 70.0]), friction=0.3, restitution=0.7)
    after = stepped(one, one.duration.min() / 200.0, 0.2, 1.5 * one.duration.max())
    for now, before in ((after.normal, one.normal), (after.slide, one.slide)):
        np.testing.assert_allclose((one.mass * now).sum(axis=0), (one.mass * before).sum(axis=0), rtol=1e-12)


def test_sliding_throughout_is_approached_at_a_grazing_angle_of_stiff_spheres():
    """Without damping, and with an overlap that vanishes beside the radius, the law slides like rigid bodies do."""
    one = on_plane(2, angle=np.array([80.0, 85.0]), speed=1e-3, youngs=2.08e11, radius=1e-5, density=7850.0, friction=0.3)
    np.testing.assert_allclose(patch(one, solved(one, 300)), patch(one, sliding_throughout(one)), atol=1e-4)
    np.testing.assert_allclose(patch(one, partial_slip(one)), patch(one, sliding_throughout(one)), atol=2e-4)


def test_partial_slip_is_linear_without_slip_and_gives_less_back_than_it_takes():
    angle = np.array([5.0, 20.0, 40.0, 60.0])
    one = on_plane(4, angle=angle, speed=1.0 / np.cos(np.radians(angle)), friction=1e6)
    ratio = patch(one, partial_slip(one)) / (one.sliding / one.closing)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-3)
    one = on_plane(9, angle=np.linspace(5.0, 85.0, 9), friction=0.3)
    after = partial_slip(one)
    before = 0.5 * one.mass[0] * (one.slide[0] ** 2 + 0.4 * (one.radius[0] * one.spin[0]) ** 2)
    assert (0.5 * one.mass[0] * (after.slide[0] ** 2 + 0.4 * (one.radius[0] * after.spin[0]) ** 2) < before).all()
    np.testing.assert_allclose(after.normal[0], one.closing, rtol=1e-3)


def test_partial_slip_does_not_depend_on_its_resolution():
    one = on_plane(5, angle=np.linspace(5.0, 85.0, 5), speed=3.9, friction=0.092)
    np.testing.assert_allclose(patch(one, partial_slip(one, 200, 1000)), patch(one, partial_slip(one, 400, 2000)), atol=3e-3)


def test_the_time_of_hertz_is_the_known_number():
    assert pytest.approx(2.94328, abs=1e-5) == HERTZ_TIME
