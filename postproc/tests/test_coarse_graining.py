"""Coarse-grained fields against conservation laws, closed forms and the plain peer of the compiled code."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from packings import contact_frame, cubic_lattice, fcc_lattice, grain_frame, packing_at_rest, random_frame

from dembark.common.errors import DembarkError
from dembark.postproc.contacts import ContactFrame
from dembark.postproc.fields.coarse_graining import WallContacts, coarse_grain, interpolate
from dembark.postproc.fields.face_stress import face_stress
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import NAMES, Kernel
from dembark.postproc.fields.sums import Fields, moving_average

flags = st.tuples(st.booleans(), st.booleans(), st.booleans())
shapes = st.tuples(st.integers(1, 5), st.integers(1, 4), st.integers(1, 9))
kernels = st.tuples(st.sampled_from(NAMES), st.sampled_from([1e-6, 0.02, 0.11, 0.4]))


def box(periodic, shape, reach):
    """A grid over the period of periodic axes, and over all that the unit box reaches along the others."""
    low, high = np.where(periodic, 0.0, -reach - 0.5), np.where(periodic, 1.0, 1.5 + reach)
    return Grid(low, high, shape, periodic)


def moment(contacts):
    return -(contacts.forces[:, :, None] * contacts.branch[:, None, :]).sum(axis=0)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), flags, shapes, kernels, st.tuples(*[st.floats(-0.4, 0.4)] * 3))
@example(2710, (False, False, False), (2, 3, 2), ("gaussian", 1e-6), (0.0, 0.0, 0.0))  # one grain in a cell: its spread is all rounding
def test_totals_are_the_sums_over_grains_and_contacts(seed, periodic, shape, kernel, tilt):
    name, width = kernel
    tilt = np.where([periodic[1], periodic[2], periodic[2]], tilt, 0.0)
    grains, contacts = random_frame(seed, periodic=periodic, tilt=tilt)
    grid = box(periodic, shape, 3 * width + 0.5)
    fields = coarse_grain(grains, contacts, grid, kernel=name, width=width).fields()

    def total(field):
        return field.sum(axis=(0, 1, 2)) * grid.cell_volume

    # Images across a sheared border cut a ball at other places, so that its parts add up as far as their quadrature goes.
    accuracy = 1e-12 if name == "gaussian" or not tilt.any() else 2e-3
    assert total(fields.density) == pytest.approx(grains.masses.sum(), rel=accuracy)
    np.testing.assert_allclose(total(fields.momentum), grains.masses @ grains.velocities, atol=30 * accuracy)
    np.testing.assert_allclose(total(fields.contact_stress), moment(contacts), atol=accuracy)
    assert total(fields.solid_fraction) == pytest.approx((4 / 3 * np.pi * grains.radii**3).sum(), rel=accuracy)
    liquid = grains.extra["liquid_volume"].sum() + contacts.extra["liquid_volume"].sum()
    assert total(fields.liquid_content) == pytest.approx(liquid, rel=accuracy)
    assert fields.grain_count.sum() == pytest.approx(len(grains.ids), rel=accuracy)
    assert fields.contact_count.sum() == pytest.approx(len(contacts.ids), rel=accuracy)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10**6), flags, shapes, kernels, st.booleans(), st.floats(-0.3, 0.3), st.integers(2, 5))
def test_compiled_code_equals_numpy_and_no_bit_depends_on_threads(seed, periodic, shape, kernel, closed, tilt, threads):
    name, width = kernel
    # The spherical kernels are slow in numpy, the more so the narrower they are beside a cell or a line.
    count, width, shape = (10, width, shape) if name == "gaussian" else (2, max(width, 0.4), tuple(max(3, cells) for cells in shape))
    grains, contacts = random_frame(seed, count, count, periodic=periodic, tilt=(tilt if periodic[1] else 0.0, 0.0, 0.0))
    wall = WallContacts(*np.random.default_rng(seed).uniform(0, 1, (3, 4, 3)))
    grid = Grid((0, 0, 0), (1, 1, 1), shape, periodic)
    mean = np.random.default_rng(seed).normal(size=(*shape, 3))

    def sums(**how):
        return coarse_grain(grains, contacts, grid, kernel=name, width=width, closed=closed, walls=[wall], mean_velocity=mean, **how)

    one, many, plain = sums(threads=1), sums(threads=threads), sums(backend="numpy")
    for part in ("grains", "contacts", "boundary"):
        assert np.array_equal(getattr(one, part), getattr(many, part))
        # An edge of a cell is rounded to 1e-16 m, which a narrow kernel sees as 1e-16 / width.
        np.testing.assert_allclose(getattr(one, part), getattr(plain, part), atol=1e-13 + 1e-15 / width)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("periodic", [False, True])
def test_many_lines_of_all_lengths_in_one_cell_equal_numpy(periodic, closed):
    # More lines than are spread together, whose windows begin and end in many cells.
    random = np.random.default_rng(3)
    grains, _ = random_frame(3, count=700, periodic=(periodic,) * 3)
    pairs = random.integers(0, 700, (700, 2))
    branch = random.uniform(-1, 1, (700, 3)) * random.uniform(0, 0.5, (700, 1))
    contacts = ContactFrame(7, grains.wrapped[pairs[:, 0]], branch, random.normal(size=(700, 3)), grains.ids[pairs])
    grid = Grid((0, 0, 0), (1, 1, 1), (9, 7, 11), (periodic,) * 3)
    one, many, plain = (
        coarse_grain(grains, contacts, grid, width=0.06, closed=closed, **how)
        for how in ({"threads": 1}, {"threads": 3}, {"backend": "numpy"})
    )
    for part in ("grains", "contacts"):
        assert np.array_equal(getattr(one, part), getattr(many, part))
        np.testing.assert_allclose(getattr(one, part), getattr(plain, part), atol=1e-12 * np.abs(getattr(plain, part)).max())


def test_large_frames_one_after_another_do_not_see_each_other():
    # Large enough for memory that the compiled code keeps from frame to frame.
    grid = Grid((0, 0, 0), (1, 1, 1), (22, 22, 22), (True,) * 3)
    frames = [random_frame(seed, 30000, 30000, periodic=(True,) * 3)[0] for seed in (1, 2)]
    first, _, again = (coarse_grain(frame, None, grid, width=0.03) for frame in (frames[0], frames[1], frames[0]))
    assert np.array_equal(first.grains, again.grains)
    assert again.grains[..., 28].sum() == pytest.approx(30000, rel=1e-12)


@pytest.mark.parametrize("apart", [1, 1000, 2**60 // 12])
def test_ids_may_lie_far_apart(apart):
    grains, contacts = random_frame(2)
    far = replace(grains, ids=grains.ids * apart)
    grid = Grid((0, 0, 0), (1, 1, 1), (3, 3, 3))
    near = coarse_grain(grains, contacts, grid, width=0.1)
    found = coarse_grain(far, replace(contacts, ids=contacts.ids * apart), grid, width=0.1)
    assert np.array_equal(near.grains, found.grains) and np.array_equal(near.contacts, found.contacts)
    unknown = np.array([[apart, 12 * apart + 1]])
    with pytest.raises(DembarkError, match=f"grain {12 * apart + 1}, step 7"):
        coarse_grain(far, ContactFrame(7, *np.zeros((3, 1, 3)), unknown), grid, width=0.1)


def test_huge_numbers_are_finite_and_infinities_are_not():
    grains, contacts = random_frame(2)
    grid = Grid((0, 0, 0), (1, 1, 1), (3, 3, 3))
    huge = replace(grains, velocities=np.full((len(grains.ids), 3), 1e150))
    assert np.isfinite(coarse_grain(huge, None, grid, width=0.1).grains[..., 1:4]).all()
    for wrong in (np.inf, -np.inf, np.nan):
        velocities = grains.velocities.copy()
        velocities[-1, 2] = wrong
        with pytest.raises(DembarkError, match="velocities with numbers that are not finite"):
            coarse_grain(replace(grains, velocities=velocities), contacts, grid, width=0.1)


def test_a_closed_grid_keeps_what_is_near_its_faces():
    grains, contacts = random_frame(5, count=40)
    grid = Grid((0, 0, 0), (1, 1, 1), (5, 4, 6))
    for name in NAMES:
        kept = coarse_grain(grains, contacts, grid, kernel=name, width=0.15, closed=True)
        lost = coarse_grain(grains, contacts, grid, kernel=name, width=0.15)
        assert kept.grains[..., 0].sum() == pytest.approx(grains.masses.sum(), rel=1e-13)
        assert lost.grains[..., 0].sum() < 0.99 * grains.masses.sum()


def test_one_cell_along_an_axis_averages_over_it():
    grains, contacts = random_frame(8)
    for axis in range(3):
        shape = np.array([4, 5, 6])
        fine = Grid((-1, -1, -1), (2, 2, 2), tuple(shape.tolist()))
        shape[axis] = 1
        flat = Grid((-1, -1, -1), (2, 2, 2), tuple(shape.tolist()))
        thick, thin = (coarse_grain(grains, contacts, grid, width=0.1).fields() for grid in (fine, flat))
        for name in ("density", "contact_stress", "momentum"):
            np.testing.assert_allclose(getattr(thick, name).mean(axis=axis, keepdims=True), getattr(thin, name), atol=1e-11)


def test_a_kernel_narrower_than_a_cell_is_a_histogram():
    grains, _ = random_frame(4)
    grid = Grid((0, 0, 0), (1, 1, 1), (3, 3, 3))
    expected = np.histogramdd(grains.wrapped, [grid.edges(axis) for axis in range(3)], weights=grains.masses)[0]
    for name in NAMES:
        found = coarse_grain(grains, None, grid, kernel=name, width=1e-7).fields().density * grid.cell_volume
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_moving_a_grain_by_an_edge_of_a_triclinic_box_changes_nothing():
    grains, contacts = random_frame(9, periodic=(True,) * 3, tilt=(0.3, -0.2, 0.45))
    grid = Grid((0, 0, 0), (1, 1, 1), (4, 5, 6), (True,) * 3)
    for edge in ([1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [-0.2, 0.45, 1.0]):
        moved = grain_frame(
            grains.wrapped + edge, radii=grains.radii, masses=grains.masses, periodic=(True,) * 3, tilt=(0.3, -0.2, 0.45), omegas=None
        )
        other = ContactFrame(7, contacts.first - edge, contacts.branch, contacts.forces, contacts.ids)
        here, there = coarse_grain(grains, contacts, grid, width=0.2), coarse_grain(moved, other, grid, width=0.2)
        np.testing.assert_allclose(here.grains[..., 0], there.grains[..., 0], atol=1e-13)
        np.testing.assert_allclose(here.contacts[..., :9], there.contacts[..., :9], atol=1e-13)


def test_density_of_one_grain_is_the_mean_of_the_kernel_over_each_cell():
    grains = grain_frame([[0.1, -0.2, 0.05]], masses=2.5)
    grid = Grid((-1, -1, -1), (1, 1, 1), (5, 5, 5))
    kernel = Kernel("gaussian", 0.3)
    place, weight = np.polynomial.legendre.leggauss(30)
    x, y, z = (0.2 * place + grid.centres(axis)[count] for axis, count in enumerate((2, 1, 3)))
    inside = kernel(np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1) - grains.wrapped[0])
    mean = 2.5 * np.einsum("abc,a,b,c", inside, weight, weight, weight) / 8.0
    assert coarse_grain(grains, None, grid, width=0.3).fields().density[2, 1, 3] == pytest.approx(mean, rel=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_line_integral_is_the_mean_over_many_points(name):
    grains = grain_frame([[0.2, 0.3, 0.5], [0.75, 0.6, 0.4]], omegas=None)
    contacts = contact_frame(grains, [[0, 1]], [[1.0, 2.0, 3.0]])
    grid = Grid((-1, -1, -1), (2, 2, 2), (12, 9, 10))
    found = coarse_grain(grains, contacts, grid, kernel=name, width=0.5).contacts[..., 19]
    place = contacts.first + (np.arange(400)[:, None] + 0.5) / 400 * contacts.branch
    mean = coarse_grain(grain_frame(place), None, grid, kernel=name, width=0.5).grains[..., 28] / 400
    # Gauss points do not see just where the Gaussian is cut and where Heaviside's kernel jumps.
    np.testing.assert_allclose(found, mean, atol={"gaussian": 5e-5, "lucy": 1e-5, "heaviside": 2e-3}[name] * mean.max())


@pytest.mark.parametrize("gradient",
                         [[[0, 0, 0], [0, 0, 0], [3, 0, 0]], [[0, -2, 0], [2, 0, 0], [0, 0, 0]], [[1, 2, 3], [4, 5, 6], [7, 8, -6]]])
def test_gradient_of_an_affine_velocity_is_exact_for_any_packing(gradient):
    gradient = np.array(gradient, float)
    place = np.random.default_rng(2).uniform(0, 1, (300, 3))
    grid = Grid((0, 0, 0), (1, 1, 1), (5, 4, 3))
    for name in NAMES:
        moving = grain_frame(place, velocities=place @ gradient.T + [5.0, -7.0, 9.0])
        fields = coarse_grain(moving, None, grid, kernel=name, width=0.3).fields(shear_corrected=True)
        np.testing.assert_allclose(fields.velocity_gradient, np.broadcast_to(gradient, (5, 4, 3, 3, 3)), atol=1e-8)
        np.testing.assert_allclose(fields.strain_rate, np.broadcast_to(0.5 * (gradient + gradient.T), (5, 4, 3, 3, 3)), atol=1e-8)
        curl = [gradient[2, 1] - gradient[1, 2], gradient[0, 2] - gradient[2, 0], gradient[1, 0] - gradient[0, 1]]
        np.testing.assert_allclose(fields.vorticity, np.broadcast_to(curl, (5, 4, 3, 3)), atol=1e-8)
        # Nothing fluctuates about an affine field.
        np.testing.assert_allclose(fields.temperature, 0.0, atol=1e-10)


def test_shear_counts_as_fluctuation_unless_it_is_corrected():
    grains, _ = cubic_lattice(12, (1.0, 1.0, 1.0))
    rate, noise = 0.7, np.random.default_rng(6).normal(0.0, 0.2, (len(grains.ids), 3))
    moving = grain_frame(grains.wrapped, velocities=noise + rate * grains.wrapped[:, [2]] * [1.0, 0.0, 0.0])
    grid = Grid((4, 4, 4), (8, 8, 8), (2, 2, 2))
    # Grains cut by the kernel's end are few: the spread seen is that of the kernel and of the cell within some percent.
    for width in (0.8, 1.2):
        sums = coarse_grain(moving, None, grid, width=width)
        spread = Kernel("gaussian", width).variance + grid.spacing[2] ** 2 / 12
        naive, corrected = sums.fields(), sums.fields(shear_corrected=True)
        assert (naive.kinetic_stress - corrected.kinetic_stress)[..., 0, 0].mean() == pytest.approx(rate**2 * spread, rel=0.05)
        assert corrected.temperature.mean() == pytest.approx(0.04, rel=0.15)
        known = np.zeros((2, 2, 2, 3))
        known[..., 0] = rate * grid.centres(2)
        about = coarse_grain(moving, None, Grid((4, 4, 4), (8, 8, 8), (2, 2, 2)), width=width, mean_velocity=known).fields()
        # The given field is constant beyond the outermost centres, so that only a part of the shear is taken off here.
        assert corrected.temperature.mean() < about.temperature.mean() < naive.temperature.mean()


def test_velocities_about_a_given_field():
    place = np.random.default_rng(1).uniform(0.2, 0.8, (50, 3))
    grid = Grid((0, 0, 0), (1, 1, 1), (5, 5, 5))
    given = grid.points() @ np.diag([1.0, -2.0, 0.5]) + 3.0
    np.testing.assert_allclose(interpolate(given, grid, place), place @ np.diag([1.0, -2.0, 0.5]) + 3.0, atol=1e-13)
    moving = grain_frame(place, velocities=place @ np.diag([1.0, -2.0, 0.5]) + 3.0)
    fields = coarse_grain(moving, None, grid, width=0.1, mean_velocity=given).fields()
    np.testing.assert_allclose(fields.kinetic_stress, 0.0, atol=1e-12)
    with pytest.raises(DembarkError, match="on the grid of the fields"):
        coarse_grain(moving, None, grid, width=0.1, mean_velocity=given[:2])


def test_kinetic_stress_of_two_streams():
    place = np.repeat(np.random.default_rng(3).uniform(0, 1, (30, 3)), 2, axis=0)
    speed = np.tile([[0.0, 0.0, 2.0], [0.0, 0.0, -2.0]], (30, 1)) + np.array([7.0, 0.0, 0.0])
    fields = coarse_grain(grain_frame(place, velocities=speed), None, Grid((0, 0, 0), (1, 1, 1), (3, 2, 2)), width=0.2).fields()
    np.testing.assert_allclose(fields.kinetic_stress[..., 2, 2], 4.0 * fields.density, rtol=1e-12)
    np.testing.assert_allclose(fields.temperature, 4.0 / 3.0, rtol=1e-12)


@pytest.mark.parametrize("forces", [(2.0, 2.0, 2.0), (0.0, 0.0, 5.0), (1.0, 3.0, 4.0)])
def test_simple_cubic_lattice_has_its_exact_stress_and_fabric(forces):
    grains, contacts = cubic_lattice(6, forces)
    fields = coarse_grain(grains, contacts, Grid((0, 0, 0), (6, 6, 6), (6, 3, 2), (True,) * 3), width=0.9).fields()
    np.testing.assert_allclose(fields.stress, np.broadcast_to(np.diag(forces), (6, 3, 2, 3, 3)), atol=1e-6 * max(forces))
    np.testing.assert_allclose(fields.coordination, 6.0, rtol=1e-12)
    np.testing.assert_allclose(fields.fabric, np.broadcast_to(np.eye(3) / 3, (6, 3, 2, 3, 3)), atol=1e-6)
    np.testing.assert_allclose(fields.solid_fraction, np.pi / 6, rtol=1e-12)
    # Anywhere, not only where cells fall on the lattice, up to the ripple that the cut of the kernel leaves.
    fields = coarse_grain(grains, contacts, Grid((0.3, 0.1, 0.2), (4, 5, 5.5), (7, 11, 13)), width=0.9).fields()
    np.testing.assert_allclose(fields.stress, np.broadcast_to(np.diag(forces), (7, 11, 13, 3, 3)), atol=0.012 * max(forces))


def test_fcc_lattice_under_pressure():
    grains, contacts = fcc_lattice(3, 2.0)
    fields = coarse_grain(grains, contacts, Grid((0, 0, 0), (3, 3, 3), (3, 3, 3), (True,) * 3), width=0.6).fields()
    # 24 contacts a cube of volume 1, each with f l = 2 sqrt(1/2), the trace of three times the pressure.
    pressure = 24 * 2.0 * np.sqrt(0.5) / 3.0
    np.testing.assert_allclose(fields.stress, np.broadcast_to(pressure * np.eye(3), (3, 3, 3, 3, 3)), atol=1e-4 * pressure)
    np.testing.assert_allclose(fields.coordination, 12.0, rtol=1e-12)


def at_rest(width, shape, low=-2.0, high=5.0):
    """Fields of a packing at rest, the load on it (N/m3), and its stress on the faces."""
    grains, contacts, wall, gravity = packing_at_rest()
    grid = Grid((low,) * 3, (high,) * 3, shape)
    fields = coarse_grain(grains, contacts, grid, width=width, walls=[wall]).fields()
    load = fields.boundary_force + fields.density[..., None] * gravity
    faces = face_stress(grains, contacts, grid, width=width, walls=[wall])
    return fields, load, faces


def test_a_packing_at_rest_is_in_balance_in_every_cell_to_round_off():
    for shape, width in (((9, 8, 7), 0.6), ((9, 8, 7), 0.05), ((3, 1, 14), 0.2)):
        _, load, faces = at_rest(width, shape)
        assert np.abs(load - faces.divergence()).max() < 1e-12 * np.abs(load).max()


def test_cell_averages_are_in_balance_to_second_order_and_agree_with_the_faces():
    errors, apart = [], []
    for count in (14, 28):
        fields, load, faces = at_rest(0.8, (count,) * 3)
        centres = sum(np.gradient(fields.stress[..., axis], 7.0 / count, axis=axis) for axis in range(3))
        errors.append(np.abs(load - centres).max() / np.abs(load).max())
        middle = 0.5 * (faces.faces[2][:, :, 1:] + faces.faces[2][:, :, :-1])
        apart.append(np.abs(middle - fields.stress[..., 2]).max() / np.abs(fields.stress).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.25) and errors[1] < 0.05
    assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.25) and apart[1] < 0.01


def test_face_stress_crosses_periodic_borders():
    grains, contacts = random_frame(11, periodic=(True,) * 3, tilt=(0.2, 0.0, -0.3))
    grid = Grid((0, 0, 0), (1, 1, 1), (4, 5, 3), (True,) * 3)
    faces = face_stress(grains, contacts, grid, width=0.15)
    for axis, face in enumerate(faces.faces[:1]):
        np.testing.assert_allclose(np.take(face, 0, axis), np.take(face, -1, axis), atol=1e-12)
    second = contacts.first + contacts.branch
    net = np.concatenate([contacts.forces, -contacts.forces])
    wall = WallContacts(np.concatenate([contacts.first, second]), np.concatenate([contacts.first, second]), net)
    density = coarse_grain(grains, None, grid, width=0.15, walls=[wall]).fields().boundary_force
    np.testing.assert_allclose(faces.divergence(), -density, atol=1e-11)


def test_walls_close_the_balance_of_the_whole():
    grains, contacts, wall, gravity = packing_at_rest()
    grid = Grid((-3,) * 3, (6,) * 3, (6, 6, 6))
    fields = coarse_grain(grains, contacts, grid, width=0.5, walls=[wall]).fields()
    total = fields.boundary_force.sum(axis=(0, 1, 2)) * grid.cell_volume
    np.testing.assert_allclose(total, wall.forces.sum(axis=0), atol=1e-11)
    np.testing.assert_allclose(total, -grains.masses.sum() * gravity, atol=1e-10)
    # The integral of the stress is the moment of the external forces.
    external = -(wall.forces[:, :, None] * wall.points[:, None, :]).sum(axis=0)
    external -= (grains.masses[:, None, None] * gravity[:, None] * grains.wrapped[:, None, :]).sum(axis=0)
    np.testing.assert_allclose(fields.stress.sum(axis=(0, 1, 2)) * grid.cell_volume, external, atol=1e-10)


def pair(velocities, omegas, force, radii=0.5, extra=None):
    grains = grain_frame([[0.0, 0.0, 0.0], [0.98, 0.0, 0.0]], velocities=velocities, omegas=omegas, radii=radii)
    contacts = contact_frame(grains, [[0, 1]], [force], extra)
    grid = Grid((-3,) * 3, (4,) * 3, (2, 2, 2))
    fields = coarse_grain(grains, contacts, grid, width=0.3).fields()
    if fields.dissipated_power is None:
        return None
    return fields.dissipated_power.sum() * grid.cell_volume, fields.friction_power.sum() * grid.cell_volume


def test_power_of_a_sliding_a_rolling_and_an_approaching_pair():
    still = np.zeros((2, 3))
    # Sliding at 2 m/s against a friction of 3 N, under a normal force that does no work.
    assert pair([[0, 2.0, 0], [0, 0, 0]], still, [-10.0, -3.0, 0.0]) == pytest.approx((6.0, 6.0))
    # Rolling on each other: the surfaces move alike at the contact, 0.49 m from either centre.
    assert pair(still, [[0, 0, 1.0], [0, 0, -1.0]], [-10.0, -3.0, 0.0]) == pytest.approx((0.0, 0.0), abs=1e-12)
    # Spinning alike they slide at twice the speed of a surface.
    assert pair(still, [[0, 0, 1.0], [0, 0, 1.0]], [-10.0, -3.0, 0.0]) == pytest.approx((3.0 * 0.98, 3.0 * 0.98))
    # Approaching: the normal force takes up 10 N times 0.1 m/s, no friction.
    assert pair([[0.1, 0, 0], [0, 0, 0]], still, [-10.0, 0.0, 0.0]) == pytest.approx((1.0, 0.0), abs=1e-12)
    assert pair(still, None, [-10.0, 0.0, 0.0]) is None
    assert pair(still, still, [-10.0, 0.0, 0.0], extra={"dissipated_power": np.array([4.0])})[0] == pytest.approx(4.0)


def test_a_bridge_across_a_gap_carries_stress_but_is_no_contact():
    grains = grain_frame([[0, 0, 0], [1.1, 0, 0], [2.1, 0, 0]])
    contacts = contact_frame(grains, [[0, 1], [1, 2]], [[3.0, 0, 0], [-1.0, 0, 0]])
    grid = Grid((-3,) * 3, (5,) * 3, (1, 1, 1))
    sums = coarse_grain(grains, contacts, grid, width=0.3)
    fields = sums.fields()
    assert fields.coordination[0, 0, 0] == pytest.approx(2 / 3) and fields.contact_count.sum() == pytest.approx(2.0)
    assert fields.contact_stress[0, 0, 0, 0, 0] * grid.cell_volume == pytest.approx(1.0 - 3.3)


def test_frames_add_and_windows_run():
    frames = [coarse_grain(*random_frame(seed), Grid((0, 0, 0), (1, 1, 1), (2, 2, 2)), width=0.2) for seed in range(5)]
    mean = (frames[0] + frames[1]).fields()
    np.testing.assert_allclose(mean.density, 0.5 * (frames[0].fields().density + frames[1].fields().density))
    windows = list(moving_average(frames, 2))
    assert len(windows) == 4 and all(one.frames == 2 for one in windows)
    assert np.array_equal(windows[0].grains, (frames[0] + frames[1]).grains)
    assert list(moving_average(frames, 6)) == []
    with pytest.raises(DembarkError, match="window of 0"):
        next(moving_average(frames, 0))
    other = coarse_grain(*random_frame(0), Grid((0, 0, 0), (1, 1, 1), (2, 2, 2)), width=0.3)
    with pytest.raises(DembarkError, match="differ in kernel"):
        frames[0] + other
    with pytest.raises(DembarkError, match="grid"):
        frames[0] + coarse_grain(*random_frame(0), Grid((0, 0, 0), (1, 1, 2), (2, 2, 2)), width=0.2)


def test_no_grains_and_no_contacts():
    grid = Grid((0, 0, 0), (1, 1, 1), (2, 3, 4))
    empty = grain_frame(np.zeros((0, 3)))
    nothing = contact_frame(empty, np.zeros((0, 2), int), np.zeros((0, 3)))
    fields = coarse_grain(empty, nothing, grid, width=0.1).fields(shear_corrected=True)
    assert (fields.density == 0.0).all() and np.isnan(fields.velocity).all() and (fields.contact_stress == 0.0).all()
    assert np.isnan(fields.coordination).all() and np.isnan(fields.strain_rate).all()
    fields = coarse_grain(grain_frame([[0.5, 0.5, 0.5]]), None, grid, width=0.1).fields()
    assert fields.contact_stress is fields.stress is fields.coordination is fields.dissipated_power is None
    assert set(fields.arrays()) <= set(Fields.units) == set(Fields.long_names) and "stress" not in fields.arrays()


def test_a_grid_away_from_the_grains_holds_nothing():
    fields = coarse_grain(*random_frame(1), Grid((50, 50, 50), (51, 51, 51), (2, 2, 2)), width=0.1).fields()
    assert (fields.density == 0.0).all() and (fields.contact_stress == 0.0).all()


def test_wrong_input_is_refused_in_one_line():
    grains, contacts = random_frame(1)
    grid = Grid((0, 0, 0), (1, 1, 1), (2, 2, 2))
    broken = grain_frame(np.where(np.arange(36).reshape(12, 3) == 5, np.nan, grains.wrapped))
    for match, call in (
        ("positions with numbers that are not finite", lambda: coarse_grain(broken, None, grid, width=0.1)),
        ("width", lambda: coarse_grain(grains, contacts, grid, width=0.0)),
        ("unknown kernel", lambda: coarse_grain(grains, contacts, grid, kernel="box", width=0.1)),
        ("unknown backend", lambda: coarse_grain(grains, contacts, grid, width=0.1, backend="gpu")),
        ("0 threads", lambda: coarse_grain(grains, contacts, grid, width=0.1, threads=0)),
        ("grain 99, step 7", lambda: coarse_grain(grains, ContactFrame(7, *np.zeros((3, 1, 3)), np.array([[1, 99]])), grid, width=0.1)),
        ("both must agree", lambda: coarse_grain(grains, contacts, Grid((0, 0, 0), (1, 1, 1), (2, 2, 2), (True, False, False)), width=0.1)),
        ("forces with numbers", lambda: coarse_grain(
            grains, ContactFrame(7, contacts.first, contacts.branch, contacts.forces * np.nan, contacts.ids), grid, width=0.1)),
    ):  # fmt: skip
        with pytest.raises(DembarkError, match=match) as caught:
            call()
        assert "\n" not in str(caught.value)
