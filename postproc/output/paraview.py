"""Fields, wall patches and grains for ParaView: a collection `<name>.pvd` of times, whose VTK files are in the folder `<name>_pvd`.

Fields are images with one value a cell (.vti); walls are polygons and grains are points with `radius` (.vtp), which the script
`<name>_pvd.py` shows as spheres. The formats have no place for units: they are text in the field data, `units`, a line for each array.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.files import disk_error, move_into_place, write_atomic

from ..grains import GrainFrame
from ..walls.stress import COMPONENTS, WallStress
from .netcdf import Attributes

if TYPE_CHECKING:
    import pyvista
    import xarray

Array = NDArray[Any]

_SUFFIXES = (".vti", ".vtp")
_GRAINS = {"ids": ("id", "1"), "types": ("type", "1"), "radii": ("radius", "m"), "masses": ("mass", "kg"),
           "velocities": ("velocity", "m s-1"), "omegas": ("angular_velocity", "rad s-1"), "forces": ("force", "N")}

# What ParaView does to show grains, for its --script or File, Load State.
_SPHERES = '''"""Grains as spheres of their size: paraview --script={script}, or File, Load State."""

from pathlib import Path

from paraview.simple import *

here = Path(globals().get("__file__") or {place!r})
grains = PVDReader(registrationName="grains", FileName=str(here.with_name({name!r})))
grains.UpdatePipeline()
spheres = Glyph(registrationName="spheres", Input=grains, GlyphType="Sphere")
spheres.GlyphType.ThetaResolution = spheres.GlyphType.PhiResolution = 16
spheres.GlyphMode = "All Points"
spheres.OrientationArray = ["POINTS", "No orientation array"]
spheres.ScaleArray = ["POINTS", "radius"]
spheres.ScaleFactor = 2.0  # ParaView's sphere has the diameter 1
view = GetActiveViewOrCreate("RenderView")
shown = Show(spheres, view)
has_velocity = grains.PointData.GetArray("velocity") is not None
ColorBy(shown, ("POINTS", "velocity", "Magnitude") if has_velocity else ("POINTS", "radius"))
scene = GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
scene.GoToLast()
shown.RescaleTransferFunctionToDataRange(False, True)
shown.SetScalarBarVisibility(view, True)
view.ResetCamera()
Render(view)
'''


class TimeSeries:
    """A collection that grows by one time with each `add`.

    The files are written into a hidden folder. Leaving the `with` block moves them into place and writes `path`; an error removes them.
    """

    def __init__(self, path: str | Path, attributes: Attributes | None = None, spheres: bool = False) -> None:
        """`spheres`: they are grains, and a script shows them. DembarkError when `path` is no place for a collection, see `check_place`."""
        self.path = check_place(Path(path))
        self._attributes = dict(attributes or {})
        self._spheres = spheres
        self._work = self.path.with_name(f".{_folder(self.path).name}.part-{os.getpid()}")
        self._entries: list[str] = []

    def __enter__(self) -> Self:
        return self

    def add(self, data: pyvista.ImageData | pyvista.PolyData, time: float, units: Mapping[str, str]) -> None:
        """Add the data set of `time` (s) with the `units` of its arrays; RunError when the disk refuses."""
        data.field_data["units"] = [_ascii(f"{name}: {unit}") for name, unit in units.items()]
        for name, value in self._attributes.items():
            data.field_data[name] = [_ascii(value) if isinstance(value, str) else value]
        import pyvista
        from vtkmodules.vtkIOXML import vtkXMLImageDataWriter, vtkXMLPolyDataWriter

        image = isinstance(data, pyvista.ImageData)
        writer = vtkXMLImageDataWriter() if image else vtkXMLPolyDataWriter()
        writer.SetInputData(data)
        # A file that Python writes says why the disk refuses; VTK does not.
        writer.SetWriteToOutputString(True)
        writer.SetDataModeToBinary()
        writer.Write()
        file = f"{len(self._entries):06d}{_SUFFIXES[0 if image else 1]}"
        try:
            self._work.mkdir(exist_ok=True)
            (self._work / file).write_text(writer.GetOutputString(), encoding="utf-8")
        except OSError as error:
            raise disk_error(error, self.path) from None
        self._entries.append(f'<DataSet timestep="{time!r}" file={quoteattr(f"{_folder(self.path).name}/{file}")}/>')

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            if kind is None and not self._entries:
                raise DembarkError(f"nothing to write to {self.path}", "there is no time step")
            if kind is None:
                lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "<Collection>", *self._entries,
                         "</Collection>", "</VTKFile>", ""]
                move_into_place(self._work, _folder(self.path))
                write_atomic(self.path, "\n".join(lines).encode())
                if self._spheres:
                    script = _folder(self.path).with_suffix(".py")
                    text = _SPHERES.format(script=script.name, place=str(script.resolve()), name=self.path.name)
                    write_atomic(script, text.encode())
        except OSError as refused:
            raise disk_error(refused, self.path) from None
        finally:
            shutil.rmtree(self._work, ignore_errors=True)


def _ascii(text: str) -> str:
    """`text` with escapes for letters that PyVista does not take, as in a path."""
    return text.encode("ascii", "backslashreplace").decode()


def _folder(path: Path) -> Path:
    return path.with_name(f"{path.stem}_pvd")


def check_place(path: Path) -> Path:
    """`path` itself; DembarkError when it does not end in .pvd, or its folder of VTK files holds something else, which would be lost."""
    if path.suffix != ".pvd":
        raise DembarkError(f"{path} does not end in .pvd", "", "ParaView knows a collection of times by this suffix")
    for other in _folder(path).glob("*"):
        if other.suffix not in _SUFFIXES:
            raise DembarkError(f"{other} is in the folder of {path.name}", "", "it would be lost; move it, or give another name")
    return path


def write_fields(path: str | Path, data: xarray.Dataset, attributes: Attributes | None = None) -> Path:
    """Write the fields of `netcdf.dataset`, of one or more times, as images; returns the path."""
    import pyvista

    low, high = (np.array([float(data[f"{axis}_bounds"][end, end]) for axis in "xyz"]) for end in (0, -1))
    shape = np.array([data.sizes[axis] for axis in "xyz"])
    fields = {str(name): one for name, one in data.items() if one.dims[:4] == ("time", "x", "y", "z")}
    units = {name: f"{one.units}, {one.long_name}" for name, one in fields.items()}
    with TimeSeries(path, {**data.attrs, **(attributes or {})}) as file:
        for number, time in enumerate(data.time.values):
            image = pyvista.ImageData(dimensions=tuple(shape + 1), spacing=tuple((high - low) / shape), origin=tuple(low))
            for name, one in fields.items():
                # x runs fastest; the components of a cell stay together.
                values = np.moveaxis(one.values[number], (0, 1, 2), (2, 1, 0))
                image.cell_data[name] = values.reshape(image.n_cells, -1) if values.ndim > 3 else values.ravel()
            file.add(image, float(time), units)
    return Path(path)


def write_grains(path: str | Path, frames: Iterable[GrainFrame], time_step: float = 1.0, attributes: Attributes | None = None) -> Path:
    """Write grains as points, one frame at a time, and a script that shows them as spheres. Returns the path.

    `time_step` (s) turns steps into times of frames that have none.
    """
    with TimeSeries(path, attributes, spheres=True) as file:
        for frame in frames:
            add_grains(file, frame, frame.time_by(time_step))
    return Path(path)


def add_grains(file: TimeSeries, frame: GrainFrame, time: float) -> None:
    """Add the grains of a frame at `time` (s), with what the dump holds of them."""
    import pyvista

    arrays = {name: (getattr(frame, attribute), unit) for attribute, (name, unit) in _GRAINS.items() if frame.has(attribute)}
    arrays |= {f"force_of_{wall}": (force, "N") for wall, force in frame.wall_forces.items()}
    arrays |= {name: (column, "as in the dump") for name, column in frame.extra.items()}
    cloud = pyvista.PolyData(np.asarray(frame.wrapped, float).reshape(-1, 3))
    for name, (values, _) in arrays.items():
        # PyVista takes no arrays of no points.
        if len(values):
            cloud.point_data[name] = values
    file.add(cloud, time, {name: unit for name, (_, unit) in arrays.items()})


def write_wall(path: str | Path, stress: WallStress, attributes: Attributes | None = None) -> Path:
    """Write a wall's patches as polygons: means, deviations and intervals, and each frame's stress where the series was kept.

    A wall that moves is shown where it is at each time; without the series there is only the last one. Returns the path.
    """
    import pyvista

    patches, owners = stress.patches, stress.patches.owners
    arrays: dict[str, tuple[Array, str]] = {"patch": (owners, "1"), "contact_count": (stress.contacts[owners], "1")}
    means = (("mean_stress", stress.mean), ("stress_deviation", stress.deviation), ("stress_half_width", stress.half))
    for name, values in means:
        arrays |= {f"{name}_{component}": (values[owners, column], "Pa") for column, component in enumerate(COMPONENTS)}
    corners = np.column_stack([np.full(len(patches.cells), patches.cells.shape[1]), patches.cells]).ravel()
    with TimeSeries(path, attributes) as file:
        for step in range(len(stress.times) if stress.series is not None else 0) or (len(stress.times) - 1,):
            surface = pyvista.PolyData(patches.vertices + stress.displacements[step], corners)
            series = {} if stress.series is None else {
                f"stress_{component}": (stress.series[step, owners, column], "Pa") for column, component in enumerate(COMPONENTS)}
            for name, (values, _) in {**arrays, **series}.items():
                surface.cell_data[name] = values
            file.add(surface, float(stress.times[step]), {name: unit for name, (_, unit) in {**arrays, **series}.items()})
    return Path(path)
