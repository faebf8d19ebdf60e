"""The SPH solver from Python: kernels and state beside their definitions, one result on any processor and thread, bodies, input."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from dembark.physics import SPH_KERNELS, SphFluid, sph_kernel, tait_pressure
from dembark.physics.sph import lattice, tank_walls

DX = 0.02
SIZES = st.floats(1e-6, 1e3)


@pytest.mark.parametrize("name", SPH_KERNELS)
@pytest.mark.parametrize("dimension", [2, 3])
def test_kernels_integrate_to_one(name, dimension):
    def shell(r):
        return 2.0 * np.pi * r if dimension == 2 else 4.0 * np.pi * r**2

    total, _ = quad(lambda r: shell(r) * sph_kernel(name, dimension, 0.3, r)[0], 0.0, 0.6, points=[0.3])
    assert total == pytest.approx(1.0, rel=1e-9)


@given(st.sampled_from(SPH_KERNELS), st.sampled_from([2, 3]), SIZES, st.floats(0.0, 2.5))
def test_kernels_scale_with_h_and_fall(name, dimension, h, q):
    value, slope = sph_kernel(name, dimension, h, q * h)
    unit, unit_slope = sph_kernel(name, dimension, 1.0, q)
    assert value == pytest.approx(unit / h**dimension, rel=1e-9, abs=1e-12 / h**dimension)
    assert slope == pytest.approx(unit_slope / h ** (dimension + 2), rel=1e-9, abs=1e-9 / h ** (dimension + 2))
    assert value >= -1e-12 / h**dimension and slope <= 0.0


@given(st.floats(1.0, 9.0), st.floats(1.0, 1e3), st.floats(0.9, 1.1))
def test_tait_is_its_formula(gamma, sound, ratio):
    p = tait_pressure(850.0 * ratio, rest_density=850.0, sound_speed=sound, gamma=gamma, tension=True)
    due = min(850.0 * sound**2 / gamma * (ratio**gamma - 1.0), 0.1 * 850.0 * sound**2)
    assert p == pytest.approx(due, rel=1e-9, abs=1e-9 * 850.0 * sound**2)
    assert tait_pressure(850.0 * ratio, rest_density=850.0, sound_speed=sound, gamma=gamma) == max(p, 0.0)


def splash(**options):
    """A column beside a tank's wall."""
    water = SphFluid(lattice([0, 0], [0.2, 0.3], DX), spacing=DX, sound_speed=35.0, gravity=[0, -9.81], **options)
    return water, water.add_wall(tank_walls([0, 0], [0.5, 0.4], DX))


@pytest.mark.parametrize("options", [{}, {"kernel": "cubic_spline", "shifting": 2.0, "no_slip": True}, {"boundary": "dynamic"},
                                     {"xsph": 0.5, "shepard": 10},
                                     {"moment": "particles"}])
def test_every_processor_and_number_of_threads_gets_the_same_bits(options):
    states = []
    for more in ({}, {"instruction_set": "portable"}, {"threads": 2}):
        water, _ = splash(**options, **more)
        water.run(0.03)
        states.append(water.state())
    assert (states[0] == states[1]).all() and (states[0] == states[2]).all()


def test_walls_fill_the_support_of_any_kernel():
    """With three layers a particle came as near as 0.28 spacings to a floor under h = 2.5 spacings, for which these are too few."""
    depth = 12 * DX
    points = lattice([0, 0], [0.4, depth], DX)
    water = SphFluid(points, spacing=DX, sound_speed=31.0, gravity=[0, -9.81], smoothing=2.5, pressure=9810.0 * (depth - points[:, 1]))
    tank = water.add_wall(tank_walls([0, 0], [0.4, depth + 4 * DX], DX, smoothing=2.5))
    forces = []
    for _ in range(10):
        water.run(0.1)
        forces.append(-tank.force[1] / (9810.0 * depth * 0.4))
    assert water.positions[:, 1].min() > 0.45 * DX
    assert np.mean(forces[5:]) == pytest.approx(1.0, abs=5e-4)


def test_a_state_goes_on_bit_for_bit_and_is_refused_elsewhere():
    water, _ = splash()
    water.run(0.02)
    kept = water.state()
    water.run(0.02)
    again, _ = splash()
    again.restore(kept)
    assert again.time == pytest.approx(0.02)
    again.run(0.02)
    assert (again.positions == water.positions).all() and again.energies() == water.energies()
    other = SphFluid([[0.0, 0.0]], spacing=DX, sound_speed=35.0)
    with pytest.raises(ValueError, match="it is not of this fluid"):
        other.restore(kept)
    with pytest.raises(ValueError, match="state must be a number"):
        again.restore(np.where(np.arange(kept.size) == 9, np.nan, kept))


def test_a_plane_column_is_the_same_whichever_way_gravity_points():
    paths = []
    for turn in ([[1, 0], [0, 1]], [[0, 1], [1, 0]]):
        rotation = np.array(turn, float)
        water = SphFluid(lattice([0, 0], [0.2, 0.3], DX) @ rotation, spacing=DX, sound_speed=35.0, gravity=rotation.T @ [0, -9.81])
        water.add_wall(tank_walls([0, 0], [0.5, 0.4], DX) @ rotation)
        water.run(0.05)
        paths.append(water.positions @ rotation.T)
    assert np.abs(paths[0] - paths[1]).max() < 1e-9


def test_energy_falls_and_the_ledger_balances():
    water, _ = splash(alpha=0.1)
    water.run(1e-4)
    begin = water.energies()
    stored = [begin.stored]
    for _ in range(20):
        water.run(0.01)
        stored.append(water.energies().stored)
    end = water.energies()
    assert (np.diff(stored) < 1e-3 * end.kinetic).all()
    assert end.viscous > 0.0 and end.work == 0.0
    lost = end.viscous + end.diffusive + end.boundary
    assert end.stored + lost - begin.stored == pytest.approx(0.0, abs=0.02 * end.kinetic)


def test_a_piston_does_the_work_that_the_fluid_gets():
    # A closed box, one wall of which is pushed in.
    water = SphFluid(lattice([0, 0], [0.4, 0.2], DX), spacing=DX, sound_speed=20.0, tension=True, alpha=0.1)
    walls = tank_walls([0, 0], [0.4, 0.2], DX, open_top=False)
    piston = walls[:, 0] < 0.0
    water.add_wall(walls[~piston])
    moved = water.add_wall(walls[piston])
    moved.set_motion([0.1, 0.0])
    water.run(0.02)
    e = water.energies()
    assert moved.position == pytest.approx([0.002, 0.0])
    assert e.work > 0.0 and moved.force[0] < 0.0
    assert e.stored + e.viscous + e.diffusive + e.boundary == pytest.approx(e.work, rel=0.05)
    assert water.pressures.mean() == pytest.approx(1000.0 * 400.0 * 0.002 / 0.4, rel=0.1)  # rho c^2 dV/V


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_a_body_in_deep_water_begins_to_move_as_its_added_mass_says(ratio):
    side = 8 * DX
    points = lattice([0, 0], [0.8, 0.6], DX)
    inside = (np.abs(points - [0.4, 0.3]) < side / 2).all(axis=1)
    water = SphFluid(points[~inside], spacing=DX, sound_speed=50.0, gravity=[0, -9.81], alpha=0.1,
                     pressure=1000.0 * 9.81 * (0.6 - points[~inside][:, 1]))
    water.add_wall(tank_walls([0, 0], [0.8, 0.7], DX))
    body = water.add_body(points[inside], mass=ratio * 1000.0 * side**2, inertia=np.inf, centre=[0.4, 0.3])
    water.run(0.05)
    # A square's added mass is 1.51 pi a^2 with half its side a (J. N. Newman, Marine Hydrodynamics, table 4.3); the tank adds some.
    added = 1.51 * np.pi / 4
    free = 9.81 * (1.0 - ratio) / (ratio + added)
    speed = body.velocity[1] / 0.05
    assert np.sign(speed) == np.sign(free)
    assert 0.7 * abs(free) < abs(speed) < 1.05 * abs(free)
    assert body.velocity[0] == pytest.approx(0.0, abs=0.02 * abs(body.velocity[1]))


def test_a_body_turns_and_momentum_is_exchanged():
    fluid = lattice([0, 0], [0.3, 0.3], DX)
    inside = (np.abs(fluid - 0.15) < 0.05).all(axis=1)
    water = SphFluid(fluid[~inside], spacing=DX, sound_speed=20.0, tension=True, no_slip=True, alpha=0.5)
    body = water.add_body(fluid[inside], mass=10.0, inertia=0.02, centre=[0.15, 0.15])
    body.set_motion([0.0, 0.0], spin=2.0)
    body.set_load([0.0, 0.0], torque=0.0)
    water.run(0.05)
    assert 0.0 < body.spin < 1.999 and body.orientation[3] > 0.01
    (x, y), (u, v) = (water.positions - body.position).T, water.velocities.T
    angular = water.particle_mass * (x * v - y * u).sum() + 0.02 * body.spin
    assert angular == pytest.approx(0.04, rel=1e-3)


def test_the_contact_potential_keeps_fluid_away_from_bodies():
    gaps = []
    for options in ({}, {"boundary": "dynamic", "contact_stiffness": 1e9}):
        points = lattice([0, 0], [0.4, 0.2], DX)
        block = points[(np.abs(points - [0.2, 0.1]) < 0.04).all(axis=1)]
        fluid = points[~(np.abs(points - [0.2, 0.1]) < 0.04).all(axis=1)]
        water = SphFluid(fluid, spacing=DX, sound_speed=30.0, gravity=[0, -9.81], alpha=0.2, **options)
        water.add_wall(tank_walls([0, 0], [0.4, 0.3], DX))
        body = water.add_body(block, mass=6.4, inertia=np.inf, centre=[0.2, 0.1])
        water.run(0.3)
        near = np.linalg.norm(water.positions[:, None] - body.particles[0][None], axis=2).min()
        gaps.append(near / DX)
    assert gaps[0] < 1.1
    assert gaps[1] > 1.2


def test_space():
    """Three dimensions: the walls of a small tank carry the water."""
    points = lattice([0, 0, 0], [0.2, 0.16, 0.12], DX)
    water = SphFluid(points, spacing=DX, sound_speed=22.0, gravity=[0, 0, -9.81], alpha=0.2, pressure=9810.0 * (0.12 - points[:, 2]))
    wall = water.add_wall(tank_walls([0, 0, 0], [0.2, 0.16, 0.14], DX))
    forces = []
    for _ in range(40):
        water.run(0.005)
        forces.append(wall.force)
    assert np.mean(forces, axis=0) == pytest.approx([0.0, 0.0, -9.81 * len(points) * water.particle_mass],
                                                    abs=0.02 * 9.81 * len(points) * water.particle_mass)
    assert wall.torque.shape == (3,) and wall.particles[0].shape[1] == 3


@pytest.mark.parametrize(("change", "line"), [
    ({"positions": [1.0, 2.0]}, r"positions must have the shape \(n, 2 or 3\), not \(2,\)"),
    ({"positions": np.zeros((0, 2))}, "positions: there must be one particle of fluid or more"),
    ({"spacing": 0.0}, r"spacing must be a number > 0 \(m\)"),
    ({"sound_speed": -1.0}, r"sound_speed must be a number > 0 \(m/s\)"),
    ({"gravity": [0, 0, -9.81]}, r"gravity must have 2 components \(m/s\^2\), not the shape \(3,\)"),
    ({"velocity": 1.0}, r"velocity must have the shape \(1, 2\) or \(2,\), not \(\)"),
    ({"pressure": -5.0}, "pressure must be >= 0 Pa and finite, not -5"),
    ({"pressure": -6e4, "tension": True}, r"a pressure must be > -57142.9 Pa \(density sound_speed\^2/gamma\), not -60000 Pa"),
    ({"kernel": "gauss"}, "kernel must be wendland_c2 or cubic_spline, not 'gauss'"),
    ({"boundary": "mirror"}, "boundary must be extrapolated or dynamic, not 'mirror'"),
    ({"alpha": np.nan}, "alpha must be between 0 and 1"),
    ({"smoothing": 9.0}, r"smoothing \(h over the spacing\) must be between 0.8 and 3"),
    ({"threads": 0}, "threads must be 1 or more"),
    ({"xsph": 1.5}, "xsph must be between 0 and 1"),
    ({"shepard": -1}, r"shepard \(steps from one filter to the next\) must be 0 or more"),
    ({"contact_exponent": 0}, "contact_exponent must be 1 or more"),
])
def test_wrong_input_gets_one_line(change, line):
    with pytest.raises(ValueError, match=line) as caught:
        SphFluid(**{"positions": [[0.0, 0.0]], "spacing": DX, "sound_speed": 20.0} | change)
    assert "\n" not in str(caught.value)


def test_wrong_use_gets_one_line():
    water = SphFluid([[0.0, 0.0]], spacing=DX, sound_speed=20.0)
    wall = water.add_wall([[1.0, 0.0]])
    with pytest.raises(ValueError, match="a wall moves as it is told and takes no load; use set_motion"):
        wall.set_load([1.0, 0.0])
    with pytest.raises(ValueError, match=r"inertia must be a number \(kg m\^2\)"):
        water.add_body([[1.0, 0.0]], mass=1.0, inertia=[1, 1, 1], centre=[1, 0])
    with pytest.raises(ValueError, match="points must not be empty: walls and bodies are made of particles"):
        water.add_body(np.zeros((0, 2)), mass=1.0, inertia=1.0, centre=[1, 0])
    with pytest.raises(ValueError, match="points must not be empty"):
        water.add_wall(np.zeros((0, 2)))
    with pytest.raises(ValueError, match=r"mass must be > 0 kg and finite, not 0"):
        water.add_body([[1.0, 0.0]], mass=0.0, inertia=1.0, centre=[1, 0])
    with pytest.raises(ValueError, match=r"the time step must be > 0 and at most 0.6 h/sound_speed = 0.78"):
        water.run(1.0, step=0.1)
    water.run(1e-3)
    with pytest.raises(ValueError, match="must be added before the first step"):
        water.add_wall([[2.0, 0.0]])
    with pytest.raises(ValueError, match="must be whole numbers of the spacing"):
        lattice([0, 0], [0.1, 0.05], DX)
    fast = SphFluid([[0.0, 0.0]], spacing=DX, sound_speed=20.0, velocity=[25.0, 0.0])
    with pytest.raises(RuntimeError, match="faster than sound"):
        fast.run(1e-3)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_particles_that_are_not_one_spacing_apart_are_told(factor):
    """The mass of each follows from the spacing: another one makes another fluid."""
    points = lattice([0, 0], [0.2, 0.2], DX)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        SphFluid(points, spacing=DX, sound_speed=25.0)
        SphFluid(points[:1], spacing=DX, sound_speed=25.0)
    with pytest.warns(UserWarning, match=f"lie {1.0 / factor:.3g} spacings apart"):
        SphFluid(points, spacing=factor * DX, sound_speed=25.0)


def test_what_is_put_into_the_fluid_is_told():
    points = lattice([0, 0], [0.2, 0.2], DX)
    water = SphFluid(points, spacing=DX, sound_speed=20.0)
    water.add_body(lattice([0.05, 0.05], [0.13, 0.13], DX), mass=6.4, inertia=0.007, centre=[0.09, 0.09])
    with pytest.raises(ValueError, match=r"^the particle of fluid at \(0\.\d+, 0\.\d+, 0\) m overlaps others: there are 1\.9\d times"):
        water.run(1e-3)
    twice = SphFluid(np.concatenate([points, points[:1]]), spacing=DX, sound_speed=20.0)
    with pytest.raises(ValueError, match=r"\(0\.01, 0\.01, 0\) m overlaps another: it is 0\.00 spacings away from it; leave out fluid"):
        twice.state()
    fine = SphFluid(points, spacing=DX, sound_speed=20.0)
    fine.add_wall(lattice([0, -0.1], [0.2, 0.0], 0.5 * DX))
    with pytest.raises(ValueError, match="and give them its spacing"):
        fine.run(1e-3)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from([2, 3]), st.sampled_from(SPH_KERNELS))
def test_momentum_of_a_free_cloud_is_conserved(seed, dimension, kernel):
    """With XSPH, too, which moves the centre of mass as the momentum does."""
    random = np.random.default_rng(seed)
    points = lattice([0] * dimension, [0.1] * dimension, DX) + random.uniform(-0.2, 0.2, (5**dimension, dimension)) * DX
    cloud = SphFluid(points, spacing=DX, sound_speed=20.0, alpha=0.3, kernel=kernel, velocity=random.uniform(-1, 1, points.shape),
                     pressure=random.uniform(0.0, 2e4, len(points)), xsph=0.5, shepard=5, moment="particles")
    before = cloud.velocities
    cloud.run(0.01)
    middle = points.mean(axis=0) + 0.01 * before.mean(axis=0)
    assert np.abs(cloud.positions.mean(axis=0) - middle).max() < 1e-13
    assert np.abs(cloud.velocities.sum(axis=0) - before.sum(axis=0)).max() < 1e-12 * np.abs(before).sum()


def still_boxes(slit_pressure, boxes=1, plane=True):
    """Boxes of 0.1 m stacked on the floor of still water, 0.3 m deep, and held; their mean forces over rho g V, and the boxes."""
    dx, side, depth = 0.025, 0.1, 0.3
    points = lattice([0, 0, 0], [0.3, 0.3, depth], dx)
    held = ((points > [0.1, 0.1, 0.0]) & (points < [0.2, 0.2, boxes * side])).all(axis=1)
    points = points[~held]
    water = SphFluid(points, spacing=dx, sound_speed=25.0, gravity=[0, 0, -9.81], pressure=9810.0 * (depth - points[:, 2]), alpha=0.2,
                     slit_pressure=slit_pressure)
    water.add_wall(tank_walls([0, 0, 0], [0.3, 0.3, depth + 0.1], dx))
    if plane:
        water.add_plane([0, 0, 0], [0, 0, 2.0])
    held = [water.add_box([0.1, 0.1, k * side], [0.2, 0.2, (k + 1) * side], mass=1e6) for k in range(boxes)]
    for body in held:
        body.set_load([0.0, 0.0, 9.81e6])
    forces = []
    for _ in range(15):
        water.run(0.01)
        forces.append([body.force / (9810.0 * side**3) for body in held])
    return np.mean(forces[7:], axis=0), held


def test_a_box_on_the_floor_is_lifted_by_a_full_film_and_pressed_by_a_dry_one():
    """Archimedes' force, and the weight of the water above, twice the box's volume: 5 %, where half of a layer of particles is 12 %."""
    (full,), _ = still_boxes(1.0)
    (dry,), _ = still_boxes(0.0)
    assert full == pytest.approx([0.0, 0.0, 1.0], abs=0.05)
    assert dry == pytest.approx([0.0, 0.0, -2.0], abs=0.05)


def test_a_film_between_two_boxes_pushes_both_alike():
    _, (low, high) = still_boxes(1.0, boxes=2, plane=False)
    assert high.film_force[2] > 9810.0 * 0.1 * 0.9 * 0.1**2
    np.testing.assert_allclose(low.film_force, -high.film_force, rtol=0.0, atol=1e-12 * high.film_force[2])


def test_wrong_boxes_are_told():
    water = SphFluid(lattice([0, 0, 0], [0.1, 0.1, 0.1], DX), spacing=DX, sound_speed=25.0)
    with pytest.raises(ValueError, match="must be whole numbers of the spacing"):
        water.add_box([0, 0, 0.2], [0.11, 0.1, 0.3], mass=1.0)
    with pytest.raises(ValueError, match="point and normal of a plane must have three components"):
        water.add_plane([0, 0], [0, 1])
    with pytest.raises(ValueError, match="normal of a plane must not be zero"):
        water.add_plane([0, 0, 0], [0, 0, 0])
    plane, _ = splash()
    with pytest.raises(ValueError, match="boxes with films are for three dimensions"):
        plane.add_box([0, 0], [0.1, 0.1], mass=1.0)
    with pytest.raises(ValueError, match="slit_pressure must be between 0 and 1"):
        SphFluid([[0.0, 0.0, 0.0]], spacing=DX, sound_speed=25.0, slit_pressure=2.0)
