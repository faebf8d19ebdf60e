"""Logs in space: closed solutions, the cross-section as their limit, conservation laws and the interface."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from dembark.physics import CapsuleSystem, Drum, FinnieRabinowicz, ImpactSystem, Plane

G = 9.81
FLOOR = Plane(point=(0, 0, 0), normal=(0, 0, 1))


def inertia(mass, radius, length):
    """Of a solid capsule about its axis and across it, kg m^2, from the integrals over slices of it."""
    z, weight = np.polynomial.legendre.leggauss(40)

    def over(low, high, square):
        x = low + 0.5 * (high - low) * (z + 1)
        return 0.5 * (high - low) * weight @ np.stack([(s := square(x)), s**2 / 2, s**2 / 4 + s * x**2], axis=1)
    half = 0.5 * length
    volume, axial, across = (over(-half, half, lambda x: radius**2 + 0 * x)
                             + 2 * over(half, half + radius, lambda x: radius**2 - (x - half)**2))
    return mass / volume * np.array([axial, across])


def momenta(motion, mass, moments, k=-1):
    """Momentum, and angular momentum about the origin, of sample k."""
    x, v, w, u = motion.position[k], motion.velocity[k], motion.spin[k], motion.axis[k]
    axial, across = np.broadcast_to(moments, (len(mass), 2)).T[:, :, None]
    own = across * w + (axial - across) * np.sum(w * u, axis=1, keepdims=True) * u
    return mass @ v, (np.cross(x, mass[:, None] * v) + own).sum(axis=0)


def energy(motion, mass, moments, k=-1):
    """Kinetic, J, of sample k, at which nothing touches."""
    axial, across = np.broadcast_to(moments, (len(mass), 2)).T
    along = np.sum(motion.spin[k] * motion.axis[k], axis=1)
    return 0.5 * np.sum(mass * np.sum(motion.velocity[k]**2, axis=1) + across * np.sum(motion.spin[k]**2, axis=1)
                        + (axial - across) * along**2)


@pytest.mark.parametrize(("radius", "length"), [(0.1, 1.5), (0.3, 0.2), (0.2, 0.0), (0.01, 2.0)])
def test_inertia_is_that_of_the_solid(radius, length):
    """By the kinetic energy of a spin about the axis and across it."""
    exact = inertia(40.0, radius, length)
    for axis, moment in (((0, 0, 1), exact[0]), ((1, 0, 0), exact[1])):
        log = CapsuleSystem(40.0, radius, length, [[0, 0, 0]], spin=np.multiply(2.0, axis))
        assert log.run(1e-3, 1e-3).kinetic_energy[0] == pytest.approx(0.5 * moment * 4.0, rel=1e-13)


def test_free_rotation_keeps_energy_and_angular_momentum():
    """About an axis across the log, about its own and about one between, for many turns; the axis goes round the angular momentum."""
    mass, moments = np.array([40.0]), inertia(40.0, 0.1, 1.5)
    for spin in ([3.0, 0, 0], [0, 0, 20.0], [3.0, -2.0, 20.0]):
        motion = CapsuleSystem(40.0, 0.1, 1.5, [[0, 0, 0]], spin=[spin]).run(20.0, 1e-3, every=500)
        _, start = momenta(motion, mass, moments, 0)
        for k in range(len(motion.time)):
            assert energy(motion, mass, moments, k) == pytest.approx(energy(motion, mass, moments, 0), rel=1e-11)
            np.testing.assert_allclose(momenta(motion, mass, moments, k)[1], start, rtol=0, atol=1e-13 * np.linalg.norm(start))
        rate = np.linalg.norm(start) / moments[1]
        direction, u = start / np.linalg.norm(start), motion.axis
        along = u[0, 0] @ direction * direction
        across = u[0, 0] - along
        angle = rate * motion.time[:, None]
        np.testing.assert_allclose(u[:, 0], along + np.cos(angle) * across + np.sin(angle) * np.cross(direction, across), atol=1e-10)


def test_free_rotation_does_not_depend_on_the_step():
    ends = [CapsuleSystem(40.0, 0.1, 1.5, [[0, 0, 0]], spin=[[3.0, -2.0, 20.0]]).run(0.5, dt).orientation[-1, 0] for dt in (0.5, 1e-3)]
    np.testing.assert_allclose(*ends, atol=1e-12)


def tilted(angle, stiffness, turn, height=1e-5, **options):
    """A frictionless log of 40 kg that falls on a rigid plate with its left end first, at 1 m/s."""
    m, r, length = 40.0, 0.1, 1.5
    across = inertia(m, r, length)[1]
    lever = 0.5 * length * np.cos(angle)
    reduced = 1 / (1 / m + lever**2 / across)
    start = r + 0.5 * length * np.sin(angle) + height
    log = CapsuleSystem(m, r, length, [[0, 0, start]], [[0, 0, -1.0]], axis=(np.cos(angle), 0, np.sin(angle)), stiffness=stiffness,
                        theta=0.5, walls=[FLOOR], **options)
    return log, m, across, lever, reduced, turn / np.sqrt(stiffness / reduced), start


@pytest.mark.parametrize("angle", [0.1, 0.6, 1.2])
def test_tilted_log_on_a_plate_is_the_rigid_body(angle):
    """One impact with e = 1: the impulse 2 v m*, 1/m* = 1/m + (lever)^2 / I. The stiffer the log, the closer."""
    errors = []
    for stiffness in (1e11, 1e13):
        log, m, across, lever, reduced, dt, _ = tilted(angle, stiffness, 0.02)
        motion = log.run(1.2e-5 + 3 * np.pi / np.sqrt(stiffness / reduced), dt, every=10**6)
        impulse = 2 * reduced
        np.testing.assert_allclose(motion.velocity[-1, 0], [0, 0, -1 + impulse / m], atol=5e-4)
        np.testing.assert_allclose(motion.spin[-1, 0], [0, lever * impulse / across, 0], atol=1e-3)
        impact, = motion.impacts
        assert impact.impulse == pytest.approx(impulse, rel=5e-4)
        errors.append(abs(motion.velocity[-1, 0, 2] + 1 - impulse / m))
    assert errors[1] < max(0.3 * errors[0], 2e-5)


def test_two_impacts_of_a_falling_log():
    """The other end comes down faster than the log fell; the second impact follows from the first, exactly."""
    angle = 0.15
    log, m, across, lever, reduced, dt, start = tilted(angle, 1e11, 0.05)
    half = 0.75
    v, w = -1 + 2 * reduced / m, 2 * lever * reduced / across  # after the first
    first = 1e-5
    lowest = start - first

    def height(t):  # of the right end after the first impact
        return lowest + v * t + half * np.sin(angle - w * t) - 0.1
    second = brentq(height, 0.02, 0.5)
    tilt = angle - w * second
    closing = -(v - w * half * np.cos(tilt))
    arm = half * np.cos(tilt)
    reduced = 1 / (1 / m + arm**2 / across)
    motion = log.run(first + second + 1e-4, dt, every=10**7)
    assert [round(i.point[0], 2) for i in motion.impacts] == [round(-lever, 2), round(arm, 2)]
    assert motion.impacts[1].time == pytest.approx(first + second, rel=1e-3)
    assert motion.impacts[1].relative_speed == pytest.approx(closing, rel=1e-3)
    np.testing.assert_allclose(motion.velocity[-1, 0, 2], v + 2 * reduced * closing / m, atol=2e-3)
    np.testing.assert_allclose(motion.spin[-1, 0, 1], w - 2 * arm * reduced * closing / across, atol=4e-3)


def test_ends_hit_each_other_as_balls_of_the_same_mass():
    masses, v = [30.0, 50.0], np.array([[0, 0, 1.0], [0, 0, -0.5]])
    logs = CapsuleSystem(masses, [0.1, 0.15], [1.0, 0.4], [[0, 0, 0], [0, 0, 0.951]], v, stiffness=[1e7, 3e7])
    balls = ImpactSystem(masses, [0.1, 0.15], [[0, 0, 0.5], [0, 0, 0.751]], v, stiffness=[1e7, 3e7])
    one, two = (s.run(0.02, 1e-5, every=10) for s in (logs, balls))
    np.testing.assert_allclose(one.velocity, two.velocity, atol=1e-12)
    assert one.impacts[0].peak_force == pytest.approx(two.impacts[0].peak_force, rel=1e-12)
    assert two.velocity[-1, 0, 2] < 0


def test_a_capsule_without_a_length_is_a_ball():
    x, v = np.array([[0, 0, 0.1], [0.05, 0, 0.31], [0.4, 0.03, 0.15]]), [[0, 0, 0], [0, 0, -1.0], [-3.0, 0, 0]]
    options = {"stiffness": 1e7, "friction": 0.3, "gravity": (0, 0, -G), "walls": [FLOOR], "contact_damping": 300.0}
    one = CapsuleSystem(20.0, 0.1, 0.0, x, v, **options).run(0.4, 1e-4, every=100)
    two = ImpactSystem(20.0, 0.1, x, v, inertia="sphere", **options).run(0.4, 1e-4, every=100)
    np.testing.assert_allclose(one.position, two.position, atol=1e-12)
    np.testing.assert_allclose(one.spin, two.spin, atol=1e-10)


def section(n, seed, mu, wall, theta, sweeps):
    """The same logs as capsules along z and as discs."""
    random = np.random.default_rng(seed)
    r = random.uniform(0.06, 0.12, n)
    place = np.array([(i % 3 - 1, i // 3 - 1) for i in range(n)]) * 0.26 + random.uniform(-0.004, 0.004, (n, 2))
    length, mass = random.uniform(0.5, 2.0, n), random.uniform(20, 60, n)
    velocity = random.uniform(-1, 1, (n, 2))
    options = {"friction": mu, "theta": theta, "contact_damping": 500.0, "friction_sweeps": sweeps,
               "stiffness": random.choice([1e7, 2e7], n)}
    moments = np.array([inertia(*each) for each in zip(mass, r, length, strict=True)])
    walls = [Drum(radius=0.65, omega=2.0, stiffness=5e7)] if wall == "drum" else [Plane(point=(0, -0.45), normal=(0.1, 1))]
    discs = ImpactSystem(mass, r, place, velocity, inertia=moments[:, 0], gravity=(0, -G), walls=walls, **options)
    logs = CapsuleSystem(mass, r, length, np.column_stack([place, np.zeros(n)]), np.column_stack([velocity, np.zeros(n)]),
                         gravity=(0, -G, 0), walls=walls, **options)
    return discs, logs


@pytest.mark.parametrize("theta", [1.0, 0.6])
@pytest.mark.parametrize("wall", ["drum", "plane"])
@pytest.mark.parametrize(("mu", "sweeps"), [(0.0, 1), (0.4, 300)])
def test_parallel_logs_are_the_cross_section(theta, wall, mu, sweeps):
    """To 1e-8 m, from impact to impact; friction and normal forces need many alternations to be the same from both sides."""
    discs, logs = section(9, 3, mu, wall, theta, sweeps)
    one, two = (s.run(0.45 if wall == "drum" else 0.25, 2e-4, every=10) for s in (discs, logs))
    assert one.report["impacts_begun"][-1] > 10
    assert two.report["impacts_begun"][-1] == 2 * one.report["impacts_begun"][-1]
    np.testing.assert_allclose(two.position[..., :2], one.position, atol=1e-8)
    np.testing.assert_allclose(two.spin[..., 2], one.spin, atol=1e-6)
    np.testing.assert_allclose(two.position[..., 2], 0.0, atol=1e-10)
    assert two.dissipated_energy[-1] == pytest.approx(one.dissipated_energy[-1], rel=1e-7)


def cluster(seed, n=8, *, reverse=False, **options):
    """Logs in any direction that close in on each other."""
    random = np.random.default_rng(seed)
    r, length, mass = random.uniform(0.06, 0.12, n), random.uniform(0.0, 0.8, n), random.uniform(10, 60, n)
    x = 1.2 * np.array([(i % 2, i // 2 % 2, i // 4) for i in range(n)]) - 0.6 + random.uniform(-0.05, 0.05, (n, 3))
    v, w, q = -2.0 * x + random.normal(0, 0.5, (n, 3)), random.normal(0, 3, (n, 3)), random.normal(size=(n, 4))
    order = np.arange(n)[::-1] if reverse else np.arange(n)
    log = CapsuleSystem(mass[order], r[order], length[order], x[order], v[order], spin=w[order], orientation=q[order],
                        stiffness=np.where(order % 2, 1e7, 3e7), **options)
    return log, mass, np.array([inertia(*each) for each in zip(mass, r, length, strict=True)])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.01, 2.0), st.sampled_from([0.0, 0.3]), st.sampled_from([0.0, 1e3]), st.sampled_from([0.0, 200.0]))
@example(7, 0.1, 0.0, 0.0, 0.0)
def test_energy_never_grows_and_the_ledger_closes(seed, omega_tau, mu, contact_damping, damping):
    log, mass, _ = cluster(seed, friction=mu, contact_damping=contact_damping, damping=damping)
    dt = 2e-3 * omega_tau
    motion = log.run(max(0.4, 300 * dt), dt)
    held = motion.kinetic_energy[1:] + motion.elastic_energy[:-1]  # of one half step
    assert (np.diff(held) <= 1e-12 * held[0]).all()
    np.testing.assert_allclose(held + motion.dissipated_energy[:-1], motion.kinetic_energy[0], rtol=1e-10)
    assert motion.report["worst_certificate"][-1] <= 1e-10
    if not damping:
        np.testing.assert_allclose(mass @ motion.velocity[-1], mass @ motion.velocity[0], atol=1e-11 * np.sum(mass))


def test_impact_without_loss_keeps_all():
    """Of crossing logs, off-centre, with theta = 1/2: momentum and angular momentum to round-off; the energy at the phase of the step at
    which the impact is its own mirror image in time, to round-off too, and at any other within (omega tau)^2 / 4."""
    mass, moments = np.array([30.0, 50.0]), np.array([inertia(30.0, 0.1, 1.2), inertia(50.0, 0.12, 0.8)])
    turn, dt = 0.1, 0.1 / np.sqrt(5e6 / 8)

    def run(gap):
        logs = CapsuleSystem(mass, [0.1, 0.12], [1.2, 0.8], [[0.3, 0.1, 0.0], [0.0, 0.0, 0.22 + gap]], [[0, 0, 1.0], [0, 0, 0]],
                             axis=[[1, 0, 0], [0, 1, 0]], stiffness=1e7, theta=0.5)
        return logs.run(0.04, dt, every=10)

    def gain(gap):
        motion = run(gap)
        assert motion.report["active"][-1] == 0
        for one, two in zip(momenta(motion, mass, moments), momenta(motion, mass, moments, 0), strict=True):
            np.testing.assert_allclose(one, two, atol=1e-12 * 30)
        return energy(motion, mass, moments) / energy(motion, mass, moments, 0) - 1

    gaps = (1 + np.linspace(0, 1, 9)) * dt
    gains = np.array([gain(g) for g in gaps])
    assert np.abs(gains).max() < turn**2 / 4
    change = int(np.flatnonzero(gains[1:] * gains[:-1] < 0)[0])
    best = brentq(gain, gaps[change], gaps[change + 1], xtol=1e-18, rtol=1e-15)
    assert abs(gain(best)) < 1e-12
    assert abs(run(best).spin[-1]).max() > 0.5


def test_results_do_not_depend_on_the_order_of_the_logs():
    """The numbers of the logs turn the contacts round: to round-off until impacts have blown that up."""
    one, two = (cluster(5, friction=0.3, reverse=reverse)[0].run(0.35, 1e-4, every=100) for reverse in (False, True))
    assert one.report["impacts_begun"][-1] == two.report["impacts_begun"][-1] > 5
    np.testing.assert_allclose(one.position, two.position[:, ::-1], atol=1e-9)
    np.testing.assert_allclose(one.axis, two.axis[:, ::-1], atol=1e-8)


def pile(mu=0.4, balls=False, **options):
    """Logs of unequal length in an inclined drum with plates."""
    random = np.random.default_rng(4)
    n = 18
    axis = np.array([np.sin(0.1), 0, np.cos(0.1)])
    x = np.array([(0.3 * (i % 3 - 1), 0.3 * (i // 3 % 3 - 1), 1.3 * (i // 9) - 0.65) for i in range(n)])
    shell = Drum(radius=0.7, omega=2.0, stiffness=5e7, axis=axis)
    mass, length = random.uniform(20, 50, n), random.uniform(0.4, 0.9, n)
    if balls:
        length[::3] = 0.0
    return CapsuleSystem(mass, 0.1, length, x, axis=random.normal((0, 0, 20), 1, (n, 3)),
                         gravity=(0, -G, 0), friction=mu, contact_damping=500.0, walls=[shell, *shell.end_plates(3.0)], **options)


@pytest.mark.parametrize(("theta", "balls"), [(1.0, False), (0.6, False), (1.0, True)])
def test_state_goes_on_bit_for_bit(theta, balls):
    one, two = (pile(theta=theta, balls=balls) for _ in range(2))
    one.run(1.0, 2e-4, every=1000)
    two.restore(one.state(), 2e-4)
    a, b = (s.run(0.2, 2e-4, every=10) for s in (one, two))
    assert a.report["active"].max() > 10
    for name in ("position", "orientation", "spin", "dissipated_energy"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert a.impacts == b.impacts
    assert a.impacts
    np.testing.assert_array_equal(one.state(), two.state())


def test_logs_stay_in_a_drum_that_is_closed():
    motion = pile().run(4.0, 2e-4, every=1000)
    axis = np.array([np.sin(0.1), 0, np.cos(0.1)])
    along = motion.position @ axis
    assert np.abs(along).max() < 1.5
    assert np.linalg.norm(motion.position - along[..., None] * axis, axis=-1).max() < 0.605  # 5 mm of a load that gives way
    assert motion.report["worst_certificate"][-1] <= 1e-10
    assert {i.b for i in motion.impacts} >= {-1, -2, -3}


def test_parallel_logs_lie_still():
    """A log in the valley of two others on a floor, which friction holds: nothing rocks or turns."""
    x = [[0, -0.101, 0.1], [0, 0.101, 0.1], [0, 0, 0.1 + np.sqrt(0.2**2 - 0.101**2)]]
    logs = CapsuleSystem(40.0, 0.1, [1.0, 1.4, 0.8], x, axis=(1, 0, 0), gravity=(0, 0, -G), friction=0.5, contact_damping=3e3,
                         walls=[FLOOR])
    motion = logs.run(2.0, 1e-4, every=1000)
    np.testing.assert_allclose(motion.velocity[-1], 0.0, atol=1e-6)
    np.testing.assert_allclose(motion.spin[-1], 0.0, atol=1e-5)
    np.testing.assert_allclose(motion.axis[-1], [[1, 0, 0]] * 3, atol=1e-6)
    forces = [(c["a"], c["b"], c["normal_force"]) for c in logs.contacts()]
    assert sum(f for _, b, f in forces if b < 0) == pytest.approx(3 * 40 * G, rel=1e-5)
    np.testing.assert_allclose([f for a, b, f in forces if (a, b) == (0, 2)], 40 * G / 4 / np.cos(np.arcsin(0.101 / 0.2)), rtol=0.3)


@pytest.mark.parametrize("balls", [False, True])
def test_every_method_gives_the_same_forces(balls):
    one, forces = pile(balls=balls), []
    one.run(0.5, 2e-4, every=10**6)
    for method in ("auto", "energy", "block", "murty"):
        logs = pile(method=method, balls=balls)
        logs.restore(one.state(), 2e-4)
        logs.run(2e-4, 2e-4)
        forces.append([c["normal_force"] for c in logs.contacts()])
    # One that goes on has contacts of logs and of balls from the steps before.
    one.run(2e-4, 2e-4)
    forces.append([c["normal_force"] for c in one.contacts()])
    assert len(forces[0]) > (8 if balls else 12)  # of logs more than are solved with a matrix in any case
    for other in forces[1:]:
        np.testing.assert_allclose(other, forces[0], rtol=1e-9, atol=1e-6)


def test_end_plates_turn_with_the_drum():
    """A log that leans on a plate is carried round by it: the force along the plate points the way the plate turns."""
    shell = Drum(radius=2.0, omega=1.5, axis=(0, 0, 1), centre=(0, 0, 0.0))
    back, ahead = shell.end_plates(2.0)
    assert (back.omega, ahead.omega, back.point[2], ahead.point[2]) == (1.5, -1.5, -1.0, 1.0)
    log = CapsuleSystem(10.0, 0.1, 0.5, [[1.0, 0, -0.65]], force=(0, 0, -100.0), friction=0.2, contact_damping=1e3, walls=[back])
    log.run(0.05, 1e-4)
    contact, = log.contacts()
    np.testing.assert_allclose(contact["tangential"], [0, 0.2 * contact["normal_force"], 0], rtol=0.05, atol=1.0)


def test_a_period_along_the_drum():
    """Logs that pass the boundary, and fall along the axis of the drum, do what they do in the middle."""
    shell = Drum(radius=0.7, omega=2.0, stiffness=5e7)
    random = np.random.default_rng(8)
    x = np.array([(0.3 * (i % 3 - 1), 0.3 * (i // 3 - 1), 2.0 + random.uniform(-0.3, 0.3)) for i in range(9)])
    axis = random.normal((0, 0, 12), 1, (9, 3))
    options = {"axis": axis, "gravity": (0, -9.7, 1.0), "friction": 0.3, "walls": [shell], "stiffness": 1e7}
    alone = CapsuleSystem(30.0, 0.1, 0.6, x, **options).run(0.6, 2e-4, every=100)
    for move in (0.0, 2.1, -7.3):
        motion = CapsuleSystem(30.0, 0.1, 0.6, x + np.array([0, 0, move]), period=4.0, **options).run(0.6, 2e-4, every=100)
        np.testing.assert_allclose(motion.position - [0, 0, move], alone.position, atol=1e-7)
    # A row that is longer than the period by an overlap pushes itself apart: the last log touches the first.
    row = CapsuleSystem(30.0, 0.1, 1.0, [[0, 0, 1.1995 * i] for i in range(4)], period=4 * 1.1995)
    row.run(1e-4, 1e-4)
    assert sorted((c["a"], c["b"]) for c in row.contacts() if c["normal_force"] > 0) == [(0, 1), (0, 3), (1, 2), (2, 3)]


GOOD = {"mass": 40.0, "radius": 0.1, "length": 1.0, "position": [[0, 0, 0], [0, 1, 0]]}


@pytest.mark.parametrize(("wrong", "message"), [
    ({"length": -1.0}, "length must be >= 0 m and finite, not -1"),
    ({"radius": 0.0}, "radius must be > 0 m and finite, not 0"),
    ({"mass": 0.0}, "mass must be > 0 kg, not 0"),
    ({"mass": [1.0, 2.0, 3.0]}, r"mass must be a number or have one value a body, shape \(2,\), not \(3,\) \(kg\)"),
    ({"position": [[0, 0, 0], [0, 0.19, 0]]}, "body 0 and body 1 overlap at the start by 0.1 of the radius"),
    ({"walls": [FLOOR]}, "body 0 and wall 1 overlap at the start"),
    ({"position": [0.0, 1.0]}, r"position must have the shape \(bodies, 3\), not \(2,\)"),
    ({"position": [[0, 0, np.nan]]}, "position must be a finite number"),
    ({"axis": (0, 0, 0)}, "axis must not be zero"),
    ({"orientation": (0, 0, 0, 0)}, "orientation must not be zero"),
    ({"orientation": (1, 0, 0)}, r"orientation must have the shape \(2, 4\), not \(3,\)"),
    ({"orientation": (1, 0, 0, 0), "axis": (0, 0, 1)}, "give orientation or axis, not both"),
    ({"inertia": (1.0, -1.0)}, r"inertia must be > 0 kg m\^2, not -1"),
    ({"inertia": 1.0}, r"inertia must have the shape \(2, 2\), not \(\)"),
    ({"walls": [Drum(radius=1.0, axis=(0, 0, 0))]}, "axis must not be zero"),
    ({"period": 5.0, "walls": [Drum(radius=9.0, axis=(0, 0.1, 1))]}, "with a period all walls must be the same along z"),
    ({"period": 1.0}, "the periodic box is too short along z"),
    ({"friction": FinnieRabinowicz(static_friction=0.5, kinetic_friction=0.5, critical_slip_distance=0.0, presliding="partial_slip")},
     "presliding of logs"),
])
def test_one_clear_line(wrong, message):
    with pytest.raises(ValueError, match=message) as error:
        CapsuleSystem(**GOOD | wrong)
    assert "\n" not in str(error.value)


def test_the_axis_of_a_drum_in_the_plane():
    with pytest.raises(ValueError, match="in the plane the axis of a drum must be along z"):
        ImpactSystem(1.0, 0.1, [[0.0, 1.0]], walls=[Drum(radius=2.0, axis=(1, 0, 0))])
