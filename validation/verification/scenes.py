"""Small deterministic systems with known answers: grains as frames, networks of contacts that are in equilibrium."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dembark.postproc import ContactFrame, GrainFrame
from dembark.postproc.fields.coarse_graining import WallContacts

Array = NDArray[np.float64]

DENSITY = 2500.0
GRAVITY = 9.81


def grains(
    places: Array, radii: Array, velocities: Array | None = None, *, low: Array, high: Array, periodic: bool = False,
    forces: Array | None = None
) -> GrainFrame:
    """Grains of DENSITY as one frame; no spin."""
    zero = np.zeros_like(places)
    return GrainFrame(
        step=0, low=np.asarray(low, float), high=np.asarray(high, float), periodic=np.full(3, periodic), ids=np.arange(1, len(places) + 1),
        types=np.ones(len(places), np.int64), positions=places, wrapped=places, velocities=zero if velocities is None else velocities,
        omegas=zero, forces=zero if forces is None else forces, radii=radii, masses=DENSITY * 4.0 / 3.0 * np.pi * radii**3, wall_forces={},
    )


def contacts(first: Array, branch: Array, forces: Array, pairs: NDArray[np.int64]) -> ContactFrame:
    """Contacts between the grains in rows `pairs` (m, 2)."""
    return ContactFrame(0, first, branch, forces, pairs + 1)


@dataclass(frozen=True)
class Network:
    """A heap at rest on a base: `frame`, contacts `links`, and those with the base."""

    frame: GrainFrame
    links: ContactFrame
    base: WallContacts


def heap(count: int = 40, seed: int = 3) -> Network:
    """Grains at random places in a unit cube above the base z = 0, each held by its neighbours: the contact forces, of any direction, are
    the smallest ones with which every grain is in equilibrium under its weight."""
    random = np.random.default_rng(seed)
    places = random.uniform(0.0, 1.0, (count, 3))
    radii = random.uniform(0.04, 0.07, count)
    pairs = cKDTree(places).query_pairs(0.36, output_type="ndarray")
    standing = np.nonzero(places[:, 2] < 0.25)[0]
    frame = grains(places, radii, low=np.zeros(3), high=np.ones(3))
    # Equilibrium: incidence (grains, contacts) times the forces on the first grains is minus the weight.
    incidence = np.zeros((count, len(pairs) + len(standing)))
    link = np.arange(len(pairs))
    incidence[pairs[:, 0], link], incidence[pairs[:, 1], link] = 1.0, -1.0
    incidence[standing, len(pairs) + np.arange(len(standing))] = 1.0
    load = np.zeros((count, 3))
    load[:, 2] = frame.masses * GRAVITY
    # Forces across the weight that cancel on every grain make all components of the stress differ from zero.
    stray = random.normal(size=(incidence.shape[1], 3)) * load[:, 2].mean()
    inverse = np.linalg.pinv(incidence)
    forces = inverse @ load + stray - inverse @ (incidence @ stray)
    links = contacts(places[pairs[:, 0]], places[pairs[:, 1]] - places[pairs[:, 0]], forces[: len(pairs)], pairs)
    points = places[standing] * [1.0, 1.0, 0.0]
    return Network(frame, links, WallContacts(points, places[standing], forces[len(pairs) :]))


def with_wall(network: Network) -> GrainFrame:
    """The heap's frame with the forces of its wall `base` on each grain, as a dump has them."""
    frame = network.frame
    forces = np.zeros_like(frame.positions)
    forces[cKDTree(frame.positions).query(network.base.positions)[1]] = network.base.forces
    return replace(frame, wall_forces={"base": forces})


def lattice(cells: int, force: float, distance: float = 1.0) -> tuple[GrainFrame, ContactFrame]:
    """A periodic face-centred cubic crystal of `cells`^3 cubes whose nearest neighbours at `distance` (m) press with `force` (N)."""
    edge = np.sqrt(2.0) * distance
    corner = np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    basis = np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [0.5, 0.5, 0.0]])
    places = ((corner + basis).reshape(-1, 3) + 0.25) * edge
    size = np.full(3, cells * edge)
    frame = grains(places, np.full(len(places), 0.5 * distance), low=np.zeros(3), high=size, periodic=True)
    pairs = cKDTree(places, boxsize=size).query_pairs(1.01 * distance, output_type="ndarray")
    branch = places[pairs[:, 1]] - places[pairs[:, 0]]
    branch -= size * np.round(branch / size)
    return frame, contacts(places[pairs[:, 0]], branch, -force * branch / distance, pairs)
