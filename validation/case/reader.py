"""The reader of case.toml: every mistake is reported with the table, and the line, that it is in."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from dembark.common.choices import Value, nearest
from dembark.common.errors import DembarkError
from dembark.common.units import known_unit, si_unit
from dembark.validation import engines

from . import walls
from .expressions import Expression
from .folders import package_root
from .model import (
    EVIDENCE,
    FIRST_ORDER,
    OUTPUTS,
    PICTURE_WORDS,
    PROFILES,
    STANDARD_OUTPUTS,
    Case,
    Constraint,
    Declared,
    Finding,
    Parameter,
    PlannedRun,
    Study,
)
from .tables import TableReader, Types, load_toml

_TABLES: dict[str, Types] = {
    "case": dict, "parameters": dict, "profiles": dict, "variants": dict, "runs": dict, "constraints": dict, "studies": dict,
    "derived": dict, "quantities": dict, "controls": dict, "picture": dict, "walls": dict, "needs": dict, "findings": list}
_CASE: dict[str, Types] = {
    "title": str, "description": str, "source": list, "engines": list, "outputs": list, "particles": str, "groups": list,
    "references": list, "paired": bool, "rates": dict}
_RUN: dict[str, Types] = {"variant": str, "variants": list, "engines": list, "replicas": dict}
# Keys of [picture]: of a cross-section, and of a packing.
_NUMBER: Types = (int, float, str)
_SECTION: dict[str, Types] = {"cross_section": str, "drum_radius": _NUMBER, "drum_speed": _NUMBER, "speed": _NUMBER, "frames": int,
                              "chains": bool, "last": int, "pixels": int}
_PACKING: dict[str, Types] = {"colour_by": str, "scale": _NUMBER, "view": str, "cut": bool, "surface": bool}


@cache
def _groups() -> dict[str, Any]:
    return load_toml(package_root() / "common" / "groups.toml")


@cache
def _citations() -> dict[str, Any]:
    return load_toml(Path(__file__).with_name("references.toml"))


class CaseReader(TableReader):
    """Turns the tables of one case.toml into a Case."""

    def case(self, data: Mapping[str, Any]) -> Case:
        """The complete case; `data` is the content of the file."""
        self.table(data, "top level", _TABLES, ("case",))
        head = data["case"]
        self.table(head, "case", _CASE, ("title",))
        self.texts(head, "case", [key for key, kind in _CASE.items() if kind is list])
        groups = [_groups()[self.pick(name, _groups(), "group", "case")] for name in head.get("groups", ())]
        given = {name for group in groups for name in group.get("parameters", {})}
        parameters = {name: self.parameter(name, entry, given) for name, entry in self.merged("parameters", data, groups).items()}
        derived = self.derived(data.get("derived", {}), parameters)
        quantities = self.merged("quantities", data, groups)
        controls = self.controls([*groups, data], quantities)
        variants = self.changes("variants", data.get("variants", {"default": {}}), parameters)
        one = Case(
            name=self.path.parent.name, folder=self.path.parent, title=head["title"], description=head.get("description", "").strip(),
            source=tuple(head.get("source", ())), engines=self.engines(head), outputs=self.outputs(head), paired=head.get("paired", False),
            rates=self.rates(head.get("rates", {})),
            references=tuple(_citations()[self.pick(name, _citations(), "reference", "case")] for name in head.get("references", ())),
            particles=self.expression("case", head["particles"], {**parameters, **derived}) if "particles" in head else None,
            parameters=parameters, variants=variants,
            profiles=self.changes("profiles", {name: {} for name in PROFILES} | data.get("profiles", {}), parameters), runs={},
            constraints=tuple(self.constraint(text, message, parameters) for table in (*groups, data)
                              for text, message in table.get("constraints", {}).items()),
            studies={name: self.study(name, entry, parameters, variants) for name, entry in data.get("studies", {}).items()},
            derived=derived, controls=controls, picture=self.picture(data.get("picture", {})),
            walls=walls.read(self, data.get("walls", {})),
            quantities={name: self.quantity(name, entry, [wrong for wrong, seen in controls.items() if name in seen])
                        for name, entry in quantities.items()},
            needs={self.pick(name, engines.CAPABILITIES, "capability", "needs"): self.expression("needs", text, parameters)
                   for table in (*groups, data) for name, text in table.get("needs", {}).items()})
        self.families(one.quantities)
        return replace(one, runs=self.runs(data.get("runs", {}), one),
                       findings=tuple(self.finding(entry, one) for entry in data.get("findings", ())))

    def engines(self, head: Mapping[str, Any]) -> tuple[str, ...]:
        """The engines that the case names, else those with a deck in its folder."""
        decks = {name: engines.facts(name).deck for name in engines.names()}
        found = head.get("engines", [name for name, deck in decks.items() if (self.path.parent / deck).is_file()])
        if not found:
            raise self.fail("case", "there is no deck", f"one of {', '.join(decks.values())}")
        return tuple(self.pick(name, decks, "engine", "case") for name in found)

    def outputs(self, head: Mapping[str, Any]) -> tuple[str, ...]:
        """What the decks write."""
        found = tuple(self.pick(name, OUTPUTS, "output", "case") for name in head.get("outputs", STANDARD_OUTPUTS))
        if not found or len(set(found)) < len(found):
            raise self.fail("case", f"outputs = {list(found)} is empty or repeats one",
                            f"give one or more of {', '.join(OUTPUTS)}, each once")
        return found

    def rates(self, given: Mapping[str, Any]) -> dict[str, float]:
        """Measured particle-steps per second and core, by engine."""
        for engine, rate in given.items():
            self.pick(engine, engines.names(), "engine", "case")
            if isinstance(rate, bool) or not isinstance(rate, int | float) or not rate > 0:
                raise self.fail("case", f"rates: {engine} = {rate!r} is no rate",
                                "give particle-steps per second and core, a number > 0", "rates")
        return dict(given)

    def merged(self, table: str, data: Mapping[str, Any], groups: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """The entries of all `groups`, then those of the case; where both have one, the case's keys replace single keys of the group's."""
        result: dict[str, Any] = {name: entry for group in groups for name, entry in group.get(table, {}).items()}
        for name, entry in data.get(table, {}).items():
            if not isinstance(entry, dict):
                raise self.fail(f"{table}.{name}", f"{entry!r} is not a table", "write it as { key = value, ... }")
            result[name] = {**result.get(name, {}), **entry}
        return result

    def parameter(self, name: str, entry: Mapping[str, Any], of_groups: Collection[str] = ()) -> Parameter:
        """[parameters.NAME], its own value checked. `of_groups`: names that need no `doc`, of which it may be a misspelt one."""
        table = f"parameters.{name}"
        if not name.isidentifier():
            raise self.fail(table, f"{name!r} is not a name of a parameter", "letters, digits and underscores")
        if "doc" not in entry and (near := nearest(name, of_groups)).startswith("did you mean"):
            raise self.fail(table, f"no group has a parameter {name}, and doc is missing", near)
        found = self.record(Parameter, entry, table, name=name)
        if found.value is None and not found.optional:
            raise self.fail(table, "value is missing", "a value, or optional = true")
        if isinstance(found.value, str) and not found.values:
            raise self.fail(table, f"value = {found.value!r} is not a number", "a number; words need values = [...]")
        if not si_unit(found.unit):
            raise self.fail(table, f"{found.unit!r} is not a base SI unit", 'such as m or kg/m^3, or "1"; --set accepts others')
        self.value(table, found, found.value)
        return found

    def derived(self, data: Mapping[str, Any], parameters: Mapping[str, Parameter]) -> dict[str, Expression]:
        """[derived]: expressions, each in the parameters and those before it."""
        found: dict[str, Expression] = {}
        for name, text in data.items():
            if not isinstance(text, str) or not name.isidentifier() or name in parameters:
                raise self.fail("derived", f"{name} = {text!r}", "a new name and an expression in the parameters, as a text")
            found[name] = self.expression("derived", text, {**parameters, **found})
        return found

    def constraint(self, text: str, message: Any, parameters: Mapping[str, Parameter]) -> Constraint:
        """An entry of [constraints]: the condition, and the sentence for whoever breaks it."""
        if not isinstance(message, str):
            raise self.fail("constraints", f"{message!r} is not a sentence", 'write "condition" = "what is wrong when it does not hold"')
        return Constraint(self.expression("constraints", text, parameters), message)

    def changes(self, kind: str, tables: Mapping[str, Any], parameters: Mapping[str, Parameter]) -> dict[str, dict[str, Value]]:
        """All tables [KIND.NAME], profiles or variants: changed parameters by name, on top of those of an earlier one
        that `like` names."""
        found: dict[str, dict[str, Value]] = {}
        for name, entry in tables.items():
            table = f"{kind}.{name}"
            self.folder_name(table, name)
            if not isinstance(entry, dict):
                raise self.fail(table, f"{entry!r} is not a table", "overrides are a table of key = value")
            base = found[self.pick(str(entry["like"]), found, kind[:-1], table)] if "like" in entry else {}
            own = {self.pick(key, parameters, "parameter", table): value for key, value in entry.items() if key != "like"}
            found[name] = base | {key: self.value(table, parameters[key], value) for key, value in own.items()}
        return found

    def folder_name(self, table: str, name: str) -> None:
        """DembarkError unless `name` can be that of a folder of results."""
        if not re.fullmatch(r"\w[\w.+=-]*", name):
            raise self.fail(table, f"{name!r} is not a name of a folder", "give letters, digits, '_', '.', '+', '=' and '-'")

    def runs(self, data: Mapping[str, Any], case: Case) -> dict[str, tuple[PlannedRun, ...]]:
        """[runs]: what each profile of `case` runs; where an entry names no engines, in all that are capable of it."""
        result: dict[str, tuple[PlannedRun, ...]] = {}
        for profile, entries in data.items():
            self.pick(profile, case.profiles, "profile", "runs")
            if isinstance(entries, str):
                result[profile] = result[self.pick(entries, result, "profile above", "runs")]
                continue
            result[profile] = tuple(run for entry in entries for run in self.planned(profile, entry, case))
            pairs = [(run.variant, engine) for run in result[profile] for engine in run.engines]
            if len(set(pairs)) < len(pairs):
                raise self.fail("runs", f"{profile} names a variant twice for the same engine")
        return result

    def planned(self, profile: str, given: Any, case: Case) -> list[PlannedRun]:
        """The runs of one entry of a profile: the name of a variant, or a table."""
        entry: dict[str, Any] = {"variant": given} if isinstance(given, str) else given
        self.table(entry, "runs", _RUN)
        self.texts(entry, "runs", ("variants", "engines"))
        named = entry.get("variants", [entry["variant"]] if "variant" in entry else [])
        if not named or ("variant" in entry and "variants" in entry):
            raise self.fail("runs", f"{entry!r} in {profile}", "give variant or variants")
        chosen = tuple(self.pick(engine, case.engines, "engine", "runs") for engine in entry.get("engines", case.engines))
        counts = entry.get("replicas", {})
        for engine, count in counts.items():
            self.pick(engine, chosen, "engine of replicas", "runs")
            if "replicas" not in case.parameters:
                raise self.fail("runs", "replicas are given, but nothing in this case is random", "leave them out")
            self.value("runs", case.parameters["replicas"], count)
        found = []
        for variant in (self.pick(name, case.variants, "variant", "runs") for name in named):
            values = {name: one.value for name, one in case.parameters.items()} | {**case.profiles[profile], **case.variants[variant]}
            lacks = {engine: lacking for engine in chosen if (lacking := case.missing_capabilities(engine, values))}
            if "engines" in entry and lacks:
                engine, lacking = next(iter(lacks.items()))
                raise self.fail("runs", f"{variant} in {engine}, which has no {' and no '.join(lacking)}", "take it from engines")
            able = tuple(engine for engine in chosen if engine not in lacks)
            found.append(PlannedRun(variant, able, {engine: counts[engine] for engine in able if engine in counts}))
        return found

    def study(self, name: str, entry: Any, parameters: Mapping[str, Parameter], variants: Mapping[str, Any]) -> Study:
        """[studies.NAME]: variants along a parameter."""
        table = f"studies.{name}"
        self.folder_name(table, name)
        rest, order = entry, None
        if isinstance(entry, Mapping):
            rest, order = {key: value for key, value in entry.items() if key != "formal_order"}, self.order(table, entry, parameters)
        found = self.record(Study, rest, table, name=name, formal_order=order or FIRST_ORDER)
        self.pick(found.along, parameters, "parameter", table)
        for variant in found.variants:
            self.pick(variant, variants, "variant", table)
        if len(set(found.variants)) < max(3, len(found.variants)):
            raise self.fail(table, "a study needs at least three variants, each once")
        return found

    def quantity(self, name: str, entry: Mapping[str, Any], controls: Sequence[str]) -> Declared:
        """[quantities.NAME]: what a measured quantity is, how it is judged, and the wrong physics that fails it."""
        table = f"quantities.{name}"
        found = self.record(Declared, entry, table, name=name, control="; ".join(controls))
        if "evidence" in entry:
            self.pick(found.evidence, EVIDENCE, "kind of evidence", table)
        if found.evidence == "experiment" and not found.source:
            raise self.fail(table, "evidence = 'experiment' without source", "say who measured the reference, and where it is published",
                            "evidence")
        if not known_unit(found.unit):
            raise self.fail(table, f"unknown unit {found.unit!r}", 'an SI unit, d or R, or "1"')
        if found.tolerance is not None and not found.evidence:
            raise self.fail(table, "a tolerance without evidence", f"say what the reference is: {', '.join(EVIDENCE)}")
        for key, word, advice in (("tolerance", "bound", ', or "bound"'), ("input_uncertainty", None, ""), ("agreement", None, "")):
            value = getattr(found, key)
            # An infinite one would allow anything.
            if value is not None and value != word and (isinstance(value, str) or not 0.0 <= value < math.inf):
                raise self.fail(table, f"{key} = {value!r} is not possible", f"give a finite number >= 0{advice}")
        if found.tolerance and found.tolerance != "bound" and not found.why:
            raise self.fail(table, "a tolerance without why", "say where the deviation that it allows comes from")
        if found.input_uncertainty and not (found.inputs and isinstance(found.tolerance, float)):
            raise self.fail(table, "input_uncertainty needs inputs and a tolerance that is a number", "say which inputs were changed")
        if found.input_uncertainty and found.input_uncertainty >= float(found.tolerance or 0.0):
            raise self.fail(table, "input_uncertainty is not below the tolerance, so that nothing could pass", "leave out the tolerance")
        return found

    def families(self, quantities: Mapping[str, Declared]) -> None:
        """A family is one fact, so that its quantities have one kind of evidence."""
        kinds: dict[str, Declared] = {}
        for one in quantities.values():
            first = kinds.setdefault(one.family, one)
            if one.family and one.evidence != first.evidence:
                raise self.fail(f"quantities.{one.name}", f"evidence = {one.evidence!r} in the family {one.family!r}",
                                f"{first.name} of the same family has {first.evidence!r}")

    def controls(self, tables: Sequence[Mapping[str, Any]], quantities: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
        """[controls] of the groups and of the case: wrong physics, and the quantities whose checks it fails."""
        found: dict[str, tuple[str, ...]] = {}
        for wrong, names in (entry for table in tables for entry in table.get("controls", {}).items()):
            if not isinstance(names, list) or not names:
                raise self.fail("controls", f"{wrong!r} = {names!r} is no list", "give a list of the quantities whose checks it fails")
            found[wrong] = (*found.get(wrong, ()), *(self.pick(str(name), quantities, "quantity", "controls") for name in names))
        return found

    def finding(self, entry: Any, case: Case) -> Finding:
        """An entry of [[findings]]: the cause of failures of `quantities`, in `variants` where not in all."""
        found = self.record(Finding, entry, "findings")
        for name in found.quantities:
            if not case.declared(name):
                self.pick(name, case.quantities, "quantity", "findings")
        known = [*case.variants, *(study.folder_name for study in case.studies.values())]
        for name in found.variants:
            self.pick(name, known, "variant or study", "findings")
        return found

    def picture(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """[picture]: how a run is drawn, see `postproc.pictures`; numbers may be expressions, also in what a setup.py derives."""
        if not data:
            return {}
        section = "cross_section" in data
        self.table(data, "picture", _SECTION if section else _PACKING, ())
        for key, known in PICTURE_WORDS.items():
            if key in data:
                self.pick(data[key].removesuffix(":x").removesuffix(":y").removesuffix(":z"), known, key, "picture")
        if not data.keys() & {"cross_section", "colour_by", "surface"}:
            raise self.fail("picture", "colour_by is missing", "say what grains are coloured by, or surface = true for a fluid")
        for one in data.keys() - PICTURE_WORDS.keys():
            if isinstance(data[one], str):
                try:
                    Expression(data[one])
                except DembarkError as error:
                    raise self.fail("picture", str(error), key=one) from None
        return dict(data)
