"""The store of a results folder: one SQLite file with a row for each run and each measured quantity, with where it comes from.

It is written by the process that measures and by nobody else at the same time; a series is written whole or not at all, and writing it
again changes nothing. Rows of other commits and engine versions stay, so that quantities can be followed over them.
"""

from __future__ import annotations

import csv
import io
import json
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dembark.common.choices import pick
from dembark.common.errors import DembarkError
from dembark.common.files import read_json, write_whole
from dembark.validation.judge.result import COMPARISON, METRICS, QuantityRecord
from dembark.validation.judge.tally import Tally
from dembark.validation.judge.tally import tally as count
from dembark.validation.runs import schema
from dembark.validation.runs.schema import FILE, KEYS, TABLES, clear, put

if TYPE_CHECKING:
    import numpy as np


def collect(results: Path, campaign: str, places: Iterable[Path], sweeps: Iterable[Mapping[str, Any]] | None = None) -> None:
    """Put what was measured in `places` below `results` (<case>/<variant>/<engine>) into its store, and comparisons of engines there.

    `sweeps` replace the swept points. RunError when the store cannot be written; a place is written whole or not at all.
    """
    places = list(places)
    for place in places:
        with schema.writing(results / FILE) as connection:
            _put_quantities(connection, campaign, results / place)
    with schema.writing(results / FILE) as connection:
        for variant in {place.parent for place in places}:
            _put_comparisons(connection, campaign, results / variant)
        if sweeps is not None:
            clear(connection, "points", campaign=campaign)
            put(connection, "points", _point_rows(campaign, sweeps))


def _measured(content: Mapping[str, Any]) -> dict[str, Any]:
    facts = content.get("measured", {})
    return {"commit_hash": facts.get("commit") or "", "dirty": facts.get("dirty"), "measured_at": facts.get("at")}


def _value(quantity: Mapping[str, Any]) -> dict[str, Any]:
    interval, reference = quantity.get("interval") or (None, None), quantity.get("reference_interval") or (None, None)
    return {**quantity, "low": interval[0], "high": interval[1], "reference_low": reference[0], "reference_high": reference[1]}


def _put_quantities(connection: sqlite3.Connection, campaign: str, folder: Path) -> None:
    """Quantities of one series or study as its metrics.json has them; those of the same code that it no longer has go."""
    content = read_json(folder / METRICS)
    if content is None:
        return
    facts = content.get("provenance", {})
    versions = facts.get("versions", {})
    case, variant, engine = folder.parts[-3:]
    key = {"campaign": campaign, "case_name": case, "variant": variant, "engine": engine, "engine_version": versions.get(engine) or ""}
    common = {**key, **_measured(content), "parameters_json": json.dumps(content.get("parameters", {})), "run_commit": facts.get("commit"),
              "host": facts.get("host"), "replicas": facts.get("replicas")}
    clear(connection, "quantities", **key, commit_hash=common["commit_hash"])
    put(connection, "quantities", [_value(quantity) | common for quantity in content["quantities"]])


def _put_comparisons(connection: sqlite3.Connection, campaign: str, folder: Path) -> None:
    content = read_json(folder / COMPARISON)
    if content is None:
        return
    versions = {path.parent.name: (read_json(path) or {}).get("provenance", {}).get("versions", {}).get(path.parent.name)
                for path in sorted(folder.glob(f"*/{METRICS}"))}
    common = {"campaign": campaign, "case_name": folder.parts[-2], "variant": folder.parts[-1], **_measured(content),
              "engine_versions": ", ".join(f"{name} {version}" for name, version in versions.items())}
    where = {key: common[key] for key in ("campaign", "case_name", "variant", "commit_hash", "engine_versions")}
    clear(connection, "comparisons", **where)
    put(connection, "comparisons", [_value(quantity) | common for quantity in content["quantities"]])


def _point_rows(campaign: str, sweeps: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    return [{"campaign": campaign, "case_name": sweep["case"], "variant": point["variant"], "sweep": sweep["name"],
             "base_variant": point["base"], "axis": axis, "value": value}
            for sweep in sweeps for point in sweep["points"] for axis, value in point["values"].items()]


def query(path: Path | str, sql: str, values: Sequence[Any] = ()) -> list[dict[str, Any]]:
    """Rows of any SELECT on the store `path` (a file, or the results folder that it lies in) as dicts; it is opened for reading only.

    DembarkError when there is no store, the SQL is wrong, or a newer dembark wrote it.
    """
    file = Path(path) / FILE if Path(path).is_dir() else Path(path)
    if not file.is_file():
        raise DembarkError(f"there is no store {file}", "", "it is made when the first run of a campaign has been measured")
    return schema.rows(file, sql, values)


def read(path: Path | str, table: str, **where: Any) -> list[dict[str, Any]]:
    """Rows of `table` (runs, quantities, comparisons, points) as dicts, in the order of its key.

    `where`: column = value, or a list of values. `parameters_json` comes as the dict `parameters`.
    """
    pick(table, TABLES, "table", "of the store")
    conditions, values = [], []
    for column, wanted in where.items():
        pick(column, TABLES[table], "column", f"of the table {table}")
        several = list(wanted) if isinstance(wanted, list | tuple | set) else [wanted]
        conditions.append(f"{column} IN ({', '.join('?' for _ in several)})")
        values += several
    sql = f"SELECT * FROM {table}{' WHERE ' + ' AND '.join(conditions) if conditions else ''} ORDER BY {', '.join(KEYS[table])}"
    rows = query(path, sql, values)
    for row in rows:
        if "parameters_json" in row:
            row["parameters"] = json.loads(row.pop("parameters_json") or "{}")
    return rows


def read_runs(path: Path | str, **where: Any) -> list[dict[str, Any]]:
    """The table `runs`, see `read`."""
    return read(path, "runs", **where)


def read_quantities(path: Path | str, **where: Any) -> list[dict[str, Any]]:
    """The table `quantities`, see `read`: `read_quantities("results/quick", case_name="my_case", name="rebound")`."""
    return read(path, "quantities", **where)


def trend(path: Path | str, case_name: str, variant: str, engine: str, name: str) -> list[dict[str, Any]]:
    """One quantity over commits and engine versions, the oldest measurement first."""
    return _by_date(read_quantities(path, case_name=case_name, variant=variant, engine=engine, name=name))


def _by_date(rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    return sorted(rows, key=lambda row: row["measured_at"] or "")


def tally(path: Path | str, **where: Any) -> Tally:
    """Verdicts of quantities and comparisons, also by kind of evidence; of several commits the measurement that came last counts.

    `where`: column = value, or a list of values, of columns that both tables have.
    """
    last = {(row["case_name"], row["variant"], row["engine"], row.get("reference_engine"), row["name"]): row
            for table in ("quantities", "comparisons") for row in _by_date(read(path, table, **where))}
    return count(QuantityRecord(row["name"], row["value"], row["verdict"], tolerance=row["tolerance"], evidence=row["evidence"] or "",
                                control=row.get("control") or "", family=row.get("family") or "") for row in last.values())


def curve(path: Path | str, case_name: str, engine: str, name: str, axis: str, **fixed: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A quantity against a parameter: places (n,), values (n,) and the half-widths of their 95 % intervals (n,), NaN where there is none.

    `axis` is a numeric parameter, `fixed` are values of others, all in SI units; of several commits the measurement that came last counts.
    """
    import numpy as np  # here, because every job on another host reads this file

    last = {row["variant"]: row for row in _by_date(read_quantities(path, case_name=case_name, engine=engine, name=name))}
    rows = [row for row in last.values() if row["value"] is not None and isinstance(row["parameters"].get(axis), int | float)
            and all(row["parameters"].get(key) == value for key, value in fixed.items())]
    rows.sort(key=lambda row: row["parameters"][axis])
    half = [0.5 * (row["high"] - row["low"]) if row["low"] is not None and row["high"] is not None else np.nan for row in rows]
    places, values = [row["parameters"][axis] for row in rows], [row["value"] for row in rows]
    return np.array(places, float), np.array(values, float), np.array(half, float)


def as_csv(path: Path | str, table: str) -> str:
    """A whole table as CSV with a header line."""
    pick(table, TABLES, "table", "of the store")
    text = io.StringIO()
    writer = csv.DictWriter(text, list(TABLES[table]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(query(path, f"SELECT * FROM {table} ORDER BY {', '.join(KEYS[table])}"))
    return text.getvalue()


def export(path: Path | str, table: str, target: Path) -> None:
    """Write a table as CSV to `target`, whole or not at all."""
    write_whole(target, as_csv(path, table).encode())
