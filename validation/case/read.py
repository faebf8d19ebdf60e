"""Reads and checks a case.toml: every mistake is told with the table that it is in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from dembark.common.choices import Value
from dembark.common.errors import DembarkError
from dembark.common.units import known_unit, si_unit
from dembark.validation import engines
from dembark.validation.case.expressions import Expression
from dembark.validation.case.folders import package_root
from dembark.validation.case.model import (
    EVIDENCE,
    FIRST_ORDER,
    OUTPUTS,
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
from dembark.validation.case.tables import ORDER, TableReader, Types, load_toml


@cache
def _groups() -> dict[str, Any]:
    return load_toml(package_root() / "common" / "groups.toml")


# Keys of [picture]: of a cross-section, and of a packing in perspective.
_NUMBER: Types = (int, float, str)
_SECTION: dict[str, Types] = {"cross_section": str, "drum_radius": _NUMBER, "drum_speed": _NUMBER, "speed": _NUMBER, "frames": int,
                              "chains": bool, "last": int, "pixels": int}
_PACKING: dict[str, Types] = {"colour_by": str, "scale": _NUMBER, "cut": bool, "radius": _NUMBER}


@cache
def citations() -> dict[str, Any]:
    """The publications that cases may name, by their keys."""
    return load_toml(Path(__file__).with_name("references.toml"))


def _full(entry: Mapping[str, Any]) -> dict[str, Any]:
    """The entry of a parameter with its type, and `above` and `below` as limits that are excluded."""
    kind = "choice" if "values" in entry else "int" if isinstance(entry.get("value"), int) else "float"
    result = {"type": kind, **entry}
    for short, long in (("above", "min"), ("below", "max")):
        if short in result:
            result |= {long: result.pop(short), f"exclusive_{long}": True}
    return result


class CaseReader(TableReader):
    """Turns the tables of one case.toml into a Case; each mistake names the table it is in."""

    def case(self, data: Mapping[str, Any]) -> Case:
        """The whole case; `data` is the content of the file."""
        tables = {"case": dict, "parameters": dict, "profiles": dict, "variants": dict, "runs": dict, "constraints": dict, "studies": dict,
                  "derived": dict, "quantities": dict, "controls": dict, "picture": dict, "needs": dict, "findings": list}
        self.table(data, "top level", tables, ("case",))
        head = data["case"]
        keys = {"name": str, "title": str, "description": str, "source": list, "engines": list, "outputs": list, "particles": str,
                "groups": list, "references": list, "paired": bool}
        self.table(head, "case", keys, ("title",))
        for key in (key for key, kind in keys.items() if kind is list):
            if any(not isinstance(one, str) for one in head.get(key, ())):
                raise self.fail("case", f"{key} = {head[key]}", "a list of texts", key)
        for name in head.get("references", ()):
            self.pick(name, citations(), "reference", "case")
        if head.get("name", self.path.parent.name) != self.path.parent.name:
            raise self.fail("case", f"name = {head['name']!r}", f"the name of its folder, {self.path.parent.name!r}")
        decks = [name for name in engines.names() if (self.path.parent / engines.facts(name).deck).is_file()]
        if not head.get("engines", decks):
            raise self.fail("case", "there is no deck", f"one of {', '.join(engines.facts(name).deck for name in engines.names())}")
        own_engines = tuple(head.get("engines", decks))
        for engine in own_engines:
            self.pick(engine, engines.names(), "engine", "case")
        outputs = tuple(head.get("outputs", STANDARD_OUTPUTS))
        for output in outputs:
            self.pick(output, OUTPUTS, "output", "case")
        if not outputs or len(set(outputs)) < len(outputs):
            raise self.fail("case", f"outputs = {list(outputs)}", f"one or more of {', '.join(OUTPUTS)}, each once")
        groups = [_groups()[self.pick(str(name), _groups(), "group", "case")] for name in head.get("groups", ())]
        entries = self.merged("parameters", data.get("parameters", {}), groups)
        parameters = {name: self.parameter(name, entry) for name, entry in entries.items()}
        constraints = {text: told for table in (*groups, data) for text, told in table.get("constraints", {}).items()}
        needs = {self.pick(name, engines.CAPABILITIES, "capability", "needs"): self.expression("needs", text, parameters)
                 for table in (*groups, data) for name, text in table.get("needs", {}).items()}
        derived = self.derived(data.get("derived", {}), parameters)
        quantities = self.merged("quantities", data.get("quantities", {}), groups)
        controls = self.controls([*groups, data], quantities)
        variants = self.changes("variants", data.get("variants", {"default": {}}), parameters)
        profiles = self.changes("profiles", {name: {} for name in PROFILES} | data.get("profiles", {}), parameters)
        one = Case(
            name=self.path.parent.name, title=head["title"], description=head.get("description", "").strip(),
            source=tuple(head.get("source", ())), engines=own_engines, folder=self.path.parent,
            parameters=parameters, profiles=profiles, variants=variants,
            runs={},
            constraints=tuple(self.constraint(*entry, parameters) for entry in constraints.items()),
            studies={name: self.study(name, entry, parameters, variants) for name, entry in data.get("studies", {}).items()},
            outputs=outputs, derived=derived,
            particles=self.expression("case", head["particles"], {**parameters, **derived}) if "particles" in head else None,
            quantities={name: self.quantity(name, entry, [wrong for wrong, seen in controls.items() if name in seen])
                        for name, entry in quantities.items()},
            controls=controls,
            references=tuple(head.get("references", ())), paired=head.get("paired", False),
            picture=self.picture(data.get("picture", {})), needs=needs)
        self.families(one.quantities)
        return replace(one, runs=self.runs(data.get("runs", {}), one),
                       findings=tuple(self.finding(entry, one) for entry in data.get("findings", ())))

    def families(self, quantities: Mapping[str, Declared]) -> None:
        """A family is one fact, so that its quantities have one kind of evidence."""
        kinds: dict[str, Declared] = {}
        for one in quantities.values():
            first = kinds.setdefault(one.family, one)
            if one.family and one.evidence != first.evidence:
                raise self.fail(f"quantities.{one.name}", f"evidence = {one.evidence!r} in the family {one.family!r}",
                                f"{first.name} of the same family has {first.evidence!r}")

    def finding(self, entry: Any, case: Case) -> Finding:
        """An entry of [[findings]]: the cause of failures of `quantities`, in `variants` where not in all."""
        self.table(entry, "findings", {"quantities": list, "variants": list, "cause": str}, ("quantities", "cause"))
        for name in entry["quantities"]:
            if not case.declared(str(name)):
                self.pick(str(name), case.quantities, "quantity", "findings")
        known = [*case.variants, *(study.folder_name for study in case.studies.values())]
        return Finding(tuple(entry["quantities"]), entry["cause"],
                       tuple(self.pick(str(name), known, "variant or study", "findings") for name in entry.get("variants", ())))

    def picture(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """[picture]: how a run is drawn, see `postproc.pictures`; numbers may be expressions, also in what a setup.py derives."""
        if not data:
            return {}
        section = "cross_section" in data
        self.table(data, "picture", _SECTION if section else _PACKING, ("cross_section",) if section else ("colour_by", "scale"))
        key, known = ("cross_section", ("xz", "xy")) if section else ("colour_by", ("velocity", "force", "stress"))
        self.pick(data[key], known, key, "picture")
        for one in data.keys() - {key}:
            if isinstance(data[one], str):
                try:
                    Expression(data[one])
                except DembarkError as error:
                    raise self.fail("picture", str(error), key=one) from None
        return dict(data)

    def merged(self, table: str, own: Mapping[str, Any], groups: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """The entries of all `groups`, then those of the case; where both have one, the case's keys replace single keys of the group's."""
        result: dict[str, Any] = {name: entry for group in groups for name, entry in group.get(table, {}).items()}
        for name, entry in own.items():
            if not isinstance(entry, dict):
                raise self.fail(f"{table}.{name}", f"{entry!r} is no table", "write it as { key = value, ... }")
            result[name] = {**result.get(name, {}), **entry}
        return result

    def derived(self, data: Mapping[str, Any], parameters: Mapping[str, Parameter]) -> dict[str, Expression]:
        """[derived]: expressions, each in the parameters and those before it."""
        found: dict[str, Expression] = {}
        for name, text in data.items():
            if not isinstance(text, str) or not name.isidentifier() or name in parameters:
                raise self.fail("derived", f"{name} = {text!r}", "a new name and an expression in the parameters, as a text")
            found[name] = self.expression("derived", text, {**parameters, **found})
        return found

    def controls(self, tables: Sequence[Mapping[str, Any]], quantities: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
        """[controls] of the groups and of the case: wrong physics, and the quantities whose checks it fails."""
        found: dict[str, tuple[str, ...]] = {}
        for wrong, names in (entry for table in tables for entry in table.get("controls", {}).items()):
            if not isinstance(names, list) or not names:
                raise self.fail("controls", f"{wrong!r} = {names!r}", "a list of the quantities whose checks it fails")
            found[wrong] = (*found.get(wrong, ()), *(self.pick(str(name), quantities, "quantity", "controls") for name in names))
        return found

    def quantity(self, name: str, entry: Mapping[str, Any], controls: Sequence[str]) -> Declared:
        """[quantities.NAME]: what a measured quantity is, how it is judged, and the wrong physics that fails it."""
        table = f"quantities.{name}"
        keys: dict[str, Types] = {
            "label": str, "unit": str, "evidence": str, "tolerance": (int, float, str), "why": str, "absolute": bool, "source": str,
            "detail": str, "agreement": (int, float), "compared": bool, "independent": bool, "family": str}
        self.table(entry, table, keys, ("label",))
        if "evidence" in entry:
            self.pick(entry["evidence"], EVIDENCE, "kind of evidence", table)
        if not known_unit(entry.get("unit", "1")):
            raise self.fail(table, f"unknown unit {entry['unit']!r}", 'an SI unit, d or R, or "1"')
        tolerance = entry.get("tolerance")
        if tolerance is not None and "evidence" not in entry:
            raise self.fail(table, "a tolerance without evidence", f"say what the reference is: {', '.join(EVIDENCE)}")
        if tolerance is not None and not (tolerance == "bound" or (isinstance(tolerance, int | float) and tolerance >= 0)):
            raise self.fail(table, f"tolerance = {tolerance!r}", 'a number >= 0, or "bound"')
        if isinstance(tolerance, int | float) and tolerance > 0 and not entry.get("why"):
            raise self.fail(table, "a tolerance without why", "say where the deviation that it allows comes from")
        return Declared(name=name, control="; ".join(controls), **entry)

    def parameter(self, name: str, entry: Mapping[str, Any]) -> Parameter:
        """[parameters.NAME], its own value checked."""
        table, number = f"parameters.{name}", (int, float)
        if not name.isidentifier():
            raise self.fail(table, f"{name!r} is no name of a parameter", "letters, digits and underscores")
        keys: dict[str, Types] = {
            "value": (int, float, str), "unit": str, "type": str, "min": number, "max": number, "exclusive_min": bool,
            "exclusive_max": bool, "doc": str, "values": list, "optional": bool, "above": number, "below": number}
        self.table(entry, table, keys, ("doc",))
        entry = _full(entry)
        self.pick(entry["type"], ("float", "int", "choice"), "type", table)
        if "value" not in entry and not entry.get("optional"):
            raise self.fail(table, "value is missing", "a value, or optional = true")
        if (entry["type"] == "choice") != ("values" in entry):
            raise self.fail(table, "type and values do not fit", 'values = [...] together with type = "choice"')
        if not si_unit(entry.get("unit", "1")):
            raise self.fail(table, f"{entry['unit']!r} is no base SI unit", 'such as m or kg/m^3, or "1"; --set accepts others')
        parameter = Parameter(name=name, **{**entry, "values": tuple(entry.get("values", ()))})
        self.value(table, parameter, parameter.value)
        return parameter

    def changes(self, kind: str, tables: Mapping[str, Any], parameters: Mapping[str, Parameter]) -> dict[str, dict[str, Value]]:
        """All tables [KIND.NAME], profiles or variants: changed parameters by name; `like` names an earlier entry to start from."""
        found: dict[str, dict[str, Value]] = {}
        for name, entry in tables.items():
            table = f"{kind}.{name}"
            own = dict(entry) if isinstance(entry, dict) else entry
            base = found[self.pick(str(own.pop("like")), found, kind[:-1], table)] if isinstance(own, dict) and "like" in own else {}
            found[name] = base | self.overrides(table, own, parameters)
        return found

    def overrides(self, table: str, entry: Any, parameters: Mapping[str, Parameter]) -> dict[str, Value]:
        """One table of changed parameters."""
        if not isinstance(entry, dict):
            raise self.fail(table, "overrides are a table of key = value")
        return {self.pick(key, parameters, "parameter", table): self.value(table, parameters[key], value) for key, value in entry.items()}

    def runs(self, data: Mapping[str, Any], case: Case) -> dict[str, tuple[PlannedRun, ...]]:
        """[runs]: what each profile of `case` runs; where an entry names no engines, in all that are capable of it."""
        result: dict[str, tuple[PlannedRun, ...]] = {}
        for profile, entries in data.items():
            self.pick(profile, case.profiles, "profile", "runs")
            if isinstance(entries, str):
                result[profile] = result[self.pick(entries, result, "profile above", "runs")]
                continue
            planned = []
            for one in entries:
                entry = {"variant": one} if isinstance(one, str) else one
                self.table(entry, "runs", {"variant": str, "variants": list, "engines": list, "replicas": dict})
                named = entry.get("variants", [entry["variant"]] if "variant" in entry else [])
                if not named or ("variant" in entry and "variants" in entry):
                    raise self.fail("runs", f"{entry!r} in {profile}", "give variant or variants")
                chosen = tuple(entry.get("engines", case.engines))
                for engine in chosen:
                    self.pick(engine, case.engines, "engine", "runs")
                counts = self.replicas(entry, chosen, case.parameters)
                for name in named:
                    variant = self.pick(str(name), case.variants, "variant", "runs")
                    able = self.able(case, profile, variant, chosen, told="engines" in entry)
                    planned.append(PlannedRun(variant, able, {engine: counts[engine] for engine in able if engine in counts}))
            pairs = [(run.variant, engine) for run in planned for engine in run.engines]
            if len(set(pairs)) < len(pairs):
                raise self.fail("runs", f"{profile} names a variant twice for the same engine")
            result[profile] = tuple(planned)
        return result

    def able(self, case: Case, profile: str, variant: str, chosen: Sequence[str], told: bool) -> tuple[str, ...]:
        """Those of the engines `chosen` that have all that the variant needs in that profile; a mistake where the case has `told` them."""
        values = {name: one.value for name, one in case.parameters.items()} | {**case.profiles[profile], **case.variants[variant]}
        lacks = {engine: found for engine in chosen if (found := case.lacks(engine, values))}
        for engine, found in lacks.items() if told else ():
            raise self.fail("runs", f"{variant} in {engine}, which has no {' and no '.join(found)}", "take it from engines")
        return tuple(engine for engine in chosen if engine not in lacks)

    def replicas(self, entry: Mapping[str, Any], chosen: Sequence[str], parameters: Mapping[str, Parameter]) -> dict[str, int]:
        """`replicas` of an entry of [runs]: how many, by engine."""
        counts = entry.get("replicas", {})
        for engine, count in counts.items():
            self.pick(engine, chosen, "engine of replicas", "runs")
            if "replicas" not in parameters:
                raise self.fail("runs", "replicas are given, but nothing in this case is random", "leave them out")
            self.value("runs", parameters["replicas"], count)
        return dict(counts)

    def study(self, name: str, entry: Any, parameters: Mapping[str, Parameter], variants: Mapping[str, Any]) -> Study:
        """[studies.NAME]: variants along a parameter."""
        table = f"studies.{name}"
        keys: dict[str, Types] = {"title": str, "description": str, "along": str, "variants": list, "formal_order": ORDER}
        self.table(entry, table, keys, ("title", "along", "variants"))
        self.pick(entry["along"], parameters, "parameter", table)
        for variant in entry["variants"]:
            self.pick(variant, variants, "variant", table)
        if len(set(entry["variants"])) < max(3, len(entry["variants"])):
            raise self.fail(table, "a study needs at least three variants, each once")
        return Study(name, entry["title"], entry.get("description", "").strip(), entry["along"], tuple(entry["variants"]),
                     self.order(table, entry, parameters) or FIRST_ORDER)

    def constraint(self, text: str, message: Any, parameters: Mapping[str, Parameter]) -> Constraint:
        """An entry of [constraints]: the condition, and the sentence for whoever breaks it."""
        if not isinstance(message, str):
            raise self.fail("constraints", f"{message!r} is no sentence", 'write "condition" = "what is wrong when it does not hold"')
        return Constraint(self.expression("constraints", text, parameters), message)
