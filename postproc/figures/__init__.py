"""Figures of the fields that a measurement left in `fields.nc`, by the kind that its attribute `kind` says."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from dembark.postproc.figures.panels import FieldFigure, Looks

FILE = "fields.nc"
KINDS = ("silo", "channel", "drum")


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


def draw(datasets: Mapping[str, Any], looks: Looks) -> list[FieldFigure]:
    """All figures of the engines' datasets, which have to be of one kind; none for a kind that nothing here draws."""
    kinds = {str(one.attrs.get("kind", "")) for one in datasets.values()}
    if len(kinds) != 1 or not kinds <= set(KINDS):
        return []
    return list(importlib.import_module(f"dembark.postproc.figures.{kinds.pop()}").draw(datasets, looks))
