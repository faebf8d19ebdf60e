"""Coarse-grained stress balances the forces on a packing at rest."""

import numpy as np
import pytest
from packings import packing_at_rest, random_frame

from dembark.postproc.fields.coarse_graining import WallContacts, coarse_grain
from dembark.postproc.fields.face_stress import face_stress
from dembark.postproc.fields.grid import Grid


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
