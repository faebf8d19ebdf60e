"""Fields and wall loads in NetCDF-4 with the attributes of the CF conventions (1.11), for xarray.

Coordinates are the centres of the cells, with the cells' faces in `x_bounds` and so on; `time` is the middle of the averaged span,
`time_bounds` its ends. Vectors have the dimension `i`, tensors `i` and `j`, labelled x, y, z. Stress is positive in compression.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5netcdf
import numpy as np
import xarray
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.files import disk_error
from dembark.postproc.fields.grid import Grid
from dembark.postproc.output.whole import Labelled, SteadyFile, WholeFile, timed
from dembark.postproc.walls.peaks import Histogram
from dembark.postproc.walls.stress import COMPONENTS, WallStress

Array = NDArray[np.float64]
Attributes = Mapping[str, str | float | int]

_AXES = "xyz"
_DIMENSIONS = ("time", "x", "y", "z", "i", "j")


def dataset(fields: Labelled, time: float = 0.0, span: tuple[float, float] | None = None,
            attributes: Attributes | None = None) -> xarray.Dataset:
    """Fields of one time (s; `span` = first and last time averaged over) as a labelled xarray Dataset, as in the file of `write_netcdf`."""
    bounds = (time, time) if span is None else span
    variables = _coordinates(fields.grid)
    variables["time"] = (("time",), np.array([time]), _TIME)
    variables["time_bounds"] = (("time", "bounds"), np.array([bounds], float), {})
    for name, values in fields.arrays().items():
        variables[name] = (_DIMENSIONS[: values.ndim + 1], values[None], _attributes(fields, name))
    coordinates = {name: variables.pop(name) for name in ("time", *_AXES, "i", "j")}
    return xarray.Dataset(variables, coordinates, {"Conventions": "CF-1.11", **(attributes or {})})


def write_netcdf(path: str | Path, fields: Labelled | Iterable[tuple[float, Labelled]], attributes: Attributes | None = None) -> Path:
    """Write fields, or pairs (time in s, fields) of several times on one grid, taken one after the other; returns the path.

    `attributes` are added to the file's own, for example kernel, width and provenance.
    """
    with FieldsNetcdf(path, attributes) as file:
        for time, one in timed(fields):
            file.add(one, time)
    return Path(path)


def write_wall_netcdf(
    path: str | Path, walls: Iterable[WallStress], attributes: Attributes | None = None, *, timed: bool = True
) -> Path:
    """Write wall loads, a group for each wall by its name: `xarray.open_dataset(path, group="side")`; returns the path."""
    with FieldsNetcdf(path, attributes, without_fields=True, timed=timed) as file:
        file.add_walls(walls)
    return Path(path)


def _write_walls(file: Any, walls: Iterable[WallStress], timed: bool) -> None:
    """Add a group for each wall; `wall_<name>` for one that is called like a field."""
    taken = {*file.variables, *file.dimensions}
    for stress in walls:
        name = stress.wall.name
        group = file.create_group(f"wall_{name}" if name in taken else name)
        wall_dataset(stress, timed=timed).dump_to_store(xarray.backends.H5NetCDFStore(group))


class FieldsNetcdf:
    """A NetCDF file that grows by one time with each `add`; leaving the `with` block makes it whole, an error removes it.

    `without_fields`: it may hold walls alone. Not `timed`: what is given as times are numbers of steps, and the file says so.
    """

    def __init__(
        self, path: str | Path, attributes: Attributes | None = None, without_fields: bool = False, *, timed: bool = True
    ) -> None:
        self._timed = timed
        self._whole = WholeFile(path)
        try:
            self._part = SteadyFile(self._whole.part)
        except OSError as error:
            raise disk_error(error, self._whole.path) from None
        self._file: Any = h5netcdf.File(self._part, "w")
        self._file.attrs.update({"Conventions": "CF-1.11", **(attributes or {})})
        self._count = 0
        self._may_be_empty = without_fields
        self._grid: Grid | None = None
        self._walls: list[WallStress] = []

    def __enter__(self) -> Self:
        return self

    def add(self, fields: Labelled, time: float, span: tuple[float, float] | None = None) -> None:
        """Add the fields of `time` (s), averages over `span` (s, s); DembarkError when they are others than before."""
        arrays = fields.arrays()
        try:
            if self._grid is None:
                self._begin(fields, arrays)
            elif not self._grid.same(fields.grid) or any(name not in self._file.variables for name in arrays):
                raise DembarkError(f"fields of another grid or kind at {time:g} s", f"for {self._whole.path}", "one file holds one kind")
            self._file.resize_dimension("time", self._count + 1)
            self._file.variables["time"][self._count] = time
            self._file.variables["time_bounds"][self._count] = (time, time) if span is None else span
            for name, values in arrays.items():
                self._file.variables[name][self._count] = values
            self._part.check()
        except OSError as error:
            raise disk_error(error, self._whole.path) from None
        self._count += 1

    def add_walls(self, walls: Iterable[WallStress]) -> None:
        """Add the loads of walls, a group each."""
        self._walls += walls

    def update(self, attributes: Attributes) -> None:
        """Add attributes of the file that are known only at the end."""
        self._file.attrs.update(dict(attributes))

    def _begin(self, fields: Labelled, arrays: Mapping[str, Array]) -> None:
        file, self._grid = self._file, fields.grid
        file.dimensions = {"time": None, **dict(zip(_AXES, fields.grid.shape, strict=True)), "i": 3, "j": 3, "bounds": 2}
        for name, (dimensions, values, attributes) in _coordinates(fields.grid).items():
            if values.dtype.kind == "U":
                variable = file.create_variable(name, dimensions, h5netcdf.core.h5py.string_dtype())
                variable[:] = values.astype(object)
            else:
                variable = file.create_variable(name, dimensions, values.dtype, data=values)
            variable.attrs.update(attributes)
        file.create_variable("time", ("time",), "f8").attrs.update(_TIME if self._timed else {**_STEPS, "bounds": "time_bounds"})
        file.create_variable("time_bounds", ("time", "bounds"), "f8")
        for name, values in arrays.items():
            dimensions = _DIMENSIONS[: values.ndim + 1]
            # One time is one piece, not packed: the digits of a mean are noise, which takes long to pack and stays as large.
            variable = file.create_variable(name, dimensions, "f8", chunks=(1, *values.shape), fillvalue=np.nan)
            variable.attrs.update(_attributes(fields, name))

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._whole.settle(self._finish if kind is None else self._close, kind is None)

    def _close(self) -> None:
        self._file.close()
        self._part.close()

    def _finish(self) -> None:
        try:
            if self._count == 0 and not self._may_be_empty:
                raise DembarkError(f"nothing to write to {self._whole.path}", "there is no field of any time")
            _write_walls(self._file, self._walls, self._timed)
        finally:
            self._close()
        self._part.check()


_TIME = {"units": "s", "long_name": "simulated time, middle of the averaged span", "axis": "T", "standard_name": "time",
         "bounds": "time_bounds"}
_STEPS = {"units": "1", "long_name": "number of the time step, for the time is not known", "axis": "T"}


def _coordinates(grid: Grid) -> dict[str, tuple[tuple[str, ...], Any, dict[str, str]]]:
    result: dict[str, tuple[tuple[str, ...], Any, dict[str, str]]] = {}
    for axis, name in enumerate(_AXES):
        edges = grid.edges(axis)
        result[name] = ((name,), grid.centres(axis), {"units": "m", "long_name": f"{name} of the cells' centres", "axis": name.upper(),
                                                      "bounds": f"{name}_bounds"})
        result[f"{name}_bounds"] = ((name, "bounds"), np.column_stack([edges[:-1], edges[1:]]), {})
    for name in ("i", "j"):
        result[name] = ((name,), np.array(list(_AXES)), {"long_name": "component"})
    return result


def _attributes(fields: Labelled, name: str) -> dict[str, str]:
    return {"units": fields.units[name], "long_name": fields.long_names[name], "cell_methods": "time: mean"}


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
        variables[name] = (dimensions, values, {"units": units, "long_name": text})

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
