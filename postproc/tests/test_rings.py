"""Fields averaged around an axis conserve what they must."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from packings import grain_frame

from dembark.postproc import ContactFrame
from dembark.postproc.fields.coarse_graining import WallContacts
from dembark.postproc.fields.rings import Rings, coarse_grain


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.5), st.floats(0.03, 0.4))
def test_rings_conserve_mass_wherever_grains_are(seed, width, spacing):
    random = np.random.default_rng(seed)
    place = random.uniform(-1.2, 1.2, (30, 3))
    frame = grain_frame(place, radii=random.uniform(0.01, 0.1, 30), masses=random.uniform(0.1, 1.0, 30))
    rings = Rings.around(1.0, 1.0, width, spacing)
    none = np.zeros((0, 3))
    links = ContactFrame(0, none, none, none, np.zeros((0, 2), np.int64))
    fields, _ = coarse_grain(frame, links, [WallContacts(none, none, none)], rings, np.ones((len(rings.heights), 1)),
                                   lambda places: np.ones((len(places), 1)))
    assert fields.mass.sum() == pytest.approx(frame.masses.sum(), rel=1e-12)


def test_rings_average_a_column_of_pressure():
    """Many vertical lines spread evenly over a cylinder: sigma_zz is uniform in it, and nothing else is there."""
    random = np.random.default_rng(3)
    count, radius = 1000, 1.0
    r, turn = radius * np.sqrt((np.arange(count) + 0.5) / count), random.uniform(0.0, 2.0 * np.pi, count)
    first = np.column_stack([r * np.cos(turn), r * np.sin(turn), np.zeros(count)])
    branch, forces = np.tile([0.0, 0.0, 1.0], (count, 1)), np.tile([0.0, 0.0, -1.0], (count, 1))
    frame = grain_frame(first[:1], radii=0.1)
    links = ContactFrame(0, first, branch, forces, np.zeros((count, 2), np.int64))
    rings = Rings.around(radius, 1.0, 0.1, 0.1)
    none = np.zeros((0, 3))
    fields, _ = coarse_grain(frame, links, [WallContacts(none, none, none)], rings, np.ones((len(rings.heights), 1)),
                                   lambda places: np.ones((len(places), 1)))
    inside = np.ix_(rings.radii < 0.6, (rings.heights > 0.4) & (rings.heights < 0.6))
    np.testing.assert_allclose(fields.mean("zz", rings)[inside], count / np.pi, rtol=5e-3)
    np.testing.assert_allclose(fields.mean("rr", rings), 0.0, atol=1e-12)
    # Over what the kernel sees inside, it is uniform up to the wall.
    edge = rings.radii < radius
    np.testing.assert_allclose((fields.mean("zz", rings) / rings.coverage)[edge][:, inside[1].ravel()], count / np.pi, rtol=0.01)


@pytest.mark.parametrize("height", [0.01, 0.0118])
def test_what_flows_through_the_borders_is_what_the_layers_gain(height):
    """Also in the outermost layers, which hold all that the kernel carries beyond them."""
    width = 0.005
    rings = Rings.around(0.02, height, width, 0.5 * width)
    node, weight = np.polynomial.legendre.leggauss(40)
    for low, high in ((0.0, 0.5 * width), (height, height + width)):
        before, after = (rings.along(np.array([place]))[0][0] for place in (low, high))
        places, weights = low + 0.5 * (high - low) * (node + 1.0), 0.5 * (high - low) * weight
        flow = weights @ rings.along(places)[1]
        np.testing.assert_allclose(after - before, -np.diff(flow), rtol=0.0, atol=1e-9)
    assert (rings.across(np.array([0.019]))[3][:, -1] == 0.0).all()


def test_sums_over_the_nodes_of_the_tables_are_those_of_each_point():
    """Points one by one, at exact heights, against sums over nodes: what the tables cost is below 1e-6."""
    random = np.random.default_rng(11)
    width = 0.2
    rings = Rings.around(1.0, 2.0, width, 0.1)
    place = random.uniform([-0.7, -0.7, 0.0], [0.7, 0.7, 2.0], (40, 3))
    frame = grain_frame(place, radii=random.uniform(0.01, 0.1, 40), masses=random.uniform(0.1, 1.0, 40))
    frame = replace(frame, velocities=random.normal(size=(40, 3)))
    none = np.zeros((0, 3))
    links = ContactFrame(0, none, none, none, np.zeros((0, 2), np.int64))
    layers, sectors = random.uniform(0.0, 1.0, (len(rings.heights), 2)), random.uniform(0.0, 1.0, (40, 3))
    fields, zones = coarse_grain(frame, links, [WallContacts(none, none, none)], rings, layers,
                                 lambda places: sectors if len(places) else np.zeros((0, 3)))
    radius = np.hypot(place[:, 0], place[:, 1])
    (zero, one, two, _), (layer, _) = rings.across(radius), rings.along(place[:, 2])
    outward = np.column_stack([place[:, 0], place[:, 1], np.zeros(40)]) / radius[:, None]
    around = np.column_stack([-outward[:, 1], outward[:, 0], np.zeros(40)])
    v = [np.einsum("ni,ni->n", frame.velocities, axis) for axis in (outward, around)] + [frame.velocities[:, 2]]

    def spread(across, a, b):
        return across * (frame.masses * v[a] * v[b])[:, None]

    vertical, radial = spread(zero, 2, 2), 0.5 * (spread(zero, 0, 0) + spread(zero, 1, 1) + spread(two, 0, 0) - spread(two, 1, 1))
    expected = {"mass": zero * frame.masses[:, None], "zz": vertical, "rr": radial, "zr": spread(one, 2, 0), "rz": spread(one, 0, 2)}
    for name, across in expected.items():
        sums = across.T @ layer
        np.testing.assert_allclose(getattr(fields, name), sums, rtol=0.0, atol=1e-6 * np.abs(sums).max(), err_msg=name)
    for part, across in enumerate((vertical, radial)):
        sums = np.einsum("nz,ns,nk->zsk", layer @ layers, sectors, across)
        np.testing.assert_allclose(zones.stress[..., part], sums, rtol=0.0, atol=1e-6 * np.abs(sums).max())
