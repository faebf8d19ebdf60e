"""Grains out of arrays, without a file."""

from __future__ import annotations

from typing import Any

import numpy as np

from dembark.postproc import ContactFrame, GrainFrame


def frame_of(positions: Any, radii: Any = 0.1, walls: Any = None, *, step: int = 0, low: Any = (-5.0,) * 3, high: Any = (5.0,) * 3,
             periodic: Any = (False,) * 3, ids: Any = None) -> GrainFrame:
    """Resting grains of mass 1 with given wall forces."""
    positions = np.asarray(positions, float).reshape(-1, 3)
    count = len(positions)
    zero = np.zeros((count, 3))
    return GrainFrame(
        step=step, low=np.array(low), high=np.array(high), periodic=np.array(periodic), types=np.ones(count, np.int64),
        ids=np.arange(1, count + 1) if ids is None else np.asarray(ids), positions=positions, wrapped=positions,
        velocities=zero, omegas=zero, forces=zero, radii=np.broadcast_to(np.asarray(radii, float), count).copy(), masses=np.ones(count),
        wall_forces={name: np.asarray(force, float).reshape(-1, 3) for name, force in (walls or {}).items()})


def contacts_of(frame: GrainFrame, first: Any, second: Any, forces: Any) -> ContactFrame:
    """Contacts between grains by their ids, with the forces on the first."""
    place = dict(zip(frame.ids.tolist(), frame.positions, strict=True))
    start = np.array([place[number] for number in first])
    return ContactFrame(frame.step, start, np.array([place[number] for number in second]) - start, np.asarray(forces, float),
                        np.column_stack([first, second]))
