"""From the finished replicas of one case, variant and engine, or the variants of a study, to a Result with intervals and verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import fmean, median
from typing import Any

from dembark.common.errors import RunError
from dembark.common.files import read_json
from dembark.postproc.measurement import FIELDS_FILE, SURFACE_FILE, Measurement
from dembark.postproc.replica import Replica
from dembark.validation import analysis, engines, provenance, results
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.case.model import Case, Study
from dembark.validation.judge import inputs, measurement, measurement_file, prediction, verdict
from dembark.validation.judge.result import METRICS, Result, as_json, read


def replicas(folder: Path) -> list[Replica]:
    """Finished replicas of `folder`, in the order of their numbers."""
    found = [Replica(path.parent, _complete(record)) for path in folder.glob("replica-*/run.json")
             if (record := read_json(path)) is not None]
    return sorted(found, key=lambda one: int(one.record["replica"]))


def _complete(record: dict[str, Any]) -> dict[str, Any]:
    """The record with what those of earlier versions lack: how the engine counts bodies, and the numbers derived from the parameters."""
    derived = {} if "derived" in record else deck.derived(deck.prepare(find(record["case"]), record["parameters"]))
    return {"impact_id_offset": engines.facts(record["engine"]).impact_id_offset, "derived": derived, **record}


def measure(folder: Path, wanted: int | None = None) -> Result:
    """Measure the replicas in `folder`, of which there are to be `wanted`, and judge what was measured; `measurement.json` keeps it,
    `fields.nc` its fields and `surface.vtkhdf` its map on a surface. What was measured before of the same inputs is not measured again.

    RunError when there is no finished replica, or one of their files cannot be read: a result is complete or not there.
    """
    runs = replicas(folder)
    if not runs:
        raise RunError(f"nothing to measure in {folder}", "it has no finished replica-*/run.json")
    first, case = runs[0].record, find(runs[0].record["case"])
    inputs_hash = inputs.of_measurement(case, [one.folder / "run.json" for one in runs])
    kept = measurement_file.read(folder, inputs_hash) or _measure(folder, case, runs, inputs_hash)
    parameters = {key: value for key, value in first["parameters"].items() if key != "seed"}
    if wanted is not None and "replicas" in parameters:
        # Replicas of an earlier request are kept; their records hold the number asked for then.
        parameters["replicas"] = wanted
    # Of fitted parameters the middle of what the members have, which is in their records.
    for name in first.get("fitted", {}).get("names", ()):
        parameters[name] = median(one.record["parameters"][name] for one in runs)
    numbers = {int(one.record["replica"]) for one in runs}
    judged = verdict.quantities(case, kept.found, first["variant"], first["parameters"], _fitted(folder, first))
    return Result(
        case.name, first["variant"], first["engine"], judged, first["profile"],
        parameters=parameters, profiles=tuple(kept.found.profiles), remarks=_remarks(case, kept.found),
        picture=case.picture_of({**first["parameters"], **first["derived"]}), references=case.references, provenance=_provenance(runs),
        measured=kept.facts,
        inputs=tuple(one.record["inputs"] for one in runs if "inputs" in one.record),
        replicas_missing=tuple(number for number in range(1, (wanted or 0) + 1) if number not in numbers))


def _measure(folder: Path, case: Case, runs: Sequence[Replica], inputs_hash: str) -> measurement_file.Measured:
    (folder / measurement_file.FILE).unlink(missing_ok=True)
    files = []
    with analysis.collected_warnings() as warnings:
        found = measurement.measure(case, runs)
        if runs[0].record.get("fitted"):
            found = prediction.over_members(case, found, [measurement.measure(case, [one]) for one in runs])
        if found.fields is not None:
            # Of the extra `fields`, which cases without fields do without.
            from dembark.postproc.output.netcdf import write_netcdf

            files.append(FIELDS_FILE)
            write_netcdf(folder / FIELDS_FILE, found.fields)
        if found.surface is not None:
            from dembark.postproc.output.vtkhdf import write_surface

            files.append(SURFACE_FILE)
            write_surface(folder / SURFACE_FILE, found.surface)
    gone = filter(None, (analysis.departed(one.folder) for one in runs))
    noted = replace(found, remarks=[*found.remarks, *gone, *dict.fromkeys(warnings)], fields=None, surface=None)
    return measurement_file.write(folder, measurement_file.Measured(inputs_hash, noted, provenance.measured(), tuple(files)))


def _fitted(folder: Path, record: Mapping[str, Any]) -> Mapping[str, Any]:
    """What the parameters of the run with this `record` were fitted to, as `prediction.marked` takes it; empty where they were not: that of
    its posterior, or the targets of the campaign in whose folder it is, all of which is then the fitted experiment."""
    if "fitted" in record or len(folder.parents) < 3:
        return record.get("fitted", {})
    plan = results.plan(folder.parents[2])
    for sweep in plan.get("sweeps", ()):
        sampled = sweep.get("sample", {}).get("targets")
        targets = sampled or plan.get("fitted", {})
        if targets and sweep["case"] == record["case"] and any(point["variant"] == record["variant"] for point in sweep["points"]):
            return {"case": record["case"], "targets": targets, "conditions": {}, "sampled": bool(sampled)}
    return {}


def picture(folder: Path) -> Mapping[str, Any] | None:
    """How the report shows the replicas in `folder`, see `Case.picture_of`."""
    first = next(iter(replicas(folder)), None)
    return find(first.record["case"]).picture_of({**first.record["parameters"], **first.record["derived"]}) if first else None


def _remarks(case: Case, found: Measurement) -> tuple[str, ...]:
    return *found.remarks, *(f"{one['short']}: {one['statement']}" for one in case.references if one["statement"])


def study(planned: Study, folders: Sequence[Path]) -> Result:
    """A study of one engine from the measured variants in `folders`.

    RunError when one of them has no measurement or the case has no `study` in its measure.py.
    """
    absent = [folder for folder in folders if not (folder / METRICS).is_file()]
    if absent:
        raise RunError(f"study {planned.name} is incomplete", f"{absent[0]} has no {METRICS}", "every variant of a study is needed")
    points = [read(folder / METRICS) for folder in folders]
    first, case = points[0], find(points[0].case)
    found = measurement.study(case, planned, [as_json(point) for point in points])
    return Result(
        case.name, planned.folder_name, first.engine, verdict.quantities(case, found, planned.folder_name), first.profile,
        planned.title, planned.description, profiles=tuple(found.profiles), remarks=_remarks(case, found),
        references=case.references, provenance={"variants": list(planned.variants)}, measured=provenance.measured())


def worst(found: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """The largest errors and the fewest steps of a contact among what the integration monitors of some runs found.

    A run without contacts says 0 steps and does not count there.
    """
    errors = {name: max(one[name] for one in found if name in one) for name in ("position", "velocity", "spin")
              if any(name in one for one in found)}
    steps = [one["contact_steps"] for one in found if one.get("contact_steps")]
    return errors | ({"contact_steps": min(steps)} if steps else {})


def _provenance(runs: list[Replica]) -> dict[str, Any]:
    """That of the first replica, with what concerns all: seeds, wall time, mean speed, the worst of the steps."""
    record, every = runs[0].record, [one.record.get("provenance", {}) for one in runs]
    wall, speed = ([float(facts[key]) for facts in every if facts.get(key)] for key in ("wall_time", "particle_steps_per_second"))
    return {**{key: value for key, value in every[0].items() if key != "seed"},
            "seeds": [one.record.get("seed") for one in runs], "replicas": len(runs), "wall_time": sum(wall) if wall else None,
            **({"fitted": {key: runs[0].record["fitted"][key] for key in ("file", "sha256", "case", "variant", "engine", "names")}}
               if runs[0].record.get("fitted") else {}),
            "integration": worst([one.record.get("integration", {}) for one in runs]),
            "particle_steps_per_second": fmean(speed) if speed else None, "steps": record["steps"], "time_step": record["time_step"]}
