"""Figures of fields and wall loads with matplotlib, in the style of the report. Each function returns a Figure."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.files import disk_error, write_atomic

from .fields.field_set import FieldSet
from .pictures import saved
from .style import DIVERGING, GRID, PALETTE, SEQUENTIAL, STYLE
from .walls import CylinderWall, Inclusion, MeshWall, PlaneWall
from .walls.peaks import Histogram
from .walls.stress import WallStress

Array = NDArray[np.float64]

_AXES = "xyz"
# What is drawn of fields by default.
_USUAL = ("solid_fraction", "density", "velocity:magnitude", "pressure", "stress:zz", "deviator", "temperature", "coordination")
_SHEAR = {PlaneWall: ("shear along v", "shear along u"), CylinderWall: ("shear along the axis", "shear around it"),
          MeshWall: ("shear upwards", "shear sideways"), Inclusion: ("shear towards the axis' end", "shear around the axis")}
_WIDTH = 7.2
_NUMBERS = "{x:.4g}"
# Elevation and azimuth (degrees) of two opposite views.
_VIEWS = ((20.0, -60.0), (-20.0, 120.0))


def scalar(fields: FieldSet, name: str) -> tuple[Array, str, str]:
    """A scalar (nx, ny, nz) of the fields with its unit and a label; NaN in cells without it.

    `name` is that of a scalar field, `velocity:x`, `velocity:magnitude`, `stress:xz`, or `pressure` (a third of the stress's trace) or
    `deviator` (half the difference of its largest and smallest principal value).
    """
    arrays = fields.arrays()
    base, _, part = name.partition(":")
    label = " ".join(name.replace(":", " ").split("_"))
    if base in ("pressure", "deviator") and not part:
        stress, unit = _known(fields, arrays, "stress")
        if base == "pressure":
            return np.trace(stress, axis1=-2, axis2=-1) / 3.0, unit, label
        complete = np.isfinite(stress).all(axis=(-2, -1))
        values = np.full(stress.shape[:3], np.nan)
        principal = np.linalg.eigvalsh(0.5 * (stress[complete] + np.swapaxes(stress[complete], -1, -2)))
        values[complete] = 0.5 * (principal[:, -1] - principal[:, 0])
        return values, unit, "largest shear stress"
    values, unit = _known(fields, arrays, base)
    if values.ndim == 3 and not part:
        return values, unit, label
    if part == "magnitude" and values.ndim > 3:
        return np.sqrt((values**2).sum(axis=tuple(range(3, values.ndim)))), unit, "speed" if base == "velocity" else label
    if len(part) != values.ndim - 3 or any(letter not in _AXES for letter in part):
        right = {3: base, 4: f"{base}:x or {base}:magnitude", 5: f"{base}:xy"}[values.ndim]
        raise DembarkError(f"{name!r} is not a scalar", "", f"write {right}")
    component: tuple[Any, ...] = (..., *(_AXES.index(letter) for letter in part))
    return values[component], unit, label


def _known(fields: FieldSet, arrays: Mapping[str, Array], name: str) -> tuple[Array, str]:
    if name not in arrays:
        raise DembarkError(f"there is no field {name!r}", "", f"there are {', '.join(arrays)}")
    return arrays[name], fields.units[name]


def slice_figure(fields: FieldSet, names: Sequence[str], axis: str = "y", place: float | None = None) -> Figure:
    """Maps of scalars (see `scalar`) in the layer of cells that holds `place` (m) along `axis`; in the middle when it is not given.

    Cells without a value, as masked thin ones, are grey.
    """
    across = _AXES.index(axis)
    edges = fields.grid.edges(across)
    at = 0.5 * (edges[0] + edges[-1]) if place is None else place
    if not edges[0] <= at <= edges[-1]:
        raise DembarkError(f"{axis} = {at:g} m is outside the grid", "", f"it reaches from {edges[0]:g} to {edges[-1]:g} m")
    layer = min(int(np.searchsorted(edges, at, side="right")) - 1, len(edges) - 2)
    right, up = (other for other in range(3) if other != across)
    spans = [1e3 * fields.grid.edges(other) for other in (right, up)]
    shape = float(np.ptp(spans[1]) / np.ptp(spans[0]))
    columns = min(len(names), 4 if shape > 0.8 else 2 if shape > 0.25 else 1)
    rows = -(-len(names) // columns)
    with matplotlib.rc_context(STYLE):
        # Ticks and colour scale next to the map take about an inch.
        tall = float(np.clip(shape * (_WIDTH / columns - 1.0), 0.8, 4.5))
        figure = Figure(figsize=(_WIDTH, rows * (tall + 0.65)), layout="constrained")
        for number, name in enumerate(names):
            values, unit, label = scalar(fields, name)
            axes = figure.add_subplot(rows, columns, number + 1)
            axes.set_box_aspect(shape)
            _map(figure, axes, spans, np.take(values, layer, axis=across), label, unit)
            axes.set_xlabel(f"{_AXES[right]} / mm" if number // columns == rows - 1 else "")
            axes.set_ylabel(f"{_AXES[up]} / mm" if number % columns == 0 else "")
            axes.tick_params(labelleft=number % columns == 0)
    return figure


def _map(figure: Figure, axes: Axes, spans: Sequence[Array], values: Array, label: str, unit: str) -> None:
    known = values[np.isfinite(values)]
    low, high = (float(edge) for edge in np.percentile(known, [1.0, 99.0])) if len(known) else (0.0, 1.0)
    signed = low < 0.0 < high
    if signed:
        low, high = -max(-low, high), max(-low, high)
    axes.set_facecolor(GRID)
    axes.grid(False)
    drawn = axes.pcolormesh(*spans, np.ma.masked_invalid(values).T, cmap=DIVERGING if signed else SEQUENTIAL,
                            norm=Normalize(low, high or 1.0), rasterized=True)
    bar = figure.colorbar(drawn, ax=axes, pad=0.02, aspect=25)
    bar.outline.set_linewidth(0.4)
    bar.ax.tick_params(labelsize=6)
    bar.ax.yaxis.set_major_formatter(_NUMBERS)
    axes.set_title(axis_label(label, unit), fontsize=7.0)


def axis_label(label: str, unit: str) -> str:
    """A quantity over its unit, as an axis says it."""
    if unit == "1":
        return label
    raised = re.sub(r"(?<=[A-Za-z])(-?\d+)", r"$^{\1}$", unit)
    return f"{label} / ({raised})" if " " in unit else f"{label} / {raised}"


def profile_figure(fields: FieldSet, names: Sequence[str], axis: str = "z") -> Figure:
    """Scalars (see `scalar`) along `axis`, drawn upwards along z: means over the cells across it that are filled, those with a value
    and more than a tenth of the largest density. Cells beyond the walls, which only the kernel reaches, do not count."""
    along = _AXES.index(axis)
    place = 1e3 * fields.grid.centres(along)
    others = tuple(other for other in range(3) if other != along)
    columns = max(1, min(len(names), 4))
    rows = -(-len(names) // columns)
    density = np.nan_to_num(fields.arrays()["density"])
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH, 2.4 * rows), layout="constrained")
        for number, name in enumerate(names):
            values, unit, label = scalar(fields, name)
            known = np.isfinite(values) & (density > 0.1 * density.max())
            count = known.sum(axis=others)
            mean = np.divide(np.where(known, values, 0.0).sum(axis=others), count, out=np.full(len(place), np.nan), where=count > 0)
            axes = figure.add_subplot(rows, columns, number + 1)
            axes.plot(*((mean, place) if axis == "z" else (place, mean)), color=PALETTE[0])
            text = axis_label(label, unit)
            axes.set(**({"xlabel": text, "ylabel": "z / mm"} if axis == "z" else {"xlabel": f"{axis} / mm", "ylabel": text}))
            (axes.xaxis if axis == "z" else axes.yaxis).set_major_formatter(_NUMBERS)
            axes.locator_params(axis="x", nbins=4)
    return figure


def wall_figure(stress: WallStress) -> Figure:
    """Mean normal and shear stress over the patches, unrolled. A flat mesh is seen along the direction in which it is thin; any other
    one from above and in front, and from the opposite side, so that no triangle of a closed mesh hides behind others in both views."""
    components = ("normal stress", *_SHEAR[type(stress.wall)])
    values = np.where(stress.contacts[:, None] > 0, stress.mean[:, :3], np.nan)
    with matplotlib.rc_context(STYLE):
        if not stress.patches.edges and not _flat(stress):
            return _solid_figure(stress, components, values)
        figure = Figure(figsize=(_WIDTH, 2.9), layout="constrained")
        figure.suptitle(stress.wall.name, fontsize=8.0)
        for number, component in enumerate(components):
            axes = figure.add_subplot(1, 3, number + 1)
            if stress.patches.edges:
                factor = [1e3 if unit == "m" else 180.0 / np.pi for unit in stress.patches.units]
                spans = [scale * edges for scale, edges in zip(factor, stress.patches.edges, strict=True)]
                _map(figure, axes, spans, stress.on_grid(values[:, number]), component, "Pa")
                units = ["mm" if unit == "m" else "degrees" for unit in stress.patches.units]
                axes.set(xlabel=f"{stress.patches.names[0].replace('_', ' ')} / {units[0]}",
                         ylabel=f"{stress.patches.names[1].replace('_', ' ')} / {units[1]}", ylim=_touched(stress, spans[1]))
            else:
                _mesh_map(figure, axes, stress, values[:, number], component)
    return figure


def _touched(stress: WallStress, edges: Array) -> tuple[float, float]:
    """The part of the second coordinate where there were contacts, and one patch more: a box is often much higher than what is in it."""
    rows = np.nonzero(stress.on_grid(stress.contacts).any(axis=0))[0]
    if not len(rows):
        return float(edges[0]), float(edges[-1])
    return float(edges[max(0, rows[0] - 1)]), float(edges[min(len(edges) - 1, rows[-1] + 2)])


def _flat(stress: WallStress) -> bool:
    extent = np.ptp(stress.patches.vertices, axis=0)
    return bool(extent.min() < 0.05 * extent.max())


def _paint(values: Array) -> dict[str, Any]:
    known = values[np.isfinite(values)]
    norm = Normalize(*((float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)))
    return {"array": np.ma.masked_invalid(values), "norm": norm, "edgecolor": "white", "linewidth": 0.2,
            "cmap": matplotlib.colormaps[SEQUENTIAL].with_extremes(bad=GRID)}


def _colour_bar(figure: Figure, paint: ScalarMappable, axes: Axes | list[Axes], label: str) -> None:
    # Below the map and with the label at it: elsewhere it would cover titles.
    bar = figure.colorbar(paint, ax=axes, orientation="horizontal", pad=0.03, aspect=25, shrink=0.85)
    bar.outline.set_linewidth(0.4)
    bar.ax.tick_params(labelsize=6)
    bar.ax.xaxis.set_major_formatter(_NUMBERS)
    bar.locator = MaxNLocator(4)
    bar.set_label(axis_label(label, "Pa"), fontsize=7.0)


def _mesh_map(figure: Figure, axes: Axes, stress: WallStress, values: Array, label: str) -> None:
    patches = stress.patches
    # Seen along the direction in which the mesh is thinnest.
    thinnest = int(np.argmin(np.ptp(patches.vertices, axis=0)))
    right, up = (other for other in range(3) if other != thinnest)
    paint = PolyCollection(list(1e3 * patches.vertices[patches.cells][:, :, [right, up]]), **_paint(values[patches.owners]))
    axes.add_collection(paint)
    axes.autoscale_view()
    axes.set(xlabel=f"{_AXES[right]} / mm", ylabel=f"{_AXES[up]} / mm", aspect="equal")
    axes.grid(False)
    _colour_bar(figure, paint, axes, label)


def _solid_figure(stress: WallStress, components: Sequence[str], values: Array) -> Figure:
    corners = 1e3 * stress.patches.vertices[stress.patches.cells]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    figure = Figure(figsize=(_WIDTH, 6.6), layout="constrained")
    figure.suptitle(f"{stress.wall.name}: from above and in front, and from the opposite side", fontsize=8.0)
    for column, component in enumerate(components):
        views = [figure.add_subplot(2, 3, 1 + column + 3 * row, projection="3d") for row in range(2)]
        for axes, (elevation, azimuth) in zip(views, _VIEWS, strict=True):
            paint = Poly3DCollection(corners, **_paint(values[stress.patches.owners, column]))
            axes.add_collection3d(paint)
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]), xlabel="x / mm", ylabel="y / mm",
                     zlabel="z / mm")
            axes.set_box_aspect(high - low)
            axes.view_init(elev=elevation, azim=azimuth)
            axes.tick_params(labelsize=5, pad=-3)
            for name, line in zip(_AXES, (axes.xaxis, axes.yaxis, axes.zaxis), strict=True):
                line.label.set_fontsize(6)
                line.labelpad = -7
                axes.locator_params(axis=name, nbins=3)
        _colour_bar(figure, paint, views, component)
    return figure


def force_figure(stress: WallStress) -> Figure:
    """The wall's force over time, along x, y, z and normal to it, with the peaks of the latter."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH, 2.5), layout="constrained")
        axes = figure.add_subplot()
        for axis, paint in zip(range(3), PALETTE[1:4], strict=True):
            axes.plot(stress.times, stress.force[:, axis], color=paint, linewidth=0.9, label=_AXES[axis])
        axes.plot(stress.times, stress.normal_force, color=PALETTE[0], label="normal")
        axes.plot(stress.peak_times, stress.peak_forces, ".", color=PALETTE[0], markersize=5, label="peaks")
        axes.set(xlabel="time / s", ylabel="force / N", title=f"{stress.wall.name}: force on the grains")
        axes.legend(ncols=5, loc="best", fontsize=6.5)
    return figure


def peak_figure(stress: WallStress) -> Figure:
    """Distributions of the peaks of the patches' normal stress and of the normal forces of contacts, over their means."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH, 2.5), layout="constrained")
        _distribution(figure.add_subplot(1, 2, 1), stress.peak_stress, "peak of a patch's normal stress", "Pa", stress.wall.name)
        _distribution(figure.add_subplot(1, 2, 2), stress.contact_force, "normal force of a contact", "N", stress.wall.name)
    return figure


def _distribution(axes: Axes, histogram: Histogram, what: str, unit: str, wall: str) -> None:
    axes.set_title(f"{wall}: {histogram.number} values")
    if not histogram.counts.any():
        axes.text(0.5, 0.5, "nothing to show", transform=axes.transAxes, ha="center", color="#666c75")
        return
    mean = histogram.mean
    axes.stairs(mean * histogram.density(), histogram.edges / mean, fill=True, color=PALETTE[0], alpha=0.6)
    axes.axvline(histogram.quantile(0.99) / mean, color=PALETTE[1], linewidth=0.9, label="99 %")
    axes.set(yscale="log", xlabel=f"{what} / mean ({mean:.3g} {unit})", ylabel="density")
    axes.set_xlim(0.0, 1.05 * histogram.largest / mean)
    axes.legend(fontsize=6.5)


def field_figures(fields: FieldSet) -> dict[str, Figure]:
    """Slices through the middle and profiles along z of what there is of the usual scalars, by name."""
    arrays = fields.arrays()
    there = [name for name in _USUAL if ("stress" if name in ("pressure", "deviator") else name.partition(":")[0]) in arrays]
    found = {f"slice_{axis}": slice_figure(fields, there, axis) for axis in ("x", "y") if fields.grid.shape[_AXES.index(axis)] > 1}
    return (found or {"slice_y": slice_figure(fields, there)}) | {"profile_z": profile_figure(fields, there)}


def wall_figures(stress: WallStress) -> dict[str, Figure]:
    """The figures of a wall, by name."""
    name = stress.wall.name
    return {f"wall_{name}": wall_figure(stress), f"wall_{name}_force": force_figure(stress), f"wall_{name}_peaks": peak_figure(stress)}


def save(folder: str | Path, figures: Mapping[str, Figure]) -> list[Path]:
    """Write figures as PNG into `folder`, which is made; returns the files."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise disk_error(error, folder) from None
    return [write_atomic(folder / f"{name}.png", saved(figure, dots=160.0)) for name, figure in figures.items()]
