"""The schemes have the orders and stability limits that they are known for, and the problems the laws of `dembark.physics`."""

import json
import math

import numpy as np
import pytest

from benchmarks import schemes, schemes_problems
from benchmarks.schemes_problems import MASS, RADIUS
from dembark.physics import Body, Contact, FinnieRabinowicz, drop

ORDERS = {"verlet": (2, 2), "engines": (2, 1), "ab2": (2, 2), "ab3": (3, 3), "ab4": (4, 4), "pece": (4, 4), "pecece": (4, 4),
          "rkf45": (5, 5), "midpoint": (2, 2)}
# Where an undamped oscillator begins to grow. Verlet: 2; D. R. Durran, Mon. Weather Rev. 119 (1991) 702: 0 of the second, 0.72 of the third
# and 0.43 of the fourth order of Adams and Bashforth; the midpoint rule is stable for all steps.
KNOWN = {"verlet": 2.0, "engines": 2.0, "ab2": 0.0, "ab3": 0.7236, "ab4": 0.4300, "midpoint": math.inf}


@pytest.mark.parametrize("name", schemes.SCHEMES)
def test_order_of_convergence(name):
    for damping, expected in zip((0.0, 0.1), ORDERS[name], strict=True):
        assert schemes.order(schemes.SCHEMES[name][2], damping, (80, 160)) == pytest.approx(expected, abs=0.15)


@pytest.mark.parametrize("name", KNOWN)
def test_the_characteristic_equation_has_the_known_limit(name):
    found = schemes.limit(lambda turn: schemes.known_growth(name, turn), 1e-12)
    assert found == pytest.approx(KNOWN[name], abs=0.05 if name == "ab2" else 1e-3)


@pytest.mark.parametrize("damping", [0.1, 0.5])
def test_lagging_damping_lowers_the_limit_as_its_closed_form_says(damping):
    """omega h = 2 (sqrt(1 + zeta^2) - zeta): T. Belytschko, in: Computational Methods for Transient Analysis (North-Holland 1983)."""
    found = schemes.limit(lambda turn: schemes.known_growth("engines", turn, damping), 1e-12)
    assert found == pytest.approx(2.0 * (math.hypot(1.0, damping) - damping), abs=2e-4)


@pytest.mark.parametrize("name", [name for name in schemes.SCHEMES if name != "midpoint"])
def test_an_oscillator_grows_as_the_characteristic_equation_says(name):
    for damping in (0.2,) if name == "rkf45" else (0.0, 0.2):
        _, known, measured = schemes.limits(name, damping)
        assert measured == pytest.approx(known, rel=0.02)


def test_the_midpoint_rule_does_not_grow_at_any_step():
    problem = schemes_problems.oscillator()
    problem.end = 50 * 8.0
    assert problem.energy(schemes.midpoint(problem, 8.0)) == pytest.approx(0.5, rel=1e-6)


def test_the_scheme_of_the_engines_is_that_of_drop():
    """The same impact in `dembark.physics.drop`, which LIGGGHTS, LAMMPS and YADE equal to round-off."""
    law = Contact(effective_youngs_modulus=schemes_problems.E_STAR, effective_shear_modulus=schemes_problems.G_STAR, restitution=0.7,
                  friction=FinnieRabinowicz(static_friction=0.0, kinetic_friction=0.0, critical_slip_distance=0.0))
    gap, h = 1e-5, schemes_problems.duration(1.0) / 20.0
    problem = schemes_problems.impact(0.7, gap)
    problem.end = 40 * h
    theirs = drop(law, Body(radius=RADIUS, mass=MASS, position=(0, 0, RADIUS + gap), velocity=(0, 0, -1.0)), time_step=h, steps=40,
                  gravity=(0, 0, 0)).velocity[-1, 0, 2]
    ours = schemes.verlet(problem, h, lagged=True)[1]
    assert ours == pytest.approx(theirs, rel=1e-9)
    assert schemes.verlet(problem, h)[1] != pytest.approx(theirs, rel=1e-3)


def test_the_block_has_the_friction_of_the_law():
    """The displacements of the spring along a path, in the step of the engines."""
    block, path = schemes_problems.block(), np.concatenate([np.linspace(0.0, 4e-4, 101)[1:], np.linspace(4e-4, 2e-4, 101)])
    s, springs = np.zeros(2), []
    for move in np.diff(path, prepend=0.0)[:100]:
        s = block.advance(s, np.array([move]), s, 1.0)
        springs.append(s[0])
    force = schemes_problems.LAW.drive(schemes_problems.BLOCK_LOAD, schemes_problems.BLOCK_STIFFNESS, 1e-6, path[:100])
    assert schemes_problems.BLOCK_STIFFNESS * np.array(springs) == pytest.approx(force, rel=1e-9)


def test_a_contact_of_the_bed_is_that_of_the_shared_law():
    """Normal and tangential force of two grains, and the torque."""
    friction = FinnieRabinowicz(static_friction=0.5, kinetic_friction=0.5, critical_slip_distance=0.0)
    law = Contact(effective_youngs_modulus=schemes_problems.E_STAR, effective_shear_modulus=schemes_problems.G_STAR, restitution=0.7,
                  friction=friction)
    bed = schemes_problems.Bed(0.7, 0.5, count=2, gravity=0.0)
    x = np.array([0.03, 0.03, 0.0, 0.03 + 1.3 * RADIUS, 0.03 + 1.5 * RADIUS, 0.0])
    for sideways in (0.002, 3.0):  # sticks, slides
        v, h = np.array([0.1, sideways, 2.0, -0.1, 0.3, 1.0]), 1e-6
        s = bed.advance(x, v, np.zeros(len(bed.body)), h)
        found = bed.acceleration(x, v, s)
        # x, z and the angle are x, y and the angle about z of the law.
        separation = (x[0] - x[3], x[1] - x[4], 0.0)
        force, torque = law.begin().step(separation, (v[0], v[1], 0.0), (v[3], v[4], 0.0), (0.0, 0.0, v[2]), (0.0, 0.0, v[5]), RADIUS,
                                         RADIUS, MASS, MASS, h, True)[:2]
        assert MASS * found[:2] == pytest.approx(force[:2], rel=1e-9)
        assert 0.4 * MASS * RADIUS**2 * found[2] == pytest.approx(torque[2], rel=1e-9)


def test_the_references_do_not_depend_on_their_tolerance():
    assert schemes_problems.impact_oracle(0.7, 1e-13) == pytest.approx(schemes_problems.impact_oracle(0.7, 1e-11), abs=1e-10)
    assert schemes_problems.block_oracle() == pytest.approx(schemes_problems.block_oracle(1e-11), abs=1e-11)
    # Without damping nothing is lost.
    assert schemes_problems.impact_oracle(1.0) == pytest.approx(1.0, abs=1e-12)


def test_energy_stays_with_verlet_and_grows_with_adams_and_bashforth():
    verlet, ab2 = (schemes.drift(schemes.SCHEMES[name][2], 1, spans=3) for name in ("verlet", "ab2"))
    assert max(map(abs, verlet)) < 0.02 < ab2[0] < ab2[-1]


def test_the_command_keeps_what_it_does_not_measure_anew(tmp_path, monkeypatch):
    monkeypatch.setattr(schemes, "STEPS", (10,))
    file = tmp_path / "schemes.json"
    file.write_text('{"orders": 1, "step": 2}')
    assert schemes.main(["--only", "step", "--out", str(file)]) == 0
    found = json.loads(file.read_text())
    assert found["orders"] == 1
    errors = {row["restitution"]: row["largest"] for row in found["step"]}
    # The lag of the damping: the stronger that is, the larger is the error.
    assert 0.0 < errors[1.0] < errors[0.9] < errors[0.5] < errors[0.3] < 0.05


def test_the_block_as_a_differential_equation_is_that_from_event_to_event():
    """And in the steps of the engines, at first order."""
    exact = schemes_problems.block_oracle()
    problem = schemes_problems.block()
    assert problem.measure(schemes.fehlberg(problem, 0.0, 1e-8)) == pytest.approx(exact, abs=1e-6)
    errors = [np.abs(problem.measure(schemes.verlet(schemes_problems.block(), h, lagged=True)) - exact).max() for h in (2e-3, 1e-5)]
    assert errors[1] < 1e-3 and errors[1] < errors[0] / 50.0
