"""Limits and balances of the Finnie-Rabinowicz law along prescribed paths."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dembark.physics import FinnieRabinowicz, FrictionLaw

N, K, AREA = 2.0, 1e5, 1e-6
RAMP = np.linspace(0.0, 2e-4, 4001)[1:]
COULOMB = FinnieRabinowicz(static_friction=0.4, kinetic_friction=0.4, critical_slip_distance=1e-5)
WEAK = replace(COULOMB, static_friction=0.5, kinetic_friction=0.3)
EVERY = [COULOMB, WEAK, replace(WEAK, critical_slip_distance=0.0), replace(WEAK, interface_shear_strength=1e6)]
EVERY += [replace(WEAK, healing_time=5.0)]
PARTIAL = [replace(law, presliding="partial_slip") for law in EVERY]
EVERY += [replace(law, presliding="exponential") for law in EVERY]


def limit(law, mu, normal_force=N, area=AREA):
    strength = law.interface_shear_strength * area
    return mu * normal_force if np.isinf(strength) else -strength * np.expm1(-mu * normal_force / strength)


def test_coulomb_is_a_spring_up_to_friction():
    np.testing.assert_allclose(COULOMB.drive(N, K, AREA, RAMP), np.minimum(K * RAMP, 0.4 * N), rtol=1e-12)


def test_weakening_with_slip():
    """Beyond the peak mu_s N the force follows mu(s) N with the slip that is total minus elastic displacement."""
    path = WEAK.follow(N, K, AREA, RAMP)
    peak = path.force.argmax()
    assert path.force[peak] == pytest.approx(0.5 * N, rel=0.01)
    slipping = path.slip > 0.0
    np.testing.assert_allclose(path.slip[slipping], (RAMP - path.force / K)[slipping], rtol=1e-9)
    np.testing.assert_allclose(path.force[slipping], WEAK.friction_coefficient(path.slip[slipping]) * N, rtol=1e-9)
    assert path.force[-1] == pytest.approx(0.3 * N, rel=1e-6)


@pytest.mark.parametrize("presliding", ["linear", "exponential"])
def test_no_saw_tooth(presliding):
    """One peak: once friction falls it never rises again in steady sliding, also where the spring is softer than the drop."""
    for s_c in (1e-4, 1e-5, 1e-6, 0.0):
        force = replace(WEAK, critical_slip_distance=s_c, presliding=presliding).drive(N, K, AREA, RAMP * 10.0)
        after = np.diff(force[force.argmax():])
        assert after.max() <= 1e-12 * N
        assert force[-1] == pytest.approx(0.3 * N, rel=1e-3)


def test_vanishing_slip_distance():
    """s_c -> 0 tends to the law that drops at once."""
    jump = replace(WEAK, critical_slip_distance=0.0).drive(N, K, AREA, RAMP)
    np.testing.assert_allclose(jump, np.where(K * RAMP <= 0.5 * N * (1 + 1e-12), K * RAMP, 0.3 * N), rtol=1e-12)
    work = [abs(replace(WEAK, critical_slip_distance=s).drive(N, K, AREA, RAMP) - jump).mean() for s in (1e-5, 1e-6, 1e-7, 1e-8)]
    assert work[0] > work[1] > work[2] >= work[3]
    assert work[3] < 1e-12


@pytest.mark.parametrize("presliding", ["linear", "exponential"])
def test_shear_strength(presliding):
    """Constant friction: T_max = tau A (1 - exp(-mu N / (tau A))); Coulomb for a light load, tau A for a heavy one."""
    law = replace(COULOMB, interface_shear_strength=1e6, presliding=presliding)
    far = np.linspace(0.0, 1e-2, 50)[1:]

    def plateau(normal_force):
        return law.drive(normal_force, K, AREA, far)[-1]

    for normal_force in (1e-3, 0.3, 3.0, 100.0):
        assert plateau(normal_force) == pytest.approx(limit(law, 0.4, normal_force), rel=1e-10)
    assert plateau(1e-6) == pytest.approx(0.4e-6, rel=1e-6)
    assert plateau(1e4) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("law", EVERY)
def test_no_load_no_friction(law):
    for normal_force in (0.0, -1.0):
        assert (law.drive(normal_force, K, AREA, RAMP) == 0.0).all()
    for normal_force in (1e-3, 1e-9):
        assert np.abs(law.drive(normal_force, K, AREA, RAMP)).max() <= 0.5 * normal_force * (1 + 1e-12)


def test_lost_load_lowers_a_held_force():
    """A force that was built up shrinks with the load."""
    load = np.linspace(N, 0.0, 50)
    for law in EVERY:
        force = law.drive(load, K, AREA, np.full(50, 5e-6))
        assert (force <= limit(law, law.static_friction, np.maximum(load, 1e-300)) * (1 + 1e-12)).all()
        assert force[-1] == 0.0


def test_exponential_curve_is_exact_for_any_step():
    """Dahl: T = T_max (1 - exp(-k u / T_max))."""
    law = replace(COULOMB, interface_shear_strength=1e6, presliding="exponential")
    top = limit(law, 0.4)
    for path in (RAMP, RAMP[::100], RAMP[[7, 1000, 3999]]):
        force = law.drive(N, K, AREA, path)
        np.testing.assert_allclose(force, -top * np.expm1(-K * path / top), rtol=1e-10)
        assert (np.diff(force) >= 0.0).all() and force[-1] <= top


def test_curves_share_stiffness_and_limit():
    exponential = replace(COULOMB, presliding="exponential")
    assert exponential.drive(N, K, AREA, [1e-10])[0] == pytest.approx(K * 1e-10, rel=1e-4)
    assert (exponential.drive(N, K, AREA, RAMP) <= COULOMB.drive(N, K, AREA, RAMP) * (1 + 1e-12)).all()


def test_healing():
    """A contact that sticks again shows its static friction: at once, or after the healing time."""
    forth, back = np.linspace(0.0, 1e-4, 500)[1:], np.linspace(1e-4, 9.9e-5, 50)[1:]
    again = np.linspace(9.9e-5, 2e-4, 500)[1:]
    path = np.concatenate([forth, back, again])

    def second_peak(law, time_step=1.0):
        return law.drive(N, K, AREA, path, time_step=time_step)[-499:].max()

    assert second_peak(WEAK) == pytest.approx(0.5 * N, rel=0.02)
    slow = replace(WEAK, healing_time=1.0)
    assert second_peak(slow, 1e-6) == pytest.approx(0.3 * N, rel=0.01)
    assert second_peak(slow, 1.0) == pytest.approx(0.5 * N, rel=0.02)


# Multiples of a picometre: squares of displacements near 1e-160 m leave the range of numbers.
COORDINATES = st.integers(-50_000_000, 50_000_000).map(lambda picometres: picometres * 1e-12)
PATHS = st.integers(2, 40).flatmap(lambda n: arrays(float, (n, 2), elements=COORDINATES))
LAWS = st.sampled_from(EVERY)


def fine(corners):
    """Straight lines between the corners in steps of at most 2 % of the limit's displacement, back to the start."""
    corners = np.vstack([np.zeros(2), corners, np.zeros(2)])
    pieces = [a + (b - a) * np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(b - a) / 1.2e-7))[1:, None]
              for a, b in itertools.pairwise(corners)]
    return np.vstack(pieces)


def test_partial_slip_is_that_of_cattaneo_and_mindlin():
    """At a constant load, in any plane: T / (mu N) = 1 - (1 - u / u_max)^1.5 with u_max = 1.5 mu N / k_t."""
    law, along = replace(COULOMB, presliding="partial_slip"), np.array([1.0, 2.0, -2.0]) / 3.0
    most = 1.5 * 0.4 * N / K
    path = most * np.linspace(0.0, 1.2, 601)[1:]
    expected = 0.4 * N * (1.0 - np.maximum(1.0 - path / most, 0.0)**1.5)
    np.testing.assert_allclose(law.drive(N, K, AREA, path[:, None] * along) @ along, expected, atol=0.01 * 0.4 * N)
    np.testing.assert_allclose(law.drive(N, K, AREA, path), law.drive(N, K, AREA, path[:, None] * along) @ along, rtol=1e-12)
    assert np.abs(COULOMB.drive(N, K, AREA, path) - expected).max() > 0.1 * 0.4 * N


def test_partial_slip_without_an_area_or_a_load_carries_nothing():
    law = replace(COULOMB, presliding="partial_slip")
    assert not law.drive(N, K, 0.0, RAMP).any()
    assert not law.drive(-1.0, K, AREA, RAMP).any()


@settings(max_examples=30, deadline=None)
@given(law=LAWS, corners=st.integers(1, 6).flatmap(lambda n: arrays(float, (n, 2), elements=COORDINATES)))
def test_energy_balance(law, corners):
    """Work put in = elastic energy + dissipated energy; a closed path never gives energy back."""
    path = fine(corners)
    out = law.follow(N, K, AREA, path)
    increment = np.diff(path, axis=0, prepend=np.zeros((1, 2)))
    mean = 0.5 * (out.force + np.vstack([np.zeros(2), out.force[:-1]]))
    work = np.cumsum((mean * increment).sum(axis=1))
    stored = (out.force**2).sum(axis=1) / (2.0 * K)
    size = max(np.abs(work).max(), stored.max(), out.dissipated_energy[-1])
    # Slip turns within a step and the law's slope breaks at the limit: the balance closes with the step.
    tolerance = 0.03 * size + 1e-6 * N * np.linalg.norm(increment, axis=1).max()
    np.testing.assert_allclose(work, stored + out.dissipated_energy, atol=tolerance, rtol=0.0)
    assert work[-1] >= -1e-12 * size


@settings(max_examples=100, deadline=None)
@given(law=st.sampled_from(EVERY + PARTIAL), path=PATHS, data=st.data())
def test_any_path(law, path, data):
    """Whatever happens: no NaN, force below static friction's limit, dissipation never falls, forces turn with the path."""
    load = data.draw(arrays(float, len(path), elements=st.integers(-500, 5000).map(lambda millinewtons: 1e-3 * millinewtons)))
    out = law.follow(load, K, AREA, path, time_step=0.3)
    assert np.isfinite(out.force).all() and np.isfinite(out.slip).all()
    size = np.linalg.norm(out.force, axis=1)
    # The spring is the path less the slip, which round-off leaves uncertain by a part of the path.
    assert (size <= limit(law, law.static_friction, np.maximum(load, 0.0)) * (1 + 1e-12) + 1e-15 * K * np.abs(path).max()).all()
    assert (np.diff(out.dissipated_energy, prepend=0.0) >= 0.0).all()
    assert (out.slip >= 0.0).all()
    angle = data.draw(st.floats(0.0, 6.0))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(law.drive(load, K, AREA, -path, time_step=0.3), -out.force, atol=0.0, rtol=0.0)
    if law.static_friction == law.kinetic_friction:
        # Else a turned path may stick, by round-off, where the other just slips.
        np.testing.assert_allclose(law.drive(load, K, AREA, path @ turn.T, time_step=0.3), out.force @ turn.T, atol=1e-9)


@pytest.mark.parametrize("law", EVERY + PARTIAL)
def test_loops_with_reversals_dissipate(law):
    """The area of the loop of force over displacement is what the state says is lost."""
    points, amplitude = 1000, 5e-5
    path = amplitude * np.sin(2.0 * np.pi * np.arange(1, 4 * points + 1) / points)
    out = law.follow(N, K, AREA, path, time_step=1e-3)
    last = slice(3 * points - 1, None)
    area = np.trapezoid(out.force[last], path[last])
    assert area > N * amplitude * 0.1
    assert area == pytest.approx(out.dissipated_energy[-1] - out.dissipated_energy[3 * points - 1], rel=5e-3)


def test_a_long_path_needs_memory_for_its_points_alone():
    """A path of 2e5 points in an oblique plane; a matrix of points by points would have 320 GB."""
    turns = np.linspace(0.0, 40.0, 200_000)
    path = 1e-5 * (np.outer(np.sin(turns), [1.0, 0.0, 1.0]) + np.outer(turns, [0.0, 0.2, 0.0]))
    force = COULOMB.drive(N, K, AREA, path)
    assert np.abs(force[:, 0] - force[:, 2]).max() < 1e-9 * np.abs(force).max()


@pytest.mark.parametrize(("change", "words"), [
    ({"static_friction": -0.1}, "static_friction must be >= 0"),
    ({"kinetic_friction": 0.6}, "kinetic friction must not exceed static friction"),
    ({"critical_slip_distance": -1e-6}, "critical_slip_distance"),
    ({"interface_shear_strength": 0.0}, "interface_shear_strength"),
    ({"healing_time": -1.0}, "healing_time"),
    ({"healing_time": np.nan}, "healing_time"),
    ({"static_friction": np.inf}, "static_friction"),
    ({"friction_limit": "viscous"}, "must be total or elastic"),
    ({"presliding": "curved"}, "must be linear, exponential or partial_slip"),
])
def test_bad_parameters(change, words):
    with pytest.raises(ValueError, match=words) as caught:
        replace(WEAK, **change)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("arguments", "words"), [
    ((N, 0.0, AREA, RAMP), "tangential_stiffness"), ((N, -1.0, AREA, RAMP), "tangential_stiffness"), ((N, K, -AREA, RAMP), "contact_area"),
    ((np.nan, K, AREA, RAMP), "normal_force"), (([1.0, 2.0], K, AREA, RAMP), "one value a point of the path"),
    ((N, K, AREA, np.zeros((3, 4))), "shape"), ((N, K, AREA, 1.0), "shape"), ((N, K, AREA, [np.inf]), "displacement"),
])
def test_bad_arguments(arguments, words):
    with pytest.raises(ValueError, match=words):
        WEAK.drive(*arguments)


def test_shapes():
    assert WEAK.drive(N, K, AREA, np.zeros(5)).shape == (5,)
    assert WEAK.drive(N, K, AREA, np.zeros((5, 2))).shape == (5, 2)
    assert WEAK.drive(np.full(5, N), np.full(5, K), np.full(5, AREA), np.zeros((5, 3))).shape == (5, 3)
    assert WEAK.drive(N, K, AREA, np.zeros((0, 3))).shape == (0, 3)


def test_any_law_by_the_names_of_the_table():
    """The same numbers and words, with and without a class of their own; what a law needs is missed, what none knows is refused."""
    given = {"static_friction": 0.5, "kinetic_friction": 0.3, "critical_slip_distance": 1e-5, "presliding": "exponential"}
    np.testing.assert_array_equal(FrictionLaw(**given).drive(N, K, AREA, RAMP), FinnieRabinowicz(**given).drive(N, K, AREA, RAMP))
    with pytest.raises(ValueError, match="critical_slip_distance is missing"):
        FrictionLaw(static_friction=0.5, kinetic_friction=0.3)
    with pytest.raises(ValueError, match="no parameter 'slip_distance'"):
        FrictionLaw(**given, slip_distance=1e-5)
    with pytest.raises(TypeError, match="presliding must be a word"):
        FrictionLaw(**given | {"presliding": 1})
