"""Cases as data: find the folders that hold a `case.toml`, read them and check that what they declare makes sense."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError
from dembark.common.units import known_unit
from dembark.validation.expressions import Expression
from dembark.validation.parameters import Parameter, Value, checked, nearest, pick
from dembark.validation.tables import TableReader, load_toml

ENGINES = ("liggghts", "yade")
STUDY_PREFIX = "study-"
# What a deck may be asked to write, and the file that it goes to; a case asks for the first three unless it says otherwise.
OUTPUTS = {"grains": "grains.dump", "contacts": "contacts.dump", "times": "time.csv", "impacts": "impacts.txt"}
STANDARD_OUTPUTS = ("grains", "contacts", "times")


@dataclass(frozen=True)
class Constraint:
    """A condition between parameters and the sentence for whoever breaks it."""

    expression: Expression
    message: str


@dataclass(frozen=True)
class PlannedRun:
    """One line of `[runs]`: a variant, the engines it runs in, and how many replicas where that differs from the profile's number."""

    variant: str
    engines: tuple[str, ...]
    replicas: Mapping[str, int] = field(default_factory=dict)

    def changes(self, engine: str) -> dict[str, Value]:
        """What this line changes of the variant's parameters in `engine`."""
        return {"replicas": self.replicas[engine]} if engine in self.replicas else {}


@dataclass(frozen=True)
class Study:
    """Variants that differ in one parameter, `along`, and are looked at together, in this order."""

    name: str
    title: str
    description: str
    along: str
    variants: tuple[str, ...]

    @property
    def folder_name(self) -> str:
        """Its place beside the variants in the results."""
        return STUDY_PREFIX + self.name


@dataclass(frozen=True)
class Case:
    """A case folder: its parameters, profiles and variants (overrides of parameters by name), and what a profile runs."""

    name: str
    title: str
    description: str
    source: tuple[str, ...]
    engines: tuple[str, ...]
    folder: Path
    parameters: Mapping[str, Parameter]
    profiles: Mapping[str, Mapping[str, Value]]
    variants: Mapping[str, Mapping[str, Value]]
    runs: Mapping[str, tuple[PlannedRun, ...]]
    constraints: tuple[Constraint, ...] = ()
    studies: Mapping[str, Study] = field(default_factory=dict)
    outputs: tuple[str, ...] = STANDARD_OUTPUTS
    particles: Expression | None = None

    def deck(self, engine: str) -> Path:
        """Deck of `engine` in this folder."""
        return self.folder / {"liggghts": "liggghts.in", "yade": "yade.py"}[engine]

    def particle_count(self, values: Mapping[str, Value]) -> int | None:
        """Number of bodies in a run with these parameters; None when the case does not say."""
        found = self.particles(values) if self.particles else None
        if found is None:
            found = values.get("grain_count", values.get("log_count"))
        return round(found) if isinstance(found, int | float) else None


def checkout() -> Path | None:
    """Top of the source tree this package runs from; None for an installed copy."""
    root = Path(__file__).resolve().parents[1]
    return root if (root / "pyproject.toml").is_file() else None


def deck_root() -> Path:
    """Folder of the case folders: `DEMBARK_DECKS`, else the checkout's or installed `input_decks`, else the one below here."""
    named = os.environ.get("DEMBARK_DECKS")
    if named:
        if not Path(named).is_dir():
            raise DembarkError(f"DEMBARK_DECKS={named} is no folder", "", "set it to the folder that holds the case folders")
        return Path(named).resolve()
    # The decks lie beside this package in a checkout and in an installed copy alike.
    for place in (Path(__file__).resolve().parents[1] / "input_decks", Path.cwd() / "input_decks"):
        if place.is_dir():
            return place.resolve()
    raise DembarkError("no folder input_decks found", "", "set DEMBARK_DECKS to the folder that holds the case folders")


def discover(root: Path | None = None) -> dict[str, Case]:
    """All cases below `root` (default: `deck_root()`) by name; raises DembarkError at the first case.toml with a mistake."""
    base = root or deck_root()
    found = {}
    for path in sorted(base.glob("*/case.toml")):
        case = load(path)
        found[case.name] = case
    return found


def find(name: str, root: Path | None = None) -> Case:
    """The case called `name`; only its own file is read, so a mistake in another case does not matter."""
    base = root or deck_root()
    pick(name, [path.parent.name for path in base.glob("*/case.toml")], "case", f"in {base}")
    return load(base / name / "case.toml")


@cache
def load(path: Path) -> Case:
    """Read and check one case.toml; raises DembarkError saying what is wrong in which table."""
    return _Reader(path).case(load_toml(path))


class _Reader(TableReader):
    """Turns the tables of one case.toml into a Case; each mistake names the table it is in."""

    def case(self, data: Mapping[str, Any]) -> Case:
        tables = {"case": dict, "parameters": dict, "profiles": dict, "variants": dict, "runs": dict, "constraints": list, "studies": dict}
        self.table(data, "top level", tables, ("case", "parameters"))
        head = data["case"]
        keys = {"name": str, "title": str, "description": str, "source": list, "engines": list, "outputs": list, "particles": str}
        self.table(head, "case", keys, ("name", "title", "engines"))
        if head["name"] != self.path.parent.name:
            raise self.fail("case", f"name = {head['name']!r}", f"the name of its folder, {self.path.parent.name!r}")
        for engine in head["engines"]:
            pick(engine, ENGINES, "engine", f"[case] of {self.path}")
        outputs = tuple(head.get("outputs", STANDARD_OUTPUTS))
        for output in outputs:
            pick(output, OUTPUTS, "output", f"[case] of {self.path}")
        if not outputs or len(set(outputs)) < len(outputs):
            raise self.fail("case", f"outputs = {list(outputs)}", f"one or more of {', '.join(OUTPUTS)}, each once")
        parameters = {name: self.parameter(name, entry) for name, entry in data["parameters"].items()}
        variants = self.changes("variants", data.get("variants", {"default": {}}), parameters)
        profiles = self.changes("profiles", data.get("profiles", {}), parameters)
        return Case(
            name=head["name"], title=head["title"], description=head.get("description", "").strip(), source=tuple(head.get("source", ())),
            engines=tuple(head["engines"]), folder=self.path.parent, parameters=parameters, profiles=profiles, variants=variants,
            runs=self.runs(data.get("runs", {}), profiles, variants, tuple(head["engines"]), parameters),
            constraints=tuple(self.constraint(entry, parameters) for entry in data.get("constraints", ())),
            studies={name: self.study(name, entry, parameters, variants) for name, entry in data.get("studies", {}).items()},
            outputs=outputs, particles=self.expression("case", head["particles"], parameters) if "particles" in head else None)

    def parameter(self, name: str, entry: Mapping[str, Any]) -> Parameter:
        table, number = f"parameters.{name}", (int, float)
        if not isinstance(entry, dict) or not name.isidentifier():
            raise self.fail(table, "a parameter is a table with an identifier as name")
        keys = {"value": (int, float, str), "unit": str, "type": str, "min": number, "max": number, "exclusive_min": bool,
                "exclusive_max": bool, "doc": str, "values": list, "optional": bool}
        self.table(entry, table, keys, ("type", "doc"))
        pick(entry["type"], ("float", "int", "choice"), "type", f"[{table}] of {self.path}")
        if "value" not in entry and not entry.get("optional"):
            raise self.fail(table, "value is missing", "a value, or optional = true")
        if (entry["type"] == "choice") != ("values" in entry):
            raise self.fail(table, "type and values do not fit", 'values = [...] together with type = "choice"')
        if not known_unit(entry.get("unit", "1")):
            raise self.fail(table, f"unknown unit {entry['unit']!r}", 'an SI unit, or "1"')
        parameter = Parameter(name=name, **{**entry, "values": tuple(entry.get("values", ()))})
        self.check(table, parameter, parameter.value)
        return parameter

    def check(self, table: str, parameter: Parameter, value: Value) -> Value:
        try:
            return checked(parameter, value)
        except DembarkError as error:
            raise self.fail(table, str(error)) from None

    def changes(self, kind: str, tables: Mapping[str, Any], parameters: Mapping[str, Parameter]) -> dict[str, dict[str, Value]]:
        return {name: self.overrides(f"{kind}.{name}", entry, parameters) for name, entry in tables.items()}

    def overrides(self, table: str, entry: Any, parameters: Mapping[str, Parameter]) -> dict[str, Value]:
        if not isinstance(entry, dict):
            raise self.fail(table, "overrides are a table of key = value")
        for key in entry:
            if key not in parameters:
                raise self.fail(table, f"unknown parameter {key!r}", nearest(key, parameters))
        return {key: self.check(table, parameters[key], value) for key, value in entry.items()}

    def runs(self, data: Mapping[str, Any], profiles: Mapping[str, Any], variants: Mapping[str, Any],
             engines: tuple[str, ...], parameters: Mapping[str, Parameter]) -> dict[str, tuple[PlannedRun, ...]]:
        result = {}
        for profile, entries in data.items():
            pick(profile, profiles, "profile", f"[runs] of {self.path}")
            planned = []
            for entry in entries:
                self.table(entry, "runs", {"variant": str, "engines": list, "replicas": dict}, ("variant",))
                chosen = tuple(entry.get("engines", engines))
                pick(entry["variant"], variants, "variant", f"[runs] of {self.path}")
                for engine in chosen:
                    pick(engine, engines, "engine", f"[runs] of {self.path}")
                planned.append(PlannedRun(entry["variant"], chosen, self.replicas(entry, chosen, parameters)))
            pairs = [(run.variant, engine) for run in planned for engine in run.engines]
            if len(set(pairs)) < len(pairs):
                raise self.fail("runs", f"{profile} names a variant twice for the same engine")
            result[profile] = tuple(planned)
        return result

    def replicas(self, entry: Mapping[str, Any], engines: tuple[str, ...], parameters: Mapping[str, Parameter]) -> dict[str, int]:
        counts = entry.get("replicas", {})
        for engine, count in counts.items():
            pick(engine, engines, "engine", f"replicas in [runs] of {self.path}")
            if "replicas" not in parameters:
                raise self.fail("runs", "replicas are given, but nothing in this case is random", "leave them out")
            self.check("runs", parameters["replicas"], count)
        return dict(counts)

    def study(self, name: str, entry: Any, parameters: Mapping[str, Parameter], variants: Mapping[str, Any]) -> Study:
        table = f"studies.{name}"
        if not isinstance(entry, dict):
            raise self.fail(table, "a study is a table with title, along and variants")
        self.table(entry, table, {"title": str, "description": str, "along": str, "variants": list}, ("title", "along", "variants"))
        pick(entry["along"], parameters, "parameter", f"[{table}] of {self.path}")
        for variant in entry["variants"]:
            pick(variant, variants, "variant", f"[{table}] of {self.path}")
        if len(set(entry["variants"])) < max(3, len(entry["variants"])):
            raise self.fail(table, "a study needs at least three variants, each once")
        return Study(name, entry["title"], entry.get("description", "").strip(), entry["along"], tuple(entry["variants"]))

    def constraint(self, entry: Any, parameters: Mapping[str, Parameter]) -> Constraint:
        if not isinstance(entry, dict):
            raise self.fail("constraints", "a constraint is a table with expression and message")
        self.table(entry, "constraints", {"expression": str, "message": str}, ("expression", "message"))
        return Constraint(self.expression("constraints", entry["expression"], parameters), entry["message"])

    def expression(self, table: str, text: str, parameters: Mapping[str, Parameter]) -> Expression:
        try:
            expression = Expression(text)
        except DembarkError as error:
            raise self.fail(table, str(error)) from None
        for name in expression.names - parameters.keys():
            raise self.fail(table, f"unknown parameter {name!r}", nearest(name, parameters))
        return expression
