"""From a profile or a campaign to its runs: each point of a sweep is a variant with changes, with a folder name of its own."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from pathlib import Path
from typing import Any

from dembark.common.choices import Value, pick
from dembark.common.errors import DembarkError
from dembark.postproc.convergence import REFINEMENT
from dembark.validation import engines

from .plan import MOST_RUNS, Plan, Resources, Series, left_out, of_profile, series
from .spec import CampaignSpec, SweepSpec

LONGEST_NAME = 100
_DIGEST = 8


@dataclass(frozen=True)
class Point:
    """One point of a sweep: the folder name `variant` of its runs, the case's variant and profile that it changes, and what varies.

    `values` has the swept axes only, `changes` all differences from the variant; both in SI units, None = not set. `quantiles` are those
    of a sample.
    """

    sweep: SweepSpec
    variant: str
    base: str
    values: Mapping[str, Value]
    changes: Mapping[str, Value]
    resolved: Mapping[str, Value]
    quantiles: tuple[float, ...] = ()


def _word(value: Value) -> str:
    if value is None:
        return "auto"
    if isinstance(value, float):
        short = f"{value:g}"
        return short if float(short) == value else repr(value)
    return re.sub(r"[^A-Za-z0-9.+-]", "-", str(value))


def variant_name(base: str, values: Mapping[str, Value], prefix: str = "") -> str:
    """Name of a folder for the variant `base` with `values`: `dry_wall_friction=0.2_cylinder_radius=0.04`, at most 100 letters.

    A longer one is cut and ends in a checksum of the full name: different points have different names.
    """
    name = "_".join([*([prefix] if prefix else []), base, *(f"{key}={_word(value)}" for key, value in values.items())])
    if len(name) <= LONGEST_NAME:
        return name
    digest = hashlib.sha256(name.encode()).hexdigest()[:_DIGEST]
    return f"{name[:LONGEST_NAME - _DIGEST - 1]}_{digest}"


def _points(sweep: SweepSpec, where: str) -> Iterator[Point]:
    """Points of one sweep; two that come to the same numbers are a mistake."""
    seen: dict[tuple[Value, ...], str] = {}
    for base in sweep.variants:
        for number, (row, quantiles) in enumerate(zip(sweep.rows, sweep.drawn.quantiles if sweep.drawn else repeat(()), strict=False)):
            name = variant_name(base, row, sweep.name)
            try:
                changes, resolved = sweep.changes(base, row), sweep.resolved(base, row)
            except DembarkError as error:
                raise DembarkError(f"point {name} of {where}", str(error)) from None
            twin = seen.setdefault(tuple(resolved.values()), name)
            if twin != name:
                raise DembarkError(f"points {twin} and {name} are the same run", where, "remove one of them")
            own = _packings(sweep, number, changes, resolved, where)
            axes = {"variant": base, **row} if len(sweep.variants) > 1 else dict(row)
            yield Point(sweep, name, base, axes, {**changes, **own}, {**resolved, **own}, quantiles)


def _packings(sweep: SweepSpec, number: int, changes: Mapping[str, Value], resolved: Mapping[str, Value],
              where: str) -> Mapping[str, Value]:
    """The seed of the point with this `number` (from 0) of a calibration, whose packings are its own: some that all points shared would
    shift the results of all alike, and a fit would take that for an effect of the parameters. DembarkError for one that the case does not
    allow."""
    seed = resolved.get("seed")
    if not (sweep.sample and sweep.sample.targets) or not isinstance(seed, int) or "seed" in changes:
        return {}
    replicas = int(resolved.get("replicas") or 1)
    own, most = seed + number * replicas, sweep.case.parameters["seed"].max
    if most is not None and own > most:
        raise DembarkError(f"point {number + 1} of {where} has packings with the seeds {own} and on, the largest is {most:g}",
                           "each point of a calibration has packings of its own", "lower samples, replicas or the seed of the profile")
    return {"seed": own}


def points(spec: CampaignSpec) -> list[Point]:
    """All points of a campaign, every condition of the cases checked at each; no engine is needed for it.

    A point that an earlier sweep of the campaign has already takes over that one's folder name: it is run once. DembarkError for a
    point that breaks a condition, for two of a sweep that are the same, and for two that would share a folder although they differ.
    """
    found: list[Point] = []
    folders: dict[tuple[Value, ...], str] = {}
    for sweep in spec.sweeps:
        for point in _points(sweep, f"[{sweep.label}] of {spec.path}"):
            folder = folders.setdefault((sweep.case.name, *point.resolved.values()), point.variant)
            found.append(replace(point, variant=folder))
    _distinct(spec, found)
    runs = sum(len(point.sweep.engines) * int(point.resolved.get("replicas") or 1) for point in found)
    if runs > MOST_RUNS:
        raise DembarkError(f"{spec.path} has {runs} runs", "", f"a campaign may have {MOST_RUNS}: make several")
    return found


def _distinct(spec: CampaignSpec, found: Sequence[Point]) -> None:
    """DembarkError when two points that differ have one folder, or folders that differ in upper and lower case only."""
    named: dict[tuple[str, str], Point] = {}
    for point in found:
        other = named.setdefault((point.sweep.case.name, point.variant.lower()), point)
        if other.resolved != point.resolved:
            raise DembarkError(f"[{other.sweep.label}] and [{point.sweep.label}] of {spec.path} both have a point {point.variant}",
                               "with other values elsewhere (profile, fixed, replicas)", 'give one of them a name, name = "..."')


def _sweeps(spec: CampaignSpec, found: Sequence[Point]) -> list[dict[str, Any]]:
    """The sweeps for a JSON file: case, name, title, axes, sample, and their points with folder names and values in SI units."""
    return [{"case": sweep.case.name, "name": sweep.name or f"sweep {sweep.number}", "title": sweep.title, "axes": list(sweep.axes),
             "engines": list(sweep.engines), "profile": sweep.profile,
             **({"sample": sweep.sample.facts() | {"left_out": sweep.drawn.left_out}} if sweep.sample and sweep.drawn else {}),
             "points": [{"variant": point.variant, "base": point.base, "values": dict(point.values), "changes": dict(point.changes),
                         "formal_orders": _formal_orders(point), **({"quantiles": point.quantiles} if point.quantiles else {})}
                        for point in found if point.sweep is sweep]}
            for sweep in spec.sweeps]


def _formal_orders(point: Point) -> dict[str, float]:
    """Formal order of the scheme at a point, by the parameters of the method that vary; DembarkError when it is not a positive number."""
    found, where = {}, f"point {point.variant}"
    for axis in (axis for axis in point.sweep.axes if axis in REFINEMENT):
        expression = point.sweep.formal_order or point.sweep.case.formal_order(axis)
        order = expression.evaluated(point.resolved, "formal_order", where)
        if not isinstance(order, int | float) or not 0.0 < order < math.inf:
            raise DembarkError(f"formal_order = {expression.text!r} is {order}", where, "give a positive number, or an expression for one")
        found[axis] = float(order)
    return found


def campaign(spec: CampaignSpec, only_cases: Sequence[str] = (), only_engines: Sequence[str] = ()) -> Plan:
    """What the campaign `spec` runs, of all its cases and engines or only some; the engines that are needed have to be there."""
    for name in only_cases:
        pick(name, {sweep.case.name for sweep in spec.sweeps}, "case", f"in {spec.path}")
    for name in only_engines:
        pick(name, engines.names(), "engine", "in --engine")
    all_points = points(spec)
    found: dict[Path, Series] = {}
    resources: dict[Path, Resources] = {}
    for point in all_points:
        if only_cases and point.sweep.case.name not in only_cases:
            continue
        for engine in point.sweep.engines:
            place = Path(point.sweep.case.name, point.variant, engine)
            if place in found or (only_engines and engine not in only_engines):
                continue
            found[place] = series(point.sweep.case, point.base, point.sweep.profile, engines.find(engine), point.changes, point.variant)
            resources[place] = point.sweep.resources[engine]
    facts = {"campaign": spec.name, "description": spec.description, "sweeps": _sweeps(spec, all_points),
             **({"fitted": dict(spec.fitted)} if spec.fitted else {})}
    return Plan(spec.name, tuple(sorted(found.values(), key=lambda one: -one.cost)), facts, resources, spec.retries, spec.measure,
                _tables(spec))


def _tables(spec: CampaignSpec) -> tuple[Path, ...]:
    """The files of the targets; DembarkError for two of one name, for copies of them lie in one folder."""
    found: dict[str, Path] = {}
    for sweep in spec.sweeps:
        for path in (one.file for one in sweep.sample.targets.values() if one.file) if sweep.sample else ():
            if found.setdefault(path.name, path) != path:
                raise DembarkError(f"{found[path.name]} and {path} have one name", f"in {spec.path}", "rename one of them")
    return tuple(found.values())


def profile(name: str, cases: Sequence[str] = (), engines: Sequence[str] = ()) -> Plan:
    """What the cases list for the profile `name`: all of it, or that of some cases and engines."""
    runs, gone = tuple(of_profile(name, cases, engines)), left_out(name, cases, engines)
    return Plan(name, runs, {"profile": name, **({"cases": list(cases)} if cases else {}), **({"left_out": gone} if gone else {})})
