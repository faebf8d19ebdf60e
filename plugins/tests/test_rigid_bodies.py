"""Bodies of spheres by `dembark body` in the engines, against the mechanics of rigid bodies."""

import math
from dataclasses import replace

import numpy as np
import pytest
from rig.rigid_bodies import Flight, fly
from rig.scenarios import Material

ENGINES = ("liggghts", "yade", "lammps")
SMOOTH = Material(youngs_modulus=1e8, restitution=0.5, static_friction=0.0, kinetic_friction=0.0)


def block(*edges):
    """Triangles of a block around the origin with these edges (m)."""
    corners = 0.5 * np.array(edges) * [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners[[(a, b, c) for one in faces for a, b, c in (one[:3], (one[0], *one[2:]))]]


BRICK = block(0.02, 0.03, 0.04)
# Three spheres of 5 mm radius in a row.
ROD, UPRIGHT = block(0.03, 0.01, 0.01), block(0.01, 0.01, 0.03)
MASS = 2500 * 3e-6
MOMENT = MASS * (0.01**2 + 0.03**2) / 12  # across the rod


@pytest.fixture(params=ENGINES)
def engine(request):
    request.getfixturevalue(f"{request.param}_is_there")
    return request.param


def restitution(of_material, counted, moved):
    """That of a contact whose dashpot counts with the mass `counted` where `moved` is what the contact moves: the damping ratio of
    Hertz's contact goes with the root of the former over that of the latter."""
    ratio = -math.log(of_material) / math.hypot(math.log(of_material), math.pi) * math.sqrt(counted / moved)
    return math.exp(-math.pi * ratio / math.sqrt(1 - ratio**2))


def test_free_flight_about_the_middle_axis_conserves_energy_and_momentum(engine, tmp_path):
    """Unstable: it tumbles over several times (Poinsot), and energy and angular momentum must stay what they were."""
    spin = np.array([0.5, 100.0, 0.5])
    found = fly(engine, tmp_path, Flight(BRICK, 0.01, height=0.05, velocity=(0.1, -0.05, 0.03), spin=tuple(spin), time_step=5e-5,
                                         steps=20000, frames=100))
    mass = 2500 * 2.4e-5
    moments = mass / 12 * (np.sum(np.square([0.02, 0.03, 0.04])) - np.square([0.02, 0.03, 0.04]))
    own = found.turn.inv().apply(found.spin)
    energy, momentum = 0.5 * (own**2) @ moments, found.turn.apply(own * moments)
    begin = 0.5 * moments @ spin**2
    print(engine, np.abs(energy / begin - 1).max(), np.abs(momentum - moments * spin).max() / (1e-5 * 100))
    assert own[:, 1].min() < -99 and own[:, 1].max() > 99
    np.testing.assert_allclose(energy, begin, rtol=1e-4)
    # YADE's spins are half a step behind its orientations.
    np.testing.assert_allclose(momentum, np.tile(moments * spin, (len(momentum), 1)), atol=0.5 * 5e-5 * 100 * moments[1] * 100)
    np.testing.assert_allclose(found.velocity, [[0.1, -0.05, 0.03]] * len(momentum), atol=1e-9)
    np.testing.assert_allclose(found.place[-1], [0.1, -0.05, 0.08], atol=2e-4)


def test_the_own_loop_of_yade_damps_with_the_mass_of_the_clump(yade_is_there, tmp_path):
    flight = Flight(UPRIGHT, 0.01, height=0.05, grain=(0, 0, 0.0295, 0, 0, 1.0), grain_mass=0.01, time_step=1e-6, steps=2000, frames=20,
                    material=SMOOTH)
    stock, own = (fly("yade", tmp_path / str(loop), replace(flight, own_loop=loop)) for loop in (False, True))
    np.testing.assert_allclose(own.velocity[-1], [0, 0, 1.5 / (1 / 0.01 + 1 / MASS) / MASS], atol=5e-3)
    np.testing.assert_allclose(own.velocity, stock.velocity, atol=1e-12)


def test_a_body_dropped_on_one_sphere_below_its_centre_rebounds_with_the_restitution(engine, tmp_path):
    """An upright rod. In LIGGGHTS a member damps with its own mass, a third of the body's."""
    found = fly(engine, tmp_path, Flight(UPRIGHT, 0.01, height=0.0155, velocity=(0, 0, -1), floor=True, time_step=1e-6, steps=2000,
                                         frames=20, material=SMOOTH))
    e = restitution(0.5, MASS / 3, MASS) if engine == "liggghts" else 0.5
    print(engine, found.velocity[-1], e)
    np.testing.assert_allclose(found.velocity[-1], [0, 0, e], atol=5e-3)
    assert np.abs(found.spin).max() < 1e-6


@pytest.mark.parametrize("e", [1.0, 0.5])
def test_a_grain_hits_the_end_of_a_rod(engine, tmp_path, e):
    """The impulse (1 + e) v / (1/m + 1/M + a²/I) of two rigid bodies; the dashpot counts with m and M, not with what the end moves."""
    flight = Flight(ROD, 0.01, height=0.05, grain=(0.01, 0, 0.0399, 0, 0, 1.0), grain_mass=0.01, time_step=2e-7, steps=3000, frames=20,
                    material=replace(SMOOTH, youngs_modulus=1e9, restitution=e))
    found = fly(engine, tmp_path, flight)
    moved = 1 / (1 / 0.01 + 1 / MASS + 0.01**2 / MOMENT)
    body = MASS / 3 if engine == "liggghts" else MASS
    seen = restitution(e, 1 / (1 / 0.01 + 1 / body), moved) if e < 1 else 1.0
    impulse = (1 + seen) * moved
    print(engine, e, seen, found.velocity[-1], impulse / MASS, found.spin[-1], -0.01 * impulse / MOMENT, found.grain_velocity[-1])
    np.testing.assert_allclose(found.velocity[-1], [0, 0, impulse / MASS], atol=0.01 * impulse / MASS)
    np.testing.assert_allclose(found.spin[-1], [0, -0.01 * impulse / MOMENT, 0], atol=0.01 * 0.01 * impulse / MOMENT)
    np.testing.assert_allclose(found.grain_velocity[-1], [0, 0, 1 - impulse / 0.01], atol=0.01)
