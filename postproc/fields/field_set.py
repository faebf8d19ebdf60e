"""Named fields on a grid, whether they come from coarse graining or from averages over cells."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .grid import Grid

Array = NDArray[np.float64]

# Unit and long name of every field.
_FIELDS = {"density": ("kg m-3", "bulk density"), "momentum": ("kg m-2 s-1", "momentum density"),
           "velocity": ("m s-1", "mean velocity by mass"), "solid_fraction": ("1", "volume of grains per volume"),
           "kinetic_stress": ("Pa", "kinetic stress, compression positive"), "temperature": ("m2 s-2", "granular temperature"),
           "velocity_gradient": ("s-1", "velocity gradient, component [a, b] = d v_a / d x_b"), "strain_rate": ("s-1", "strain rate"),
           "vorticity": ("s-1", "curl of the velocity"), "boundary_force": ("N m-3", "force density of walls on grains"),
           "contact_stress": ("Pa", "contact stress, compression positive"), "stress": ("Pa", "total stress, compression positive"),
           "coordination": ("1", "mean number of contacts of a grain with others"),
           "fabric": ("1", "fabric tensor of contact normals, of trace 1"),
           "dissipated_power": ("W m-3", "power of contact forces lost by the grains"),
           "friction_power": ("W m-3", "tangential part of the power of contact forces"),
           "liquid_content": ("1", "volume of liquid per volume"), "grain_count": ("1", "grains sampled, summed over frames"),
           "contact_count": ("1", "contacts sampled, summed over frames")}


@dataclass(frozen=True, eq=False)
class FieldSet:
    """Averages over each cell of `grid` and over `frames`, by name in `values`; SI units, compression positive.

    Each field is an attribute too, `fields.stress`: an array (nx, ny, nz), of vectors (nx, ny, nz, 3), of tensors (nx, ny, nz, 3, 3); NaN
    where a mean has nothing to average over; None what the frames did not hold. `mask` (nx, ny, nz) marks cells that were left out, None
    where there are none. Definitions: docs/theory/fields_theory.md.
    """

    grid: Grid
    frames: int
    values: Mapping[str, Array]
    mask: NDArray[np.bool_] | None = None

    units: ClassVar[Mapping[str, str]] = {name: unit for name, (unit, _) in _FIELDS.items()}
    long_names: ClassVar[Mapping[str, str]] = {name: text for name, (_, text) in _FIELDS.items()}

    def __getattr__(self, name: str) -> Any:
        if name not in _FIELDS:
            raise AttributeError(f"{name!r} is not a field")
        return self.values.get(name)

    def arrays(self) -> dict[str, Array]:
        """The fields that are there, by name."""
        return {name: self.values[name] for name in _FIELDS if name in self.values}
