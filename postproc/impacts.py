"""Records of impacts: `impacts.txt`, or `impacts.bin`, of `fix lcp/impact` and of YADE's `LcpImpact`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .dumps import DumpError

# In their order in both forms of the file. Units: docs/reference/parameters.md, "Impacts of logs".
COLUMNS = ("id_a", "id_b", "time", "duration", "peak_force", "impulse", "relative_speed", "dissipated", "x", "y", "z", "friction_loss",
           "nx", "ny", "nz", "turn_a", "turn_b")
# A record of `impacts.bin`, for numpy.memmap and numpy.fromfile.
RECORD = np.dtype([(name, "<f8") for name in COLUMNS])

Impacts = NDArray[np.void]


def read_impacts(path: str | Path) -> Impacts:
    """Impacts (n,) that have ended, with the fields of RECORD, SI units, in the order in which they ended.

    A file whose name ends in .bin is mapped, not read; of another one the last line of the header names the columns, in any order, and
    columns of other names are left out. DumpError when the file cannot be read, lacks a column or holds something else.
    """
    path = Path(path)
    try:
        return _mapped(path) if path.suffix == ".bin" else _table(path)
    except OSError as error:
        raise DumpError(f"{path} cannot be read: {error.strerror}") from None


def _mapped(path: Path) -> Impacts:
    size = path.stat().st_size
    if size % RECORD.itemsize:
        raise DumpError(f"{path} has {size} bytes, which are no whole number of records of {RECORD.itemsize} bytes")
    found: Any = np.memmap(path, RECORD, "r") if size else np.zeros(0, RECORD)
    first = found[:1]
    if not all(np.isfinite(first[name]).all() for name in COLUMNS) or (first["id_a"] % 1.0).any() or (first["id_b"] % 1.0).any():
        raise DumpError(f"{path} holds no records of impacts")
    return found


def _table(path: Path) -> Impacts:
    names: list[str] = []
    with path.open(encoding="ascii", errors="replace") as lines:
        # The first line without a # is that of an impact.
        first = next((line for line in lines if not _heads(line, names)), "")
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        raise DumpError(f"{path} lacks the columns {' '.join(missing)} in the last line of its header")
    try:
        values = (np.loadtxt(path, ndmin=2) if first else np.zeros(0)).reshape(-1, len(names))
    except ValueError:
        raise DumpError(f"{path}: a line does not hold {len(names)} numbers") from None
    if len(wrong := np.flatnonzero(~np.isfinite(values).all(axis=1))):
        raise DumpError(f"{path}: impact {wrong[0] + 1} holds a number that is not finite")
    found = np.empty(len(values), RECORD)
    for name in COLUMNS:
        found[name] = values[:, names.index(name)]
    return found


def _heads(line: str, names: list[str]) -> bool:
    """Whether `line` belongs to the header; its words become `names`."""
    if not line.startswith("#"):
        return False
    names[:] = line[1:].split()
    return True
