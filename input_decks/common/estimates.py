"""Estimates over the runs of a series and over the points of a study, and rows of reference data."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from dembark.postproc.measurement import Array, Estimate, over_replicas
from dembark.postproc.statistics import combined


def over_chaotic(values: Iterable[float]) -> Estimate:
    """Mean of one number from each run of a chaotic motion; a single run gives no interval."""
    return over_replicas([Estimate(one, math.inf, "one run of a chaotic motion does not show its spread") for one in values])


def divided(found: Estimate, scale: float) -> Estimate:
    """`found` and its interval over `scale`."""
    return Estimate(found.value / scale, found.half / scale, found.basis)


def ratio(one: Estimate, other: Estimate) -> Estimate:
    """`one` over `other`, which are independent."""
    value = one.value / other.value
    return Estimate(value, combined([one.half / other.value, value * other.half / other.value]), "propagated from both runs")


def values_and_halves(found: Sequence[Estimate]) -> tuple[Array, Array]:
    """Values (n,) and half-widths (n,) of their intervals."""
    return np.array([one.value for one in found]), np.array([one.half for one in found])


def reference_rows(path: Path, **wanted: str) -> list[dict[str, str]]:
    """Rows of a CSV file of reference data whose columns have the `wanted` texts."""
    with path.open(encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if all(row[name] == text for name, text in wanted.items())]
