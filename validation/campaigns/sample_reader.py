"""The table `sample` of a sweep, read and checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from dembark.common.choices import pick
from dembark.common.errors import DembarkError
from dembark.common.units import finite, to_si
from dembark.validation.case.model import Case, Declared, Parameter
from dembark.validation.case.tables import TableReader, Types

from . import targets
from .plan import MOST_RUNS
from .sampling import DESIGNS, DISTRIBUTIONS, Sample, Variable
from .targets import CurveTarget, Table, Target

_KEYS: dict[str, Types] = {"design": str, "samples": int, "seed": int, "quantities": list, "parameters": dict,
                           "targets": dict}
_NUMBER = (int, float, str)
_TARGET: dict[str, Types] = {"value": _NUMBER, "uncertainty": _NUMBER, "file": str, "at": str, "where": dict, "correlation": (int, float)}
# What to write where a target lacks a key.
_LACKING = {"value": "give a number or, with a file, the name of its column", "uncertainty": "give its standard uncertainty, > 0",
            "correlation": "give the length over which errors of the curve are correlated, 0 where they are independent"}


class SampleReader(TableReader):
    """Reads parameters of a sweep and their distributions; each mistake names the table it is in."""

    def known(self, table: str, key: str, case: Case) -> None:
        """DembarkError unless `key` is a parameter that a sweep may set."""
        if key == "replicas":
            raise self.fail(table, "replicas is not a parameter of a sweep", "write replicas = ... in [[sweeps]] or [campaign]")
        pick(key, case.parameters, "parameter", f"{self.where(table)}, case {case.name}")

    def least(self, table: str, data: Mapping[str, Any], **lows: int) -> None:
        """DembarkError when one of the numbers in `data` is below its least value."""
        for key, low in lows.items():
            if data.get(key, low) < low:
                raise self.fail(table, f"{key} = {data[key]} is out of range", f"it must be >= {low}")

    def sample(self, table: str, entry: Mapping[str, Any], case: Case) -> Sample:
        """The sample that the table `entry` of a sweep of `case` describes."""
        self.table(entry, table, _KEYS, ("design", "samples", "parameters"))
        design = self.pick(entry["design"], DESIGNS, "design", table)
        self.least(table, entry, samples=1, seed=0)
        given = entry["parameters"]
        if not given:
            raise self.fail(table, "the sample has no parameters", "give it one: wall_friction = { min = 0.2, max = 0.8 }")
        variables = {key: self.variable(f"{table}.parameters", key, one, case) for key, one in given.items()}
        sample = Sample(design, entry["samples"], variables, entry.get("seed", 0), self.quantities(table, entry, case),
                        self.targets(f"{table}.targets", entry.get("targets", {}), case))
        if sample.count > MOST_RUNS:
            raise self.fail(table, f"samples = {sample.samples} makes {sample.count} points", f"a campaign may have {MOST_RUNS} runs")
        self.suited(table, sample)
        return sample

    def suited(self, table: str, sample: Sample) -> None:
        """DembarkError for what a design of a sensitivity analysis cannot have."""
        if sample.design == "morris":
            for name, one in sample.variables.items():
                if "min" not in one.numbers:
                    raise self.fail(f"{table}.parameters.{name}", f"{one.distribution} has no limits, which the design morris needs",
                                    'take "truncnorm" or another with min and max')
        if sample.design == "morris" and sample.targets:
            raise self.fail(table, "the design morris has targets", "its points lie on four levels: fit with sobol or latin_hypercube")
        if sample.design == "saltelli" and sample.samples & (sample.samples - 1):
            below = 2 ** (sample.samples.bit_length() - 1)
            raise self.fail(table, f"samples = {sample.samples} of the design saltelli", f"give a power of 2: {below} or {2 * below}")

    def quantities(self, table: str, entry: Mapping[str, Any], case: Case) -> tuple[str, ...]:
        """The names of measured quantities that the sample is to be looked at for."""
        names = entry.get("quantities", [])
        self.texts(entry, table, ["quantities"])
        for name in names:
            self.measured(table, name, case)
        return tuple(names)

    def measured(self, table: str, name: str, case: Case) -> Declared:
        """The declaration of the quantity `name`; DembarkError when the case does not measure it."""
        if (found := case.declared(name)) is None:
            pick(name, case.quantities, "quantity", f"{self.where(table)}, case {case.name} does not measure it")
            raise AssertionError
        return found[0]

    def targets(self, table: str, entry: Mapping[str, Any], case: Case) -> dict[str, Target | CurveTarget]:
        """What the parameters are to be fitted to, by the name of the quantity or curve."""
        return {name: self.target(f"{table}.{name}", name, given, case) for name, given in entry.items()}

    def target(self, place: str, name: str, given: Any, case: Case) -> Target | CurveTarget:
        """One target: two numbers, a row of a table, or with `at` a curve."""
        self.table(given, place, _TARGET)
        if missing := [key for key in ("value", "uncertainty", *(["correlation"] if "at" in given else [])) if key not in given]:
            raise self.fail(place, f"the target {name} has no {' and no '.join(missing)}", _LACKING[missing[0]])
        unit = "1" if "at" in given else self.measured(place, name, case).unit
        if "file" not in given:
            for key in given.keys() & {"at", "where", "correlation"}:
                raise self.fail(place, f"{key} without a file", "name the table with file = ..., or remove it", key)
            value, deviation = (self.quantity(place, given[key], unit, f"{key} of {name}") for key in ("value", "uncertainty"))
            return self.positive(place, name, Target(value, deviation))
        if not isinstance(given["value"], str):
            raise self.fail(place, f"value = {given['value']!r} is not the name of a column", "name the column that holds it", "value")
        try:
            found = targets.table(targets.find(given["file"], self.path, case.folder), given.get("where", {}))
            if "at" in given:
                return self.curve(place, name, given, found)
            value, own = targets.one_number(found, given["value"], unit), self.deviation(place, name, given, unit)
            deviation = targets.one_number(found, own, unit) if isinstance(own, str) else own
            return self.positive(place, name, Target(value, deviation, found.path))
        except DembarkError as error:
            raise error if f"[{place}]" in str(error) else self.fail(place, str(error)) from None

    def positive(self, place: str, name: str, found: Target) -> Target:
        """`found`; DembarkError when its uncertainty is not positive."""
        if found.uncertainty <= 0.0:
            raise self.fail(place, f"uncertainty of {name} = {found.uncertainty:g} is out of range", "it must be > 0")
        return found

    def curve(self, place: str, name: str, given: Mapping[str, Any], found: Table) -> CurveTarget:
        """The target `name` that is a curve."""
        own = self.deviation(place, name, given, "1")
        correlation = self.quantity(place, given["correlation"], "1", f"correlation of {name}")
        if correlation < 0.0:
            raise self.fail(place, f"correlation of {name} = {correlation:g} is out of range", "it must be >= 0")
        return targets.curve(found, given["at"], given["value"], own, correlation)

    def deviation(self, place: str, name: str, given: Mapping[str, Any], unit: str) -> str | float:
        """The uncertainty of a target with a table: the name of its column, or a number."""
        own = given["uncertainty"]
        return own if isinstance(own, str) else self.quantity(place, own, unit, f"uncertainty of {name}")

    def quantity(self, table: str, given: Any, unit: str, name: str) -> float:
        """A finite number in `unit`; `name` is what it was given for."""
        try:
            return to_si(given, unit, name) if isinstance(given, str) else finite(float(given), name)
        except DembarkError as error:
            raise self.fail(table, str(error)) from None

    def variable(self, table: str, key: str, entry: Any, case: Case) -> Variable:
        """The distribution of the parameter `key`."""
        self.known(table, key, case)
        parameter = case.parameters[key]
        if parameter.values:
            raise self.fail(table, f"{key} is a word, of which there is no sample", "give it in fixed, or write a sweep for each")
        if not isinstance(entry, Mapping):
            raise self.fail(table, f"{key} = {entry!r} is not a range", f"write {key} = {{ min = ..., max = ... }}")
        place = f"{table}.{key}"
        name = entry.get("distribution", "uniform")
        needed = DISTRIBUTIONS[self.pick(name if isinstance(name, str) else str(name), DISTRIBUTIONS, "distribution", place)]
        self.table(entry, place, {"distribution": str, **dict.fromkeys(needed, _NUMBER)})
        if missing := [one for one in needed if one not in entry]:
            raise self.fail(place, f"{key} has no {' and no '.join(missing)}", f"{name} needs {' and '.join(needed)}")
        variable = Variable(parameter, name, {one: self.number(place, parameter, one, entry[one]) for one in needed})
        self.ordered(place, variable)
        return variable

    def number(self, table: str, parameter: Parameter, key: str, given: Any) -> float:
        """One number of a distribution in SI units; `std` and `sigma` are differences and may be out of the parameter's range."""
        if key not in ("std", "sigma"):
            return float(self.value(table, parameter, given))  # type: ignore[arg-type]
        name, unit = f"{key} of {parameter.name}", "1" if key == "sigma" else parameter.unit
        number = self.quantity(table, given, unit, name)
        if number <= 0.0:
            raise self.fail(table, f"{name} = {number:g} is out of range", "it must be > 0")
        return number

    def ordered(self, table: str, variable: Variable) -> None:
        """DembarkError unless the numbers of a distribution follow each other."""
        name, of = variable.parameter.name, variable.numbers
        low, high = of.get("min", -math.inf), of.get("max", math.inf)
        if not low < high:
            raise self.fail(table, f"min = {low:g} of {name} is not below max = {high:g}", "exchange them, or give it in fixed")
        if not low <= of.get("mode", low) <= high:
            raise self.fail(table, f"mode = {of['mode']:g} of {name} is not between min = {low:g} and max = {high:g}")
        if variable.distribution in ("loguniform", "lognorm") and of.get("min", of.get("median", 0.0)) <= 0.0:
            raise self.fail(table, f"{variable.distribution} of {name} reaches 0", "give positive numbers, or take another distribution")
