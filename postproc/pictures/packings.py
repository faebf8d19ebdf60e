"""Packings of grains, coloured by velocity, contact forces or pressure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .. import ContactFrame, ContactsDump, GrainFrame, GrainsDump, render
from ..fields.coarse_graining import WallContacts, rows_of
from ..spheres import volume
from ..walls import CylinderWall, PlaneWall, wall_contacts
from . import saved

HEIGHT = 3.3  # inches


def picture(folder: Path, colour_by: str, scale: float, cut: bool = False, radius: float = 0.0) -> bytes:
    """The last frame of the run in `folder` as a PNG, see `scene`; RunError when the renderer fails."""
    return saved(render.picture(scene(folder, colour_by, scale, cut, radius), height=HEIGHT))


def scene(folder: Path, colour_by: str, scale: float, cut: bool = False, radius: float = 0.0) -> render.Scene:
    """The last frame of the run in `folder`.

    `colour_by` is "velocity" (downward, over `scale` in m/s), "force" (sum of the normal contact forces on a grain over the mean
    weight of a grain, `scale` being gravity in m/s2) or "stress" (pressure in a grain by its contacts with others, and with wall
    and base of a cylinder of `radius` (m), over `scale` in Pa); `cut` leaves out the half that is nearer to the eye.
    """
    grains = GrainsDump(folder / "grains.dump")
    frame = grains[len(grains) - 1]
    if colour_by == "velocity":
        values, label = -frame.velocities[:, 2] / scale, "downward velocity v / v₀"
    else:
        contacts = ContactsDump(folder / "contacts.dump").at_step(frame.step)
        if colour_by == "stress":
            walls = [wall_contacts(frame, wall) for wall in (CylinderWall("side", radius), PlaneWall("base"))] if radius else []
            values = grain_pressure(frame, contacts, walls) / scale
            label = "pressure in a grain" + (" (kPa)" if scale == 1e3 else f" / {scale:g} Pa")
        else:
            values = _normal_forces(frame, contacts) / (frame.masses.mean() * scale)
            label = "normal contact forces on a grain / its weight"
    values = np.where(frame.types == 1, values, np.nan)
    keep = frame.wrapped[:, 1] >= 0.0 if cut else np.ones(len(frame.ids), bool)
    # Glued grains of a rough wall reach far beyond the packing.
    free = frame.positions[frame.types == 1, 2]
    reach = 3.0 * frame.radii.max()
    keep &= (frame.positions[:, 2] >= free.min() - reach) & (frame.positions[:, 2] <= free.max() + reach)
    return render.grain_scene(frame, values, label, keep)


def _normal_forces(frame: GrainFrame, contacts: ContactFrame) -> NDArray[np.float64]:
    """Sum of the normal forces (n,) in N of each grain's contacts."""
    length = np.linalg.norm(contacts.branch, axis=1)
    normal = np.abs(np.sum(contacts.forces * contacts.branch, axis=1)) / np.maximum(length, 1e-300)
    index = rows_of(frame.ids, contacts.ids, contacts.step)
    return np.asarray(sum(np.bincount(index[:, side], normal, len(frame.ids)) for side in (0, 1)))


def grain_pressure(frame: GrainFrame, contacts: ContactFrame, walls: Sequence[WallContacts] = ()) -> NDArray[np.float64]:
    """Pressure (n,) in Pa in each grain: -1/3 of the sum of f . r over its contacts, over its volume, r from its centre to the contact;
    compression positive."""
    index = rows_of(frame.ids, contacts.ids, contacts.step)
    # The contact lies where the two grains share the way between their centres by their radii.
    share = frame.radii[index] / np.maximum(frame.radii[index].sum(axis=1), 1e-300)[:, None]
    moment = -np.sum(contacts.forces * contacts.branch, axis=1)[:, None] * share
    total = sum(np.bincount(index[:, side], moment[:, side], len(frame.ids)) for side in (0, 1))
    for wall in walls:
        _, row = cKDTree(frame.positions).query(wall.positions)
        total = total - np.bincount(row, np.sum(wall.forces * (wall.points - wall.positions), axis=1), len(frame.ids))
    return np.asarray(total / (3.0 * volume(frame.radii)))
