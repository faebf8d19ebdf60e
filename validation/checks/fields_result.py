"""What a case's field measurement yields: labelled fields for `fields.nc` beside metrics.json, and quantities drawn from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from dembark.postproc.output.whole import WholeFile
from dembark.validation.checks.quantity import Quantity
from numpy.typing import NDArray

FILE = "fields.nc"


@dataclass(frozen=True)
class FieldResult:
    """`dataset` holds the fields, its attribute `kind` says how the report draws them; `quantities` and `remarks` join those of the case."""

    dataset: xarray.Dataset
    quantities: list[Quantity] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def variable(dimensions: Sequence[str], values: NDArray[Any], units: str, name: str) -> tuple[tuple[str, ...], NDArray[Any], dict[str, str]]:
    """A variable of a dataset with the attributes of the CF conventions: `units` and its long `name`."""
    return tuple(dimensions), np.asarray(values), {"units": units, "long_name": name}


def labelled(variables: Mapping[str, Any], coordinates: Mapping[str, Any], **attributes: str | float) -> xarray.Dataset:
    """A dataset by the CF conventions."""
    return xarray.Dataset(dict(variables), dict(coordinates), {"Conventions": "CF-1.11", **attributes})


def write(folder: Path, dataset: xarray.Dataset) -> Path:
    """Write `fields.nc` into `folder`, whole or not at all."""
    with WholeFile(folder / FILE) as part:
        dataset.to_netcdf(part, engine="h5netcdf")
    return folder / FILE
