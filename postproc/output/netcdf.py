"""Fields and wall loads as xarray Datasets, and in NetCDF-4 files with the attributes of the CF conventions (1.11).

Coordinates are the centres of the cells, with the cells' faces in `x_bounds` and so on; `time` is the middle of the averaged span,
`time_bounds` its ends. Vectors have the dimension `i`, tensors `i` and `j`, labelled x, y, z. Stress is positive in compression.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import xarray
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.files import write_atomic

from ..fields.field_set import FieldSet
from ..walls.peaks import Histogram
from ..walls.stress import COMPONENTS, WallStress

Attributes = Mapping[str, str | float | int]

_AXES = "xyz"
_DIMENSIONS = ("time", "x", "y", "z", "i", "j")
_TIME = {"units": "s", "long_name": "simulated time, middle of the averaged span", "axis": "T", "standard_name": "time",
         "bounds": "time_bounds"}
_STEPS = {"units": "1", "long_name": "number of the time step, for the time is not known", "axis": "T"}


def variable(dimensions: Sequence[str], values: Any, units: str, name: str) -> tuple[tuple[str, ...], NDArray[Any], dict[str, str]]:
    """A variable of a Dataset with the attributes of the CF conventions: `units` and its long `name`."""
    return tuple(dimensions), np.asarray(values), {"units": units, "long_name": name}


def with_interval(key: str, dimensions: Sequence[str], estimates: Sequence[Any], units: str, name: str) -> dict[str, Any]:
    """The variable `key` from (nested sequences of) estimates, and `<key>_half`, the half-width of its 95 % interval."""
    table = np.array(estimates, object)
    values, halves = (np.vectorize(attrgetter(part), otypes=[float])(table) for part in ("value", "half"))
    return {key: variable(dimensions, values, units, name),
            f"{key}_half": variable(dimensions, halves, units, "half-width of its 95 % interval")}


def cf_dataset(variables: Mapping[str, Any], coordinates: Mapping[str, Any], **attributes: str | float) -> xarray.Dataset:
    """A Dataset by the CF conventions."""
    return xarray.Dataset(dict(variables), dict(coordinates), {"Conventions": "CF-1.11", **attributes})


def dataset(fields: FieldSet, time: float = 0.0, span: tuple[float, float] | None = None, attributes: Attributes | None = None, *,
            timed: bool = True) -> xarray.Dataset:
    """Fields of one `time` (s; `span`: first and last time that they are averaged over), a variable for each with its unit and long name.

    `attributes` describe all of it, for example kernel, width and provenance. Not `timed`: `time` is the number of a step.
    """
    grid = fields.grid
    coordinates: dict[str, Any] = {"time": ("time", [time], _TIME if timed else {**_STEPS, "bounds": "time_bounds"})}
    variables: dict[str, Any] = {"time_bounds": (("time", "bounds"), np.array([span or (time, time)], float))}
    for axis, name in enumerate(_AXES):
        edges = grid.edges(axis)
        coordinates[name] = (name, grid.centres(axis), {"units": "m", "long_name": f"{name} of the cells' centres", "axis": name.upper(),
                                                        "bounds": f"{name}_bounds"})
        variables[f"{name}_bounds"] = ((name, "bounds"), np.column_stack([edges[:-1], edges[1:]]))
    for name in "ij":
        coordinates[name] = (name, list(_AXES), {"long_name": "component"})
    for name, values in fields.arrays().items():
        about = {"units": fields.units[name], "long_name": fields.long_names[name], "cell_methods": "time: mean"}
        variables[name] = (_DIMENSIONS[: values.ndim + 1], values[None], about)
    return cf_dataset(variables, coordinates, **(attributes or {}))


def joined(datasets: Sequence[xarray.Dataset]) -> xarray.Dataset:
    """The Datasets of several times as one; DembarkError when there is none, or when their grids or fields are different."""
    if not datasets:
        raise DembarkError("there is no field of any time")
    odd = {str(name) for one in datasets for name in {*datasets[0].variables} ^ {*one.variables}}
    try:
        if odd:
            raise ValueError(f"{', '.join(sorted(odd))} are missing at some times")
        return xarray.concat(datasets, "time", data_vars="minimal", coords="minimal", compat="equals", join="exact",
                             combine_attrs="override")
    except ValueError as error:
        raise DembarkError("fields of several times do not fit together", str(error).splitlines()[0],
                           "all need the same grid and the same fields") from None


def write_netcdf(path: str | Path, data: xarray.Dataset, walls: Iterable[WallStress] = (), *, timed: bool = True) -> Path:
    """Write the fields `data`, and a group for each of the `walls` by its name, at once or not at all; returns the path.

    Read them with `xarray.open_dataset(path)` and `xarray.open_dataset(path, group="side")`; the group of a wall that is called like a
    field is `wall_<name>`. The file is made in memory: on a full disk the HDF5 library would crash. RunError when it cannot be written.
    """
    groups = {stress.wall.name: wall_dataset(stress, timed=timed) for stress in walls}
    content = io.BytesIO()
    with h5netcdf.File(content, "w") as file:
        data.dump_to_store(xarray.backends.H5NetCDFStore(file))
        for name, one in groups.items():
            group = file.create_group(f"wall_{name}" if name in {*file.variables, *file.dimensions} else name)
            one.dump_to_store(xarray.backends.H5NetCDFStore(group))
    return write_atomic(Path(path), content.getvalue())


def wall_dataset(stress: WallStress, *, timed: bool = True) -> xarray.Dataset:
    """Load of a wall as a labelled xarray Dataset: its patches, time series, peaks and histograms.

    Patches lie along the wall's coordinates (u, v; angle, height; angle, polar_angle) or along `patch` on a mesh.
    """
    patches = stress.patches
    names = patches.names or ("patch",)
    coordinates: dict[str, Any] = {
        "component": ("component", list(COMPONENTS), {"long_name": "normal (compression positive) and shear stress"}),
        "axis": ("axis", list(_AXES)),
        "time": ("time", stress.times, {"units": "s", "long_name": "simulated time"} if timed else _STEPS),
    }
    for axis, name in enumerate(patches.names):
        coordinates[name] = (name, patches.middles(axis), {"units": patches.units[axis], "long_name": f"{name} of the patches' middles"})
    if patches.labels:
        coordinates["patch"] = ("patch", list(patches.labels))
    variables: dict[str, Any] = {}

    def put(name: str, dimensions: tuple[str, ...], values: Any, units: str, text: str) -> None:
        variables[name] = variable(dimensions, values, units, text)

    on = stress.on_grid
    put("stress", (*names, "component"), on(stress.mean), "Pa", "mean stress of the wall on the grains")
    put("stress_deviation", (*names, "component"), on(stress.deviation), "Pa", "standard deviation of the stress in time")
    put("stress_half_width", (*names, "component"), on(stress.half), "Pa",
        f"half-width of the mean's 95 % interval ({stress.blocks} blocks)")
    put("patch_force", (*names, "axis"), on(stress.mean_force), "N", "mean force of the patch on the grains")
    put("contact_count", names, on(stress.contacts), "1", "contacts in all frames")
    put("area", names, on(patches.areas), "m2", "area of the patch")
    put("centre", (*names, "axis"), on(patches.centres), "m", "centre of the patch")
    put("normal", (*names, "axis"), on(patches.normals), "1", "normal of the patch")
    put("step", ("time",), stress.steps, "1", "time step")
    put("force", ("time", "axis"), stress.force, "N", "force of the wall on the grains")
    put("outside_force", ("time", "axis"), stress.outside, "N", "part of the force beyond all patches")
    put("normal_force", ("time",), stress.normal_force, "N", "sum of the normal components")
    put("displacement", ("time", "axis"), stress.displacements, "m", "displacement of the wall; of an inclusion: its centre")
    if stress.series is not None:
        shape = (len(stress.times), *patches.shape, len(COMPONENTS))
        put("stress_series", ("time", *names, "component"), stress.series.reshape(shape), "Pa", "stress of each frame")
    put("peak_force", ("peak",), stress.peak_forces, "N", "local maxima in time of the wall's normal force")
    put("peak_time", ("peak",), stress.peak_times, "s" if timed else "1", "their times")
    for name, histogram, units, text in (("patch_peak", stress.peak_stress, "Pa", "local maxima in time of the patches' normal stress"),
                                         ("contact_force", stress.contact_force, "N", "normal force of a contact")):
        _put_histogram(variables, coordinates, name, histogram, units, text)
    about = {"wall": stress.wall.name, "kind": type(stress.wall).__name__, "frames": len(stress.steps)}
    return xarray.Dataset(variables, coordinates, about)


def _put_histogram(variables: dict[str, Any], coordinates: dict[str, Any], name: str, histogram: Histogram, units: str, text: str) -> None:
    middles = 0.5 * (histogram.edges[1:] + histogram.edges[:-1])
    coordinates[f"{name}_bin"] = (f"{name}_bin", middles, {"units": units, "long_name": f"{text}, middle of the bin"})
    variables[f"{name}_histogram"] = ((f"{name}_bin",), histogram.counts, {
        "units": "1", "long_name": f"number of {text}", "mean": histogram.mean,
        "largest": histogram.largest if histogram.number else np.nan, "not_positive": histogram.below})
