"""What a case's measure.py returns: values with intervals by name, profiles for the report, remarks and fields.

It is also the one module that a measure.py imports for its daily needs: replicas, estimates, profiles and the types of its arguments.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from .replica import Array, Replica
from .resampling import pooled, profile
from .statistics import CONFIDENCE, Estimate, block_mean, exact, over_replicas

if TYPE_CHECKING:
    import xarray as xr

    from .output.vtkhdf import Surface

__all__ = ["CONFIDENCE", "Array", "Curve", "Estimate", "Measurement", "Numbers", "Points", "Replica", "Replicas", "Value", "block_mean",
           "exact", "number", "over_replicas", "pooled", "profile"]

# The fields of a series next to its metrics.json.
FIELDS_FILE = "fields.nc"
# A map on a surface, there as well.
SURFACE_FILE = "surface.vtkhdf"
# Parameters of a run by name, in SI units.
Numbers = Mapping[str, Any]
# What `profile` returns.
Curve = dict[str, Any]
# The results of a study's variants, each the content of a metrics.json.
Points = Sequence[Mapping[str, Any]]
Replicas = Sequence[Replica]


@dataclass(frozen=True)
class Value:
    """A measured quantity: `estimate` with its interval, and the `reference` that it is compared with, if there is one.

    What the quantity is called, its unit, its tolerance with the reason and the kind of evidence are declared in case.toml.

    half : half-width of the interval of the deviation, where value and reference come from one run and are correlated
    bound : the tolerance where case.toml says "bound": what theory allows for the parameters of the run
    scale : what the declared agreement of engines is multiplied with, in the unit of the value
    reason : why the quantity cannot be decided
    inapplicable : why the reference does not hold for this set-up: the deviation is shown, and nothing is checked
    verdict : pass or fail by another rule than the tolerance, given in `detail`
    compared : False where engines are not compared in it for what was measured
    """

    estimate: Estimate
    reference: Estimate | None = None
    half: float | None = None
    bound: float | None = None
    scale: float = 1.0
    reason: str = ""
    inapplicable: str = ""
    verdict: str = ""
    detail: str = ""
    compared: bool = True


@dataclass(frozen=True)
class Measurement:
    """All that is measured of the replicas of a run: `values` by the names that case.toml declares, `profiles` (see `profile`), `remarks`
    in words, `fields` on a grid, and a map on a `surface`."""

    values: Mapping[str, Value]
    profiles: Sequence[Mapping[str, Any]] = ()
    remarks: Sequence[str] = ()
    fields: xr.Dataset | None = field(default=None)
    surface: Surface | None = field(default=None)


def number(value: float, reference: float | None = None, **more: Any) -> Value:
    """`value` and `reference` without an interval; `more` as in Value."""
    return Value(exact(value), None if reference is None else exact(reference), **more)
