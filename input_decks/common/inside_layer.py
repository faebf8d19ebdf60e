"""Frames of a layer between two plates of glued grains, as plates.in has it: what is measured away from the plates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dembark.physics import capillary_force
from dembark.postproc import ContactFrame, GrainFrame
from dembark.postproc.measurement import Array, Numbers
from dembark.postproc.spheres import slice_volumes
from dembark.postproc.stress import pair_stress

# Mean diameters from the plates within which nothing is measured.
NEAR = 2.0


@dataclass(frozen=True, eq=False)
class Inside:
    """`stress` (3, 3) of the contacts and `attraction` of the bridges, mean of its three normal stresses, in Pa; solid fraction; `height`
    (m) from plate to plate; contacts and bridges of a grain."""

    stress: Array
    attraction: float
    fraction: float
    height: float
    coordination: float


def inside(grains: GrainFrame, contacts: ContactFrame, p: Numbers, area: float) -> Inside:
    """Of one frame of a layer that covers `area` (m²), for a case with the groups grains and bridges."""
    free, z = grains.types == 1, grains.positions[:, 2]
    low, high = (float(plate.mean()) for plate in np.array_split(z[~free], 2))
    near = NEAR * p["grain_diameter"]
    edges = np.array([low + near, high - near])
    fraction = float(slice_volumes(z, grains.radii, edges).sum() / (area * (edges[1] - edges[0])))
    stress, attraction = pair_stress(contacts.first, contacts.branch, contacts.forces, 2, edges, area)[0], 0.0
    if p["bridge_volume"] > 0.0:
        radii, apart = grains.radii[np.searchsorted(grains.ids, contacts.ids)], np.linalg.norm(contacts.branch, axis=1)
        pull = capillary_force(radii[:, 0], radii[:, 1], apart - radii.sum(axis=1), p["bridge_volume"], p["surface_tension"],
                               p["contact_angle"], model=p["capillary_model"])
        pulls = (pull / apart)[:, None] * contacts.branch
        attraction = -float(np.trace(pair_stress(contacts.first, contacts.branch, pulls, 2, edges, area)[0])) / 3.0
    # A contact with a glued grain counts for one free grain only.
    met = free[np.searchsorted(grains.ids, contacts.ids)].sum()
    return Inside(stress, attraction, fraction, high - low, float(met) / float(free.sum()))
