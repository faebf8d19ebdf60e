"""Fields of a series as one labelled file: variables with units and names by the CF conventions.

Labelled arrays and files take a while to import: that is done when they are made, which runs that are not over yet need not wait for.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray

FILE = "fields.nc"
Variable = tuple[tuple[str, ...], NDArray[Any], dict[str, str]]


def variable(dimensions: Sequence[str], values: NDArray[Any], units: str, name: str) -> Variable:
    """A variable of a dataset with the attributes of the CF conventions: `units` and its long `name`."""
    return tuple(dimensions), np.asarray(values), {"units": units, "long_name": name}


def with_interval(key: str, dimensions: Sequence[str], estimates: Sequence[Any], units: str, name: str) -> dict[str, Variable]:
    """The variable `key` from (nested sequences of) estimates, and beside it `<key>_half`, the half-width of its 95 % interval."""
    table = np.array(estimates, object)
    values, halves = (np.vectorize(operator.attrgetter(part), otypes=[float])(table) for part in ("value", "half"))
    return {key: variable(dimensions, values, units, name),
            f"{key}_half": variable(dimensions, halves, units, "half-width of its 95 % interval")}


def labelled(variables: Mapping[str, Any], coordinates: Mapping[str, Any], **attributes: str | float) -> xarray.Dataset:
    """A dataset by the CF conventions."""
    import xarray

    return xarray.Dataset(dict(variables), dict(coordinates), {"Conventions": "CF-1.11", **attributes})


def write(path: Path, dataset: xarray.Dataset) -> Path:
    """Write `dataset` as NetCDF to `path`, at once or not at all; returns the path."""
    from .output.netcdf import write_netcdf

    return write_netcdf(path, dataset)
