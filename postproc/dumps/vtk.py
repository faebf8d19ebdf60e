"""VTK files, one a step, through VTK's own readers: `dump custom/vtk` and `atom/vtk` (grains), `local/gran/vtk` (contacts)."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .frames import HINT, Array, CutOffError, Dump, DumpError, DumpWarning, Entry, RawFrame, numbered
from .source import Source

BOX = "boundingBox_"
_AXES = ("x", "y", "z")
# Vectors that custom/vtk makes of columns of the text dump.
_VECTORS = {"v", "f", "omega", "i", "tq", "mu", "angmom"}
# What atom/vtk calls them.
_OTHER_NAMES = {"radii": "radius", "velocity_lin": "v", "velocity_ang": "omega", "force": "f"}


def read_vtk(path: Path) -> Any:
    """The data set in a file, legacy or XML whatever it is called; DumpError when VTK reports an error."""
    # Of the extra `fields`: text dumps do without.
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow
    from vtkmodules.vtkIOLegacy import vtkGenericDataObjectReader
    from vtkmodules.vtkIOXML import vtkXMLGenericDataObjectReader

    reader = vtkGenericDataObjectReader() if Source(path).begins_with(b"# vtk") else vtkXMLGenericDataObjectReader()
    reader.SetFileName(str(path))
    said, before = vtkStringOutputWindow(), vtkOutputWindow.GetInstance()
    loud = vtkLogger.GetCurrentVerbosityCutoff()
    vtkOutputWindow.SetInstance(said)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        reader.Update()
        found = reader.GetOutput()
    finally:
        vtkOutputWindow.SetInstance(before)
        vtkLogger.SetStderrVerbosity(loud)
    if found is None or not found.IsA("vtkDataSet") or reader.GetErrorCode() or "ERROR" in said.GetOutput():
        raise CutOffError(f"{path}: truncated, VTK's reader cannot read it ({HINT})")
    return pyvista.wrap(found)


def _table(data: Any, where: str) -> dict[str, Array]:
    """Columns of a dataset, named as those of a text dump."""
    points, cells, nodes = np.asarray(data.points, float), data.cell_data, data.point_data
    columns: dict[str, Array] = {}
    if not len(points):
        # Written when no grain or contact was there. What its columns would be is in other files, which may be of another kind than this.
        return columns
    if "id1" in cells or not len(nodes):
        ends, held = points.reshape(-1, 6), dict(cells.items())
        if any(len(values) != len(ends) for values in held.values()):
            raise DumpError(f"{where}: its lines do not have two ends each")
        columns |= {f"{axis}{end + 1}": ends[:, 3 * end + n] for end in (0, 1) for n, axis in enumerate(_AXES)}
    else:
        held = {_OTHER_NAMES.get(name, name): values for name, values in nodes.items()}
        columns |= {axis: points[:, n] for n, axis in enumerate(_AXES)}
    for name, array in held.items():
        values = np.asarray(array)
        if values.dtype.kind not in "biuf":
            continue
        values = values.astype(float)
        if values.ndim == 1:
            columns[name] = values
        elif name in _VECTORS:
            columns |= {f"{name}{axis}": part for axis, part in zip(_AXES, values.T, strict=True)}
        else:
            base = re.sub(r"\[1-\d+\]$", "", name)
            columns |= {f"{base}[{n}]": part for n, part in enumerate(values.T, 1)}
    return columns


def _box(path: Path, columns: dict[str, Array]) -> tuple[Array, Array, Array]:
    """Corners and tilt of the box from the file that the engine writes with it, else the grains' extent."""
    head, step, _ = _split(path)
    # The box of a .vtp or .vtu lies in a .vtr, or in a .vtu when it is tilted.
    for boxed in (path.with_name(f"{head}{BOX}{step}{suffix}") for suffix in (path.suffix, ".vtu", ".vtr")):
        if not boxed.is_file():
            continue
        data = read_vtk(boxed)
        if data.n_points == 8 and data.IsA("vtkUnstructuredGrid"):
            corner = np.asarray(data.points, float)
            a, b, c = corner[1] - corner[0], corner[3] - corner[0], corner[4] - corner[0]
            return corner[0], corner[0] + (a[0], b[1], c[2]), np.array([b[0], c[0], c[1]])
        bounds = np.array(data.bounds).reshape(3, 2)
        return bounds[:, 0], bounds[:, 1], np.zeros(3)
    places = [columns.get(axis, columns.get(f"{axis}1", np.zeros(0))) for axis in _AXES]
    reach = columns.get("radius", np.zeros(1)).max(initial=0.0)
    if not len(places[0]):
        return np.zeros(3), np.zeros(3), np.zeros(3)
    if any(columns[name].any() for name in ("ix", "iy", "iz") if name in columns):
        said = f"{path.parent}: without a file {head}{BOX}*, which holds the box, image flags are not used"
        warnings.warn(said, DumpWarning, stacklevel=2)
        columns |= {name: np.zeros(len(places[0])) for name in ("ix", "iy", "iz")}
    return np.array([place.min() - reach for place in places]), np.array([place.max() + reach for place in places]), np.zeros(3)


def _split(path: Path) -> tuple[str, str, str]:
    """Name before its last number, that number, the rest."""
    found = re.fullmatch(r"(.*?)(\d+)(\D*)", path.name[: -len(path.suffix)])
    if not found:
        raise DumpError(f"{path}: its name holds no number, which would be the step")
    return found.group(1), found.group(2), found.group(3)


class VtkFile(Dump):
    """One VTK file as a dump with one frame. The step is the last number in its name, coordinates are single precision as VTK has them.

    The box is read from the file ...boundingBox_... that the engine writes with it; no axis is called periodic, for no file says it.
    """

    def __init__(self, path: Path, *, units: str = "") -> None:
        """The step; the file is read when its frame is."""
        self._step = int(_split(path)[1])
        super().__init__(path, skip_truncated=False, stream=True, units=units)

    def _find(self) -> Iterator[Entry]:
        yield Entry(0, 0, 0, 1, self._step, -1)

    def _read(self, entry: Entry, columns: Sequence[str] | None) -> RawFrame:
        table = _table(read_vtk(self.path), str(self.path))
        names = tuple(table) if columns is None or not table else tuple(columns)
        numbered(tuple(table), names, str(self.path))
        low, high, tilt = _box(self.path, table)
        values = np.column_stack([table[name] for name in names]) if names else np.empty((0, 0))
        bad = np.argwhere(~np.isfinite(values))
        if len(bad):
            row, column = bad[0]
            raise DumpError(f"{self.path}, row {row + 1}: array {names[column]} holds a number that is not finite, '{values[row, column]}'")
        return RawFrame(self._step, low, high, np.zeros(3, bool), names, values, tilt, flagged=False)
