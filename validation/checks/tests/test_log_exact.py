"""The exact motions that logs are compared with obey their equations and known limits."""

import math

import numpy as np
import pytest
from dembark.validation.checks.log_exact import chain_motion, chain_with_loss, pair_motion
from hypothesis import given, settings
from hypothesis import strategies as st

PAIR = {
    "target": "log",
    "mass_1": 20.0,
    "mass_2": 80.0,
    "stiffness_1": 1e7,
    "stiffness_2": 3e7,
    "radius_1": 0.1,
    "radius_2": 0.15,
    "velocity_1": 1.5,
    "velocity_2": 0.0,
    "offset": 0.0,
    "damping": 0.0,
    "contact_damping": 0.0,
    "lead_time": 5e-4,
}
positive = st.floats(0.1, 10.0)


@settings(max_examples=25, deadline=None)
@given(m1=positive, m2=positive, s1=positive, s2=positive, v=positive)
def test_two_bodies_head_on_are_half_an_oscillation(m1, m2, s1, s2, v):
    p = PAIR | {"mass_1": 20 * m1, "mass_2": 20 * m2, "stiffness_1": 1e7 * s1, "stiffness_2": 1e7 * s2, "velocity_1": v}
    reduced, k = 20 * m1 * m2 / (m1 + m2), 1e7 * s1 * s2 / (s1 + s2)
    omega = math.sqrt(k / reduced)
    times = np.linspace(0.0, p["lead_time"] + 1.3 * math.pi / omega, 50)
    found = pair_motion(p, times)
    assert found.end - found.begin == pytest.approx(math.pi / omega, rel=1e-9)
    assert found.peak == pytest.approx(v * math.sqrt(k * reduced), rel=1e-6)
    during = (times > found.begin) & (times < found.end)
    assert found.force[during] == pytest.approx(
        v * math.sqrt(k * reduced) * np.sin(omega * (times[during] - found.begin)), abs=1e-6 * found.peak
    )
    assert found.force[~during] == pytest.approx(0.0, abs=1e-9 * found.peak)
    assert found.velocities[-1, :, 0] == pytest.approx([(m1 - m2) / (m1 + m2) * v, 2 * m1 / (m1 + m2) * v], abs=1e-9 * v)


def test_the_published_pair():
    found = pair_motion(PAIR, np.array([0.0, 0.0075]))
    assert found.peak == pytest.approx(16431.7, abs=0.05)
    assert found.velocities[-1, :, 0] == pytest.approx([-0.9, 0.6], abs=1e-9)


def test_off_centre_keeps_momentum_angular_momentum_and_energy():
    p = PAIR | {"offset": 0.12, "velocity_2": -0.5}
    found = pair_motion(p, np.linspace(0.0, 0.008, 41))
    mass = np.array([20.0, 80.0])
    momentum = np.einsum("tbi,b->ti", found.velocities, mass)
    spin = (found.positions[..., 0] * found.velocities[..., 1] - found.positions[..., 1] * found.velocities[..., 0]) @ mass
    energy = 0.5 * (found.velocities**2).sum(axis=2) @ mass
    assert momentum == pytest.approx(np.broadcast_to(momentum[0], momentum.shape), abs=1e-9)
    assert spin == pytest.approx(spin[0], rel=1e-9)
    assert energy[-1] == pytest.approx(energy[0], rel=1e-9)
    # The line of centres is turned by the angle whose sine is offset over distance.
    assert found.normal[1] / math.hypot(*found.normal) == pytest.approx(-0.12 / 0.25, abs=1e-9)


def test_a_stiff_impact_off_centre_is_that_of_smooth_discs():
    """Impulse along the line of centres only, as the impact becomes short."""
    p = PAIR | {"offset": 0.12, "stiffness_1": 1e12, "stiffness_2": 3e12}
    found = pair_motion(p, np.array([0.0, 0.0006]))
    normal, v = found.normal, np.array([[1.5, 0.0], [0.0, 0.0]])
    impulse = 2 * 16.0 * float((v[0] - v[1]) @ normal)
    assert found.velocities[-1] == pytest.approx(v + np.array([-impulse / 20.0, impulse / 80.0])[:, None] * normal, abs=1e-4)


def test_wall_and_dampers():
    on_wall = pair_motion(PAIR | {"target": "wall", "stiffness_2": 5e7}, np.array([0.0, 0.02]))
    assert on_wall.velocities[-1, 0, 0] == pytest.approx(-1.5, abs=1e-9)
    damped = pair_motion(PAIR | {"contact_damping": 4000.0}, np.array([0.0, 0.01]))
    zeta = 4000.0 / (2.0 * math.sqrt(7.5e6 * 16.0))
    wide = math.sqrt(1.0 - zeta**2)
    # d = exp(-zeta w t) sin(wide w t): k d + c d' is 0, the first time after the touch, before d is.
    angle = math.atan2(2.0 * zeta * wide, 2.0 * zeta**2 - 1.0)
    e = math.exp(-zeta / wide * angle)
    assert (damped.velocities[-1, 1, 0] - damped.velocities[-1, 0, 0]) / 1.5 == pytest.approx(e, rel=1e-6)
    slowed = pair_motion(PAIR | {"damping": 300.0}, np.array([0.0, 0.01]))
    assert np.abs(slowed.velocities[-1, :, 0] @ [20.0, 80.0]) < 30.0


def test_the_cradle_of_five():
    found = chain_motion(np.full(5, 50.0), np.full(4, 1e7), np.zeros(4), np.eye(5)[0], np.linspace(0.0, 0.02, 81))
    # What a scheme with a loss of 1e-3 gives, to the digits that are known of it.
    assert found.velocities[-1] == pytest.approx([-0.132, -0.075, -0.031, 0.296, 0.941], abs=2e-3)
    assert found.velocities.sum(axis=1) == pytest.approx(1.0, abs=1e-12)
    assert (found.velocities[-1] ** 2).sum() == pytest.approx(1.0, abs=1e-12)
    assert (found.forces >= -1e-6).all()


def test_two_logs_are_half_an_oscillation_and_gaps_hand_on_the_speed():
    pair = chain_motion(np.array([20.0, 80.0]), np.array([7.5e6]), np.array([1e-3]), np.array([1.5, 0.0]), np.linspace(0.0, 0.02, 2001))
    assert pair.velocities[-1] == pytest.approx([-0.9, 0.6], abs=1e-12)
    assert pair.forces.max() == pytest.approx(16431.7, rel=1e-4) and pair.events == 2
    row = chain_motion(np.full(4, 50.0), np.full(3, 1e7), np.full(3, 0.01), np.eye(4)[0], np.array([0.0, 0.08]))
    assert row.velocities[-1] == pytest.approx([0.0, 0.0, 0.0, 1.0], abs=1e-12) and row.events == 6


@settings(max_examples=15, deadline=None)
@given(masses=st.lists(positive, min_size=3, max_size=6), speed=positive)
def test_the_two_ways_to_solve_a_row_agree(masses, speed):
    mass = 20.0 * np.array(masses)
    stiffness, gaps, velocity = np.full(len(mass) - 1, 1e7), np.zeros(len(mass) - 1), speed * np.eye(len(mass))[0]
    times = np.array([0.0, 0.015])
    found = chain_motion(mass, stiffness, gaps, velocity, times)
    assert found.velocities[-1] == pytest.approx(chain_with_loss(mass, stiffness, gaps, velocity, times[-1], 0.0), abs=1e-6 * speed)
    assert found.velocities[-1] @ mass == pytest.approx(speed * mass[0], rel=1e-11)


def test_the_loss_is_that_of_a_damper():
    """N = k (d + lag d'): two bodies part with exp(-pi omega lag / 2) to first order."""
    omega = math.sqrt(1e7 / 25.0)
    for lag in (1e-5, 2e-5):
        after = chain_with_loss(np.full(2, 50.0), np.array([1e7]), np.zeros(1), np.array([1.0, 0.0]), 0.01, lag)
        assert after[1] - after[0] == pytest.approx(math.exp(-0.5 * math.pi * omega * lag), abs=(omega * lag) ** 2)
