"""Fields averaged around an axis conserve what they must."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from packings import grain_frame
from scipy.special import ive

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


def _shares(rings, order, radius):
    """Shares (n, k) of the kernel in the rings by Gauss's rule of 20 points, the last ring with all that is beyond it."""
    node, weight = np.polynomial.legendre.leggauss(20)
    half = 0.5 * np.diff(rings.radial)[:, None]
    r, s = (rings.radii[:, None] + half * node), radius[:, None, None]
    kernel = np.exp(-0.5 * ((r - s) / rings.width) ** 2) * ive(order, r * s / rings.width**2) / rings.width**2
    found = (kernel * r * half * weight).sum(axis=2)
    if order == 0:
        found[:, -1] += 1.0 - found.sum(axis=1)
    return found


def test_sums_over_the_nodes_of_the_tables_are_those_of_each_point():
    """Forces that are not along their lines, moving grains and a wall: point by point, by quadrature, to a millionth."""
    random = np.random.default_rng(11)
    rings = Rings.around(1.0, 2.0, 0.2, 0.1)
    place = random.uniform([-0.7, -0.7, 0.0], [0.7, 0.7, 2.0], (40, 3))
    frame = grain_frame(place, radii=random.uniform(0.01, 0.1, 40), masses=random.uniform(0.1, 1.0, 40))
    frame = replace(frame, velocities=random.normal(size=(40, 3)), forces=random.normal(size=(40, 3)))
    branch = random.uniform(-0.06, 0.06, (40, 3))
    links = ContactFrame(0, place, branch, random.normal(size=(40, 3)), np.zeros((40, 2), np.int64))
    wall = WallContacts(place[:5] + branch[:5], place[:5], random.normal(size=(5, 3)))
    layers, parts = random.uniform(0.0, 1.0, (len(rings.heights), 2)), random.uniform(0.0, 1.0, 3)
    fields, zones = coarse_grain(frame, links, [wall], rings, layers, lambda places: np.tile(parts, (len(places), 1)))

    node, weight = np.polynomial.legendre.leggauss(3)
    first, line = np.concatenate([place, wall.positions]), np.concatenate([branch, wall.points - wall.positions])
    force = np.concatenate([links.forces, wall.forces])
    points = (first + 0.5 * (node[:, None, None] + 1.0) * line).reshape(-1, 3)
    tensors = (0.5 * weight[:, None, None, None] * -np.einsum("na,nb->nab", force, line)).reshape(-1, 3, 3)
    moving = np.einsum("n,na,nb->nab", frame.masses, frame.velocities, frame.velocities)

    def turned(at, tensor):
        outward = at * [1.0, 1.0, 0.0] / np.hypot(at[:, 0], at[:, 1])[:, None]
        axes = np.stack([outward, np.cross([0.0, 0.0, 1.0], outward), np.tile([0.0, 0.0, 1.0], (len(at), 1))], axis=1)
        return axes @ tensor @ axes.transpose(0, 2, 1)

    def radial(at, order):
        return _shares(rings, order, np.hypot(at[:, 0], at[:, 1]))

    def stress(at, tensor):
        t, zero, one, two = turned(at, tensor), *(radial(at, order) for order in (0, 1, 2))
        mean, half = 0.5 * (t[:, 0, 0] + t[:, 1, 1])[:, None] * zero, 0.5 * (t[:, 0, 0] - t[:, 1, 1])[:, None] * two
        return {"zz": t[:, 2, 2, None] * zero, "rr": mean + half, "tt": mean - half, "zr": t[:, 2, 0, None] * one,
                "rz": t[:, 0, 2, None] * one}

    def layered(at):
        return rings.along(at[:, 2])[0]

    of_lines, of_grains = stress(points, tensors), stress(place, moving)
    expected = {name: of_lines[name].T @ layered(points) + of_grains[name].T @ layered(place) for name in of_lines}
    shares = radial(place, 0)
    for name, carried in (("mass", frame.masses), ("volume", 4.0 / 3.0 * np.pi * frame.radii**3), ("net", frame.forces[:, 2])):
        expected[name] = (shares * carried[:, None]).T @ layered(place)
    expected["wall"] = (radial(wall.points, 0) * wall.forces[:, 2, None]).T @ layered(wall.points)
    expected["through_layers"] = of_lines["zz"].T @ rings.along(points[:, 2])[1]
    for name, sums in expected.items():
        np.testing.assert_allclose(getattr(fields, name), sums, rtol=0.0, atol=1e-6 * np.abs(sums).max(), err_msg=name)
    for part, name in enumerate(("zz", "rr")):
        sums = (np.einsum("nz,nk->zk", layered(points) @ layers, of_lines[name])
                + np.einsum("nz,nk->zk", layered(place) @ layers, of_grains[name]))[:, None, :] * parts[:, None]
        np.testing.assert_allclose(zones.stress[..., part], sums, rtol=0.0, atol=1e-6 * np.abs(sums).max())


def test_what_flows_above_the_layers_crosses_no_border():
    """A falling grain far above the filling is in the uppermost layer, and nothing of it moves through the layers."""
    rings = Rings.around(1.0, 1.0, 0.2, 0.1)
    frame = grain_frame(np.array([[0.1, 0.2, rings.vertical[-1] + 2.0]]), radii=0.1)
    none = np.zeros((0, 3))
    place = np.array([[0.1, 0.2, rings.vertical[-1] + 2.0]])
    links = ContactFrame(0, place, np.array([[0.0, 0.0, 0.2]]), np.array([[0.0, 0.0, -1.0]]), np.zeros((1, 2), np.int64))
    fields, _ = coarse_grain(frame, links, [WallContacts(none, none, none)], rings, np.ones((len(rings.heights), 1)),
                             lambda places: np.ones((len(places), 1)))
    assert fields.mass[:, -1].sum() == pytest.approx(frame.masses.sum(), rel=1e-9)
    assert np.abs(fields.through_layers).max() < 1e-7
