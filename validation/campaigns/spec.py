"""The file of a campaign: which cases, engines, parameters and replicas, and what a run may use. Read and checked."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

from dembark.common import units
from dembark.common.choices import Value, nearest, pick
from dembark.common.errors import DembarkError
from dembark.validation import engines
from dembark.validation.case.expressions import Expression
from dembark.validation.case.folders import discover, files, find
from dembark.validation.case.model import Case, checked
from dembark.validation.case.resolve import merged, resolve
from dembark.validation.case.tables import ORDER, Types, load_toml

from .plan import RETRIES, Resources
from .sample_reader import SampleReader
from .sampling import Drawn, Sample

MEASURE = "measure"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_PER_RUN = {"ranks": int, "threads": int, "memory": str, "time": str, "restart_interval": str}
_MEASURING = {"threads": int, "memory": str, "time": str}
_SWEEP: dict[str, Types] = {
    "case": str, "name": str, "title": str, "profile": str, "variant": str, "variants": list, "engines": list, "grid": dict, "list": list,
    "sample": dict, "fixed": dict, "derived": dict, "replicas": int, "resources": dict, "formal_order": ORDER}
# Keys of a sweep that [campaign] may give for all sweeps that do not have them.
_SHARED = ("case", "variants", "fixed", "derived")
_CAMPAIGN = {"name": str, "description": str, "profile": str, "engines": list, "replicas": int, "retries": int,
             **{key: _SWEEP[key] for key in _SHARED}}


@dataclass(frozen=True)
class SweepSpec:
    """One sweep: `rows` are the changes of its points, in SI units, to each of `variants`; `axes` are the names that vary, slowest first.

    `fixed` are changes of all points; `derived` are parameters that follow from the others of a point; `formal_order` is that of the scheme
    in a time step or stiffness that varies (None: as the case says). Where the rows are a `sample`, `drawn` has what is known of them.
    """

    number: int
    case: Case
    name: str
    title: str
    profile: str
    variants: tuple[str, ...]
    engines: tuple[str, ...]
    axes: tuple[str, ...]
    rows: tuple[Mapping[str, Value], ...]
    fixed: Mapping[str, Value]
    derived: Mapping[str, Expression]
    replicas: int | None
    resources: Mapping[str, Resources]
    formal_order: Expression | None = None
    sample: Sample | None = None
    drawn: Drawn | None = None

    @property
    def label(self) -> str:
        """How an error line calls it."""
        return f"sweeps {self.number}"

    def changes(self, base: str, row: Mapping[str, Value]) -> dict[str, Value]:
        """All differences of the point `row` from the variant `base`, in SI units; an expression may use those before it."""
        changes: dict[str, Value] = {**self.fixed, **row}
        if self.replicas is not None:
            changes["replicas"] = self.replicas
        for key, expression in self.derived.items():
            parameter = self.case.parameters[key]
            value = expression.evaluated(merged(self.case, self.profile, base, changes), key)
            if isinstance(value, bool | complex):
                raise DembarkError(f"{key} = {expression.text!r} is not a number")
            # Grains are counted: what comes out is the next whole number.
            counted = parameter.is_whole and isinstance(value, float) and math.isfinite(value)
            changes[key] = checked(parameter, round(value) if counted else value)
        return changes

    def resolved(self, base: str, row: Mapping[str, Value]) -> dict[str, Value]:
        """All parameters of the point `row` of the variant `base`; DembarkError where it breaks a condition."""
        return resolve(self.case, self.profile, base, self.changes(base, row))

    def broken(self, row: Mapping[str, Value], variants: Iterable[str] = ()) -> str:
        """The condition that the point `row` breaks in one of `variants`, of all when none is named; "" for none."""
        try:
            for base in variants or self.variants:
                self.resolved(base, row)
        except DembarkError as error:
            return str(error)
        return ""

    def sampled(self, sample: Sample) -> SweepSpec:
        """The sweep with the points of `sample`, each of which is allowed in all variants."""
        drawn = sample.draw(self.broken)
        return replace(self, rows=drawn.rows, sample=sample, drawn=drawn)


@dataclass(frozen=True)
class CampaignSpec:
    """A checked campaign file; `measure` is what the job of a cluster may use that measures and writes the report, `fitted` are the targets
    that its parameters were fitted to, in a file that a calibration wrote."""

    path: Path
    name: str
    description: str
    retries: int
    sweeps: tuple[SweepSpec, ...]
    measure: Resources
    fitted: Mapping[str, Any] = field(default_factory=dict)


def shipped_campaigns() -> dict[str, Path]:
    """The campaigns that lie in the case folders, by name."""
    return {path.stem: path for case in files() for path in sorted(case.parent.glob("campaigns/*.toml"))}


def locate(name: str) -> Path:
    """File of a campaign given as a path or as the name of one that lies in a case folder; DembarkError naming near matches."""
    path = Path(name)
    if path.is_file():
        return path.resolve()
    known = shipped_campaigns()
    if name in known:
        return known[name].resolve()
    if path.is_dir():
        raise DembarkError(f"{name} is a folder", "", "give the campaign's file; to go on with a campaign: dembark resume FOLDER")
    if path.suffix == ".toml" and str(path.parent) != ".":
        raise DembarkError(f"there is no file {name}", "", nearest(path.name, (one.name for one in path.parent.glob("*.toml"))))
    raise DembarkError(f"there is no campaign {name!r}", "neither as a file nor in a case folder", nearest(path.stem, known))


def read(path: Path) -> CampaignSpec:
    """The campaign in the file `path`; DembarkError with one line for the first mistake in it.

    Checked are all keys, types, units, ranges and names, and the conditions of the cases at every point (by `expand.points`).
    """
    data = load_toml(path)
    _refuse_decimal_commas(path)
    return _Reader(path).campaign(data)


def _refuse_decimal_commas(path: Path) -> None:
    """DembarkError for a list such as `[0,15, 0.3]`: TOML reads three numbers where two were meant."""
    lines = path.read_text(encoding="utf-8").splitlines()
    bare = "\n".join(re.sub(r"\"[^\"]*\"|'[^']*'|#.*", '""', line) for line in lines)
    for part in re.finditer(r"\[[^\[\]]*\]", bare):
        tight = re.search(r"\b(\d+),(\d+)\b", part.group())
        if tight and re.search(r",\s", part.group()):
            first, second = tight.groups()
            raise DembarkError(f"{tight.group()!r} in a list: write {first}.{second}, or {first}, {second} if these are two numbers",
                               f"line {bare.count(chr(10), 0, part.start() + tight.start()) + 1} of {path}")


class _Reader(SampleReader):
    """Turns the tables of one campaign file into a CampaignSpec; each mistake names the table it is in."""

    def campaign(self, data: Mapping[str, Any]) -> CampaignSpec:
        self.table(data, "top level", {"campaign": dict, "sweeps": list, "resources": dict, "posterior": dict}, ("campaign", "sweeps"))
        head, resources = data["campaign"], data.get("resources", {})
        self.table(head, "campaign", _CAMPAIGN, ("name",))
        self.folder_name("campaign", head["name"])
        head = self.named(head["name"]) | head
        if not data["sweeps"]:
            raise self.fail("sweeps", "there are no sweeps", "add a table [[sweeps]]")
        if "profile" in head:
            self.pick(head["profile"], {name for case in discover().values() for name in case.profiles}, "profile", "campaign")
        self.least("campaign", head, replicas=1, retries=0)
        self.names("campaign", head, "engines", engines.names(), "engine")
        measure = resources.get(MEASURE, {})
        self.table(measure, f"resources.{MEASURE}", _MEASURING)
        base = self.resources("resources", {key: value for key, value in resources.items() if key != MEASURE},
                              dict.fromkeys(engines.names(), Resources()))
        return CampaignSpec(
            self.path, head["name"], head.get("description", "").strip(), head.get("retries", RETRIES),
            tuple(self.sweep(f"sweeps {number}", number, entry, head, base) for number, entry in enumerate(data["sweeps"], start=1)),
            self.changed(f"resources.{MEASURE}", Resources(), measure), data.get("posterior", {}).get("targets", {}))

    def named(self, name: str) -> dict[str, str]:
        """Case and profile that the name of a campaign, CASE-PROFILE, gives to all sweeps that name none."""
        case, _, profile = name.rpartition("-")
        if case not in {path.parent.name for path in files()}:
            return {}
        return {"case": case} | ({"profile": profile} if profile in find(case).profiles else {})

    def folder_name(self, table: str, text: str) -> None:
        if not _NAME.fullmatch(text):
            raise self.fail(table, f"name = {text!r} is not a name of a folder", "give up to 64 letters, digits, '.', '_' and '-'")

    def names(self, table: str, data: Mapping[str, Any], key: str, known: Iterable[str], what: str) -> tuple[str, ...]:
        """The list `key` of different ones among `known`; empty when it is not given."""
        if key not in data:
            return ()
        given, known = data[key], list(known)
        if not given:
            raise self.fail(table, f"{key} = [] is empty", f"name one or more of {', '.join(known)}, or leave it out")
        for one in given:
            self.pick(one if isinstance(one, str) else str(one), known, what, table)
        if len(set(given)) < len(given):
            raise self.fail(table, f"{key} names {max(given, key=given.count)} twice", "name each once")
        return tuple(given)

    def one_of(self, table: str, data: Mapping[str, Any], one: str, other: str, right: str) -> None:
        if one in data and other in data:
            raise self.fail(table, f"{one} and {other} are both given", right)

    def sweep(self, table: str, number: int, entry: Any, head: Mapping[str, Any], base: Mapping[str, Resources]) -> SweepSpec:
        if not isinstance(entry, dict):
            raise self.fail("sweeps", f"{entry!r} is not a sweep", "write each as a table [[sweeps]]")
        shared = {key: head[key] for key in _SHARED if key in head and not (key == "variants" and "variant" in entry)}
        entry = shared | entry
        self.table(entry, table, _SWEEP, ("case",))
        self.folder_name(table, entry.get("name", "unnamed"))
        case = find(self.pick(entry["case"], (path.parent.name for path in files()), "case", table))
        profile = entry.get("profile", head.get("profile"))
        if profile is None:
            raise self.fail(table, "profile is missing", f"name it here or in [campaign]: {', '.join(case.profiles)}")
        pick(profile, case.profiles, "profile", f"{self.where(table)}, case {case.name}")
        fixed, rows = self.values(f"{table}.fixed", entry.get("fixed", {}), case), self.rows(table, entry, case)
        sample = self.sample(f"{table}.sample", entry["sample"], case) if "sample" in entry else None
        axes = tuple(sample.variables if sample else rows[0])
        for key in fixed.keys() & set(axes):
            raise self.fail(f"{table}.fixed", f"{key} is fixed and varies", "remove it from one of the two")
        self.one_of(table, entry, "variant", "variants", "give one of them")
        one = {"variants": [entry["variant"]]} if "variant" in entry else entry
        variants = self.names(table, one, "variants", case.variants, "variant")
        if not axes and not variants:
            raise self.fail(table, "nothing varies", "give grid, list, sample or variants")
        variants = variants or (next(iter(case.variants)),)
        chosen = self.names(table, entry, "engines", case.engines, "engine")
        spec = SweepSpec(
            number, case, entry.get("name", ""), entry.get("title", ""), profile, variants, chosen,
            (*(("variant",) if len(variants) > 1 else ()), *axes), tuple(rows), fixed,
            self.derived(f"{table}.derived", entry.get("derived", {}), {*axes, *fixed}, case),
            self.replicas(table, entry, case, head), self.resources(f"{table}.resources", entry.get("resources", {}), base),
            self.order(table, entry, case.parameters))
        if sample:
            try:
                spec = spec.sampled(sample)
            except DembarkError as error:
                raise self.fail(f"{table}.sample", str(error)) from None
        return spec if spec.engines else replace(spec, engines=self.capable(table, spec, head))

    def capable(self, table: str, spec: SweepSpec, head: Mapping[str, Any]) -> tuple[str, ...]:
        """The engines of a sweep that names none: those of the campaign that the case has, else all of the case that can do all points;
        optional ones have to be named, so that a campaign is the same on every machine."""
        case = spec.case
        needed = [merged(case, spec.profile, one, {**spec.fixed, **row}) for one in spec.variants for row in spec.rows]
        chosen = tuple(name for name in case.engines if (name in head["engines"] if "engines" in head else
                                                         not engines.facts(name).optional
                                                         and not any(case.missing_capabilities(name, values) for values in needed)))
        if not chosen:
            raise self.fail(table, f"case {case.name} runs in none of the campaign's engines", f"it runs in {', '.join(case.engines)}")
        return chosen

    def replicas(self, table: str, entry: Mapping[str, Any], case: Case, head: Mapping[str, Any]) -> int | None:
        self.least(table, entry, replicas=1)
        if "replicas" in case.parameters:
            return entry.get("replicas", head.get("replicas"))
        if entry.get("replicas", 1) > 1:
            raise self.fail(table, f"replicas = {entry['replicas']}, but nothing in case {case.name} is random", "leave it out")
        return None

    def rows(self, table: str, entry: Mapping[str, Any], case: Case) -> list[dict[str, Value]]:
        """Changes of each point; all have the same parameters."""
        for one, other in combinations(("grid", "list", "sample"), 2):
            self.one_of(table, entry, one, other, "give one of them, or make two sweeps")
        if "grid" in entry:
            return self.grid(f"{table}.grid", entry["grid"], case)
        return self.listed(table, entry["list"], case) if "list" in entry else [{}]

    def grid(self, table: str, grid: Mapping[str, Any], case: Case) -> list[dict[str, Value]]:
        rows: list[dict[str, Value]] = [{}]
        if not grid:
            raise self.fail(table, "the grid is empty", "give it a parameter with a list of values")
        for key, given in grid.items():
            self.known(table, key, case)
            if not isinstance(given, list):
                raise self.fail(table, f"{key} = {given!r} is not a list", f"write {key} = [...], or move it to fixed")
            if not given:
                raise self.fail(table, f"{key} = [] has no values", "give it one or more")
            values = [self.values(table, {key: one}, case) for one in given]
            for index, value in enumerate(values):
                if value in values[:index]:
                    raise self.fail(table, f"{key} has the value {given[index]!r} twice", "give each once")
            rows = [row | value for row in rows for value in values]
        return rows

    def listed(self, table: str, entries: list[Any], case: Case) -> list[dict[str, Value]]:
        if not entries:
            raise self.fail(table, "list = [] has no points", "give it one or more tables {...}")
        rows: list[dict[str, Value]] = []
        for index, entry in enumerate(entries, start=1):
            place = f"{table}.list {index}"
            if not isinstance(entry, dict) or not entry:
                raise self.fail(place, f"{entry!r} is not a point", "write a table {parameter = value, ...}")
            row = self.values(place, entry, case)
            if rows and row.keys() != rows[0].keys():
                raise self.fail(place, f"a point with {', '.join(row)}", f"all must have the first one's {', '.join(rows[0])}")
            if row in rows:
                raise self.fail(place, f"the point is that of {table}.list {rows.index(row) + 1} again", "remove one")
            rows.append({key: row[key] for key in rows[0]} if rows else row)
        return rows

    def derived(self, table: str, texts: Mapping[str, Any], given: Collection[str], case: Case) -> dict[str, Expression]:
        """Parameters of a sweep that are given by expressions in the others."""
        for key, text in texts.items():
            self.known(table, key, case)
            if key in given:
                raise self.fail(table, f"{key} is derived and given", "remove it from one of the two")
            if not isinstance(text, str):
                raise self.fail(table, f"{key} = {text!r} has the wrong type", "write an expression in a text, or move it to fixed")
        return {key: self.expression(table, text, case.parameters) for key, text in texts.items()}

    def values(self, table: str, entry: Mapping[str, Any], case: Case) -> dict[str, Value]:
        for key, given in entry.items():
            self.known(table, key, case)
            if isinstance(given, bool) or not isinstance(given, int | float | str):
                raise self.fail(table, f"{key} = {given!r} has the wrong type", "give a number or a text")
        return {key: self.value(table, case.parameters[key], given) for key, given in entry.items()}

    def resources(self, table: str, data: Mapping[str, Any], base: Mapping[str, Resources]) -> dict[str, Resources]:
        """Resources of each engine: keys of `data` count for all engines, its tables for one; `base` are the defaults."""
        self.table(data, table, _PER_RUN | dict.fromkeys(engines.names(), dict))
        common = {key: value for key, value in data.items() if key in _PER_RUN}
        self.changed(table, Resources(), common)
        found = {}
        for engine in engines.names():
            facts, own = engines.facts(engine), data.get(engine, {})
            self.table(own, f"{table}.{engine}", _PER_RUN)
            # What is said for all engines cannot mean ranks for the one that has none.
            shared = {key: value for key, value in common.items() if key != "ranks" or facts.ranks}
            one = found[engine] = self.changed(f"{table}.{engine}", base[engine], shared | own)
            place = f"{table}.{engine}" if own else table
            if one.ranks > 1 and not facts.ranks:
                raise self.fail(place, f"ranks = {one.ranks} for {engine}", f"use threads: {facts.one_process}")
            if one.time is not None and one.restart_interval is not None and one.restart_interval >= one.time:
                raise self.fail(place, "restart_interval is not shorter than time", "a run must write a restart file before its time ends")
        return found

    def changed(self, table: str, base: Resources, data: Mapping[str, Any]) -> Resources:
        """`base` with the numbers that the texts of `data` mean."""
        self.least(table, data, ranks=1, threads=1)
        read = {"memory": units.size, "time": units.seconds, "restart_interval": units.seconds}
        try:
            numbers: dict[str, Any] = {key: read[key](value) if key in read else value for key, value in data.items()}
        except DembarkError as error:
            raise self.fail(table, str(error)) from None
        return replace(base, **numbers)
