"""Which grains a wall touches, where and with what force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..dumps import DumpError
from ..dumps.frames import folded
from ..fields.coarse_graining import WallContacts
from ..grains import GrainFrame
from .surfaces import Wall

Array = NDArray[np.float64]


def into_box(frame: GrainFrame) -> Array:
    """Positions (n, 3) in m inside the box on periodic axes: engines let grains drift a little out of it between neighbour lists."""
    return folded(frame.wrapped, frame.low, frame.high, frame.tilt, frame.periodic)


def touching(frame: GrainFrame, name: str) -> tuple[NDArray[np.bool_], Array]:
    """Which grains (n,) the wall `name` pushes or pulls, and its forces on those (k, 3); DumpError when the dump has no such wall."""
    if name not in frame.wall_forces:
        known = ", ".join(frame.wall_forces) or "none"
        raise DumpError(f"wall {name!r} has no columns f_force_{name}[1..3] in the dump; there are: {known}")
    forces = frame.wall_forces[name]
    mask = np.any(forces != 0.0, axis=1)
    return mask, forces[mask]


def wall_contacts(frame: GrainFrame, wall: Wall, time: float = 0.0) -> WallContacts:
    """Where `wall` touches the grains of `frame` and with what force, for `coarse_grain(walls=...)`; `time` (s) places a moving wall."""
    mask, forces = touching(frame, wall.name)
    centres = into_box(frame)[mask]
    return WallContacts(wall.at(time).places(centres).points, centres, forces)
