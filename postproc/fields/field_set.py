"""What fields on a grid have in common, whether they come from coarse graining or from cell averages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .grid import Grid


class FieldSet(Protocol):
    """Named fields on a grid."""

    @property
    def grid(self) -> Grid:
        """Where they are."""

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of each field."""

    @property
    def long_names(self) -> Mapping[str, str]:
        """What each field is."""

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """The fields that are there, by name: (nx, ny, nz), (nx, ny, nz, 3) or (nx, ny, nz, 3, 3)."""
