"""The one SQLite file of a results folder: its tables and how they are written; whole transactions, also on network file systems."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

from dembark.common.errors import DembarkError, RunError
from dembark.common.files import disk_error

FILE = "store.sqlite"
# A change of the tables below is a new version.
VERSION = 6
PATIENCE = 60.0

_PLACE = {"campaign": "TEXT NOT NULL", "case_name": "TEXT NOT NULL", "variant": "TEXT NOT NULL"}
_MEASURED = {"commit_hash": "TEXT NOT NULL", "dirty": "INTEGER", "measured_at": "TEXT"}
_VALUE = {"name": "TEXT NOT NULL", "label": "TEXT", "unit": "TEXT", "value": "REAL", "low": "REAL", "high": "REAL",
          "reference": "REAL", "reference_low": "REAL", "reference_high": "REAL", "deviation": "REAL", "deviation_kind": "TEXT",
          "tolerance": "REAL", "verdict": "TEXT", "evidence": "TEXT", "reason": "TEXT", "detail": "TEXT", "source": "TEXT",
          "control": "TEXT", "family": "TEXT", "cause": "TEXT", "decides": "TEXT"}
# What the table of runs knows of each run and step; see `table.State`.
_STATE = {"state": "TEXT NOT NULL", "message": "TEXT", "attempts": "INTEGER", "began": "REAL", "ended": "REAL", "host": "TEXT",
          "job": "TEXT"}

TABLES: dict[str, dict[str, str]] = {
    "runs": {
        "run_id": "TEXT NOT NULL", **_PLACE, "profile": "TEXT", "engine": "TEXT NOT NULL", "engine_version": "TEXT",
        "engine_identity": "TEXT", "replica": "INTEGER", "seed": "INTEGER", "parameters_json": "TEXT", **_STATE,
        "resumed_from_step": "INTEGER", "step": "INTEGER", "resume": "TEXT", "ranks": "INTEGER",
        "threads": "INTEGER", "particles": "INTEGER", "steps": "INTEGER", "time_step": "REAL", "estimated_time": "REAL",
        "wall_time": "REAL", "particle_steps_per_second": "REAL", "commit_hash": "TEXT",
        "dirty": "INTEGER", "cpu": "TEXT", "started": "TEXT", "folder": "TEXT"},
    "steps": {"campaign": "TEXT NOT NULL", "name": "TEXT NOT NULL", "kind": "TEXT NOT NULL", **_STATE},
    "quantities": {
        **_PLACE, "engine": "TEXT NOT NULL", **_VALUE, "basis": "TEXT", "deviation_half_width": "REAL", "compared": "INTEGER",
        "agreement": "REAL", "replicas": "INTEGER", "parameters_json": "TEXT", **_MEASURED, "engine_version": "TEXT NOT NULL",
        "run_commit": "TEXT", "host": "TEXT"},
    "comparisons": {
        **_PLACE, "engine": "TEXT NOT NULL", "reference_engine": "TEXT NOT NULL", **_VALUE, "joint_half_width": "REAL", **_MEASURED,
        "engine_versions": "TEXT NOT NULL"},
    "points": {**_PLACE, "sweep": "TEXT NOT NULL", "base_variant": "TEXT", "axis": "TEXT NOT NULL", "value": ""},
}
KEYS = {
    "runs": ("run_id", "folder"),
    "steps": ("name",),
    "quantities": ("campaign", "case_name", "variant", "engine", "name", "commit_hash", "engine_version"),
    "comparisons": ("campaign", "case_name", "variant", "engine", "reference_engine", "name", "commit_hash", "engine_versions"),
    "points": ("campaign", "case_name", "variant", "sweep", "axis"),
}


@contextmanager
def writing(path: Path) -> Iterator[sqlite3.Connection]:
    """One transaction on the file, which is made when it is not there; RunError when it cannot be written."""
    try:
        # The journal is deleted after each transaction: a write-ahead log does not work on network file systems.
        with closing(sqlite3.connect(path, timeout=PATIENCE, isolation_level=None)) as connection:
            connection.row_factory = sqlite3.Row
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


def version(connection: sqlite3.Connection, path: Path) -> int:
    """Version of the tables in an open file, 0 when there are none; DembarkError when it is newer than this dembark."""
    found = int(connection.execute("PRAGMA user_version").fetchone()[0])
    if found > VERSION:
        raise DembarkError(f"{path} has version {found} of the store's tables", f"this dembark knows {VERSION}", "use a newer dembark")
    return found


def rows(path: Path, sql: str, values: Sequence[Any] = ()) -> list[dict[str, Any]]:
    """Rows of any SELECT on the file as dicts; nothing else is run. DembarkError when the SQL is wrong or it cannot be read."""
    try:
        # Not opened as read-only: a writer that was killed leaves a journal, and only who may write can take back what it had begun.
        with closing(sqlite3.connect(f"file:{quote(str(path.resolve()))}?mode=rw", uri=True, timeout=PATIENCE)) as connection:
            connection.execute("PRAGMA query_only = ON")
            if not version(connection, path):
                return []  # it is being made at this moment
            connection.row_factory = sqlite3.Row
            return [dict(row) for row in connection.execute(sql, values)]
    except sqlite3.Error as error:
        raise DembarkError(f"the store {path} cannot be read", str(error)) from None


def _prepare(connection: sqlite3.Connection, path: Path) -> None:
    before = version(connection, path)
    if before == VERSION:
        return
    for table, columns in TABLES.items():
        old = [row["name"] for row in connection.execute(f"PRAGMA table_info({table})")]
        if old:
            connection.execute(f"ALTER TABLE {table} RENAME TO old_{table}")
        body = ", ".join(f"{name} {kind}".strip() for name, kind in columns.items())
        connection.execute(f"CREATE TABLE {table} ({body}, PRIMARY KEY ({', '.join(KEYS[table])}))")
        if old:
            same = ", ".join(name for name in old if name in columns)
            connection.execute(f"INSERT INTO {table} ({same}) SELECT {same} FROM old_{table}")
            connection.execute(f"DROP TABLE old_{table}")
    # A run that had not finished by then was of no state that there is now.
    connection.execute("UPDATE runs SET state = 'waiting' WHERE state NOT IN ('finished', 'superseded', 'failed')")
    connection.execute(f"PRAGMA user_version = {VERSION}")


def put(connection: sqlite3.Connection, table: str, rows: Iterable[Mapping[str, Any]]) -> None:
    """Add `rows`, or replace those with the same key; columns that a row does not name are empty."""
    columns = list(TABLES[table])
    marks = ", ".join("?" for _ in columns)
    connection.executemany(f"INSERT OR REPLACE INTO {table} ({', '.join(columns)}) VALUES ({marks})",
                           [[row.get(column) for column in columns] for row in rows])


def change(connection: sqlite3.Connection, table: str, row: Mapping[str, Any]) -> None:
    """Set the columns of `row` that are no keys in the row with its keys."""
    columns = [column for column in row if column not in KEYS[table]]
    where = " AND ".join(f"{key} = ?" for key in KEYS[table])
    connection.execute(f"UPDATE {table} SET {', '.join(f'{column} = ?' for column in columns)} WHERE {where}",
                       [*(row[column] for column in columns), *(row[key] for key in KEYS[table])])


def clear(connection: sqlite3.Connection, table: str, **where: Any) -> None:
    """Delete the rows with these values."""
    connection.execute(f"DELETE FROM {table} WHERE {' AND '.join(f'{key} = ?' for key in where)}", list(where.values()))
