"""What coarse graining spreads over a grid: nothing is lost, and the sums are those of the definitions."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from packings import contact_frame, grain_frame, random_frame

from dembark.common.errors import DembarkError
from dembark.postproc.contacts import ContactFrame
from dembark.postproc.dumps.frames import cell
from dembark.postproc.fields.accumulators import MASS, STRESS
from dembark.postproc.fields.coarse_graining import WallContacts, coarse_grain
from dembark.postproc.fields.field_set import FieldSet
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import NAMES, Kernel, cumulative, line_nodes

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
    accuracy = {"gaussian": 1e-12, "lucy": 1e-4, "heaviside": 2e-3}[name if tilt.any() else "gaussian"]
    assert total(fields.density) == pytest.approx(grains.masses.sum(), rel=accuracy)
    np.testing.assert_allclose(total(fields.momentum), grains.masses @ grains.velocities, atol=30 * accuracy)
    np.testing.assert_allclose(total(fields.contact_stress), moment(contacts), atol=accuracy)
    assert total(fields.solid_fraction) == pytest.approx((4 / 3 * np.pi * grains.radii**3).sum(), rel=accuracy)
    liquid = grains.extra["liquid_volume"].sum() + contacts.extra["liquid_volume"].sum()
    assert total(fields.liquid_content) == pytest.approx(liquid, rel=accuracy)
    assert fields.grain_count.sum() == pytest.approx(len(grains.ids), rel=accuracy)
    assert fields.contact_count.sum() == pytest.approx(len(contacts.ids), rel=accuracy)


def plain(grains, contacts, grid, width, closed):
    """Mass and contact stress times volume in each cell, by the definitions: images of the box, shares along each axis, points on lines."""
    kernel, axes = Kernel("gaussian", width), range(3)

    def shares(places):
        factors = []
        for axis in axes:
            below = cumulative(kernel, grid.edges(axis) - places[:, [axis]])
            part = np.diff(below)
            if closed and not grid.periodic[axis]:
                inside = (places[:, axis] >= grid.low[axis]) & (places[:, axis] <= grid.high[axis])
                part *= np.divide(inside, below[:, -1] - below[:, 0], out=np.zeros(len(places)), where=inside)[:, None]
            factors.append(part)
        return np.einsum("na,nb,nc->nabc", *factors)

    edges, mass, stress = cell(grains.low, grains.high, grains.tilt), np.zeros(grid.shape), np.zeros((*grid.shape, 9))
    place, weight = line_nodes(kernel, np.linalg.norm(contacts.branch, axis=1).max())
    count = int(np.ceil(kernel.reach + np.abs(contacts.branch).max()))
    for image in itertools.product(*(range(-count, count + 1) if flag else [0] for flag in grains.periodic)):
        shift = np.array(image) @ edges
        mass += np.tensordot(shares(grains.wrapped + shift), grains.masses, (0, 0))
        for node, part in zip(place, weight, strict=True):
            moments = -(contacts.forces[:, :, None] * contacts.branch[:, None, :]).reshape(-1, 9)
            stress += part * np.tensordot(shares(contacts.first + shift + node * contacts.branch), moments, (0, 0))
    return mass, stress


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10**6), flags, shapes, kernels, st.booleans(), st.floats(-0.3, 0.3), st.integers(2, 5))
def test_sums_are_those_of_the_definitions_and_no_bit_depends_on_threads(seed, periodic, shape, kernel, closed, tilt, threads):
    name, width = kernel
    grains, contacts = random_frame(seed, 10, 10, periodic=periodic, tilt=(tilt if periodic[1] else 0.0, 0.0, 0.0))
    wall = WallContacts(*np.random.default_rng(seed).uniform(0, 1, (3, 4, 3)))
    grid = Grid((0, 0, 0), (1, 1, 1), shape, periodic)
    mean = np.random.default_rng(seed).normal(size=(*shape, 3))
    how = {"kernel": name, "width": width, "closed": closed, "walls": [wall], "mean_velocity": mean}
    one, many = (coarse_grain(grains, contacts, grid, **how, threads=count) for count in (1, threads))
    for part in ("grains", "contacts", "boundary"):
        assert np.array_equal(getattr(one, part), getattr(many, part))
    if name == "gaussian":
        alone = coarse_grain(grains, contacts, grid, width=width, closed=closed)
        # An edge of a cell is rounded to 1e-16 m, which a narrow kernel sees as 1e-16 / width.
        for found, exact in zip((alone.grains[..., MASS], alone.contacts[..., STRESS]), plain(grains, contacts, grid, width, closed),
                                strict=True):
            np.testing.assert_allclose(found, exact, atol=1e-12 + 2e-15 / width)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("periodic", [False, True])
def test_many_lines_of_all_lengths_in_one_cell(periodic, closed):
    # More lines than are spread together, whose windows begin and end in many cells.
    random = np.random.default_rng(3)
    grains, _ = random_frame(3, count=150, periodic=(periodic,) * 3)
    pairs = random.integers(0, 150, (150, 2))
    branch = random.uniform(-1, 1, (150, 3)) * random.uniform(0, 0.5, (150, 1))
    contacts = ContactFrame(7, grains.wrapped[pairs[:, 0]], branch, random.normal(size=(150, 3)), grains.ids[pairs])
    grid = Grid((0, 0, 0), (1, 1, 1), (9, 7, 11), (periodic,) * 3)
    one, many = (coarse_grain(grains, contacts, grid, width=0.06, closed=closed, threads=count) for count in (1, 3))
    assert np.array_equal(one.grains, many.grains) and np.array_equal(one.contacts, many.contacts)
    mass, stress = plain(grains, contacts, grid, 0.06, closed)
    np.testing.assert_allclose(one.grains[..., MASS], mass, atol=1e-12 * mass.max())
    np.testing.assert_allclose(one.contacts[..., STRESS], stress, atol=1e-12 * np.abs(stress).max())


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
        moved = grain_frame(grains.wrapped + edge, radii=grains.radii, masses=grains.masses, periodic=(True,) * 3, tilt=(0.3, -0.2, 0.45),
                            omegas=None)
        other = ContactFrame(7, contacts.first - edge, contacts.branch, contacts.forces, contacts.ids)
        here, there = coarse_grain(grains, contacts, grid, width=0.2), coarse_grain(moved, other, grid, width=0.2)
        np.testing.assert_allclose(here.grains[..., 0], there.grains[..., 0], atol=1e-13)
        np.testing.assert_allclose(here.contacts[..., :9], there.contacts[..., :9], atol=1e-13)


def test_frames_add():
    frames = [coarse_grain(*random_frame(seed), Grid((0, 0, 0), (1, 1, 1), (2, 2, 2)), width=0.2) for seed in range(2)]
    mean = (frames[0] + frames[1]).fields()
    np.testing.assert_allclose(mean.density, 0.5 * (frames[0].fields().density + frames[1].fields().density))
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
    assert set(fields.arrays()) <= set(FieldSet.units) and "stress" not in fields.arrays()
    with pytest.raises(AttributeError, match="pressure"):
        _ = fields.pressure


@pytest.mark.parametrize(("digits", "expected"), [(6, 1.0), (10, 1.0)])
def test_contacts_touch_in_dumps_of_six_digits_too(digits, expected):
    """Pairs that overlap by less than the places are rounded by; those with a wider gap are bridges."""
    rng, radius, overlap = np.random.default_rng(4), 0.5e-3, 1e-7
    first = rng.uniform(0.1, 0.9, (400, 3))
    away = rng.normal(size=(400, 3))
    away /= np.linalg.norm(away, axis=1)[:, None]

    def coordination(gap):
        places = np.concatenate([first, first + (2.0 * radius + gap) * away])
        rounded = np.array([[float(f"{one:.{digits}g}") for one in row] for row in places])
        frame = grain_frame(rounded, radii=radius)
        contacts = contact_frame(frame, np.column_stack([np.arange(400), np.arange(400, 800)]), np.ones((400, 3)))
        fields = coarse_grain(frame, contacts, Grid((0, 0, 0), (1, 1, 1), (1, 1, 1)), width=0.3).fields()
        return float(fields.coordination.squeeze())

    assert coordination(-overlap) == pytest.approx(expected)
    assert coordination(5e-6) == 0.0


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
        ("threads = 0", lambda: coarse_grain(grains, contacts, grid, width=0.1, threads=0)),
        ("grain 99, step 7", lambda: coarse_grain(grains, ContactFrame(7, *np.zeros((3, 1, 3)), np.array([[1, 99]])), grid, width=0.1)),
        ("both must agree", lambda: coarse_grain(grains, contacts, Grid((0, 0, 0), (1, 1, 1), (2, 2, 2), (True, False, False)), width=0.1)),
        ("forces with numbers", lambda: coarse_grain(
            grains, ContactFrame(7, contacts.first, contacts.branch, contacts.forces * np.nan, contacts.ids), grid, width=0.1)),
    ):  # fmt: skip
        with pytest.raises(DembarkError, match=match) as caught:
            call()
        assert "\n" not in str(caught.value)
