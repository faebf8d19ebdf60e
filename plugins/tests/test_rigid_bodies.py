"""Bodies of spheres by `dembark body` in the engines, against the mechanics of rigid bodies."""

import math
from dataclasses import replace

import numpy as np
import pytest
from rig.liggghts_driver import head, run_deck
from rig.rigid_bodies import Flight, fly, written
from rig.scenarios import Material

ENGINES = ("liggghts", "yade", "lammps")
SMOOTH = Material(youngs_modulus=1e8, restitution=0.5, static_friction=0.0, kinetic_friction=0.0)


def block(*edges):
    """Triangles of a block around the origin with these edges (m)."""
    corners = 0.5 * np.array(edges) * [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners[[(a, b, c) for one in faces for a, b, c in (one[:3], (one[0], *one[2:]))]]


# A corner of a block of 4, 3 and 2 cm.
_CORNERS = np.array([[0, 0, 0], [0.04, 0, 0], [0, 0.03, 0], [0, 0, 0.02]])
WEDGE = _CORNERS[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
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
    found = fly(engine, tmp_path, Flight(BRICK, height=0.05, velocity=(0.1, -0.05, 0.03), spin=tuple(spin.tolist()), time_step=5e-5,
                                         steps=20000, frames=100))
    mass = 2500 * 2.4e-5
    moments = mass / 12 * (np.sum(np.square([0.02, 0.03, 0.04])) - np.square([0.02, 0.03, 0.04]))
    own = found.turn.inv().apply(found.spin)
    energy, momentum = 0.5 * (own**2) @ moments, found.turn.apply(own * moments)
    begin = 0.5 * moments @ spin**2
    assert own[:, 1].min() < -99 and own[:, 1].max() > 99
    np.testing.assert_allclose(energy, begin, rtol=1e-4)
    # YADE's spins are half a step behind its orientations.
    np.testing.assert_allclose(momentum, np.tile(moments * spin, (len(momentum), 1)), atol=0.5 * 5e-5 * 100 * moments[1] * 100)
    np.testing.assert_allclose(found.velocity, [[0.1, -0.05, 0.03]] * len(momentum), atol=1e-9)
    np.testing.assert_allclose(found.place[-1], [0.1, -0.05, 0.08], atol=2e-4)


def test_the_own_loop_of_yade_damps_with_the_mass_of_the_clump(yade_is_there, tmp_path):
    flight = Flight(UPRIGHT, height=0.05, grains=((0, 0, 0.0295, 0, 0, 1.0),), grain_mass=0.01, time_step=1e-6, steps=2000, frames=20,
                    material=SMOOTH)
    stock, own = (fly("yade", tmp_path / str(loop), replace(flight, own_loop=loop)) for loop in (False, True))
    np.testing.assert_allclose(own.velocity[-1], [0, 0, 1.5 / (1 / 0.01 + 1 / MASS) / MASS], atol=5e-3)
    np.testing.assert_allclose(own.velocity, stock.velocity, atol=1e-12)


def test_a_body_dropped_on_one_sphere_below_its_centre_rebounds_with_the_restitution(engine, tmp_path):
    """An upright rod: what damps is the mass of the body, not that of a sphere."""
    found = fly(engine, tmp_path, Flight(UPRIGHT, height=0.0155, velocity=(0, 0, -1), floor=True, time_step=1e-6, steps=2000,
                                         frames=20, material=SMOOTH))
    np.testing.assert_allclose(found.velocity[-1], [0, 0, 0.5], atol=1e-3)
    assert np.abs(found.spin).max() < 1e-6


@pytest.mark.parametrize(("e", "friction"), [(1.0, 0.0), (0.5, 0.0), (1.0, 0.1)])
def test_a_grain_hits_the_end_of_a_rod(engine, tmp_path, e, friction):
    """The impulse of two rigid bodies, sliding throughout. The dashpot counts with m and M, not with what the end moves."""
    arm, radius, m = 0.01, 0.005, 0.01
    # It slides along x by 0.3 mm, and its centre is below the end's in the middle of it.
    along = 1.0 if friction else 0.0
    flight = Flight(ROD, height=0.05, grains=((arm - 2.4e-4 * along, 0.0, 0.0399, along, 0.0, 1.0),), grain_mass=m, time_step=2e-7,
                    steps=3000, frames=20, material=replace(SMOOTH, youngs_modulus=1e9, restitution=e, static_friction=friction,
                                                kinetic_friction=friction, critical_slip_distance=1e-9))
    found = fly(engine, tmp_path, flight)
    moved = 1 / (1 / m + 1 / MASS + arm * (arm + radius * friction) / MOMENT)
    seen = restitution(e, 1 / (1 / m + 1 / MASS), moved) if e < 1 else 1.0
    impulse = (1 + seen) * moved
    push = np.array([friction * impulse, 0, impulse])
    share = 1e-2 if friction else 2e-3
    spin = -(arm * push[2] + radius * push[0]) / MOMENT
    np.testing.assert_allclose(found.velocity[-1], push / MASS, rtol=0, atol=share * impulse / MASS)
    np.testing.assert_allclose(found.spin[-1], [0, spin, 0], rtol=0, atol=share * abs(spin))
    np.testing.assert_allclose(found.grain_velocities[-1, 0], [along, 0, 1] - push / m, rtol=0, atol=share)


# Around the body, towards it.
CLOUD = tuple((x, y, z + 0.05, -25 * x, -25 * y, -25 * z) for x, y, z in (
    (0.028, 0.003, 0.002), (-0.018, 0.001, 0.004), (0.002, 0.025, -0.003), (0.004, -0.02, 0.001), (0.001, 0.003, 0.02),
    (-0.002, 0.004, -0.02)))
LAWS = {
    "friction": {}, "rolling": {"rolling_resistance": "elastic_plastic", "rolling_friction": 0.2},
    "bridges": {"bridge_volume": 2e-9, "rolling_resistance": "elastic_plastic", "rolling_friction": 0.2},
}


@pytest.mark.parametrize("law", LAWS)
def test_momentum_is_conserved_in_a_cloud_of_grains_with_a_body(engine, tmp_path, law):
    found = fly(engine, tmp_path, Flight(WEDGE, spheres=12, height=0.05, velocity=(0.1, 0.0, 0.0), grains=CLOUD, grain_mass=0.002,
                                         time_step=2e-6, steps=20000, frames=20, material=Material(youngs_modulus=1e7, **LAWS[law])))
    mass = 2500 * 4e-6
    momentum = mass * found.velocity + 0.002 * found.grain_velocities.sum(axis=1)
    begin = mass * np.array([0.1, 0, 0]) + 0.002 * np.array(CLOUD)[:, 3:].sum(axis=0)
    assert np.abs(found.velocity[-1] - [0.1, 0, 0]).max() > 0.01 and np.abs(found.spin[-1]).max() > 0.5
    np.testing.assert_allclose(momentum, np.tile(begin, (len(momentum), 1)), atol=1e-9)


def test_a_body_falls_without_turning(engine, tmp_path):
    """The weight acts at its centre of mass, which is not that of its spheres."""
    found = fly(engine, tmp_path, Flight(WEDGE, spheres=12, height=0.15, gravity=9.81, time_step=1e-5, steps=10000, frames=10))
    np.testing.assert_allclose(found.velocity[-1], [0, 0, -0.981], atol=2e-4)
    assert np.abs(found.spin).max() < 1e-6


def test_fix_sph_body_takes_the_particles_of_a_lattice(liggghts_is_there, tmp_path):
    """It falls in air, and its spin, about a principal axis, stays."""
    written(tmp_path, Flight(BRICK, height=0.1, density=1500.0), "liggghts")
    done = run_deck(tmp_path, f"""\
{head().replace("granular", "hybrid granular sph")}
region domain block -0.1 0.1 -0.1 0.1 -0.1 0.2 units box
create_box 2 domain
variable one_atom_type index 2
include one-sph.in
create_atoms 1 single 0.08 0.08 0.1 units box
mass * 0.001
set group all diameter 0.01 density 1000
set group all mass 0.001
set group all meso_rho 1000
group water type 1
neighbor 0.005 bin
pair_style sph/coupled spacing 0.01 sound_speed 10 density 1000
pair_coeff * *
timestep 1e-4
fix weight all gravity 9.81 vector 0 0 -1
fix fluid water nve/sph/coupled
fix one one ${{one_sph}} spin 0 0 2
variable all equal f_one[6]
variable spin equal f_one[9]
variable count equal count(one)
run 100
print "found: ${{all}} ${{spin}} ${{count}}"
""")
    assert done.code == 0 and not done.error, done.error or done.output[-2000:]
    velocity, spin, count = map(float, done.output.rpartition("found: ")[2].split()[:3])
    assert count == 24 and spin == pytest.approx(2.0, rel=1e-9) and velocity == pytest.approx(-0.0981, rel=1e-9)
