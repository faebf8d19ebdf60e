"""The exact motions that pairs and rows of logs are compared with obey their equations and known limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.physics.exact.chains import Chain
from dembark.physics.exact.pairs import Pair

BEGIN = 5e-4
PAIR = Pair((20.0, 80.0), 7.5e6, 0.25, (1.5, 0.0))
positive = st.floats(0.1, 10.0)


def row(n, stiffness=1e7, gap=0.0, mass=50.0):
    """n equal bodies, the first of which moves with 1 m/s."""
    return Chain(np.full(n, mass), np.full(n - 1, stiffness), np.full(n - 1, gap), np.eye(n)[0])


@settings(max_examples=25, deadline=None)
@given(m1=positive, m2=positive, k=positive, v=positive)
def test_two_bodies_head_on_are_half_an_oscillation(m1, m2, k, v):
    pair = Pair((20 * m1, 20 * m2), 1e7 * k, 0.25, (v, 0.0))
    reduced = 20 * m1 * m2 / (m1 + m2)
    omega, peak = math.sqrt(1e7 * k / reduced), v * math.sqrt(1e7 * k * reduced)
    assert (pair.omega, pair.reduced_mass, pair.speed) == pytest.approx((omega, reduced, v))
    times = np.linspace(0.0, BEGIN + 1.3 * math.pi / omega, 50)
    found = pair.motion(times, BEGIN)
    assert found.end - found.begin == pytest.approx(math.pi / omega, rel=1e-9)
    assert found.peak == pytest.approx(peak, rel=1e-6)
    during = (times > found.begin) & (times < found.end)
    assert found.force[during] == pytest.approx(peak * np.sin(omega * (times[during] - found.begin)), abs=1e-6 * found.peak)
    assert found.force[~during] == pytest.approx(0.0, abs=1e-9 * found.peak)
    assert found.velocities[-1, :, 0] == pytest.approx([(m1 - m2) / (m1 + m2) * v, 2 * m1 / (m1 + m2) * v], abs=1e-9 * v)


def test_the_published_pair():
    found = PAIR.motion(np.array([0.0, 0.0075]), BEGIN)
    assert found.peak == pytest.approx(16431.7, abs=0.05)
    assert found.velocities[-1, :, 0] == pytest.approx([-0.9, 0.6], abs=1e-9)


def test_off_centre_keeps_momentum_angular_momentum_and_energy():
    found = replace(PAIR, offset=0.12, velocities=(1.5, -0.5)).motion(np.linspace(0.0, 0.008, 41), BEGIN)
    mass = np.array(PAIR.masses)
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
    stiff = replace(PAIR, offset=0.12, stiffness=7.5e11)
    found = stiff.motion(np.array([0.0, 0.0006]), BEGIN)
    normal, v = found.normal, np.array([[1.5, 0.0], [0.0, 0.0]])
    impulse = 2 * 16.0 * float((v[0] - v[1]) @ normal)
    assert impulse == pytest.approx(2 * 16.0 * stiff.speed)
    assert found.velocities[-1] == pytest.approx(v + np.array([-impulse / 20.0, impulse / 80.0])[:, None] * normal, abs=1e-4)


def test_wall_and_dampers():
    on_wall = replace(PAIR, masses=(20.0, math.inf), distance=0.1).motion(np.array([0.0, 0.02]), BEGIN)
    assert on_wall.velocities[-1, 0, 0] == pytest.approx(-1.5, abs=1e-9)
    assert on_wall.positions[:, 1] == pytest.approx(0.0) and not on_wall.velocities[:, 1].any()
    damped = replace(PAIR, contact_damping=4000.0).motion(np.array([0.0, 0.01]), BEGIN)
    zeta = 4000.0 / (2.0 * math.sqrt(7.5e6 * 16.0))
    wide = math.sqrt(1.0 - zeta**2)
    # d = exp(-zeta w t) sin(wide w t): k d + c d' is 0, the first time after the touch, before d is.
    angle = math.atan2(2.0 * zeta * wide, 2.0 * zeta**2 - 1.0)
    e = math.exp(-zeta / wide * angle)
    assert (damped.velocities[-1, 1, 0] - damped.velocities[-1, 0, 0]) / 1.5 == pytest.approx(e, rel=1e-6)
    slowed = replace(PAIR, damping=300.0).motion(np.array([0.0, 0.01]), BEGIN)
    assert np.abs(slowed.velocities[-1, :, 0] @ PAIR.masses) < 30.0


def test_the_cradle_of_five():
    found = row(5).motion(np.linspace(0.0, 0.02, 81))
    # What a scheme with a loss of 1e-3 gives, to the digits that are known of it.
    assert found.velocities[-1] == pytest.approx([-0.132, -0.075, -0.031, 0.296, 0.941], abs=2e-3)
    assert found.velocities.sum(axis=1) == pytest.approx(1.0, abs=1e-12)
    assert (found.velocities[-1] ** 2).sum() == pytest.approx(1.0, abs=1e-12)
    assert (found.forces >= -1e-6).all()


def test_two_logs_are_half_an_oscillation_and_gaps_hand_on_the_speed():
    chain = Chain(np.array([20.0, 80.0]), np.array([7.5e6]), np.array([1e-3]), np.array([1.5, 0.0]))
    pair = chain.motion(np.linspace(0.0, 0.02, 2001))
    assert pair.velocities[-1] == pytest.approx([-0.9, 0.6], abs=1e-12)
    assert pair.forces.max() == pytest.approx(16431.7, rel=1e-4) and pair.events == 2
    assert chain.peak_force(0.02) == pytest.approx(1.5 * math.sqrt(7.5e6 * 16.0), rel=1e-5)
    apart = row(4, gap=0.01).motion(np.array([0.0, 0.08]))
    assert apart.velocities[-1] == pytest.approx([0.0, 0.0, 0.0, 1.0], abs=1e-12) and apart.events == 6


@settings(max_examples=15, deadline=None)
@given(masses=st.lists(positive, min_size=3, max_size=6), speed=positive)
def test_the_two_ways_to_solve_a_row_agree(masses, speed):
    n = len(masses)
    chain = Chain(20.0 * np.array(masses), np.full(n - 1, 1e7), np.zeros(n - 1), speed * np.eye(n)[0])
    found = chain.motion(np.array([0.0, 0.015]))
    assert found.velocities[-1] == pytest.approx(chain.velocities_with_loss(0.015, 0.0), abs=1e-6 * speed)
    assert found.velocities[-1] @ chain.masses == pytest.approx(speed * chain.masses[0], rel=1e-11)


def test_the_loss_is_that_of_a_damper():
    """N = k (d + lag d'): two bodies part with exp(-pi omega lag / 2) to first order."""
    omega = math.sqrt(1e7 / 25.0)
    for lag in (1e-5, 2e-5):
        after = row(2).velocities_with_loss(0.01, lag)
        assert after[1] - after[0] == pytest.approx(math.exp(-0.5 * math.pi * omega * lag), abs=(omega * lag) ** 2)
