"""Fields, wall patches and grains as VTKHDF files with time steps, which ParaView (5.12 and later) opens by itself.

Fields are an ImageData with one value a cell, walls a PolyData of patches, grains a PolyData of points with `radius`. The layout is
VTKHDF 2.2 (docs.vtk.org, VTKHDF file format): what changes in time is appended, and the group Steps tells where each time begins. The
format has no place for units: they are text in the field data, `units`, a line for each array.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.files import disk_error
from dembark.postproc.fields.grid import Grid
from dembark.postproc.grains import GrainFrame
from dembark.postproc.output.whole import Labelled, SteadyFile, WholeFile, timed
from dembark.postproc.walls.stress import COMPONENTS, WallStress

Array = NDArray[Any]
Attributes = Mapping[str, str | float | int]

_TEXT = h5py.string_dtype("ascii")
_PACKED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
_TOPOLOGIES = ("Vertices", "Lines", "Polygons", "Strips")
_ROWS = 1 << 15


class _Vtkhdf:
    """A file that grows by one time step with each `add` of its kind; leaving the `with` block makes it whole, an error removes it."""

    def __init__(self, path: str | Path, kind: str, attributes: Attributes | None) -> None:
        self._whole = WholeFile(path)
        try:
            self._part = SteadyFile(self._whole.part)
        except OSError as error:
            raise disk_error(error, self._whole.path) from None
        self._file = h5py.File(self._part, "w")
        self._root = self._file.create_group("VTKHDF", track_order=True)
        self._root.attrs["Version"] = np.array([2, 2], np.int64)
        self._root.attrs.create("Type", kind.encode("ascii"), dtype=h5py.string_dtype("ascii", len(kind)))
        self._steps = self._root.create_group("Steps")
        self._times: list[float] = []
        self._offsets: dict[str, list[Any]] = {}
        self._units: dict[str, str] = {}
        self._notes = dict(attributes or {})

    def __enter__(self) -> Self:
        return self

    def _append(self, name: str, rows: Array, piece: int = _ROWS, packed: bool = True) -> int:
        """Append `rows` to a dataset, which is made in pieces of `piece` rows when it is not there; returns the row they begin at."""
        if name not in self._root:
            rest = rows.shape[1:]
            packing = _PACKED if packed else {}
            self._root.create_dataset(name, (0, *rest), rows.dtype, maxshape=(None, *rest), chunks=(piece, *rest), **packing)
        data = self._root[name]
        begin = data.shape[0]
        data.resize(begin + len(rows), axis=0)
        data[begin:] = rows
        self._part.check()
        return begin

    def _note(self, name: str, value: Any) -> None:
        self._offsets.setdefault(name, []).append(value)

    def _same_names(self, names: Iterable[str], known: Iterable[str], time: float) -> None:
        odd = ", ".join(sorted(set(known).symmetric_difference(names)))
        if self._times and odd:
            raise DembarkError(f"{odd} is not there at all times", f"{self._whole.path}, {time:g} s", "write the same arrays each time")

    def _finish(self) -> None:
        if not self._times:
            raise DembarkError(f"nothing to write to {self._whole.path}", "there is no time step")
        count = len(self._times)
        if count == 1:
            # The reader takes a file of one step for one without time.
            del self._root["Steps"]
            self._root["FieldData/TimeValue"] = np.array(self._times, float)
        else:
            self._steps.attrs["NSteps"] = count
            self._steps["Values"] = np.array(self._times, float)
            for name, values in self._offsets.items():
                self._steps[name] = np.array(values, np.int64)
        lines = [f"{name}: {unit}" for name, unit in self._units.items()]
        for name, value in {"units": lines, **self._notes}.items():
            texts = value if isinstance(value, list) else [str(value)]
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            data = np.array([value], float) if number else np.array([text.encode("ascii", "replace") for text in texts], object)
            if len(data):
                self._root.create_dataset(f"FieldData/{name}", data=data, dtype=float if number else _TEXT)
                if count > 1:
                    self._steps[f"FieldDataOffsets/{name}"] = np.zeros(count, np.int64)
                    self._steps[f"FieldDataSizes/{name}"] = np.tile(np.array([1, len(data)], np.int64), (count, 1))

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._whole.settle(self._close if kind is None else self._end, kind is None)

    def _close(self) -> None:
        try:
            self._finish()
        finally:
            self._end()
        self._part.check()

    def _end(self) -> None:
        self._file.close()
        self._part.close()


class FieldsVtkhdf(_Vtkhdf):
    """Fields on a grid, a time step with each `add`."""

    def __init__(self, path: str | Path, attributes: Attributes | None = None) -> None:
        super().__init__(path, "ImageData", attributes)
        self._grid: Grid | None = None
        self._first: dict[str, Array] = {}

    def add(self, fields: Labelled, time: float) -> None:
        """Add the fields of `time` (s); DembarkError when they are of another grid or other fields than before."""
        # x runs fastest; the components of a cell stay together.
        arrays = {name: np.moveaxis(values, (0, 1, 2), (2, 1, 0)).reshape(*values.shape[2::-1], *(() if values.ndim == 3 else (-1,)))
                  for name, values in fields.arrays().items()}
        if self._grid is None:
            self._begin(fields.grid)
            self._units = {name: f"{fields.units[name]}, {fields.long_names[name]}" for name in arrays}
            # Of one time alone arrays have no axis for time, so the first has to wait for the second.
            self._first = arrays
        elif not self._grid.same(fields.grid):
            raise DembarkError(f"fields of another grid at the time {time:g} s", str(self._whole.path), "one file holds one grid")
        else:
            self._same_names(arrays, self._units, time)
            for one in filter(None, (self._first, arrays)):
                self._write(one)
            self._first = {}
        self._times.append(time)

    def _write(self, arrays: Mapping[str, Array]) -> None:
        try:
            for name, values in arrays.items():
                # The digits of a mean are noise, which takes long to pack and stays as large.
                self._note(f"CellDataOffsets/{name}", self._append(f"CellData/{name}", values[None], 1, packed=False))
        except OSError as error:
            raise disk_error(error, self._whole.path) from None

    def _finish(self) -> None:
        for name, values in self._first.items():
            self._root.create_dataset(f"CellData/{name}", data=values)
        super()._finish()

    def _begin(self, grid: Grid) -> None:
        self._grid = grid
        self._root.attrs["WholeExtent"] = np.array([[0, count] for count in grid.shape], np.int64).ravel()
        self._root.attrs["Origin"] = np.asarray(grid.low, float)
        self._root.attrs["Spacing"] = np.asarray(grid.spacing, float)
        self._root.attrs["Direction"] = np.eye(3).ravel()


class _PolyVtkhdf(_Vtkhdf):
    def __init__(self, path: str | Path, attributes: Attributes | None = None) -> None:
        super().__init__(path, "PolyData", attributes)

    def _polygons(self, points: Array, topology: str, cells: Array) -> None:
        """Append one part: `points` (n, 3) and `cells` (c, k) of one kind."""
        self._append("NumberOfPoints", np.array([len(points)], np.int64))
        self._append("Points", points.astype(float))
        for name in _TOPOLOGIES:
            one = cells if name == topology else np.zeros((0, 1), np.int64)
            self._append(f"{name}/NumberOfCells", np.array([len(one)], np.int64))
            self._append(f"{name}/NumberOfConnectivityIds", np.array([one.size], np.int64))
            self._append(f"{name}/Offsets", np.arange(len(one) + 1, dtype=np.int64) * one.shape[1])
            self._append(f"{name}/Connectivity", one.ravel().astype(np.int64))

    def _step(self, time: float, part: int, point: int, cell: int, connectivity: int, topology: str) -> None:
        """Add a step that shows the part that begins at these rows."""
        kind = _TOPOLOGIES.index(topology)
        self._note("PartOffsets", part)
        self._note("NumberOfParts", 1)
        self._note("PointOffsets", point)
        self._note("CellOffsets", [cell if number == kind else 0 for number in range(4)])
        self._note("ConnectivityIdOffsets", [connectivity if number == kind else 0 for number in range(4)])
        self._times.append(time)


class GrainsVtkhdf(_PolyVtkhdf):
    """Grains as points, a time step with each `add`; their number may change. In ParaView: Glyph, spheres, scaled by 2 radius."""

    def add(self, frame: GrainFrame, time: float, values: Mapping[str, tuple[Array, str]] | None = None) -> None:
        """Add the grains of a frame at `time` (s), with `values` beside what the dump holds: name -> ((n,) or (n, 3), unit)."""
        arrays = {**_grain_arrays(frame), **(values or {})}
        self._same_names(arrays, self._units, time)
        try:
            begins = ("NumberOfPoints", "Points", "Vertices/Offsets")
            part, point, cell = (self._root[name].shape[0] if self._times else 0 for name in begins)
            count = len(frame.ids)
            # The reader goes astray behind a part without cells: a frame without grains gets a cell without points.
            self._polygons(frame.wrapped, "Vertices", np.arange(count)[:, None] if count else np.zeros((1, 0), np.int64))
            for name, (column, unit) in arrays.items():
                self._note(f"PointDataOffsets/{name}", self._append(f"PointData/{name}", column))
                self._units[name] = unit
        except OSError as error:
            raise disk_error(error, self._whole.path) from None
        # Each part has one offset more than cells.
        self._step(time, part, point, cell - part, point, "Vertices")


def _grain_arrays(frame: GrainFrame) -> dict[str, tuple[Array, str]]:
    """What the dump holds of each grain."""
    found: dict[str, tuple[Array, str]] = {}
    for attribute, name, unit in (("ids", "id", "1"), ("types", "type", "1"), ("radii", "radius", "m"), ("masses", "mass", "kg"),
                                  ("velocities", "velocity", "m s-1"), ("omegas", "angular_velocity", "rad s-1"), ("forces", "force", "N")):
        if frame.has(attribute):
            found[name] = getattr(frame, attribute), unit
    for wall, force in frame.wall_forces.items():
        found[f"force_of_{wall}"] = force, "N"
    for name, column in frame.extra.items():
        found[name] = column, "as in the dump"
    return found


def write_vtkhdf(path: str | Path, fields: Labelled | Iterable[tuple[float, Labelled]], attributes: Attributes | None = None) -> Path:
    """Write fields, or pairs (time in s, fields) taken one after the other, as VTKHDF ImageData; returns the path."""
    with FieldsVtkhdf(path, attributes) as file:
        for time, one in timed(fields):
            file.add(one, time)
    return Path(path)


def write_vtkhdf_grains(path: str | Path, frames: Iterable[GrainFrame], time_step: float = 1.0,
                        attributes: Attributes | None = None) -> Path:
    """Write grains as VTKHDF points, one frame at a time; `time_step` (s) turns steps into times of frames that have
    none. Returns the path."""
    with GrainsVtkhdf(path, attributes) as file:
        for frame in frames:
            file.add(frame, frame.time_by(time_step))
    return Path(path)


def write_vtkhdf_wall(path: str | Path, stress: WallStress, attributes: Attributes | None = None) -> Path:
    """Write a wall's patches as VTKHDF polygons: means, deviations and intervals, and each frame's stress where the series was kept.

    A wall that moves is shown where it is at each time; without the series, at the last one. Returns the path.
    """
    with _PolyVtkhdf(path, attributes) as file:
        try:
            _write_wall(file, stress)
        except OSError as error:
            raise disk_error(error, Path(path)) from None
    return Path(path)


def _write_wall(file: _PolyVtkhdf, stress: WallStress) -> None:
    patches = stress.patches
    owners, count = patches.owners, len(patches.cells)
    constant: dict[str, tuple[Array, str]] = {"patch": (owners, "1"), "contact_count": (stress.contacts[owners], "1")}
    for name, values in (("mean_stress", stress.mean), ("stress_deviation", stress.deviation), ("stress_half_width", stress.half)):
        constant |= {f"{name}_{component}": (values[owners, column], "Pa") for column, component in enumerate(COMPONENTS)}
    steps = range(len(stress.times)) if stress.series is not None else range(len(stress.times) - 1, len(stress.times))
    moves = bool(stress.displacements.any())
    file._polygons(patches.vertices + stress.displacements[steps[0]], "Polygons", patches.cells)
    for name, (values, _) in constant.items():
        file._append(f"CellData/{name}", values)
    for number, step in enumerate(steps):
        if moves and number:
            file._append("Points", patches.vertices + stress.displacements[step])
        for name in constant:
            file._note(f"CellDataOffsets/{name}", 0)
        if stress.series is not None:
            for column, component in enumerate(COMPONENTS):
                file._append(f"CellData/stress_{component}", stress.series[step, owners, column])
                file._note(f"CellDataOffsets/stress_{component}", number * count)
        file._step(float(stress.times[step]), 0, number * len(patches.vertices) if moves else 0, 0, 0, "Polygons")
    names = [*constant, *(f"stress_{component}" for component in COMPONENTS if stress.series is not None)]
    file._units |= {name: constant[name][1] if name in constant else "Pa" for name in names}
