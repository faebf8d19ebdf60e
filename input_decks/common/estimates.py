"""Estimates over the runs of a series and over the points of a study, and rows of reference data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from dembark.common.choices import nearest
from dembark.common.errors import DembarkError
from dembark.common.tables import read_table
from dembark.common.units import finite
from dembark.postproc.measurement import Array, Estimate, Numbers, over_replicas
from dembark.postproc.statistics import combined

# 95 % half-width of a reading, in its steps: all places within half a step are alike.
STEP = 0.475


def over_chaotic(values: Iterable[float], read: float = math.inf) -> Estimate:
    """Mean of one number from each run of a chaotic motion; a single run gives no interval. `read`: STEP of a reading, or what one more of
    the things that are counted makes. The half-width is at least that, and just that of three or more equal numbers, which have no interval
    where it is not known."""
    found = list(values)
    if math.isinf(read) or len(found) < 3:
        return over_replicas([Estimate(one, math.inf, "one run of a chaotic motion does not show its spread") for one in found])
    return over_replicas([Estimate(one, read, "steps of the reading") for one in found], shared=read)


def of_packing(value: float) -> Estimate:
    """A number of one run, which depends on its packing."""
    return Estimate(value, math.inf, "one packing does not show its spread")


def divided(found: Estimate, scale: float) -> Estimate:
    """`found` and its interval over `scale`."""
    return Estimate(found.value / scale, found.half / abs(scale), found.basis)


def ratio(one: Estimate, other: Estimate) -> Estimate:
    """`one` over `other`, which are independent."""
    value = one.value / other.value
    return Estimate(value, combined([one.half / other.value, value * other.half / other.value]), "propagated from both runs")


def values_and_halves(found: Sequence[Estimate]) -> tuple[Array, Array]:
    """Values (n,) and half-widths (n,) of their intervals."""
    return np.array([one.value for one in found]), np.array([one.half for one in found])


def unlike(p: Numbers, published: Mapping[str, float]) -> str:
    """Why a run with the parameters `p` is not compared with an experiment, by those of its set-up that are `published`; "" where all are
    the same."""
    other = [f"{name} = {value:g}" for name, value in published.items() if not math.isclose(p[name], value, rel_tol=1e-6)]
    return f"the experiment had {', '.join(other)}" if other else ""


class Row(dict[str, str]):
    """A row of a table: the texts of the columns by name; `where` is its file and line."""

    def __init__(self, texts: Mapping[str, str], where: str) -> None:
        """Keep `texts` and `where`."""
        super().__init__(texts)
        self.where = where

    def number(self, column: str, empty: float | None = None) -> float:
        """The number in `column`; `empty`, if given, where the field is empty. DembarkError with file and line when there is none."""
        text = self.get(column) or ""
        if not text.strip() and empty is not None and column in self:
            return empty
        try:
            value = float(text)
        except ValueError:
            what = f"{column} = {text!r} is not a number" if column in self else f"there is no column {column!r}"
            raise DembarkError(self.where, what, "write the decimal point" if "," in text else nearest(column, self)
                               if column not in self else "") from None
        try:
            return finite(value, column, text)
        except DembarkError as error:
            raise DembarkError(self.where, str(error)) from None


def reference_rows(path: Path, **wanted: str) -> list[Row]:
    """Rows of a CSV file of reference data, with a header, whose columns have the `wanted` texts; DembarkError for a table that would be
    misread (see `read_table`), and for one without such a column."""
    names, found = read_table(path)
    if missing := [name for name in wanted if name not in names]:
        raise DembarkError(f"{path} has no column {missing[0]!r}", "", nearest(missing[0], names))
    rows = [Row(texts, f"{path}, line {line}") for line, texts in found]
    return [row for row in rows if all(row[name] == text for name, text in wanted.items())]
