"""What a case's measure.py returns: values with intervals by name, profiles for the report, remarks and fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from dembark.postproc.statistics import Estimate

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Value:
    """A measured quantity: `estimate` with its interval, and the `reference` that it is compared with, if there is one.

    What the quantity is called, its unit, its tolerance with the reason and the kind of evidence are declared in case.toml.

    half : half-width of the interval of the deviation, where value and reference come from one run and are correlated
    bound : the tolerance where case.toml says "bound": what theory allows for the parameters of the run
    scale : what the declared agreement of engines is multiplied with, in the unit of the value
    reason : why the quantity cannot be decided
    verdict : pass or fail by another rule than the tolerance, told in `detail`
    compared : False where engines are not compared in it for what was measured
    """

    estimate: Estimate
    reference: Estimate | None = None
    half: float | None = None
    bound: float | None = None
    scale: float = 1.0
    reason: str = ""
    verdict: str = ""
    detail: str = ""
    compared: bool = True


@dataclass(frozen=True)
class Measurement:
    """All that is measured of the replicas of a run: `values` by the names that case.toml declares, `profiles` (see `profile`), `remarks`
    in words, and `fields` on a grid."""

    values: Mapping[str, Value]
    profiles: Sequence[Mapping[str, Any]] = ()
    remarks: Sequence[str] = ()
    fields: xr.Dataset | None = field(default=None)
