"""Figures of the fields that the measurement left in `fields.nc`: which ones a page has, and what was read for them."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

FILE = "fields.nc"
# Module that draws the fields of a kind, beside this one.
_DRAWN_BY = {"silo": "fields_silo", "channel": "fields_channel", "drum": "fields_drum"}


@dataclass(frozen=True)
class FieldFigure:
    """A figure `name`, with a `caption` that says what is shown and how it was made; `tables` (header, rows) by name are its data."""

    name: str
    figure: Figure
    title: str
    caption: str
    tables: Mapping[str, tuple[list[str], list[list[Any]]]]


def read(folder: Path, engines: list[str]) -> dict[str, Any]:
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


def figures(datasets: Mapping[str, Any]) -> list[FieldFigure]:
    """All figures of a page, from its engines' datasets of one kind; none for a kind that nothing here draws."""
    kinds = {str(one.attrs.get("kind", "")) for one in datasets.values()}
    if len(kinds) != 1 or not kinds <= _DRAWN_BY.keys():
        return []
    module = importlib.import_module(f"dembark.validation.report.{_DRAWN_BY[kinds.pop()]}")
    return list(module.draw(datasets))
