"""What the parameters of a sample are fitted to: numbers, and curves from tables of measured values."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from dembark.common.choices import nearest
from dembark.common.errors import DembarkError
from dembark.common.tables import read_table
from dembark.common.units import to_si
from dembark.validation.judge.result import PLAN

# Copies of the tables of a campaign, next to the copy of its file.
FOLDER = "targets"
REFERENCE = "reference"


@dataclass(frozen=True)
class Target:
    """What a measured quantity is to be: `value` with its standard `uncertainty`, in the unit of the quantity. `file`: where both are
    from."""

    value: float
    uncertainty: float
    file: Path | None = None

    def facts(self) -> dict[str, Any]:
        """For `plan.json`."""
        return {"value": self.value, "uncertainty": self.uncertainty}


@dataclass(frozen=True)
class CurveTarget:
    """What a measured curve is to be: `values` at the places `at`, ascending, with their standard `uncertainties`; errors of two places
    are correlated by exp(−distance / `correlation`), not at all where that is 0. In the units of the curve."""

    at: tuple[float, ...]
    values: tuple[float, ...]
    uncertainties: tuple[float, ...]
    correlation: float
    file: Path

    def facts(self) -> dict[str, Any]:
        """For `plan.json`."""
        return {"at": list(self.at), "values": list(self.values), "uncertainties": list(self.uncertainties),
                "correlation": self.correlation}


@dataclass(frozen=True)
class Table:
    """A CSV file with a header, and the `rows` of it that were chosen, each with the number of its line."""

    path: Path
    rows: tuple[tuple[int, Mapping[str, str]], ...]

    def numbers(self, column: str, unit: str) -> tuple[float, ...]:
        """The numbers in `column`, in `unit` unless they name theirs; DembarkError with file and line for what is none."""
        return tuple(self._number(line, row, column, unit) for line, row in self.rows)

    def _number(self, line: int, row: Mapping[str, str], column: str, unit: str) -> float:
        where = f"{self.path}, line {line}"
        if column not in row:
            raise DembarkError(f"{self.path} has no column {column!r}", "", nearest(column, row))
        if not (row[column] or "").strip():
            raise DembarkError(f"{column} is empty", where, "give a number, or choose rows with 'where'")
        try:
            return to_si(row[column], unit, column)
        except DembarkError as error:
            raise DembarkError(str(error), where) from None


def table(path: Path, where: Mapping[str, Any]) -> Table:
    """The rows of the CSV file `path` whose columns have the texts, or equal the numbers, of `where`; DembarkError when there are none."""
    names, rows = read_table(path)
    for key in where:
        if key not in names:
            raise DembarkError(f"{path} has no column {key!r}", "", nearest(key, names))
    chosen = tuple((line, row) for line, row in rows if all(_same(row[key], wanted) for key, wanted in where.items()))
    if not chosen:
        wanted = ", ".join(f"{key} = {value}" for key, value in where.items())
        raise DembarkError(f"{path} has no row" + (f" with {wanted}" if wanted else ""))
    return Table(path, chosen)


def _same(text: str | None, wanted: Any) -> bool:
    given = (text or "").strip()
    if given == str(wanted):
        return True
    try:
        return math.isclose(float(given), float(wanted), rel_tol=1e-9)
    except (TypeError, ValueError):
        return False


def find(name: str, campaign: Path, case: Path) -> Path:
    """The table `name`: its copy in a campaign's folder, or next to the file of the `campaign`, or among the references in the folder of
    the `case`; DembarkError when there is none."""
    # A copy first in the folder of a campaign: what was begun goes on with what it began with.
    copies = [campaign.parent / FOLDER / Path(name).name] if (campaign.parent / PLAN).is_file() else []
    places = [*copies, campaign.parent / name, case / REFERENCE / name]
    for path in places:
        if path.is_file():
            return path
    raise DembarkError(f"there is no file {name}", f"next to {campaign.name} or in {case / REFERENCE}",
                       nearest(name, (path.name for path in campaign.parent.glob("*.csv"))))


def one_number(found: Table, column: str, unit: str) -> float:
    """The number in `column` of a table of one row; DembarkError when it has more."""
    if len(found.rows) > 1:
        raise DembarkError(f"{found.path} has {len(found.rows)} rows", "a quantity is one number",
                           "choose its row with where = { column = ... }, or name the column of the places with 'at' for a curve")
    return found.numbers(column, unit)[0]


def curve(found: Table, at: str, value: str, uncertainty: str | float, correlation: float) -> CurveTarget:
    """The curve in the columns `at` and `value`; `uncertainty` is a column, or one number for all. DembarkError for two values at one
    place, and for an uncertainty that is not positive."""
    places, values = found.numbers(at, "1"), found.numbers(value, "1")
    own = found.numbers(uncertainty, "1") if isinstance(uncertainty, str) else (float(uncertainty),) * len(places)
    rows = sorted(zip(places, values, own, (line for line, _ in found.rows), strict=True))
    for one, other in pairwise(rows):
        if one[0] == other[0]:
            raise DembarkError(f"{at} = {one[0]:g} stands in two rows", f"{found.path}, lines {one[3]} and {other[3]}",
                               "choose rows with where = { column = ... }")
    for _, _, deviation, line in rows:
        if not deviation > 0.0:
            raise DembarkError(f"uncertainty = {deviation:g} is out of range", f"{found.path}, line {line}", "it must be > 0")
    places, values, own = (tuple(row[k] for row in rows) for k in range(3))
    return CurveTarget(places, values, own, correlation, found.path)


def changed(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """What differs between the targets of a plan, read from its file, and those of now, as `facts` have them, a phrase for each; a plan of
    version 1.0.0 has pairs of numbers."""
    now = json.loads(json.dumps(now))  # as in the file
    pair = ("value", "uncertainty")
    before = {name: dict(zip(pair, one, strict=True)) if isinstance(one, list) else one for name, one in before.items()}
    for name in [*before, *(name for name in now if name not in before)]:
        if name not in now:
            yield f"{name} is gone"
        elif name not in before:
            yield f"{name} is new"
        elif before[name] != now[name]:
            yield f"{name} was {_short(before[name])}, now {_short(now[name])}"


def refuse_changed(folder: Path, number: int, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    """DembarkError when the sweep `number` of the calibration in `folder` has other targets `now` than the plan had `before`: a fit to them
    would look like a continued one."""
    if words := list(changed(before, now)):
        raise DembarkError(f"the calibration in {folder} began with other targets", f"sweeps {number}: {', '.join(words)}",
                           "restore them, or choose another folder with --out")


def _short(fact: Mapping[str, Any]) -> str:
    return f"{fact['value']:g} ± {fact['uncertainty']:g}" if "value" in fact else f"a curve of {len(fact['at'])} points"
