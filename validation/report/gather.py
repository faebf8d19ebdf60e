"""What the report shows, collected from a results folder: measurements, comparisons, and the runs that should be there but are not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError
from dembark.common.files import read_json
from dembark.validation.case.folders import discover
from dembark.validation.case.model import STUDY_PREFIX, Case

# Parameters of the method, not of the physics: results that depend on them do so by numerical error.
NUMERICAL = {"time_step_fraction": "time step", "time_step": "time step", "youngs_modulus": "stiffness"}


@dataclass
class Page:
    """One variant of a case: `metrics` by engine, `comparison` of the engines, `missing` runs as (engine, replica or None, reason)."""

    case: str
    variant: str
    title: str
    description: str
    source: tuple[str, ...]
    folder: Path
    engines: list[str] = field(default_factory=list)
    metrics: dict[str, dict[str, Any]] = field(default_factory=dict)
    comparison: dict[str, Any] | None = None
    missing: list[tuple[str, int | None, str]] = field(default_factory=list)

    @property
    def anchor(self) -> str:
        """Identifier within the document and stem of file names."""
        return f"{self.case}-{self.variant}"

    @property
    def is_study(self) -> bool:
        """Whether it looks at several variants together."""
        return self.variant.startswith(STUDY_PREFIX)

    @property
    def heading(self) -> str:
        """Title of the page."""
        return self.title if self.is_study else f"{self.title}: {self.variant.replace('_', ' ')}"

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.case.replace('_', ' ')} / {self.variant.replace('_', ' ').replace('-', ' ')}"


def gather(results: Path) -> list[Page]:
    """Pages of results/<profile>: everything that its `runs.json` or else the case files expect, and everything that is there."""
    cases = _cases()
    pages: dict[tuple[str, str], Page] = {}

    def page(case: str, variant: str) -> Page:
        known = cases.get(case)
        return pages.setdefault(
            (case, variant),
            Page(
                case,
                variant,
                known.title if known else case.replace("_", " "),
                known.description if known else "",
                known.source if known else (),
                results / case / variant,
            ),
        )

    for case, variant, engine, replica, reason in _expected(results, cases):
        one = page(case, variant)
        if engine not in one.engines:
            one.engines.append(engine)
        if reason is not None:
            one.missing.append((engine, replica, reason))
    for path in sorted(results.glob("*/*/*/metrics.json")):
        content = read_json(path)
        if not content or "quantities" not in content or "superseded" in path.parts:
            continue
        one = page(path.parts[-4], path.parts[-3])
        one.metrics[path.parts[-2]] = content
        if one.is_study:
            one.title, one.description = content.get("title", one.title), content.get("description", "")
        if path.parts[-2] not in one.engines:
            one.engines.append(path.parts[-2])
    for one in pages.values():
        one.engines.sort()
        one.comparison = read_json(one.folder / "comparison.json") if len(one.metrics) > 1 else None
        told = {engine for engine, *_ in one.missing}
        one.missing += [
            (engine, None, "it could not be measured") for engine in one.engines if engine not in one.metrics and engine not in told
        ]
    return sorted(pages.values(), key=lambda one: (one.case != "silo", one.case, one.is_study, "wet" in one.variant, one.variant))


def _cases() -> Mapping[str, Case]:
    # A report of old results must not fail because a case file has gone or is being edited.
    try:
        return discover()
    except DembarkError:
        return {}


def _expected(results: Path, cases: Mapping[str, Case]) -> list[tuple[str, str, str, int | None, str | None]]:
    """(case, variant, engine, replica, None or why it is missing) of every run that should be there."""
    summary = read_json(results / "runs.json")
    if summary:
        return [
            (
                run["case"],
                run["variant"],
                run["engine"],
                run["replica"],
                None if run["state"] == "finished" else run.get("message") or run["state"],
            )
            for run in summary["runs"]
        ]
    return [
        (
            case.name,
            planned.variant,
            engine,
            None,
            None if (results / case.name / planned.variant / engine / "metrics.json").is_file() else "not run",
        )
        for case in cases.values()
        for planned in case.runs.get(results.name, ())
        for engine in planned.engines
    ]


def studies(page: Page, pages: list[Page]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """(numerical, physical) comparisons of `page` with the variants of its case that differ from it in one parameter only.

    Each is {engine, parameter, own, other, rows}; rows are (label, own value, other value, relative difference).
    """
    numerical, physical = [], []
    for other in pages:
        if other.case != page.case or other is page or page.is_study or other.is_study:
            continue
        for engine in sorted(page.metrics.keys() & other.metrics.keys()):
            one, two = page.metrics[engine], other.metrics[engine]
            keys = one["parameters"].keys() | two["parameters"].keys()
            changed = [
                key
                for key in keys
                if one["parameters"].get(key) != two["parameters"].get(key)
                and key not in ("seed", "replicas", "frames", "grain_count", "settle_time", "measure_time")
            ]
            if len(changed) != 1:
                continue
            key = changed[0]
            entry = {
                "engine": engine,
                "parameter": NUMERICAL.get(key, key.replace("_", " ")),
                "variant": other.variant.replace("_", " "),
                "own": one["parameters"].get(key),
                "other": two["parameters"].get(key),
                "rows": _differences(one, two),
            }
            (numerical if key in NUMERICAL else physical).append(entry)
    return numerical, physical


def _differences(one: dict[str, Any], two: dict[str, Any]) -> list[dict[str, Any]]:
    by_name = {quantity["name"]: quantity for quantity in two["quantities"]}
    rows = []
    for quantity in one["quantities"]:
        other = by_name.get(quantity["name"])
        if quantity.get("compared") and other and quantity["value"] and other["value"] is not None:
            rows.append(
                {
                    "label": quantity["label"],
                    "unit": quantity["unit"],
                    "own": quantity,
                    "other": other,
                    "deviation": other["value"] / quantity["value"] - 1.0,
                }
            )
    return rows
