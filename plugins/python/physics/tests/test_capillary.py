"""Capillary bridge: continuity, rupture, scaling, shapes, and arguments that are refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark import physics
from dembark.physics import CAPILLARY_MODELS, capillary_force, rupture_distance

R, GAMMA = 1e-3, 0.072
ANGLES = [0.0, 0.35, 1.0]
VOLUMES = [1e-15, 1e-12, 5e-11]


def test_willett_as_checked_in_other_programs():
    """Closed form: r = 19 and 32.5 um, V = 12e-19 m^3, gamma = 0.024 N/m, 10 degrees, gap 248.485 nm (YADE's own check)."""
    force = capillary_force(19e-6, 32.5e-6, 248.485e-9, 12e-19, 0.024, np.radians(10.0), model="willett")
    assert force == pytest.approx(6.78192074e-7, rel=1e-6)


@pytest.mark.parametrize("model", CAPILLARY_MODELS)
@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("volume", VOLUMES)
def test_attractive_and_continuous_at_touching(model, angle, volume):
    at, overlapping = capillary_force(R, R, [0.0, -1e-4], volume, GAMMA, angle, model=model)
    assert at == overlapping > 0.0
    near = np.abs(capillary_force(R, R, [1e-14, 1e-12, 1e-10], volume, GAMMA, angle, model=model) - at) / at
    assert near[2] < 0.05
    assert near[1] < 0.1 * near[2] + 1e-12
    assert near[0] < 0.1 * near[1] + 1e-12


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("volume", VOLUMES)
def test_force_at_touching(angle, volume):
    """2 pi R gamma cos(theta) for the ring of a vanishing volume, which the models approach in their ways."""
    ring = 2.0 * np.pi * R * GAMMA

    def at(model, liquid=volume):
        return capillary_force(R, R, 0.0, liquid, GAMMA, angle, model=model)

    assert at("constant") == pytest.approx(ring * np.cos(angle), rel=1e-14)
    assert at("willett") == pytest.approx(ring * np.cos(angle), rel=1e-14)
    alpha = (2.0 * volume / (np.pi * R**3)) ** 0.25
    assert at("rabinovich") == pytest.approx(ring * (np.cos(angle) + np.sin(alpha) * np.sin(alpha + angle)), rel=1e-12)
    assert at("exact") < ring * np.cos(angle)
    far, near = (1.0 - at("exact", v) / (ring * np.cos(angle)) for v in (1e-14, 1e-15))
    assert far / near == pytest.approx(10.0**0.25, rel=0.1)
    if volume >= 1e-13 and angle < 0.6:
        assert at("willett_full") == pytest.approx(at("exact"), rel=0.03)
        assert at("bagheri") == pytest.approx(at("exact"), rel=0.10)


@pytest.mark.parametrize("model", CAPILLARY_MODELS)
@pytest.mark.parametrize("angle", ANGLES)
def test_force_falls_to_rupture_and_ends_there(model, angle):
    volume = 1e-12
    end = rupture_distance(volume, angle, R, R, model=model)
    force = capillary_force(R, R, np.linspace(0.0, 0.999999 * end, 300), volume, GAMMA, angle, model=model)
    assert (force > 0.0).all()
    assert np.diff(force).max() <= 1e-3 * force[0]
    assert (capillary_force(R, R, end * np.array([1.000001, 1.1, 2.0, np.inf]), volume, GAMMA, angle, model=model) == 0.0).all()


@pytest.mark.parametrize("model", CAPILLARY_MODELS)
def test_no_liquid_no_force(model):
    assert capillary_force(R, R, 0.0, 0.0, GAMMA, 0.3, model=model) == 0.0
    assert rupture_distance(0.0, 0.3, R, R, model=model) == 0.0
    assert capillary_force(R, R, 0.0, 1e-12, 0.0, 0.3, model=model) == 0.0


@pytest.mark.parametrize("model", CAPILLARY_MODELS)
@pytest.mark.parametrize("angle", [0.0, np.pi / 2])
def test_ends_of_the_range_are_finite(model, angle):
    gap, volume = np.meshgrid([-1e-5, 0.0, 1e-18, 1e-9, 1e-5, 1e-3, 1.0], [0.0, 5e-324, 1e-30, 1e-18, 1e-12, 1e-9, 1e-7])
    assert np.isfinite(capillary_force(R, 2 * R, gap, volume, GAMMA, angle, model=model)).all()
    assert np.isfinite(rupture_distance(volume, angle, R, np.inf, model=model)).all()


@settings(max_examples=80, deadline=None)
@given(model=st.sampled_from(CAPILLARY_MODELS), angle=st.sampled_from(ANGLES), log_volume=st.floats(-6.0, -1.0), part=st.floats(0.0, 0.999),
       ratio=st.floats(0.1, 10.0), scale=st.floats(1e-3, 1e3))
def test_scaling_and_symmetry(model, angle, log_volume, part, ratio, scale):
    """No length but those of the bridge: F(cR, cS, c^3 V) = c F; linear in surface tension; the same from both sides."""
    volume = 10.0**log_volume * R**3
    gap = part * rupture_distance(volume, angle, R, ratio * R, model=model)
    force = capillary_force(R, ratio * R, gap, volume, GAMMA, angle, model=model)
    assert capillary_force(ratio * R, R, gap, volume, GAMMA, angle, model=model) == pytest.approx(force, rel=1e-12)
    assert capillary_force(R, ratio * R, gap, volume, 3.0 * GAMMA, angle, model=model) == pytest.approx(3.0 * force, rel=1e-12)
    c = scale
    assert capillary_force(c * R, c * ratio * R, c * gap, c**3 * volume, GAMMA, angle, model=model) == pytest.approx(c * force, rel=1e-6)
    assert rupture_distance(c**3 * volume, angle, c * R, c * ratio * R, model=model) == pytest.approx(
        c * rupture_distance(volume, angle, R, ratio * R, model=model), rel=1e-9)


@pytest.mark.parametrize("model", CAPILLARY_MODELS)
def test_wall_is_the_limit_of_a_large_sphere(model):
    gap = np.linspace(0.0, 1e-4, 20)
    wall = capillary_force(R, np.inf, gap, 1e-12, GAMMA, 0.35, model=model)
    # The closed forms know R = 2 R* alone; the exact bridge is flatter on the wall and ends earlier.
    if model != "exact":
        np.testing.assert_allclose(wall, capillary_force(2 * R, 2 * R, gap, 1e-12, GAMMA, 0.35, model=model), rtol=1e-12)
    else:
        assert rupture_distance(1e-12, 0.35, R, np.inf) < 0.99 * rupture_distance(1e-12, 0.35, 2 * R, 2 * R)
    np.testing.assert_allclose(wall, capillary_force(R, 1e6 * R, gap, 1e-12, GAMMA, 0.35, model=model), rtol=1e-4)
    np.testing.assert_array_equal(wall, capillary_force(np.inf, R, gap, 1e-12, GAMMA, 0.35, model=model))


def test_broadcasting():
    radius, gap = np.array([[1e-3], [2e-3], [np.inf]]), np.linspace(0.0, 1e-4, 4)
    angle = np.array([0.0, 0.2, 0.2, 0.4])
    force = capillary_force(1e-3, radius, gap, 1e-12, GAMMA, angle)
    assert force.shape == (3, 4)
    for i in range(3):
        for j in range(4):
            assert force[i, j] == capillary_force(1e-3, radius[i, 0], gap[j], 1e-12, GAMMA, angle[j])
    assert isinstance(capillary_force(1e-3, 1e-3, 0.0, 1e-12, GAMMA, 0.0), float)
    assert capillary_force(1e-3, 1e-3, np.zeros(0), 1e-12, GAMMA, 0.0).shape == (0,)
    assert rupture_distance(np.full((2, 1), 1e-12), 0.1, 1e-3, [1e-3, 2e-3, np.inf]).shape == (2, 3)


GOOD = {"radius_i": R, "radius_j": R, "gap": 0.0, "volume": 1e-12, "surface_tension": GAMMA, "contact_angle": 0.3}


@pytest.mark.parametrize(("change", "words"), [
    ({"radius_i": 0.0}, "radius_i must be > 0 m"), ({"radius_j": -R}, "radius_j"), ({"radius_i": np.inf, "radius_j": np.inf}, "two walls"),
    ({"gap": np.nan}, "gap must be a number \\(m\\), not nan"), ({"volume": -1e-12}, "volume must be >= 0 m\\^3"),
    ({"volume": [1e-12, np.inf]}, "volume"),
    ({"surface_tension": -1.0}, "surface_tension"), ({"contact_angle": 1.6}, "contact_angle must be between 0 and 1.5708 rad"),
    ({"contact_angle": -0.1}, "contact_angle"), ({"model": "magic"}, "'magic' is unknown; it can be exact, willett"),
])
def test_bad_arguments(change, words):
    with pytest.raises(ValueError, match=words) as caught:
        capillary_force(**GOOD | change)
    assert "\n" not in str(caught.value)


@given(radius=st.floats(1e-5, 1.0), ratio=st.sampled_from([0.1, 1.0, np.inf]), cubes=st.floats(101.0, 1e9))
def test_a_volume_in_another_unit_is_refused(radius, ratio, cubes):
    """In the words of the engines; the larger radius that is not a wall counts."""
    volumes = [0.0, cubes * radius**3, 1e-3 * radius**3]
    for call in (lambda v: capillary_force(radius, ratio * radius, 0.0, v, GAMMA, 0.35, model="willett"),
                 lambda v: rupture_distance(v, 0.35, ratio * radius, radius, model="willett")):
        with pytest.raises(ValueError, match=r"volume \(m\^3\) is \S+ cubes of the largest radius; .* give its volume in m\^3"):
            call(volumes)
        call([0.0, 99.0 * radius**3])


def test_arguments_that_are_no_numbers():
    with pytest.raises(TypeError, match="volume must be a number"):
        capillary_force(**GOOD | {"volume": "a drop"})
    with pytest.raises(ValueError, match="shape"):
        capillary_force(**GOOD | {"gap": [0.0, 1.0], "volume": [1e-12, 2e-12, 3e-12]})


@pytest.mark.parametrize("call", [
    lambda a, b: physics.capillary_force(a, b, 0.0, 1e-11, 0.07, 0.0), lambda a, b: physics.capillary_force(1e-3, a, b, 1e-11, 0.07, 0.0),
    lambda a, b: physics.rupture_distance(a, 0.0, b, 1e-3), lambda a, b: physics.viscous_resistance(a, 1e-3, b, 1e-11, 1e-3, 1e-6),
    physics.liquid_share, physics.liquid_grant,
    lambda a, b: physics.liquid_bridge(a, b, 1e-3, 1e-3)])
def test_shapes_that_do_not_fit_are_named(call):
    with pytest.raises(ValueError, match=r"the shapes of \w+ \([23],\), \w+ \([23],\) do not fit together: they must be equal"):
        call([1e-3, 2e-3], [1e-3, 2e-3, 3e-3])


@pytest.mark.parametrize("radius", [None, [1e-3, None]])
def test_none_is_no_number(radius):
    with pytest.raises(TypeError, match="radius_i must be a number or an array of numbers"):
        physics.capillary_force(radius, 1e-3, 0.0, 1e-11, 0.07, 0.0)
