"""What grains are coloured by: a number for each grain, by the name of the quantity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dembark.common.choices import nearest
from dembark.common.errors import DembarkError

from .. import ContactFrame, GrainFrame
from ..fields.coarse_graining import WallContacts, rows_of
from ..spheres import volume
from ..walls.contacts import into_box

Array = NDArray[np.float64]

OF_CONTACTS = {"contact_force": "N", "contact_count": "1", "pressure": "Pa"}
_VECTORS = {"velocity": ("velocities", "m/s"), "angular_velocity": ("omegas", "rad/s"), "force": ("forces", "N")}
_SCALARS = {"diameter": "m", "radius": "m", "mass": "kg", "id": "1", "type": "1"}
# Columns of dumps whose unit is known.
_COLUMNS = {"liquid_volume": "m^3", "rho": "kg/m^3", "p": "Pa"}


@dataclass(frozen=True, eq=False)
class Quantity:
    """Numbers (n,) of the grains of a frame in `unit` (SI; "" unknown), whose `label` has no unit; `kinds`: they are numbers of kinds."""

    values: Array
    unit: str
    label: str
    kinds: bool = False


def usual(frame: GrainFrame) -> str:
    """What grains are coloured by where nothing is said: their speed, or their diameter where the dump has no velocities."""
    return "velocity" if frame.has("velocities") else "diameter"


def quantity(name: str, frame: GrainFrame, contacts: ContactFrame | None = None, walls: Sequence[WallContacts] = ()) -> Quantity:
    """The quantity `name` of the grains: a vector's magnitude, `velocity`, or component, `velocity:z`; `position:z`; `diameter`, `mass`,
    `type`, `id`; a column of the dump; of their contacts, `contact_force`, the sum of the normal forces on a grain, `contact_count`, and
    `pressure`, see grain_pressure. `walls` count for the pressure. DembarkError for another name, or where contacts are missing.
    """
    base, _, part = name.partition(":")
    vectors = {key: (getattr(frame, held), unit) for key, (held, unit) in _VECTORS.items() if frame.has(held)}
    vectors |= {"position": (frame.wrapped, "m")} | {f"force_of_{wall}": (force, "N") for wall, force in frame.wall_forces.items()}
    label = " ".join(name.replace(":", " ").split("_"))
    if name in frame.extra:
        return Quantity(np.asarray(frame.extra[name], float), _COLUMNS.get(name, ""), name)
    if base in vectors:
        values, unit = vectors[base]
        if not part or part == "magnitude":
            return Quantity(np.linalg.norm(values, axis=1), unit, "speed" if base == "velocity" else base.replace("_", " "))
        if part not in ("x", "y", "z"):
            raise DembarkError(f"unknown component {part!r} of {base}", "", f"write {base}, or {base}:x, {base}:y, {base}:z")
        return Quantity(values[:, "xyz".index(part)], unit, label)
    if name in OF_CONTACTS:
        if contacts is None:
            raise DembarkError(f"{name} needs the contacts of the grains", "", "name their dump with --contacts")
        return Quantity(_of_contacts(name, frame, contacts, walls), OF_CONTACTS[name], label)
    scalars = {"diameter": 2.0 * frame.radii, "radius": frame.radii, "mass": frame.masses, "id": frame.ids}
    if frame.has("types"):
        scalars["type"] = frame.types
    if name not in scalars:
        known = {*scalars, *vectors, *frame.extra, *OF_CONTACTS}
        raise DembarkError(f"unknown quantity {name!r}", frame.where, nearest(name, known))
    return Quantity(np.asarray(scalars[name], float), _SCALARS[name], label, name == "type")


def _of_contacts(name: str, frame: GrainFrame, contacts: ContactFrame, walls: Sequence[WallContacts]) -> Array:
    if name == "pressure":
        return grain_pressure(frame, contacts, walls)
    index, length = rows_of(frame.ids, contacts.ids, contacts.step), np.linalg.norm(contacts.branch, axis=1)
    normal = np.abs(np.sum(contacts.forces * contacts.branch, axis=1)) / np.maximum(length, 1e-300)
    weight = normal if name == "contact_force" else np.any(contacts.forces != 0.0, axis=1).astype(float)
    return np.asarray(sum(np.bincount(index[:, side], weight, len(frame.ids)) for side in (0, 1)), float)


def grain_pressure(frame: GrainFrame, contacts: ContactFrame, walls: Sequence[WallContacts] = ()) -> Array:
    """Pressure (n,) in Pa in each grain: -1/3 of the sum of f . r over its contacts, over its volume, r from its centre to the contact;
    compression positive."""
    index = rows_of(frame.ids, contacts.ids, contacts.step)
    # The contact lies where the two grains share the way between their centres by their radii.
    share = frame.radii[index] / np.maximum(frame.radii[index].sum(axis=1), 1e-300)[:, None]
    moment = -np.sum(contacts.forces * contacts.branch, axis=1)[:, None] * share
    total = sum(np.bincount(index[:, side], moment[:, side], len(frame.ids)) for side in (0, 1))
    tree = cKDTree(into_box(frame)) if walls else None
    for wall in walls:
        assert tree is not None
        _, row = tree.query(wall.positions)
        total = total - np.bincount(row, np.sum(wall.forces * (wall.points - wall.positions), axis=1), len(frame.ids))
    return np.asarray(total / (3.0 * volume(frame.radii)))
