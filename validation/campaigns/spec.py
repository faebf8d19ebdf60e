"""The file of a campaign: which cases, engines, parameters and replicas, and what a run may use. Read and checked as a whole."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from dembark.common.choices import Value, nearest, pick
from dembark.common.errors import DembarkError
from dembark.validation import engines
from dembark.validation.campaigns import sizes
from dembark.validation.case.expressions import Expression
from dembark.validation.case.folders import discover, files, find
from dembark.validation.case.model import Case
from dembark.validation.case.parameters import checked
from dembark.validation.case.tables import TableReader, load_toml
from dembark.validation.runs.plan import RETRIES, Resources

MEASURE = "measure"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_PER_RUN = {"ranks": int, "threads": int, "memory": str, "time": str, "restart_interval": str}
_MEASURING = {"memory": str, "time": str}
_SWEEP = {"case": str, "name": str, "title": str, "profile": str, "variant": str, "variants": list, "engines": list, "grid": dict,
          "list": list, "fixed": dict, "derived": dict, "replicas": int, "resources": dict}
_CAMPAIGN = {"name": str, "description": str, "profile": str, "engines": list, "replicas": int, "retries": int}


@dataclass(frozen=True)
class SweepSpec:
    """One sweep: `rows` are the changes of its points, in SI units, to each of `variants`; `axes` are the names that vary, slowest first.

    `fixed` are changes of all points; `derived` are parameters that follow from the others of a point.
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

    @property
    def label(self) -> str:
        """How an error line calls it."""
        return f"sweeps {self.number}"


@dataclass(frozen=True)
class CampaignSpec:
    """A checked campaign file; `measure` is what measuring may use as a job of its own, None when the submitting host measures."""

    path: Path
    name: str
    description: str
    retries: int
    sweeps: tuple[SweepSpec, ...]
    measure: Resources | None = None


def shipped() -> dict[str, Path]:
    """The campaigns that lie in the case folders, by name."""
    return {path.stem: path for case in files() for path in sorted(case.parent.glob("campaigns/*.toml"))}


def locate(name: str) -> Path:
    """File of a campaign given as a path or as the name of one that lies in a case folder; DembarkError naming near matches."""
    path = Path(name)
    if path.is_file():
        return path.resolve()
    known = shipped()
    if name in known:
        return known[name].resolve()
    if path.is_dir():
        raise DembarkError(f"{name} is a folder", "", "give the campaign's file; to go on with a campaign: dembark resume FOLDER")
    if path.suffix == ".toml" and str(path.parent) != ".":
        raise DembarkError(f"there is no file {name}", "", nearest(path.name, (one.name for one in path.parent.glob("*.toml"))))
    raise DembarkError(f"there is no campaign {name!r}", "neither a file nor one that lies in a case folder", nearest(path.stem, known))


def read(path: Path) -> CampaignSpec:
    """The campaign in the file `path`; DembarkError with one line for the first mistake in it.

    Checked are all keys, types, units, ranges and names, and the conditions of the cases at every point (by `expand.points`).
    """
    data = load_toml(path)
    _refuse_decimal_commas(path)
    return _Reader(path).campaign(data)


def _refuse_decimal_commas(path: Path) -> None:
    """DembarkError for a list such as `[0,15, 0.3]`: TOML reads three numbers where two were meant."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        bare = re.sub(r"\"[^\"]*\"|'[^']*'|#.*", '""', line)
        for part in re.findall(r"\[[^\[\]]*\]", bare):
            tight = re.search(r"\b(\d+),(\d+)\b", part)
            if tight and re.search(r",\s", part):
                first, second = tight.groups()
                raise DembarkError(f"{tight.group()!r} in a list: write {first}.{second}, or {first}, {second} if these are two numbers",
                                   f"line {number} of {path}")


@dataclass
class _Defaults:
    """What [campaign] and [resources] say for all sweeps."""

    profile: str | None
    engines: tuple[str, ...] | None
    replicas: int | None
    resources: dict[str, Resources] = field(default_factory=dict)


class _Reader(TableReader):
    """Turns the tables of one campaign file into a CampaignSpec; each mistake names the table it is in."""

    def campaign(self, data: Mapping[str, Any]) -> CampaignSpec:
        self.table(data, "top level", {"campaign": dict, "sweeps": list, "resources": dict}, ("campaign", "sweeps"))
        head = data["campaign"]
        self.table(head, "campaign", _CAMPAIGN, ("name",))
        self.name("campaign", head["name"])
        if not data["sweeps"]:
            raise self.fail("sweeps", "there are no sweeps", "add a table [[sweeps]]")
        if "profile" in head:
            pick(head["profile"], {name for case in discover().values() for name in case.profiles}, "profile", self.where("campaign"))
        self.least("campaign", head, "replicas", 1)
        self.least("campaign", head, "retries", 0)
        tables = data.get("resources", {})
        defaults = _Defaults(head.get("profile"), self.engines("campaign", head, engines.names()), head.get("replicas"),
                             self.resources("resources", tables, {name: Resources() for name in engines.names()}, measuring=True))
        sweeps = tuple(self.sweep(number, entry, defaults) for number, entry in enumerate(data["sweeps"], start=1))
        measure = self.measuring(tables[MEASURE]) if MEASURE in tables else None
        return CampaignSpec(self.path, head["name"], head.get("description", "").strip(), head.get("retries", RETRIES), sweeps, measure)

    def name(self, table: str, text: str) -> None:
        if not _NAME.fullmatch(text):
            raise self.fail(table, f"name = {text!r} is no name of a folder", "wanted are up to 64 letters, digits, '.', '_' and '-'")

    def least(self, table: str, data: Mapping[str, Any], key: str, low: int) -> None:
        if key in data and data[key] < low:
            raise self.fail(table, f"{key} = {data[key]} is out of range", f"allowed is >= {low}")

    def names(self, table: str, key: str, given: list[Any], known: Iterable[str], what: str) -> tuple[str, ...]:
        """`given` if it is a list of different ones among `known`."""
        known = list(known)
        if not given:
            raise self.fail(table, f"{key} = [] is empty", f"name one or more of {', '.join(known)}, or leave it out")
        for one in given:
            pick(one if isinstance(one, str) else str(one), known, what, self.where(table))
        if len(set(given)) < len(given):
            raise self.fail(table, f"{key} names {max(given, key=given.count)} twice", "name each once")
        return tuple(given)

    def engines(self, table: str, data: Mapping[str, Any], known: Iterable[str]) -> tuple[str, ...] | None:
        return self.names(table, "engines", data["engines"], known, "engine") if "engines" in data else None

    def sweep(self, number: int, entry: Any, defaults: _Defaults) -> SweepSpec:
        table = f"sweeps {number}"
        if not isinstance(entry, dict):
            raise self.fail("sweeps", f"{entry!r} is no sweep", "write each as a table [[sweeps]]")
        self.table(entry, table, _SWEEP, ("case",))
        if "name" in entry:
            self.name(table, entry["name"])
        pick(entry["case"], (path.parent.name for path in files()), "case", self.where(table))
        case = find(entry["case"])
        profile = entry.get("profile", defaults.profile)
        if profile is None:
            raise self.fail(table, "profile is missing", f"name it here or in [campaign]: {', '.join(case.profiles)}")
        pick(profile, case.profiles, "profile", f"{self.where(table)}, case {case.name}")
        rows, axes = self.rows(table, entry, case)
        variants = self.variants(table, entry, case)
        if rows == [{}] and not ("variant" in entry or "variants" in entry):
            raise self.fail(table, "nothing varies", "give grid, list or variants")
        return SweepSpec(
            number, case, entry.get("name", ""), entry.get("title", ""), profile, variants, self.chosen(table, entry, case, defaults),
            (*(("variant",) if len(variants) > 1 else ()), *axes), tuple(rows), self.values(f"{table}.fixed", entry.get("fixed", {}), case),
            self.derived(f"{table}.derived", entry, rows[0], case), self.replicas(table, entry, case, defaults),
            self.resources(f"{table}.resources", entry.get("resources", {}), defaults.resources))

    def chosen(self, table: str, entry: Mapping[str, Any], case: Case, defaults: _Defaults) -> tuple[str, ...]:
        """Engines of a sweep: its own, else those of the campaign that the case has, else all of the case."""
        own = self.engines(table, entry, case.engines)
        found = own or tuple(name for name in case.engines if name in (defaults.engines or case.engines))
        if not found:
            raise self.fail(table, f"case {case.name} runs in none of the campaign's engines", f"it runs in {', '.join(case.engines)}")
        return found

    def replicas(self, table: str, entry: Mapping[str, Any], case: Case, defaults: _Defaults) -> int | None:
        self.least(table, entry, "replicas", 1)
        if "replicas" in case.parameters:
            return entry.get("replicas", defaults.replicas)
        if entry.get("replicas", 1) > 1:
            raise self.fail(table, f"replicas = {entry['replicas']}, but nothing in case {case.name} is random", "leave it out")
        return None

    def variants(self, table: str, entry: Mapping[str, Any], case: Case) -> tuple[str, ...]:
        if "variant" in entry and "variants" in entry:
            raise self.fail(table, "variant and variants are both given", "give one of them")
        given = [entry["variant"]] if "variant" in entry else entry.get("variants", [next(iter(case.variants))])
        return self.names(table, "variants", given, case.variants, "variant")

    def rows(self, table: str, entry: Mapping[str, Any], case: Case) -> tuple[list[dict[str, Value]], tuple[str, ...]]:
        """Changes of each point and the names of the parameters that vary."""
        if "grid" in entry and "list" in entry:
            raise self.fail(table, "grid and list are both given", "give one of them, or make two sweeps")
        rows: list[dict[str, Value]] = [{}]
        if "grid" in entry:
            rows = self.grid(table, entry["grid"], case)
        elif "list" in entry:
            rows = self.listed(table, entry["list"], case)
        axes = tuple(rows[0])
        for key in entry.get("fixed", {}):
            if key in axes:
                raise self.fail(f"{table}.fixed", f"{key} is fixed and varies", "remove it from one of the two")
        return rows, axes

    def grid(self, table: str, grid: Mapping[str, Any], case: Case) -> list[dict[str, Value]]:
        rows: list[dict[str, Value]] = [{}]
        if not grid:
            raise self.fail(f"{table}.grid", "the grid is empty", "give it a parameter with a list of values")
        for key, given in grid.items():
            self.known(f"{table}.grid", key, case)
            if not isinstance(given, list):
                raise self.fail(f"{table}.grid", f"{key} = {given!r} is no list", f"write {key} = [...], or move it to fixed")
            if not given:
                raise self.fail(f"{table}.grid", f"{key} = [] has no values", "give it one or more")
            values = [self.value(f"{table}.grid", key, one, case) for one in given]
            for index, value in enumerate(values):
                if value in values[:index]:
                    raise self.fail(f"{table}.grid", f"{key} has the value {given[index]!r} twice", "give each once")
            rows = [row | {key: value} for row in rows for value in values]
        return rows

    def listed(self, table: str, entries: list[Any], case: Case) -> list[dict[str, Value]]:
        if not entries:
            raise self.fail(table, "list = [] has no points", "give it one or more tables {...}")
        rows: list[dict[str, Value]] = []
        for index, entry in enumerate(entries, start=1):
            if not isinstance(entry, dict) or not entry:
                raise self.fail(f"{table}.list {index}", f"{entry!r} is no point", "wanted is a table {parameter = value, ...}")
            row = self.values(f"{table}.list {index}", entry, case)
            if rows and row.keys() != rows[0].keys():
                right = f"all must have the first one's {', '.join(rows[0])}"
                raise self.fail(f"{table}.list {index}", f"a point with {', '.join(row)}", right)
            if row in rows:
                raise self.fail(f"{table}.list {index}", f"the point is that of {table}.list {rows.index(row) + 1} again", "remove one")
            rows.append({key: row[key] for key in rows[0]} if rows else row)
        return rows

    def derived(self, table: str, entry: Mapping[str, Any], row: Mapping[str, Value], case: Case) -> dict[str, Expression]:
        """Parameters of a sweep that are given by expressions in the others."""
        found = {}
        for key, text in entry.get("derived", {}).items():
            self.known(table, key, case)
            if key in row or key in entry.get("fixed", {}):
                raise self.fail(table, f"{key} is derived and given", "remove it from one of the two")
            if not isinstance(text, str):
                raise self.fail(table, f"{key} = {text!r} has the wrong type", 'wanted is an expression in a text, or move it to fixed')
            try:
                found[key] = Expression(text)
            except DembarkError as error:
                raise self.fail(table, f"{key}: {error}") from None
            for name in sorted(found[key].names):
                pick(name, case.parameters, "parameter", f"in {key} = {text!r}, {self.where(table)}")
        return found

    def known(self, table: str, key: str, case: Case) -> None:
        if key == "replicas":
            raise self.fail(table, "replicas is no parameter of a sweep", "write replicas = ... in [[sweeps]] or [campaign]")
        pick(key, case.parameters, "parameter", f"{self.where(table)}, case {case.name}")

    def values(self, table: str, entry: Mapping[str, Any], case: Case) -> dict[str, Value]:
        for key in entry:
            self.known(table, key, case)
        return {key: self.value(table, key, value, case) for key, value in entry.items()}

    def value(self, table: str, key: str, given: Any, case: Case) -> Value:
        if isinstance(given, bool) or not isinstance(given, int | float | str):
            raise self.fail(table, f"{key} = {given!r} has the wrong type", "wanted is a number or a text")
        try:
            return checked(case.parameters[key], given)
        except DembarkError as error:
            raise self.fail(table, str(error)) from None

    def resources(self, table: str, data: Mapping[str, Any], base: Mapping[str, Resources],
                  measuring: bool = False) -> dict[str, Resources]:
        """Resources of each engine: keys of `data` count for all engines, its tables for one; `base` are the defaults."""
        self.table(data, table, _PER_RUN | dict.fromkeys((*engines.names(), *((MEASURE,) if measuring else ())), dict))
        common = {key: value for key, value in data.items() if key in _PER_RUN}
        self.checked_resources(table, common)
        found = {}
        for engine in engines.names():
            own = data.get(engine, {})
            self.table(own, f"{table}.{engine}", _PER_RUN)
            place = f"{table}.{engine}" if own else table
            # What is said for all engines cannot mean ranks for the one that has none.
            shared = {key: value for key, value in common.items() if key != "ranks" or engines.facts(engine).ranks}
            found[engine] = replace(base[engine], **self.checked_resources(f"{table}.{engine}", shared | own))
            self.fitting(place, engine, found[engine])
        return found

    def checked_resources(self, table: str, data: Mapping[str, Any]) -> dict[str, Any]:
        """The numbers that the texts of `data` mean."""
        for key in ("ranks", "threads"):
            self.least(table, data, key, 1)
        read = {"memory": sizes.size, "time": sizes.seconds, "restart_interval": sizes.seconds}
        try:
            return {key: read[key](value) if key in read else value for key, value in data.items()}
        except DembarkError as error:
            raise self.fail(table, str(error)) from None

    def fitting(self, table: str, engine: str, found: Resources) -> None:
        facts = engines.facts(engine)
        if found.ranks > 1 and not facts.ranks:
            raise self.fail(table, f"ranks = {found.ranks} for {engine}", f"use threads: {facts.one_process}")
        if found.time is not None and found.restart_interval is not None and found.restart_interval >= found.time:
            raise self.fail(table, "restart_interval is not shorter than time", "a run that is ended must have written a restart file")

    def measuring(self, data: Mapping[str, Any]) -> Resources:
        self.table(data, f"resources.{MEASURE}", _MEASURING)
        return replace(Resources(), **self.checked_resources(f"resources.{MEASURE}", data))
