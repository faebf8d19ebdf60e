"""From the finished replicas of one case, variant and engine to quantities with intervals and verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dembark.common.errors import RunError
from dembark.common.files import read_json, write_json
from dembark.postproc.replica import Replica
from dembark.validation import engines
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.case.model import Study
from dembark.validation.judge import measuring


def replicas(folder: Path) -> list[Replica]:
    """Finished replicas of `folder`, in the order of their numbers."""
    found = [Replica(path.parent, _whole(record)) for path in folder.glob("replica-*/run.json") if (record := read_json(path)) is not None]
    return sorted(found, key=lambda one: int(one.record["replica"]))


def _whole(record: dict[str, Any]) -> dict[str, Any]:
    """The record with what those of earlier versions lack: how the engine counts bodies, and the numbers derived from the parameters."""
    derived = {} if "derived" in record else deck.derived(find(record["case"]), record["parameters"])
    return {"impact_id_offset": engines.facts(record["engine"]).impact_id_offset, "derived": derived, **record}


def measure(run_folder: Path) -> dict[str, Any]:
    """Measure the replicas in `run_folder`, write its `metrics.json` and return what it holds.

    RunError when there is no finished replica, or one of their files cannot be read: a result is whole or not there.
    """
    runs = replicas(run_folder)
    if not runs:
        raise RunError(f"nothing to measure in {run_folder}", "it has no finished replica-*/run.json")
    first = runs[0].record
    case = find(first["case"])
    found = measuring.measure(case, runs)
    if found.fields is not None:
        _write_fields(run_folder, found.fields)
    known = {**first["parameters"], **first.get("derived", {})}
    content = {
        "case": first["case"],
        "variant": first["variant"],
        "engine": first["engine"],
        "profile": first["profile"],
        "parameters": {key: value for key, value in first["parameters"].items() if key != "seed"},
        "quantities": [quantity.as_json() for quantity in measuring.quantities(case, found)],
        "profiles": list(found.profiles),
        "remarks": [*found.remarks, *measuring.statements(case)],
        "picture": measuring.picture(case, known),
        "references": measuring.references(case),
        "provenance": _provenance(runs),
    }
    write_json(run_folder / "metrics.json", content)
    return content


def _write_fields(run_folder: Path, fields: Any) -> None:
    # Labelled arrays take a second to import, which commands that measure nothing need not wait for.
    from dembark.postproc.output import labelled

    labelled.write(run_folder / "fields.nc", fields)


def study(planned: Study, folders: Sequence[Path]) -> dict[str, Any]:
    """A study of one engine from the measured variants in `folders`: content of a `metrics.json`.

    RunError when one of them has no measurement or the case has no `study` in its measure.py.
    """
    points = []
    for folder in folders:
        content = read_json(folder / "metrics.json")
        if content is None:
            raise RunError(f"study {planned.name} is incomplete", f"{folder} has no metrics.json", "every variant of a study is needed")
        points.append(content)
    first = points[0]
    case = find(first["case"])
    found = measuring.study(case, planned, points)
    return {
        "case": first["case"],
        "variant": planned.folder_name,
        "engine": first["engine"],
        "profile": first["profile"],
        "title": planned.title,
        "description": planned.description,
        "parameters": {},
        "quantities": [quantity.as_json() for quantity in measuring.quantities(case, found)],
        "profiles": list(found.profiles),
        "remarks": [*found.remarks, *measuring.statements(case)],
        "picture": None,
        "references": measuring.references(case),
        "provenance": {"variants": list(planned.variants)},
    }


def _provenance(runs: list[Replica]) -> dict[str, Any]:
    facts = dict(runs[0].record.get("provenance", {}))
    wall = [float(one.record["provenance"]["wall_time"]) for one in runs if one.record.get("provenance", {}).get("wall_time")]
    speed = [
        float(one.record["provenance"]["particle_steps_per_second"])
        for one in runs
        if one.record.get("provenance", {}).get("particle_steps_per_second")
    ]
    facts |= {
        "seeds": [one.record.get("seed") for one in runs],
        "replicas": len(runs),
        "wall_time": sum(wall) if wall else None,
        "particle_steps_per_second": sum(speed) / len(speed) if speed else None,
        "steps": runs[0].record["steps"],
        "time_step": runs[0].record["time_step"],
    }
    facts.pop("seed", None)
    return facts
