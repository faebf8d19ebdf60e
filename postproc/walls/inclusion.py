"""The surface of an inclusion: a group of grains that others press on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError

from ..contacts import ContactFrame
from ..dumps import DumpError
from ..dumps.frames import less_edges
from ..fields.coarse_graining import rows_of
from ..grains import GrainFrame
from .surfaces import CylinderWall, Places

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Inclusion:
    """The surface of a group of grains, such as one large grain or grains that are glued into a body; contacts load it.

    Stresses refer to the sphere (`surface` "sphere") or the cylinder ("cylinder") of `radius` (m) about the group's centre of mass;
    without `radius` it is that of the single grain, or of the sphere (cylinder) about the centres that holds the group. Coordinates are
    (angle about `axis` in rad, angle from `axis` in rad) on the sphere and (angle, height in m) on the cylinder. The normal is radial;
    shear_1 is along the meridian towards `axis` or along the axis, shear_2 along the rising angle.
    """

    name: str
    ids: tuple[int, ...]
    surface: str = "sphere"
    radius: float | None = None
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        if not self.ids:
            raise DembarkError(f"inclusion {self.name}: no ids", "", "it needs at least one grain")
        if self.surface not in ("sphere", "cylinder"):
            raise DembarkError(f"inclusion {self.name}: surface {self.surface!r}", "", "it must be 'sphere' or 'cylinder'")

    def _cylinder(self, radius: float) -> CylinderWall:
        return CylinderWall(self.name, radius, self.axis, inward=False)

    def size(self, frame: GrainFrame) -> float:
        """Radius (m) of the surface that stresses refer to."""
        if self.radius is not None:
            return self.radius
        members, relative = self.members(frame)
        if self.surface == "cylinder":
            axis = self._cylinder(1.0).axes[0]
            relative = relative - (relative @ axis)[:, None] * axis
        return float(np.max(np.linalg.norm(relative, axis=1) + members.radii))

    def members(self, frame: GrainFrame) -> tuple[GrainFrame, Array]:
        """The group's grains and their places (m, 3) about its centre of mass; DumpError when one is not there.

        Without image flags in the dump, a group shorter than half a period is put together across periodic faces.
        """
        wanted = np.unique(np.asarray(self.ids, np.int64))
        found = np.isin(frame.ids, wanted)
        if found.sum() != len(wanted):
            lost = np.setdiff1d(wanted, frame.ids)
            raise DumpError(f"inclusion {self.name}: grain {lost[0]} is not in the frame of step {frame.step}")
        members = frame.select(found)
        places = members.positions
        if not frame.unwrapped and frame.periodic.any():
            near = places[0] + less_edges(places - places[0], frame)
            places = np.where(np.ptp(near, axis=0) < 0.5 * (frame.high - frame.low), near, places)
        return members, places - np.average(places, axis=0, weights=members.masses)

    def loads(self, frame: GrainFrame, contacts: ContactFrame) -> tuple[Places, Array]:
        """Places of its k contacts with other grains, relative to its centre, and the forces (k, 3) of the inclusion on those, N.

        A contact lies on the line of the centres, in the middle of the overlap or of the gap.
        """
        members, relative = self.members(frame)
        ours = np.isin(contacts.ids, members.ids)
        rows = np.nonzero(ours[:, 0] != ours[:, 1])[0]
        first = ours[rows, 0]
        branch = np.where(first[:, None], contacts.branch[rows], -contacts.branch[rows])
        forces = np.where(first[:, None], -contacts.forces[rows], contacts.forces[rows])
        one, two = contacts.ids[rows].T
        member, other = np.where(first, one, two), np.where(first, two, one)
        index = rows_of(frame.ids, other, contacts.step)
        own = np.searchsorted(members.ids, member)
        length = np.maximum(np.linalg.norm(branch, axis=1), 1e-300)
        share = 0.5 * (length + members.radii[own] - frame.radii[index]) / length
        return self._places(relative[own] + share[:, None] * branch), forces

    def _places(self, points: Array) -> Places:
        cylinder = self._cylinder(1.0).places(points)
        if self.surface == "cylinder":
            return replace(cylinder, points=points)
        radial = points / np.maximum(np.linalg.norm(points, axis=1), 1e-300)[:, None]
        around = cylinder.basis[:, 2]
        axis = self._cylinder(1.0).axes[0]
        polar = np.arctan2(np.linalg.norm(np.cross(axis, radial), axis=1), radial @ axis)
        basis = np.stack([radial, np.cross(radial, around), around], axis=1)
        return Places(points, basis, np.column_stack([cylinder.coordinates[:, 0], polar]))
