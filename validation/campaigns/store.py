"""The store of a results folder: one SQLite file with a row for each run and each measured quantity, with where it comes from.

It is written by the process that measures and by nobody else at the same time; a series is written whole or not at all, and writing it
again changes nothing. Rows of other commits and engine versions stay, so that quantities can be followed over them.
"""

from __future__ import annotations

import csv
import io
import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from dembark.common.errors import DembarkError, RunError
from dembark.common.files import disk_error, read_json, write_whole
from dembark.validation.campaigns.schema import KEYS, TABLES, VERSION, statements
from dembark.validation.case.parameters import pick
from dembark.validation.plan import Run, Series, finished, studies

if TYPE_CHECKING:
    import numpy as np

FILE = "store.sqlite"
_PATIENCE = 60.0
_SUPERSEDED = "superseded"


def path_of(results: Path) -> Path:
    """Where the store of a results folder lies."""
    return results / FILE


# --- writing ----------------------------------------------------------------------------------------------------


@contextmanager
def _writing(results: Path) -> Iterator[sqlite3.Connection]:
    """One transaction on the store, which is made when it is not there; RunError when it cannot be written."""
    path = path_of(results)
    try:
        # The journal is deleted after each transaction: a write-ahead log does not work on network file systems.
        with closing(sqlite3.connect(path, timeout=_PATIENCE, isolation_level=None)) as connection:
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute("BEGIN IMMEDIATE")
            try:
                _prepare(connection, path)
                yield connection
                connection.execute("COMMIT")
            except BaseException:
                connection.execute("ROLLBACK")
                raise
    except sqlite3.Error as error:
        raise RunError(f"the store {path} cannot be written", str(error), "when it is deleted, its rows are made again") from None
    except OSError as error:
        raise disk_error(error, path) from None


def _version(connection: sqlite3.Connection, path: Path) -> int:
    found = int(connection.execute("PRAGMA user_version").fetchone()[0])
    if found > VERSION:
        raise DembarkError(f"{path} has version {found} of the store's tables", f"this dembark knows {VERSION}", "use a newer dembark")
    return found


def _prepare(connection: sqlite3.Connection, path: Path) -> None:
    if _version(connection, path) == VERSION:
        return
    for statement in statements():
        connection.execute(statement)
    connection.execute(f"PRAGMA user_version = {VERSION}")


def _put(connection: sqlite3.Connection, table: str, rows: Iterable[Mapping[str, Any]]) -> None:
    columns = list(TABLES[table])
    marks = ", ".join("?" for _ in columns)
    connection.executemany(f"INSERT OR REPLACE INTO {table} ({', '.join(columns)}) VALUES ({marks})",
                           [[row.get(column) for column in columns] for row in rows])


def _clear(connection: sqlite3.Connection, table: str, **where: Any) -> None:
    connection.execute(f"DELETE FROM {table} WHERE {' AND '.join(f'{key} = ?' for key in where)}", list(where.values()))


def collect(results: Path, campaign: str, all_series: Sequence[Series], messages: Mapping[str, str] | None = None, whole: bool = False,
            sweeps: Iterable[Mapping[str, Any]] = ()) -> None:
    """Put what `results` holds of `all_series` into its store: runs, quantities, comparisons of engines, studies and swept points.

    `messages` are the reasons of failed runs by their name. With `whole` these series are all that the campaign has: runs of other inputs
    are marked as superseded. RunError when the store cannot be written.
    """
    for one in all_series:
        with _writing(results) as connection:
            _put(connection, "runs", [_run_row(results, campaign, one, run, messages or {}) for run in one.runs])
            for run in one.runs:
                _supersede(connection, campaign, run)
            _put_quantities(connection, campaign, results / one.place)
    with _writing(results) as connection:
        for planned in studies(all_series):
            _put_quantities(connection, campaign, results / planned.place)
        for place in {one.place.parent for one in (*all_series, *studies(all_series))}:
            _put_comparisons(connection, campaign, results / place)
        if whole:
            _forget(connection, campaign, {run.inputs for one in all_series for run in one.runs})
            _clear(connection, "points", campaign=campaign)
            _put(connection, "points", _point_rows(campaign, sweeps))


def _supersede(connection: sqlite3.Connection, campaign: str, run: Run) -> None:
    """What ran in the same place with other inputs counts no more, but its row stays."""
    place = (campaign, run.case.name, run.variant, run.engine.name, run.replica)
    sql = "SELECT run_id FROM runs WHERE campaign = ? AND case_name = ? AND variant = ? AND engine = ? AND replica = ?"
    _retire(connection, {row[0] for row in connection.execute(sql, place)} - {run.inputs})


def _forget(connection: sqlite3.Connection, campaign: str, wanted: set[str]) -> None:
    _retire(connection, {row[0] for row in connection.execute("SELECT run_id FROM runs WHERE campaign = ?", (campaign,))} - wanted)


def _retire(connection: sqlite3.Connection, names: set[str]) -> None:
    """Mark finished runs as superseded; of those that never finished nothing is to be kept."""
    one_each = [(name,) for name in names]
    connection.executemany("DELETE FROM runs WHERE run_id = ? AND state IN ('failed', 'missing')", one_each)
    connection.executemany(f"UPDATE runs SET state = '{_SUPERSEDED}' WHERE run_id = ?", one_each)


def _run_row(results: Path, campaign: str, one: Series, run: Run, messages: Mapping[str, str]) -> dict[str, Any]:
    place = one.place / run.folder_name
    row = {"run_id": run.inputs, "campaign": campaign, "case_name": run.case.name, "variant": run.variant, "profile": run.profile,
           "engine": run.engine.name, "engine_version": run.engine.version, "engine_identity": run.engine.identity, "replica": run.replica,
           "seed": run.values.get("seed"), "parameters_json": json.dumps(dict(run.values)), "particles": run.particles,
           "folder": str(place)}
    if not finished(results / place, run):
        return row | {"state": "failed" if run.name in messages else "missing", "message": messages.get(run.name)}
    record = read_json(results / place / "run.json") or {}
    facts = record.get("provenance", {})
    same = ("ranks", "threads", "wall_time", "particle_steps_per_second", "dirty", "host", "cpu", "started")
    resumed = record.get("resumed_at") or [None]
    return row | {"state": "finished", "attempts": record.get("attempts", 1), "resumed_from_step": resumed[-1],
                  "resume": record.get("resume"), "steps": record.get("steps"), "time_step": record.get("time_step"),
                  "commit_hash": facts.get("commit"),
                  **{key: facts.get(key) for key in same}}


def _measured(content: Mapping[str, Any]) -> dict[str, Any]:
    facts = content.get("measured", {})
    return {"commit_hash": facts.get("commit") or "", "dirty": facts.get("dirty"), "measured_at": facts.get("at")}


def _value(quantity: Mapping[str, Any]) -> dict[str, Any]:
    interval, reference = quantity.get("interval") or (None, None), quantity.get("reference_interval") or (None, None)
    return {**quantity, "low": interval[0], "high": interval[1], "reference_low": reference[0], "reference_high": reference[1]}


def _put_quantities(connection: sqlite3.Connection, campaign: str, folder: Path) -> None:
    """Quantities of one series or study as its metrics.json has them; those of the same code that it no longer has go."""
    content = read_json(folder / "metrics.json")
    if content is None:
        return
    facts = content.get("provenance", {})
    versions = facts.get("versions", {})
    case, variant, engine = folder.parts[-3:]
    key = {"campaign": campaign, "case_name": case, "variant": variant, "engine": engine, "engine_version": versions.get(engine) or ""}
    common = {**key, **_measured(content), "parameters_json": json.dumps(content.get("parameters", {})), "run_commit": facts.get("commit"),
              "host": facts.get("host"), "replicas": facts.get("replicas")}
    _clear(connection, "quantities", **key, commit_hash=common["commit_hash"])
    _put(connection, "quantities", [_value(quantity) | common for quantity in content["quantities"]])


def _put_comparisons(connection: sqlite3.Connection, campaign: str, folder: Path) -> None:
    content = read_json(folder / "comparison.json")
    if content is None:
        return
    versions = {path.parent.name: (read_json(path) or {}).get("provenance", {}).get("versions", {}).get(path.parent.name)
                for path in sorted(folder.glob("*/metrics.json"))}
    common = {"campaign": campaign, "case_name": folder.parts[-2], "variant": folder.parts[-1], **_measured(content),
              "engine_versions": ", ".join(f"{name} {version}" for name, version in versions.items())}
    where = {key: common[key] for key in ("campaign", "case_name", "variant", "commit_hash", "engine_versions")}
    _clear(connection, "comparisons", **where)
    _put(connection, "comparisons", [_value(quantity) | common for quantity in content["quantities"]])


def _point_rows(campaign: str, sweeps: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    return [{"campaign": campaign, "case_name": sweep["case"], "variant": point["variant"], "sweep": sweep["name"],
             "base_variant": point["base"], "axis": axis, "value": value}
            for sweep in sweeps for point in sweep["points"] for axis, value in point["values"].items()]


# --- reading ----------------------------------------------------------------------------------------------------


def query(path: Path | str, sql: str, values: Sequence[Any] = ()) -> list[dict[str, Any]]:
    """Rows of any SELECT on the store `path` (a file, or the results folder that it lies in) as dicts; it is opened for reading only.

    DembarkError when there is no store, the SQL is wrong, or a newer dembark wrote it.
    """
    file = Path(path) / FILE if Path(path).is_dir() else Path(path)
    if not file.is_file():
        raise DembarkError(f"there is no store {file}", "", "it is made when the first run of a campaign has been measured")
    try:
        with closing(sqlite3.connect(f"file:{quote(str(file.resolve()))}?mode=ro", uri=True, timeout=_PATIENCE)) as connection:
            if not _version(connection, file):
                return []  # it is being made at this moment
            connection.row_factory = sqlite3.Row
            return [dict(row) for row in connection.execute(sql, values)]
    except sqlite3.Error as error:
        raise DembarkError(f"the store {file} cannot be read", str(error)) from None


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
    """The table `quantities`, see `read`: `read_quantities("results/quick", case_name="silo", name="stress_ratio_k")`."""
    return read(path, "quantities", **where)


def trend(path: Path | str, case_name: str, variant: str, engine: str, name: str) -> list[dict[str, Any]]:
    """One quantity over commits and engine versions, the oldest measurement first."""
    rows = read_quantities(path, case_name=case_name, variant=variant, engine=engine, name=name)
    return sorted(rows, key=lambda row: row["measured_at"] or "")


def curve(path: Path | str, case_name: str, engine: str, name: str, axis: str, **fixed: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A quantity against a parameter: places (n,), values (n,) and the half-widths of their 95 % intervals (n,), NaN where there is none.

    `axis` is a numeric parameter, `fixed` are values of others, all in SI units; of several commits the measurement that came last counts.
    """
    import numpy as np  # here, because every job of a workflow reads this file

    last: dict[str, dict[str, Any]] = {}
    for row in sorted(read_quantities(path, case_name=case_name, engine=engine, name=name), key=lambda one: one["measured_at"] or ""):
        last[row["variant"]] = row
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
