"""`time.csv`: kinetic energy and wall forces over the complete run, and when a series reaches a level."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .dumps import DumpError


def read_times(path: str | Path) -> dict[str, NDArray[np.float64]]:
    """Columns of a `time.csv` by name (`step`, `time` in s, `kinetic_energy` in J, `<wall>_fx` ... in N), each of shape (rows,).

    DumpError when the file is missing, has no rows or a row of another length.
    """
    path = Path(path)
    try:
        with path.open(encoding="ascii") as handle:
            names = handle.readline().strip().split(",")
            values = np.loadtxt(handle, delimiter=",", ndmin=2)
    except OSError as error:
        raise DumpError(f"{path} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise DumpError(f"{path} cannot be read: {error}") from None
    if names[:3] != ["step", "time", "kinetic_energy"] or values.shape[0] == 0 or values.shape[1] != len(names):
        raise DumpError(f"{path}: has no header step,time,kinetic_energy,... or no rows of as many columns")
    return {name: values[:, index] for index, name in enumerate(names)}


def reached(times: NDArray[np.float64], values: NDArray[np.float64], level: float) -> float:
    """When `values` (n,) first get to `level`, on straight lines between `times` (n,); NaN when they never do, or are there at once."""
    there = np.flatnonzero(values >= level)
    if len(there) == 0 or there[0] == 0:
        return math.nan
    k = int(there[0])
    return float(times[k - 1] + (times[k] - times[k - 1]) * (level - values[k - 1]) / (values[k] - values[k - 1]))
