"""The same contact in Python, LIGGGHTS, YADE and LAMMPS."""

from dataclasses import replace

import numpy as np
import pytest
from rig import python_driver
from rig.motion import deviation
from rig.scenarios import SCENARIOS, evaluate

TOLERANCE = 1e-9


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
