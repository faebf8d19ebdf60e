"""`time.csv`: kinetic energy and wall forces over the whole run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.dumptext import DumpError


def read_times(path: str | Path) -> dict[str, NDArray[np.float64]]:
    """Columns of a `time.csv` by name (`step`, `time` in s, `kinetic_energy` in J, `<wall>_fx` ... in N), each of shape (rows,).

    DumpError when the file is missing, has no rows or a row of another length.
    """
    path = Path(path)
    try:
        with path.open(encoding="ascii") as handle:
            names = handle.readline().strip().split(",")
            values = np.loadtxt(handle, delimiter=",", ndmin=2)
    except OSError:
        raise DumpError(f"{path} does not exist") from None
    except ValueError as error:
        raise DumpError(f"{path} cannot be read: {error}") from None
    if names[:3] != ["step", "time", "kinetic_energy"] or values.shape[0] == 0 or values.shape[1] != len(names):
        raise DumpError(f"{path}: has no header step,time,kinetic_energy,... or no rows of as many columns")
    return {name: values[:, index] for index, name in enumerate(names)}
