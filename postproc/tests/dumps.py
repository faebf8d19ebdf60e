"""Writes dumps in the schema of the decks out of arrays, so that every measure can be checked against what was put in."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

BOX = ((-1.0, 1.0), (-1.0, 1.0), (-1.0, 10.0))


def _head(step: int, count: int, what: str, box: Any, flags: str, columns: str) -> str:
    bounds = "\n".join(f"{low:.12g} {high:.12g}" for low, high in box)
    kind = "ATOMS" if what == "ATOMS" else "ENTRIES"
    return f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {kind}\n{count}\nITEM: BOX BOUNDS {flags}\n{bounds}\nITEM: {what} {columns} \n"


def _lines(table: Any) -> str:
    # Tests write a hundred million numbers: what is the same in all rows is formatted once.
    same = (table == table[:1]).all(axis=0)
    words = [f"{value:.12g}" if alike else "%.12g" for value, alike in zip(table[0], same, strict=True)] if len(table) else []
    row = " ".join(words) + "\n"
    return "".join([row % tuple(numbers) for numbers in table[:, ~same].tolist()])


def grains_text(step: int, positions: Any, radii: Any, *, velocities: Any = None, masses: Any = None, types: Any = None,
                walls: Mapping[str, Any] | None = None, images: Any = None, box: Any = BOX, flags: str = "ff ff ff",
                order: Any = None) -> str:
    """One frame of a grains.dump; `order` shuffles its lines."""
    count = len(positions)
    zero = np.zeros((count, 3))
    velocities = zero if velocities is None else velocities
    masses = 2500.0 * 4.0 / 3.0 * np.pi * np.asarray(radii) ** 3 if masses is None else masses
    types = np.ones(count) if types is None else types
    images = zero if images is None else images
    walls = walls or {}
    names = "id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass " + " ".join(
        f"f_force_{name}[{axis}]" for name in walls for axis in (1, 2, 3)
    )
    table = np.column_stack([np.arange(1, count + 1), types, positions, images, velocities, zero, zero, radii, masses, *walls.values()])
    return _head(step, count, "ATOMS", box, flags, names) + _lines(table if order is None else table[order])


def contacts_text(step: int, first: Any, second: Any, ids: Any, forces: Any, *, box: Any = BOX, flags: str = "ff ff ff") -> str:
    """One frame of a contacts.dump."""
    table = np.column_stack([first, second, ids, np.zeros(len(first)), forces]) if len(first) else np.empty((0, 12))
    names = " ".join(f"c_contacts[{number}]" for number in range(1, 13))
    return _head(step, len(table), "ENTRIES", box, flags, names) + _lines(table)


def write_times(path: Path, columns: Mapping[str, Any]) -> None:
    """A time.csv."""
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.15g")
