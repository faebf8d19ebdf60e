"""Frames of a layer between two plates of glued grains, as plates.in has it: what is measured away from the plates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dembark.common.errors import DembarkError
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
    (m) from plate to plate; contacts and bridges of a grain, and `touching`, those without a gap."""

    stress: Array
    attraction: float
    fraction: float
    height: float
    coordination: float
    touching: float


def inside(grains: GrainFrame, contacts: ContactFrame, p: Numbers, area: float) -> Inside:
    """Of one frame of a layer that covers `area` (m²), for a case with the groups grains and bridges; DembarkError for a thin layer."""
    free, z = grains.types == 1, grains.positions[:, 2]
    low, high = (float(plate.mean()) for plate in np.array_split(z[~free], 2))
    near = NEAR * p["grain_diameter"]
    edges = np.array([low + near, high - near])
    if edges[1] - edges[0] < p["grain_diameter"]:
        raise DembarkError(f"step {grains.step}: the plates are {(high - low) / p['grain_diameter']:.3g} grain_diameter apart",
                           f"nothing is measured within {NEAR:g} of each, so 5 are the least", "raise grain_count, or narrow the cell")
    fraction = float(slice_volumes(z, grains.radii, edges).sum() / (area * (edges[1] - edges[0])))
    stress, attraction = pair_stress(contacts.first, contacts.branch, contacts.forces, 2, edges, area)[0], 0.0
    # A contact with a glued grain counts for one free grain only.
    counts = free[np.searchsorted(grains.ids, contacts.ids)].sum(axis=1)
    met = meeting = float(counts.sum())
    if p["bridge_volume"] > 0.0:
        radii, apart = grains.radii[np.searchsorted(grains.ids, contacts.ids)], np.linalg.norm(contacts.branch, axis=1)
        gaps = apart - radii.sum(axis=1)
        meeting = float(counts[gaps <= 0.0].sum())
        pull = capillary_force(radii[:, 0], radii[:, 1], gaps, p["bridge_volume"], p["surface_tension"],
                               p["contact_angle"], model=p["capillary_model"])
        pulls = (pull / apart)[:, None] * contacts.branch
        attraction = -float(np.trace(pair_stress(contacts.first, contacts.branch, pulls, 2, edges, area)[0])) / 3.0
    return Inside(stress, attraction, fraction, high - low, met / float(free.sum()), meeting / float(free.sum()))
