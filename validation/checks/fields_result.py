"""What a case's field measurement yields: labelled fields for `fields.nc` beside metrics.json, and quantities drawn from them."""

from __future__ import annotations

from dataclasses import dataclass, field

import xarray
from dembark.postproc.output.labelled import labelled, variable
from dembark.validation.checks.quantity import Quantity

__all__ = ["FieldResult", "labelled", "variable"]


@dataclass(frozen=True)
class FieldResult:
    """`dataset` holds the fields, its attribute `kind` says how the report draws them; `quantities` and `remarks` join those of the case."""

    dataset: xarray.Dataset
    quantities: list[Quantity] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
