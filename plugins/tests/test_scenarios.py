"""The same contacts in Python, LIGGGHTS, YADE and LAMMPS: they agree, and show what each scenario is for."""

from dataclasses import replace

import numpy as np
import pytest
from rig import python_driver
from rig.motion import deviation
from rig.scenarios import DRY, SCENARIOS, TURN, evaluate, loaded, rotation_matrix
from scipy.integrate import quad

from dembark.physics import capillary_force, rupture_distance, viscous_resistance

TOLERANCE = 1e-9
DRIVERS = ["python", "liggghts", "yade", "lammps"]
BRIDGES = [name for name in SCENARIOS if name.startswith("approach, bridge")]
drivers = pytest.mark.parametrize("driver", DRIVERS)


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
@pytest.mark.parametrize("name", SCENARIOS)
def test_engine_agrees_with_python(motions, engine, name, record_property):
    found = deviation(motions("python", name), motions(engine, name))
    for quantity, value in found.items():
        record_property(quantity, value)
    assert max(found.values()) < TOLERANCE, found


@pytest.mark.parametrize("name", SCENARIOS)
def test_something_happens(motions, name):
    """No agreement on nothing: there is a contact, and where the grains slide, a tangential force and a torque."""
    motion = motions("python", name)
    assert motion.normal_force.max() > 0.02
    if not name.startswith(("approach", "head-on")):
        assert np.linalg.norm(motion.tangential_force, axis=1).max() > 0.02 * motion.normal_force.max()
        assert np.abs(motion.torque).max() > 0.0


@pytest.mark.parametrize(("name", "change"), [
    ("cycles, linear", {"static_friction": 0.5 + 1e-6}), ("cycles, linear", {"kinetic_friction": 0.3 + 1e-6}),
    ("cycles, linear", {"critical_slip_distance": 1e-5 * (1 + 1e-5)}), ("cycles, healing time", {"healing_time": 1e-3 * (1 + 1e-5)}),
    ("collision, wet", {"interface_shear_strength": 2e4 * (1 + 1e-6)}), ("collision, wet", {"restitution": 0.8 + 1e-6}),
    ("cycles, rolling spring", {"rolling_friction": 0.1 * (1 + 1e-5)}),
    ("cycles, strong rolling spring", {"rolling_damping_ratio": 0.3 + 1e-5}), ("rolling to rest", {"rolling_damping_ratio": 0.3 + 1e-5}),
    ("drop, constant torque", {"rolling_friction": 0.1 * (1 + 1e-5)}),
    ("approach, bridge", {"bridge_volume": 2e-10 * (1 + 1e-4)}), ("approach, bridge", {"contact_angle": 0.35 + 1e-4})])
def test_rig_sees_small_differences(motions, name, change):
    case = SCENARIOS[name]
    other = python_driver.run(replace(case, material=replace(case.material, **change)))
    assert max(deviation(motions("python", name), other).values()) > 10.0 * TOLERANCE


@pytest.mark.parametrize("name", [name for name, case in SCENARIOS.items() if case.prescribed])
def test_paths_are_consistent(name):
    """The velocity of a path is the derivative of its displacement, and it starts at zero."""
    time, step = np.linspace(2e-4, 9e-3, 40), 1e-7
    for grain in SCENARIOS[name].grains:
        for where, speed in zip(grain.path.displacement, grain.path.velocity, strict=True):
            slope = (evaluate(where, time + step) - evaluate(where, time - step)) / (2.0 * step)
            assert slope == pytest.approx(evaluate(speed, time), rel=1e-6, abs=1e-7)
            assert evaluate(where, np.zeros(1)) == pytest.approx(0.0, abs=1e-17)


def partner(case, motion):
    """Radius of what the first grain meets, inf for the wall, and the gap to it over time."""
    radius = np.inf if case.wall else case.grains[1].radius
    distance = motion.position[:, 0, 2] if case.wall else np.linalg.norm(motion.position[:, 0] - motion.position[:, 1], axis=1)
    return radius, distance - case.grains[0].radius - (0.0 if case.wall else radius)


@drivers
@pytest.mark.parametrize("name", BRIDGES)
def test_bridge_forms_at_touching_and_breaks_at_rupture(motions, driver, name):
    """Two approaches and retreats: no force before touching, attraction over the gap on the way out, none beyond rupture."""
    case, motion = SCENARIOS[name], motions(driver, name)
    m = case.material
    radius, gap = partner(case, motion)
    end = rupture_distance(m.bridge_volume, m.contact_angle, case.grains[0].radius, radius, model=m.capillary_model)
    leaving = np.diff(gap, append=gap[-1]) > 0.0
    apart = gap > 0.0
    held = apart & leaving & (gap < end * (1.0 - 1e-9))
    assert held.sum() > 50 and (apart & ~leaving).sum() > 100 and (gap > end).any()
    first = int(np.argmax(~apart))
    again = first + int(np.argmax(gap[first:] > end * (1.0 + 1e-9)))
    second = again + int(np.argmax(~apart[again:]))
    assert 0 < first < again < second
    for quiet in (slice(0, first), slice(again, second)):
        assert (motion.force[quiet] == 0.0).all()
    pull = -motion.normal_force[first:again]
    assert (pull[gap[first:again] > 0.0] > 0.0).all()


@drivers
@pytest.mark.parametrize(("name", "turned"), [("cycles, linear, limited strength", "cycles, rotated frame"),
                                              ("collision, wet", "collision, wet, rotated frame")])
def test_rotated_frame(motions, driver, name, turned):
    still, other = motions(driver, name), motions(driver, turned)
    for quantity in ("position", "velocity", "angular_velocity", "force", "torque"):
        expected = getattr(still, quantity) @ TURN.T
        assert np.abs(getattr(other, quantity) - expected).max() < 1e-9 * np.abs(expected).max(), quantity


@drivers
def test_rigidly_rotating_pair_keeps_its_force(motions, driver):
    motion = motions(driver, "loaded, rigidly rotating")
    late = motion.time > 0.015
    size = np.linalg.norm(motion.tangential_force[late], axis=1)
    assert size.min() > 0.1 * motion.normal_force[late].min()
    assert np.ptp(size) < 1e-9 * size[0]
    assert np.ptp(motion.normal_force[late]) < 1e-9 * motion.normal_force[late][0]


@pytest.mark.parametrize(("axis", "order"), [((0.0, 0.0, 1.0), 2), ((1.0, 0.0, 0.0), 1), ((1.0, 2.0, 2.0), 1)])
def test_direction_in_a_rotating_frame_converges(axis, order):
    """A frame that turns by 4 rad: the force turns with it, to second order in the time step about the normal.

    A load that lies askew to the axis of a turning normal comes out turned in its plane by at most (turned angle) (angle of one
    step) / 4: first order, as no normal of the step before is stored.
    """
    rate, errors = 200.0, []
    for time_step in (2e-5, 1e-5):
        case = loaded(DRY, time_step)
        still, turning = python_driver.run(case), python_driver.run(case.spinning(axis, rate, "turning"))
        back = np.array([rotation_matrix(axis, -rate * t) @ f for t, f in zip(turning.time, turning.force[:, 0], strict=True)])
        errors.append(np.abs(back - still.force[:, 0]).max() / np.linalg.norm(still.tangential_force, axis=1).max())
        assert errors[-1] < 0.25 * (rate * 0.02) * rate * time_step
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.05)


@drivers
@pytest.mark.parametrize("name", [name for name in SCENARIOS if name.startswith("sliding")])
def test_steady_sliding_has_no_saw_tooth(motions, driver, name):
    """One peak of at most static friction, then down to kinetic friction for good."""
    case, motion = SCENARIOS[name], motions(driver, name)
    ratio = np.linalg.norm(motion.tangential_force, axis=1) / motion.normal_force
    peak = int(ratio.argmax())
    assert np.diff(ratio[peak:]).max() < 1e-12
    assert len(ratio) - peak > 1500
    assert ratio[-1] == pytest.approx(0.3, rel=1e-3)
    static = case.material.static_friction
    if case.material.presliding == "linear":
        assert 0.97 * static < ratio[peak] < static * (1.0 + 1e-12)
    else:
        assert 0.3 < ratio[peak] < static


@drivers
def test_limited_strength_limits_the_force(motions, driver):
    """No tangential force above strength times contact area; with the area of Hertz, pi R* overlap."""
    case = SCENARIOS["cycles, wall"]
    motion, m = motions(driver, "cycles, wall"), case.material
    overlap = np.clip(case.grains[0].radius - motion.position[:, 0, 2], 0.0, None)
    area = np.pi * case.grains[0].radius * overlap
    size = np.linalg.norm(motion.tangential_force, axis=1)
    sliding = size > 0.5 * m.interface_shear_strength * area
    assert sliding.sum() > 50
    repulsion = np.clip(motion.normal_force, 0.0, None)
    strength = m.interface_shear_strength * area[sliding]
    top = -strength * np.expm1(-m.static_friction * repulsion[sliding] / strength)
    # The spring is below the limit; while it sticks, the dash-pot of the restitution may add to it.
    assert np.mean(size[sliding] <= top * (1.0 + 1e-9)) > 0.9


@drivers
def test_grain_leaves_the_wall_with_less_energy(motions, driver):
    for name in ("drop, dry", "drop, wet", "drop, hooke"):
        case, motion = SCENARIOS[name], motions(driver, name)
        grain = case.grains[0]
        squares = (motion.velocity**2 + 0.4 * grain.radius**2 * motion.angular_velocity**2).sum(axis=2)
        kinetic = 0.5 * grain.mass * squares[:, 0]
        energy = kinetic + grain.mass * 9.81 * motion.position[:, 0, 2]
        assert energy[-1] < 0.95 * energy[0]
        # A grain that has left takes its spin about the normal along unchanged.
        assert motion.angular_velocity[-1, 0, 2] == grain.angular_velocity[2]


@drivers
@pytest.mark.parametrize("name", ["head-on, bridge", "head-on, viscous bridge"])
def test_energy_of_a_cycle_is_the_work_of_the_liquid(motions, driver, name):
    """Elastic grains come together and part for good. The kinetic energy that is missing is the hysteresis work of the bridge, which
    forms at touching and breaks on the way out, and what the resistance of the liquid took."""
    case, motion = SCENARIOS[name], motions(driver, name)
    m, (one, two) = case.material, case.grains
    reduced = one.mass * two.mass / (one.mass + two.mass)
    speed = (motion.velocity[:, 0] - motion.velocity[:, 1])[:, 2]
    gap = (motion.position[:, 0] - motion.position[:, 1])[:, 2] - one.radius - two.radius
    end = rupture_distance(m.bridge_volume, m.contact_angle, one.radius, two.radius)
    assert gap[-1] > end
    lost = 0.5 * reduced * (one.velocity[2] ** 2 - speed[-1] ** 2)

    def against_bridge(u):  # the slope of the force is infinite at rupture: gap = end (1 - u^2)
        gap = end * (1 - u * u)
        return 2.0 * end * u * capillary_force(one.radius, two.radius, gap, m.bridge_volume, m.surface_tension, m.contact_angle)

    hysteresis = quad(against_bridge, 0.0, 1.0, epsrel=1e-9)[0]
    held = np.arange(len(gap)) >= int(np.argmax(gap < 0.0))
    held &= gap <= end
    resistance = viscous_resistance(one.radius, two.radius, gap, m.bridge_volume, m.viscosity, m.minimum_gap).normal
    resisted = np.trapezoid(np.where(held, resistance * speed**2, 0.0), motion.time)
    assert lost == pytest.approx(hysteresis + resisted, rel=2e-3)
    assert 0.2 * lost < hysteresis < lost * (1 + 2e-3) and (resisted > 0.2 * lost if m.viscosity else resisted == 0.0)


@drivers
@pytest.mark.parametrize("name", [name for name in SCENARIOS if "viscous bridge" in name and not name.startswith("head-on")])
def test_liquid_resists_only_while_there_is_a_bridge(motions, driver, name):
    """The force is that of the dry contact before the first touch and after each rupture; in between it opposes the motion."""
    case, motion = SCENARIOS[name], motions(driver, name)
    m = case.material
    radius, gap = partner(case, motion)
    end = rupture_distance(m.bridge_volume, m.contact_angle, case.grains[0].radius, radius)
    first = int(np.argmax(gap < 0.0))
    broken = first + int(np.argmax(gap[first:] > end * (1.0 + 1e-9)))
    second = broken + int(np.argmax(gap[broken:] < 0.0))
    assert 0 < first < broken < second
    for dry in (slice(0, first), slice(broken, second)):
        assert (motion.force[dry] == 0.0).all() and (motion.torque[dry] == 0.0).all()
    held = np.arange(len(gap))
    held = (held > first) & (held < broken) & (gap > 0.0)
    relative = motion.velocity[held, 0] - (0.0 if case.wall else motion.velocity[held, 1])
    parting = np.einsum("ij,ij->i", relative, motion.normal[held])
    pull = capillary_force(case.grains[0].radius, radius, gap[held], m.bridge_volume, m.surface_tension, m.contact_angle)
    resisting = motion.normal_force[held] + pull
    expected = viscous_resistance(case.grains[0].radius, radius, gap[held], m.bridge_volume, m.viscosity, m.minimum_gap)
    np.testing.assert_allclose(resisting, -expected.normal * parting, rtol=1e-6, atol=1e-9 * pull.max())
    if name.startswith("dragged"):
        sheared = np.linalg.norm(motion.tangential_force[held], axis=1)
        assert (sheared > 0.0).all() and np.abs(motion.torque[held]).max() > 0.0
