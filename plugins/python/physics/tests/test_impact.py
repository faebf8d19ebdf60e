"""Impacts of logs: closed solutions, conservation laws and the interface."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.physics import Drum, FinnieRabinowicz, ImpactChain, ImpactSystem, Plane

G = 9.81


def pair(omega_tau, theta=1.0, phase=0.3, **options):
    """Two logs of 50 kg, 1e7 N/m each, closing with 1 m/s: restitution, motion."""
    omega = np.sqrt(5e6 / 25.0)
    dt = omega_tau / omega
    row = ImpactChain([50, 50], 1e7, [0, (1 + phase) * dt], [0.5, -0.5], theta=theta, **options)
    motion = row.run(4 * np.pi / omega, dt)
    return motion.velocity[-1, 1] - motion.velocity[-1, 0], motion


@pytest.mark.parametrize("theta", [1.0, 0.8, 0.6])
def test_restitution_of_the_scheme(theta):
    e, motion = pair(0.01, theta)
    assert e == pytest.approx(np.exp(-np.pi * (2 * theta - 1) * 0.01 / 2), abs=2e-4)
    impact, = motion.impacts
    assert impact.impulse == pytest.approx(25 * (1 + e), rel=1e-12)
    assert impact.peak_force == motion.contact_force.max()
    assert impact.duration == pytest.approx(np.pi / np.sqrt(5e6 / 25), rel=0.01)
    assert impact.dissipated == pytest.approx(12.5 * (1 - e**2), rel=1e-9)


def test_published_numbers():
    e, motion = pair(0.01)
    assert e == pytest.approx(0.9844, abs=5e-5)
    assert motion.contact_force.max() / np.sqrt(5e6 * 25) == pytest.approx(0.9922, abs=5e-5)
    dt = 1e-3 / np.sqrt(7.5e6 / 16)
    motion = ImpactChain([20, 80], [1e7, 3e7], [0, 1e-5], [1.5, 0]).run(4000 * dt, dt)
    assert motion.contact_force.max() == pytest.approx(16418.8, abs=0.05)
    np.testing.assert_allclose(motion.velocity[-1], [-0.898, 0.5995], atol=5e-4)


def test_cradle_and_its_momentum():
    row = ImpactChain(np.full(5, 50.0), 2e7, 0.1 * np.arange(5), [1, 0, 0, 0, 0], radius=0.05)
    motion = row.run(0.02, 1e-6, every=100)
    np.testing.assert_allclose(motion.velocity[-1], [-0.132, -0.075, -0.031, 0.296, 0.941], atol=6e-4)
    np.testing.assert_allclose(50 * motion.velocity.sum(axis=1), 50.0, rtol=1e-12)


def test_theta_half_loses_less_than_a_thousandth_and_converges():
    def worst(omega_tau):
        return max(abs(1 - pair(omega_tau, 0.5, phase)[0] ** 2) for phase in np.arange(0.05, 1.0, 0.1))
    assert worst(0.01) < 3e-5
    assert worst(0.04) < 3e-5 * 16


def test_a_row_between_walls():
    """Columns of the contact force: walls first and last; the stack's weights as forces in a row."""
    row = ImpactChain([10, 20, 30], 1e7, [0.1, 0.3, 0.5], [0, 0, 0], radius=0.1, force=[-98.1, -196.2, -294.3], left_wall=(0.0, 2e7))
    motion = row.run(20.0, 1e-3, every=1000)
    np.testing.assert_allclose(motion.contact_force[-1], [588.6, 490.5, 294.3, 0.0], rtol=1e-9)
    bounce = ImpactChain([10], 1e7, [0.5], [2.0], radius=0.1, left_wall=0.0, right_wall=(1.0, 1e7)).run(1.0, 1e-6, every=1000)
    assert [i.b for i in bounce.impacts] == [-2, -1]
    assert bounce.velocity[-1, 0] == pytest.approx(2.0, rel=5e-3)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(1.0, 100.0), min_size=2, max_size=6), st.integers(0, 2**31), st.floats(0.02, 5.0), st.sampled_from([0.0, 3e3]),
       st.sampled_from([0.0, 300.0]))
def test_energy_never_grows_and_the_ledger_closes(mass, seed, omega_tau, contact_damping, damping):
    random = np.random.default_rng(seed)
    n = len(mass)
    row = ImpactChain(mass, random.uniform(1e6, 3e7, n), 0.2 * np.arange(n), random.uniform(-2, 2, n), radius=0.099,
                      contact_damping=contact_damping, damping=damping)
    dt = omega_tau * 1e-3
    motion = row.run(500 * dt, dt)
    held = motion.kinetic_energy[1:] + motion.elastic_energy[:-1]  # of one half step
    assert (np.diff(held) <= 1e-12 * held[0]).all()
    np.testing.assert_allclose(held + motion.dissipated_energy[:-1], motion.kinetic_energy[0], rtol=1e-10)
    if not damping:
        np.testing.assert_allclose(motion.velocity @ mass, motion.velocity[0] @ mass, atol=1e-10 * np.sum(mass))


@pytest.mark.parametrize("zeta", [0.1, 0.5, 0.9])
def test_contact_damping_lets_go_without_tension(zeta):
    omega = np.sqrt(5e6 / 25)
    e, _ = pair(3e-4, 0.5, contact_damping=2 * zeta * omega * 25)
    assert e == pytest.approx(np.exp(-2 * zeta / np.sqrt(1 - zeta**2) * np.arccos(zeta)), abs=1e-3)


def test_body_damping_is_the_damped_oscillator():
    zeta, omega = 0.02, np.sqrt(5e6 / 25)
    e, _ = pair(1e-3, 0.5, damping=2 * zeta * omega * 50)
    assert e == pytest.approx(np.exp(-zeta * np.pi / np.sqrt(1 - zeta**2)), rel=1e-4)


def on_floor(mu, **options):
    options = {"contact_damping": 1e4, "gravity": (0, -G)} | options
    return ImpactSystem(40.0, 0.1, [[0, 0.1 - 40 * G / 5e6]], stiffness=1e7, friction=mu,
                        walls=[Plane(point=(0, 0), normal=(0, 2), stiffness=1e7)], **options)


def test_spinning_log_comes_to_roll():
    motion = on_floor(0.3, spin=-30.0).run(0.5, 2e-5, every=500)
    assert motion.velocity[-1, 0, 0] == pytest.approx(1.0, rel=2e-3)
    assert -0.1 * motion.spin[-1, 0] == pytest.approx(1.0, rel=2e-3)
    lost = motion.dissipated_energy[-1]
    assert lost == pytest.approx(2 / 3 * 0.5 * 0.5 * 40 * 0.01 * 900, rel=5e-3)


@pytest.mark.parametrize(("ratio", "slides"), [(0.9, False), (1.1, True)])
def test_rolling_on_a_slope(ratio, slides):
    slope = np.arctan(3 * 0.1 * ratio)
    log = on_floor(0.1, gravity=(G * np.sin(slope), -G * np.cos(slope)))
    motion = log.run(0.5, 2e-5, every=12500)
    gain = motion.velocity[-1, 0, 0] - motion.velocity[-2, 0, 0]
    a = G * (np.sin(slope) - 0.1 * np.cos(slope)) if slides else 2 / 3 * G * np.sin(slope)
    assert gain == pytest.approx(a * 0.25, rel=2e-3)


def test_friction_law_of_a_wall():
    weak = FinnieRabinowicz(static_friction=0.5, kinetic_friction=0.2, critical_slip_distance=1e-4)
    log = ImpactSystem(40.0, 0.1, [[0, 0.1 - 40 * G / 5e6]], [[2.0, 0]], gravity=(0, -G), inertia=np.inf, contact_damping=1e4,
                       walls=[Plane(point=(0, 0), normal=(0, 1), stiffness=1e7, friction=weak)])
    motion = log.run(0.4, 2e-5, every=2000)
    assert motion.velocity[-1, 0, 0] == pytest.approx(2.0 - 0.2 * G * 0.4, rel=2e-3)
    contact, = log.contacts()
    assert (contact["a"], contact["b"]) == (0, -1)
    assert contact["tangential"][0] == pytest.approx(-0.2 * contact["normal_force"], rel=1e-3)


def crowd(theta=1.0):
    x = np.array([[0.2 * i, 0.2 * j] for i in (-2, -1, 0, 1, 2) for j in (-2, -1, 0, 1)])
    r = 0.07 + 0.02 * np.cos(7.0 * np.arange(len(x)))
    return ImpactSystem(4000 * r**2, r, x, stiffness=np.where(np.arange(len(x)) % 2, 1e7, 2e7), gravity=(0, -G), friction=0.4, theta=theta,
                        walls=[Drum(radius=1.0, omega=3.0, stiffness=5e7)], contact_damping=300.0)


@pytest.mark.parametrize("theta", [1.0, 0.6])
def test_state_goes_on_bit_for_bit(theta):
    one, two = crowd(theta), crowd(theta)
    one.run(2.0, 1e-4, every=1000)
    two.restore(one.state(), 1e-4)
    a, b = (s.run(0.2, 1e-4, every=10) for s in (one, two))
    assert a.report["active"].max() > 3
    np.testing.assert_array_equal(a.position, b.position)
    np.testing.assert_array_equal(a.dissipated_energy, b.dissipated_energy)
    assert a.impacts == b.impacts
    assert a.impacts
    np.testing.assert_array_equal(one.state(), two.state())


def test_runs_in_pieces_are_one_run():
    one, two = crowd(), crowd()
    whole = one.run(0.4, 1e-4, every=4000)
    pieces = [two.run(0.1, 1e-4) for _ in range(4)]
    np.testing.assert_array_equal(whole.position[-1], pieces[-1].position[-1])
    assert whole.impacts == [i for p in pieces for i in p.impacts]
    assert whole.report["impulse_sum"][-1] == pieces[-1].report["impulse_sum"][-1]


def test_every_method_gives_the_same_forces():
    forces = []
    for method in ("auto", "energy", "block", "murty"):
        s = ImpactSystem(20.0, 0.1, [[0, 0.1], [0.1992, 0.1], [0.0996, 0.2725]], gravity=(0, -G), method=method,
                         walls=[Plane(point=(0, 0), normal=(0, 1))])
        s.run(2e-3, 1e-4)
        forces.append([c["normal_force"] for c in s.contacts()])
    np.testing.assert_allclose(forces, np.broadcast_to(forces[0], np.shape(forces)), rtol=1e-9, atol=1e-9)


def test_what_is_held_or_rests_may_overlap():
    """A rough floor of fixed discs; a log on the deflection of its weight."""
    floor = ImpactSystem(np.inf, 0.1, [[0.0, 0.0], [0.15, 0.0]], inertia=[np.inf, np.inf], walls=[Plane(point=(0, 0), normal=(0, 1))])
    assert not floor.run(1e-3, 1e-4).velocity.any()
    row = ImpactChain([1], 1e7, [-9.81 / 1e7], [0], left_wall=0.0, force=-9.81)
    assert abs(row.run(0.01, 1e-5).velocity).max() < 1e-6


def test_in_space():
    """A ball that slides and spins on a floor obliquely; the axis of its spin turns as friction says."""
    ball = ImpactSystem(1.0, 0.1, [[0, 0, 0.1 - G / 5e6]], [[1.0, 2.0, 0]], spin=[[0, 0, 0]], stiffness=1e7, gravity=(0, 0, -G),
                        inertia="sphere", friction=0.5, contact_damping=1e3,
                        walls=[Plane(point=(0, 0, 0), normal=(0, 0, 1), stiffness=1e7)])
    motion = ball.run(1.0, 1e-5, every=1000)
    np.testing.assert_allclose(motion.velocity[-1, 0], [5 / 7, 10 / 7, 0], atol=3e-3)
    np.testing.assert_allclose(motion.spin[-1, 0] * 0.1, [-10 / 7, 5 / 7, 0], atol=3e-3)


@pytest.mark.parametrize(("wrong", "message"), [
    (lambda: ImpactChain([1, 1], 1e7, [1, 0], [0, 0]), "ascend"),
    (lambda: ImpactChain([1, -1], 1e7, [0, 1], [0, 0]), "mass must be > 0 kg"),
    (lambda: ImpactChain([1, 1], [1e7] * 3, [0, 1], [0, 0]), r"stiffness must be a number or have one value a body, shape \(2,\)"),
    (lambda: ImpactChain([1, 1], 1e7, [0, 1], [0, 0], theta=0.3), "theta"),
    (lambda: ImpactChain([1, 1], 1e7, [0, 1], [0, 0], method="x").run(1, 1), "method must be"),
    (lambda: ImpactSystem(1.0, 0.1, [0.0, 1.0]), r"position must have the shape \(bodies, 2\)"),
    (lambda: ImpactSystem(1.0, 0.1, [[0.0, 1.0]], inertia="cube"), "inertia must be"),
    (lambda: ImpactSystem(1.0, 0.1, [[0.0, 1.0]], friction=-1.0), "friction"),
    (lambda: ImpactSystem(1.0, 0.1, [[0.0, 1.0]], friction=FinnieRabinowicz(
        static_friction=0.5, kinetic_friction=0.5, critical_slip_distance=0.0, presliding="partial_slip")), "presliding of logs"),
    (lambda: ImpactSystem(1.0, 0.1, [[0.0, 1.0]], friction=FinnieRabinowicz(
        static_friction=0.5, kinetic_friction=0.5, critical_slip_distance=0.0, friction_limit="elastic")), "friction_limit of logs"),
    (lambda: ImpactSystem(1.0, 0.1, [[0.0, 1.0]], walls=[Plane(point=(0, 0), normal=(0, 0))]), "normal must not be zero"),
    (lambda: ImpactSystem(1.0, 0.1, [[0.0, 1.0]]).run(1.0, 0.0), "dt must be > 0 s"),
    # Contacts that would throw bodies apart.
    (lambda: ImpactSystem(40.0, 0.1, [[0.0, 0.0], [0.1, 0.0]]), "overlap at the start by 1 of the radius; at most 0.05 is allowed"),
    (lambda: ImpactSystem(40.0, 0.1, [[0.0, 0.0], [0.5, 0.0]], walls=[Drum(radius=0.2)]), "and wall 1 overlap at the start"),
    (lambda: ImpactChain([20, 80], 1e7, [0, 0.1], [0, 0], radius=0.1), "overlap at the start by 1 of the radius"),
    (lambda: ImpactChain([20], 1e7, [1e-3], [0], radius=0.1, left_wall=0.0), "body 0 and wall 1 overlap at the start"),
    (lambda: ImpactSystem(1.0, 0.1, [[0.0, 1.0]], walls=[Plane(point=(0, 0), normal=(0, 1), omega=5.0)]), "a plane must not turn"),
])
def test_one_clear_line(wrong, message):
    with pytest.raises(ValueError, match=message) as error:
        wrong()
    assert "\n" not in str(error.value)


def test_the_point_of_contact_lies_between_the_logs():
    logs = ImpactSystem(50.0, 0.1, [(0.0, 0.0), (0.2, 0.0)])
    logs.run(1e-5, 1e-5)
    (contact,) = logs.contacts()
    assert contact["point"] == pytest.approx([0.1, 0.0, 0.0])
