"""Figures of the fields that a measurement left in `fields.nc`, as figures.py of a case draws them: maps of the engines on one scale,
profiles with intervals, and their data as tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .measurement import FIELDS_FILE as FILE

Array = NDArray[np.float64]

_EDGE = "#9aa1a9"


@dataclass(frozen=True)
class Look:
    """How an engine is drawn everywhere."""

    title: str
    colour: str
    marker: str


Looks = Mapping[str, Look]


@dataclass(frozen=True)
class FieldFigure:
    """A figure `name`, with a `caption` that says what is shown and how it was made; `tables` (header, rows) by name are its data."""

    name: str
    figure: Figure
    title: str
    caption: str
    tables: Mapping[str, tuple[list[str], list[list[Any]]]]


def read(folder: Path, engines: Iterable[str]) -> dict[str, Any]:
    """Datasets of the engines whose folder below `folder` has a file of fields."""
    found = {engine: folder / engine / FILE for engine in engines if (folder / engine / FILE).is_file()}
    if not found:
        return {}
    import xarray

    datasets = {}
    for engine, path in found.items():
        with xarray.open_dataset(path, engine="h5netcdf") as dataset:
            datasets[engine] = dataset.load()
    return datasets


def limits(values: Sequence[Array], centre: float | None = None) -> tuple[float, float]:
    """Ends of a colour scale that leave 1 % of all finite values out at either side; even about `centre` if given."""
    everything = np.concatenate([one[np.isfinite(one)] for one in values])
    if not len(everything):
        return 0.0, 1.0
    low, high = (float(edge) for edge in np.percentile(everything, [1.0, 99.0]))
    if centre is not None:
        half = max(high - centre, centre - low) or 1.0
        return centre - half, centre + half
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def image(axes: Any, values: Array, extent: tuple[float, float, float, float], scale: tuple[float, float], paint: str, *,
          smooth: bool = True) -> None:
    """A map (rows along y, from below) of cell values; `smooth`: of a field that varies less than from cell to cell."""
    axes.imshow(np.ma.masked_invalid(values), extent=extent, origin="lower", cmap=paint, norm=Normalize(*scale),
                interpolation="bilinear" if smooth else "nearest", aspect="auto", interpolation_stage="data")
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set(visible=True, edgecolor=_EDGE, linewidth=0.6)


def bar(figure: Figure, axes: Any, scale: tuple[float, float], paint: str, label: str, **place: Any) -> None:
    """A colour scale next to or below `axes`."""
    one = figure.colorbar(ScalarMappable(Normalize(*scale), paint), ax=axes, extend="both", **place)
    one.set_label(label, fontsize=7)
    one.ax.tick_params(labelsize=6.5, width=0.5, length=2.0)
    one.outline.set_linewidth(0.4)


def curve(axes: Any, look: Look, place: Array, value: Array, half: Array | None = None, *, upward: bool = False,
          marked: bool = True) -> Any:
    """A profile of an engine with the band of its interval; `upward`: the place is drawn upwards."""
    paint, style = look.colour, {"marker": look.marker, "markersize": 2.6} if marked else {}
    if half is not None:
        band = np.where(np.isfinite(half), half, 0.0)
        (axes.fill_betweenx if upward else axes.fill_between)(place, value - band, value + band, color=paint, alpha=0.18, linewidth=0)
    pair = (value, place) if upward else (place, value)
    (line,) = axes.plot(*pair, color=paint, label=look.title, **style)
    return line


def long_table(header: Sequence[str], columns: Mapping[str, Sequence[Array]]) -> tuple[list[str], list[list[Any]]]:
    """Header and rows of the engines' columns of equal length, one below the other; what is not finite is an empty cell."""
    rows = [[engine, *(float(cell) if np.isfinite(cell) else None for cell in cells)]
            for engine, of_engine in columns.items() for cells in zip(*(np.ravel(column) for column in of_engine), strict=True)]
    return ["engine", *header], rows


def grid_table(header: Sequence[str], fields: Mapping[str, tuple[Array, Array, Sequence[Array]]]) -> tuple[list[str], list[list[Any]]]:
    """The same of each engine's fields (n, m) on a grid of places (n,) and (m,), which are the first two columns."""
    return long_table(header, {engine: [*np.broadcast_arrays(first[:, None], second), *values]
                               for engine, (first, second, values) in fields.items()})
