"""What a campaign's report shows, collected from its store and `runs.json`: sweeps, everything measured, and what is missing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dembark.common.files import read_json
from dembark.validation.case import folders
from dembark.validation.campaigns import store
from dembark.validation.campaigns.report.sweeps import Point, Sweep

_FACTS = ("dirty", "host", "cpu", "started", "ranks", "threads")


@dataclass(frozen=True)
class Campaign:
    """A campaign's results: `contents` as in metrics.json, `comparisons` of the engines, and a line for each run that is `missing`."""

    name: str
    description: str
    sweeps: tuple[Sweep, ...]
    contents: tuple[Mapping[str, Any], ...]
    comparisons: tuple[Mapping[str, Any], ...]
    missing: tuple[str, ...]


def gather(folder: Path) -> Campaign:
    """The campaign in `folder`; DembarkError when it has no store. Of several measurements of a quantity the last one counts."""
    summary = read_json(folder / "runs.json") or {}
    runs = [run for run in store.read_runs(folder) if run["state"] != "superseded"]
    contents = _contents(store.read_quantities(folder), runs)
    points = by_point(contents)
    sweeps = [sweep(one["case"], number, tuple(one["axes"]), {point["variant"]: point["values"] for point in one["points"]}, points,
                    one.get("title") or "")
              for number, one in enumerate(summary.get("sweeps", []), start=1)]
    missing = [f"{run['case_name']} {run['variant']} {run['engine']} {run['replica']}: {run['message'] or run['state']}"
               for run in runs if run["state"] != "finished"]
    return Campaign(summary.get("campaign") or folder.name, summary.get("description") or "", tuple(sweeps), contents,
                    _comparisons(store.read(folder, "comparisons")), tuple(missing))


def sweep(case: str, number: int, axes: Sequence[str], points: Mapping[str, Mapping[str, Any]],
          contents: Mapping[tuple[str, str], Mapping[str, Mapping[str, Any]]], title: str = "") -> Sweep:
    """One sweep: `points` = swept values by variant, `contents` = metrics by (case, variant) and engine."""
    found = tuple(Point(values, variant, contents.get((case, variant), {})) for variant, values in points.items())
    named = title or f"{case.replace('_', ' ').capitalize()}: {' × '.join(axis.replace('_', ' ') for axis in axes) or 'one point'}"
    # A case that has gone since leaves its results without units of the axes.
    known = folders.discover().get(case)
    units = {axis: known.parameters[axis].unit for axis in axes if known and axis in known.parameters}
    return Sweep(case, named, tuple(axes), found, f"{case}-{number}", units)


def by_point(contents: Iterable[Mapping[str, Any]]) -> dict[tuple[str, str], dict[str, Mapping[str, Any]]]:
    """Metrics by (case, variant), then by engine."""
    found: dict[tuple[str, str], dict[str, Mapping[str, Any]]] = {}
    for one in contents:
        found.setdefault((one["case"], one["variant"]), {})[one["engine"]] = one
    return found


def _latest(rows: Iterable[Mapping[str, Any]], *columns: str) -> dict[tuple[Any, ...], Mapping[str, Any]]:
    return {tuple(row[column] for column in columns): row for row in sorted(rows, key=lambda row: row["measured_at"] or "")}


def _quantity(row: Mapping[str, Any]) -> dict[str, Any]:
    """A quantity with its intervals as pairs, as it stands in a metrics.json."""
    pairs = {name: [row[low], row[high]] if row[low] is not None and row[high] is not None else None
             for name, low, high in (("interval", "low", "high"), ("reference_interval", "reference_low", "reference_high"))}
    return {**row, **pairs}


def _contents(rows: Sequence[Mapping[str, Any]], runs: Sequence[Mapping[str, Any]]) -> tuple[dict[str, Any], ...]:
    """A content for each series, of what was measured last: a quantity that only an older code measured is history, not a result."""
    last = {key: row["measured_at"] for key, row in _latest(rows, "case_name", "variant", "engine").items()}
    found: dict[tuple[Any, ...], dict[str, Any]] = {}
    for row in rows:
        key = (row["case_name"], row["variant"], row["engine"])
        if row["measured_at"] == last[key]:
            content = found.setdefault(key, {"case": key[0], "variant": key[1], "engine": key[2], "parameters": row["parameters"],
                                             "quantities": [], "provenance": _provenance(key, row, runs)})
            content["quantities"].append(_quantity(row))
    return tuple(found.values())


def _provenance(key: tuple[Any, ...], row: Mapping[str, Any], runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    own = [run for run in runs if (run["case_name"], run["variant"], run["engine"]) == key and run["state"] == "finished"]
    first = own[0] if own else {}
    wall = [run["wall_time"] for run in own if run["wall_time"]]
    speed = [run["particle_steps_per_second"] for run in own if run["particle_steps_per_second"]]
    return {"commit": row["run_commit"], "versions": {key[2]: row["engine_version"]}, "replicas": len(own),
            "wall_time": sum(wall) if wall else None, "particle_steps_per_second": sum(speed) / len(speed) if speed else None,
            "steps": first.get("steps"), "time_step": first.get("time_step"), **{name: first.get(name) for name in _FACTS}}


def _comparisons(rows: Iterable[Mapping[str, Any]]) -> tuple[dict[str, Any], ...]:
    found: dict[tuple[str, str], dict[str, Any]] = {}
    for (case, variant, *_), row in _latest(rows, "case_name", "variant", "engine", "reference_engine", "name").items():
        found.setdefault((case, variant), {"case": case, "variant": variant, "quantities": []})["quantities"].append(_quantity(row))
    return tuple(found.values())
