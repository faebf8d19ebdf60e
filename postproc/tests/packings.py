"""Frames made of arrays: lattices, random grains and a packing at rest, for the tests of fields."""

from __future__ import annotations

from typing import Any

import numpy as np

from dembark.postproc.contacts import ContactFrame
from dembark.postproc.fields.coarse_graining import WallContacts
from dembark.postproc.grains import GrainFrame, cell

FREE = (False, False, False)


def grain_frame(positions: Any, *, radii: Any = 0.5, masses: Any = 1.0, velocities: Any = 0.0, omegas: Any = 0.0, low: Any = (0, 0, 0),
                high: Any = (1, 1, 1), periodic: Any = FREE, tilt: Any = (0, 0, 0), extra: Any = None, step: int = 7, walls: Any = None,
                ids: Any = None) -> GrainFrame:
    """A frame of n grains; numbers stand for all of them."""
    positions = np.asarray(positions, float).reshape(-1, 3)
    count = len(positions)
    return GrainFrame(
        step=step, low=np.asarray(low, float), high=np.asarray(high, float), periodic=np.asarray(periodic, bool),
        ids=np.arange(1, count + 1) if ids is None else np.asarray(ids), types=np.ones(count, int), positions=positions, wrapped=positions,
        velocities=np.zeros((count, 3)) + velocities, omegas=None if omegas is None else np.zeros((count, 3)) + omegas,
        forces=np.zeros((count, 3)), radii=np.zeros(count) + radii, masses=np.zeros(count) + masses,
        wall_forces={name: np.asarray(force, float).reshape(-1, 3) for name, force in (walls or {}).items()}, tilt=np.asarray(tilt, float),
        extra=extra or {})


def frame_of(positions: Any, radii: Any = 0.1, walls: Any = None, **how: Any) -> GrainFrame:
    """Resting grains of mass 1 with given wall forces, in a box of 10 m."""
    return grain_frame(positions, radii=radii, walls=walls, **{"step": 0, "low": (-5.0,) * 3, "high": (5.0,) * 3} | how)


def contacts_of(frame: GrainFrame, first: Any, second: Any, forces: Any) -> ContactFrame:
    """Contacts between grains by their ids, with the forces on the first."""
    rows = np.searchsorted(frame.ids, np.column_stack([first, second]))
    start, end = frame.positions[rows.T]
    return ContactFrame(frame.step, start, end - start, np.asarray(forces, float), frame.ids[rows])


def contact_frame(grains: GrainFrame, pairs: Any, forces: Any, extra: Any = None) -> ContactFrame:
    """Contacts between the rows `pairs` (m, 2) with `forces` (m, 3) on the first; branches to the nearest image."""
    pairs = np.asarray(pairs, int).reshape(-1, 2)
    branch = grains.wrapped[pairs[:, 1]] - grains.wrapped[pairs[:, 0]]
    edges = cell(grains.low, grains.high, grains.tilt)
    for axis in (2, 1, 0):
        if grains.periodic[axis]:
            branch -= np.round(branch[:, axis] / edges[axis, axis])[:, None] * edges[axis]
    return ContactFrame(7, grains.wrapped[pairs[:, 0]], branch, np.asarray(forces, float).reshape(-1, 3), grains.ids[pairs], extra or {})


def random_frame(seed: int, count: int = 12, contacts: int = 18, **how: Any) -> tuple[GrainFrame, ContactFrame]:
    """Grains anywhere in the unit box with any velocities, and contacts of any branch and force between any of them."""
    random = np.random.default_rng(seed)
    grains = grain_frame(random.uniform(0, 1, (count, 3)), radii=random.uniform(0.02, 0.05, count), masses=random.uniform(1, 2, count),
                         velocities=random.normal(size=(count, 3)), omegas=random.normal(size=(count, 3)),
                         extra={"liquid_volume": random.uniform(size=count)}, **how)
    pairs = random.integers(0, count, (contacts, 2))
    frame = ContactFrame(7, grains.wrapped[pairs[:, 0]], random.normal(0, 0.06, (contacts, 3)), random.normal(size=(contacts, 3)),
                         grains.ids[pairs], {"liquid_volume": random.uniform(size=contacts)})
    return grains, frame


def cubic_lattice(size: int, stiffness: tuple[float, float, float]) -> tuple[GrainFrame, ContactFrame]:
    """A periodic simple cubic lattice of unit spheres in touch, pressed together along each axis by the forces `stiffness` (N)."""
    axis = np.arange(size) + 0.25
    place = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    grains = grain_frame(place, high=(size,) * 3, periodic=(True,) * 3)
    number = np.arange(size**3).reshape(size, size, size)
    pairs = [np.stack([number.ravel(), np.roll(number, -1, way).ravel()], axis=1) for way in range(3)]
    forces = [np.tile(-np.eye(3)[way] * stiffness[way], (size**3, 1)) for way in range(3)]
    return grains, contact_frame(grains, np.concatenate(pairs), np.concatenate(forces))


def fcc_lattice(size: int, force: float) -> tuple[GrainFrame, ContactFrame]:
    """A periodic face-centred cubic lattice of cubes of edge 1, each grain pressed against its twelve neighbours by `force` (N)."""
    corner = np.stack(np.meshgrid(*[np.arange(size)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    place = (corner + np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])).reshape(-1, 3) + 0.1
    grains = grain_frame(place, radii=np.sqrt(0.125), high=(size,) * 3, periodic=(True,) * 3)
    apart = place[None] - place[:, None]
    apart -= size * np.round(apart / size)
    one, two = np.nonzero(np.triu(np.linalg.norm(apart, axis=2) < 0.75, 1))
    return grains, contact_frame(grains, np.stack([one, two], axis=1), -force * apart[one, two] / np.sqrt(0.5))


def packing_at_rest(seed: int = 3, size: int = 3, gravity: float = 9.81) -> tuple[GrainFrame, ContactFrame, WallContacts, np.ndarray]:
    """A disordered packing on a floor between four walls, in balance to round-off; also the vector of gravity (m/s2).

    The forces are the least ones, friction unlimited, that hold every grain: a linear system, as a static engine would end at.
    """
    random = np.random.default_rng(seed)
    axis = np.arange(size) + 0.5
    place = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3) + random.uniform(-0.15, 0.15, (size**3, 3))
    grains = grain_frame(place, masses=random.uniform(0.5, 2.0, size**3), high=(size,) * 3)
    number = np.arange(size**3).reshape(size, size, size)
    pairs = np.concatenate(
        [np.stack([np.take(number, range(size - 1), way).ravel(), np.take(number, range(1, size), way).ravel()], axis=1)
         for way in range(3)]
    )
    walls = []
    for way, sides in ((0, (0, size)), (1, (0, size)), (2, (0,))):
        for side in sides:
            touching = np.take(number, 0 if side == 0 else size - 1, way).ravel()
            point = place[touching].copy()
            point[:, way] = side
            walls.append((touching, point))
    touching, points = (np.concatenate(parts) for parts in zip(*walls, strict=True))
    balance = np.zeros((size**3, len(pairs) + len(touching)))
    balance[pairs[:, 0], np.arange(len(pairs))] = 1.0
    balance[pairs[:, 1], np.arange(len(pairs))] = -1.0
    balance[touching, len(pairs) + np.arange(len(touching))] = 1.0
    down = np.array([0.0, 0.0, -gravity])
    forces = np.linalg.lstsq(balance, -grains.masses[:, None] * down, rcond=None)[0]
    return grains, contact_frame(grains, pairs, forces[: len(pairs)]), WallContacts(points, place[touching], forces[len(pairs) :]), down
