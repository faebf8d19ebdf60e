"""Viscous force of a bridge, and the energy of a cycle in which a bridge forms, is drawn out and breaks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from dembark.physics import (
    CAPILLARY_MODELS,
    Body,
    Contact,
    FinnieRabinowicz,
    capillary_force,
    collide,
    rupture_distance,
    viscous_resistance,
)

R, ETA, FLOOR, GAMMA, ANGLE = 1e-3, 0.05, 1e-6, 0.072, 0.35


def cycle_work(radius: float, volume: float, end: float) -> float:
    """Integral of the normal resistance over the gap from touching to `end` (N s), in closed form: R = 2 R*."""
    a = 2.0 * volume / (np.pi * radius)

    def inner(s):
        return np.log(s) - 2.0 * np.arcsinh(s / np.sqrt(a)) + 0.5 * np.log(s * s + a)

    at_floor = viscous_resistance(radius, radius, 0.0, volume, ETA, FLOOR).normal * FLOOR
    return at_floor + 1.5 * np.pi * ETA * radius**2 * (inner(end) - inner(FLOOR))


@settings(max_examples=100, deadline=None)
@given(log_volume=st.floats(-7.0, 0.0), log_gap=st.floats(-7.0, 0.0), ratio=st.floats(0.1, 10.0), scale=st.floats(1e-3, 1e3))
def test_signs_scaling_and_symmetry(log_volume, log_gap, ratio, scale):
    """Never negative, linear in the viscosity, the same from both sides, c times as large in a system c times as large."""
    volume, gap = 10.0**log_volume * R**3, 10.0**log_gap * R
    one = viscous_resistance(R, ratio * R, gap, volume, ETA, FLOOR)
    assert one.normal > 0.0 <= one.tangential
    for factor, other in ((1.0, viscous_resistance(ratio * R, R, gap, volume, ETA, FLOOR)),
                          (3.0, viscous_resistance(R, ratio * R, gap, volume, 3 * ETA, FLOOR)),
                          (scale, viscous_resistance(scale * R, scale * ratio * R, scale * gap, scale**3 * volume, ETA, scale * FLOOR))):
        np.testing.assert_allclose(other, factor * np.array(one), rtol=1e-9)
    assert viscous_resistance(R, ratio * R, gap, 2.0 * volume, ETA, FLOOR).normal > one.normal


@settings(max_examples=60, deadline=None)
@given(log_volume=st.floats(-7.0, 0.0), gap=st.floats(-1e-4, FLOOR))
def test_floor_holds_and_joins_without_a_step(log_volume, gap):
    volume = 10.0**log_volume * R**3
    at_floor = viscous_resistance(R, R, FLOOR, volume, ETA, FLOOR)
    assert viscous_resistance(R, R, gap, volume, ETA, FLOOR) == at_floor
    np.testing.assert_allclose(viscous_resistance(R, R, FLOOR * (1 + 1e-10), volume, ETA, FLOOR), at_floor, rtol=1e-9)


def test_unbounded_liquid_and_wall():
    """6 pi eta R*^2 / s without an end of the liquid; a wall has R* = R."""
    gap = np.array([1e-6, 1e-5])
    np.testing.assert_allclose(viscous_resistance(R, R, gap, 1e6, ETA, FLOOR).normal, 6 * np.pi * ETA * (R / 2) ** 2 / gap, rtol=1e-8)
    np.testing.assert_allclose(viscous_resistance(R, np.inf, gap, 1e6, ETA, FLOOR).normal, 6 * np.pi * ETA * R**2 / gap, rtol=1e-8)
    np.testing.assert_array_equal(viscous_resistance(R, np.inf, gap, 1e-11, ETA, FLOOR),
                                  viscous_resistance(2 * R, 2 * R, gap, 1e-11, ETA, FLOOR))


def test_shapes():
    found = viscous_resistance(R, [[R], [2 * R]], np.linspace(0, 1e-4, 3), 1e-11, ETA, FLOOR)
    assert found.normal.shape == found.tangential.shape == (2, 3)
    assert all(isinstance(part, float) for part in viscous_resistance(R, R, 0.0, 1e-11, ETA, FLOOR))
    assert viscous_resistance(R, R, 0.0, 1e-11, 0.0, 0.0) == (0.0, 0.0)


@pytest.mark.parametrize(("change", "words"), [
    ({"viscosity": -1.0}, "viscosity must be >= 0 Pa s"), ({"minimum_gap": 0.0}, "minimum_gap must be > 0 m with a viscosity"),
    ({"minimum_gap": [1e-6, 0.0]}, "minimum_gap must be > 0 m with a viscosity"), ({"minimum_gap": -1e-6}, "minimum_gap must be >= 0 m"),
    ({"volume": -1.0}, "volume"), ({"gap": np.nan}, "gap")])
def test_bad_arguments(change, words):
    good = {"radius_i": R, "radius_j": R, "gap": 0.0, "volume": 1e-11, "viscosity": ETA, "minimum_gap": FLOOR}
    with pytest.raises(ValueError, match=words) as caught:
        viscous_resistance(**good | change)
    assert "\n" not in str(caught.value)


def pair_law(**liquid) -> Contact:
    return Contact(effective_youngs_modulus=5e6, effective_shear_modulus=2e6, restitution=1.0,
                   friction=FinnieRabinowicz(static_friction=0.5, kinetic_friction=0.5, critical_slip_distance=1e-5), **liquid)


def test_a_contact_needs_a_floor_too():
    with pytest.raises(ValueError, match="minimum_gap must be > 0 m with a viscosity"):
        pair_law(bridge_volume=1e-11, viscosity=ETA)


@pytest.mark.parametrize("model", CAPILLARY_MODELS)
def test_hysteresis_work_of_the_bridge(model):
    """Work of the capillary force of one cycle: in along no force, out against the bridge; for two models in closed form."""
    volume = 1e-11
    end = rupture_distance(volume, ANGLE, R, R, model=model)
    # Towards rupture the slope of the exact force is infinite: gap = end (1 - u^2).
    work = quad(lambda u: capillary_force(R, R, end * (1 - u * u), volume, GAMMA, ANGLE, model=model) * 2 * end * u, 0.0, 1.0, epsrel=1e-9,
                limit=200)[0]
    assert work > 0.0
    ring = 2 * np.pi * R * GAMMA * np.cos(ANGLE)
    if model == "constant":
        assert work == pytest.approx(ring * end, rel=1e-9)
    if model == "willett":
        root, scale = np.sqrt(4 * 2.5 - 1.05**2), np.sqrt(volume / R)
        slope = lambda s: 2 / root * np.arctan((2 * 2.5 * s / scale + 1.05) / root)
        assert work == pytest.approx(ring * scale * (slope(end) - slope(0.0)), rel=1e-9)


@pytest.mark.parametrize("radius_j", [R, 0.4 * R, np.inf])
def test_viscous_work_of_a_slow_cycle(radius_j):
    """At constant speed the work against the liquid is speed times the integral of the resistance, here in closed form."""
    radius, volume = 2.0 / (1.0 / R + 1.0 / radius_j), 1e-11
    end = rupture_distance(volume, ANGLE, R, radius_j)
    steps = np.concatenate([np.linspace(0.0, FLOOR, 3), np.geomspace(FLOOR, end, 4001)[1:]])
    found = np.trapezoid(viscous_resistance(R, radius_j, steps, volume, ETA, FLOOR).normal, steps)
    assert found == pytest.approx(cycle_work(radius, volume, end), rel=1e-5)


@pytest.mark.parametrize(("viscosity", "speed"), [(0.0, 0.3), (0.005, 0.3), (0.005, 0.6)])
def test_energy_of_a_collision_is_lost_to_bridge_and_liquid_alone(viscosity, speed):
    """Two elastic grains meet head-on and leave: what kinetic energy is missing is the work of bridge and liquid, no more, no less."""
    volume, mass = 1e-11, 1e-5
    law = pair_law(bridge_volume=volume, surface_tension=GAMMA, contact_angle=ANGLE, viscosity=viscosity, minimum_gap=FLOOR)
    one = Body(radius=R, mass=mass, position=(0, 0, 1.02 * R), velocity=(0, 0, -speed))
    two = Body(radius=0.6 * R, mass=mass, position=(0, 0, -0.6 * R))
    end = rupture_distance(volume, ANGLE, R, 0.6 * R)
    step = 4e-7
    motion = collide(law, one, two, time_step=step, steps=int(5.0 * (end + 1e-4) / speed / step))
    reduced = 0.5 * mass
    relative = (motion.velocity[:, 0] - motion.velocity[:, 1])[:, 2]
    lost = 0.5 * reduced * (speed**2 - relative[-1] ** 2)
    assert not motion.contacts[-1].interacting and relative[-1] > 0.0

    gap = np.array([-c.overlap for c in motion.contacts])
    liquid = np.array([c.viscous_normal for c in motion.contacts])
    dissipated = -np.sum(liquid * relative) * step
    hysteresis = quad(lambda u: capillary_force(R, 0.6 * R, end * (1 - u * u), volume, GAMMA, ANGLE) * 2 * end * u, 0.0, 1.0,
                      epsrel=1e-9)[0]
    assert lost == pytest.approx(hysteresis + dissipated, rel=2e-3)
    assert (gap.min() < 0.0) and (dissipated > 0.2 * hysteresis if viscosity else dissipated == 0.0)
    assert all(c.viscous_normal == 0.0 for c in motion.contacts[: int(np.argmax(gap < 0.0))])
