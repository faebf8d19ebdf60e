"""Tables of a store: their columns, with SQLite's types, and their keys. A change of them is a new VERSION."""

from __future__ import annotations

VERSION = 1

_PLACE = {"campaign": "TEXT NOT NULL", "case_name": "TEXT NOT NULL", "variant": "TEXT NOT NULL"}
_MEASURED = {"commit_hash": "TEXT NOT NULL", "dirty": "INTEGER", "measured_at": "TEXT"}
_VALUE = {"name": "TEXT NOT NULL", "label": "TEXT", "unit": "TEXT", "value": "REAL", "low": "REAL", "high": "REAL",
          "reference": "REAL", "reference_low": "REAL", "reference_high": "REAL", "deviation": "REAL", "deviation_kind": "TEXT",
          "tolerance": "REAL", "verdict": "TEXT", "reason": "TEXT", "detail": "TEXT", "source": "TEXT"}

TABLES: dict[str, dict[str, str]] = {
    "runs": {
        "run_id": "TEXT NOT NULL", **_PLACE, "profile": "TEXT", "engine": "TEXT NOT NULL", "engine_version": "TEXT",
        "engine_identity": "TEXT", "replica": "INTEGER", "seed": "INTEGER", "parameters_json": "TEXT", "state": "TEXT NOT NULL",
        "message": "TEXT", "attempts": "INTEGER", "resumed_from_step": "INTEGER", "resume": "TEXT", "ranks": "INTEGER",
        "threads": "INTEGER", "particles": "INTEGER", "steps": "INTEGER", "time_step": "REAL", "wall_time": "REAL",
        "particle_steps_per_second": "REAL", "commit_hash": "TEXT",
        "dirty": "INTEGER", "host": "TEXT", "cpu": "TEXT", "started": "TEXT", "folder": "TEXT"},
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
    "runs": ("run_id",),
    "quantities": ("campaign", "case_name", "variant", "engine", "name", "commit_hash", "engine_version"),
    "comparisons": ("campaign", "case_name", "variant", "engine", "reference_engine", "name", "commit_hash", "engine_versions"),
    "points": ("campaign", "case_name", "variant", "sweep", "axis"),
}


def statements() -> list[str]:
    """SQL that makes the empty tables."""
    made = []
    for table, columns in TABLES.items():
        body = ", ".join(f"{name} {kind}".strip() for name, kind in columns.items())
        made.append(f"CREATE TABLE IF NOT EXISTS {table} ({body}, PRIMARY KEY ({', '.join(KEYS[table])}))")
    return made
