"""What a case is: parameters, profiles, variants, planned runs, studies, and the quantities that are measured."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dembark.common.choices import Value
from dembark.common.errors import DembarkError
from dembark.common.units import finite, to_si
from dembark.validation import engines

from .expressions import Expression

STUDY_PREFIX = "study-"
# What a deck can write, and the file of each; the first three are the default.
OUTPUTS = {"grains": "grains.dump", "contacts": "contacts.dump", "times": "time.csv", "impacts": "impacts.txt"}
STANDARD_OUTPUTS = ("grains", "contacts", "times")
# Sizes of run that every case has; one that a case does not change has its own values.
PROFILES = ("quick", "standard", "full")
# Kinds of evidence: what a reference is.
EVIDENCE = ("experiment", "theory", "code", "identity")
# What the words of [picture] may be; the quantities are those of every dump, also by component, `velocity:z`.
PICTURE_WORDS = {"cross_section": ("xz", "xy"), "view": ("front", "back", "side", "top", "iso"),
                 "colour_by": ("velocity", "force", "angular_velocity", "diameter", "type", "contact_force", "contact_count", "pressure")}
UNSET = "auto"
# The formal order of a scheme of which nothing else is said.
FIRST_ORDER = Expression("1")


@dataclass(frozen=True)
class Parameter:
    """One key of a case: its default (None = not set), the unit of plain numbers ("1" = dimensionless), and what is allowed: from `min` to
    `max`, `above` and `below` without the limit itself, or one of `values`."""

    name: str
    doc: str
    value: Value = None
    unit: str = "1"
    min: float | None = None
    max: float | None = None
    above: float | None = None
    below: float | None = None
    values: tuple[str, ...] = ()
    optional: bool = False

    @property
    def is_whole(self) -> bool:
        """Whether its values are whole numbers, as its default is."""
        return isinstance(self.value, int)

    @property
    def range(self) -> str:
        """What is allowed, in words: `> 0`, `>= 0 and <= 1`, `smooth | rough`; empty when everything is."""
        if self.values:
            return " | ".join(self.values)
        limits = ((">", self.above), (">=", self.min), ("<", self.below), ("<=", self.max))
        return " and ".join(f"{sign} {limit:g}" for sign, limit in limits if limit is not None)


def checked(parameter: Parameter, value: Value) -> Value:
    """`value` as the type that `parameter` has, None when it is optional and not set; DembarkError when not allowed."""
    if value is None or (value == UNSET and UNSET not in parameter.values):
        if parameter.optional:
            return None
        raise DembarkError(f"{parameter.name} must have a value", parameter.range)
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise DembarkError(f"{parameter.name} = {value!r} is neither a number nor a word", parameter.range)
    if parameter.values:
        if value not in parameter.values:
            raise DembarkError(f"{parameter.name} = {value!r} is not allowed", f"allowed are {parameter.range}")
        return value
    unlimited = value == "inf" == str(parameter.value)
    number = math.inf if unlimited else to_si(value, parameter.unit, parameter.name) if isinstance(value, str) else value
    # Only a case itself may mean "unlimited", by an infinite default; nan differs from everything.
    if number != parameter.value or parameter.is_whole:
        finite(number, parameter.name)
    if parameter.is_whole and number != int(number):
        raise DembarkError(f"{parameter.name} = {number!r} is not a whole number", parameter.range)
    number = int(number) if parameter.is_whole else float(number)
    limits = ((operator.gt, parameter.above), (operator.ge, parameter.min), (operator.lt, parameter.below), (operator.le, parameter.max))
    if not all(limit is None or within(number, limit) for within, limit in limits):
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        raise DembarkError(f"{parameter.name} = {number:g}{unit} is out of range", f"it must be {parameter.range}")
    return number


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
    """Variants that differ in one parameter, `along`, and are looked at together, in this order.

    `formal_order`: that of the scheme in `along`, which the grid convergence index of campaigns along it takes.
    """

    name: str
    title: str
    along: str
    variants: tuple[str, ...]
    description: str = ""
    formal_order: Expression = FIRST_ORDER

    @property
    def folder_name(self) -> str:
        """Its folder name, next to the variants."""
        return STUDY_PREFIX + self.name


@dataclass(frozen=True)
class Declared:
    """A quantity as its case declares it, before anything is measured; `name` and `label` may hold one `*` for a part that the measurement
    names.

    evidence : experiment, theory, code or identity: what its reference is; empty where there is none
    tolerance : largest allowed deviation from the reference, relative unless `absolute`; "bound": a bound that the theory gives for the
        parameters of the run, which the measurement computes; None: nothing to pass or fail
    why : the reason of the tolerance
    input_uncertainty : by how much inputs that the source does not state change the deviation, 95 % half-width in its unit; part of the
        interval of the comparison with the reference, not of that of the value
    inputs : which they are, and what was run
    agreement : largest allowed difference of two engines where nothing is random, in the unit of the value or, with `agreement_of`, in that
    compared : whether engines are compared in it
    control : wrong physics that fails it, as tests prove; a check without any is not counted
    independent : whether the reference is something else than other measured numbers of the same run
    family : name of the fact that it measures; all quantities, variants and engines of the case with that name count as one check
    """

    name: str
    label: str
    unit: str = "1"
    evidence: str = ""
    tolerance: float | str | None = None
    why: str = ""
    input_uncertainty: float = 0.0
    inputs: str = ""
    absolute: bool = False
    source: str = ""
    detail: str = ""
    agreement: float | None = None
    compared: bool = True
    control: str = ""
    independent: bool = True
    family: str = ""


@dataclass(frozen=True)
class Finding:
    """Why checks fail: the `cause` of the failures of `quantities` in `variants`, all of them when none is named."""

    quantities: tuple[str, ...]
    cause: str
    variants: tuple[str, ...] = ()


@dataclass(frozen=True)
class Case:
    """A case folder: its parameters, profiles and variants (overrides of parameters by name), what a profile runs and what is measured.

    `derived`: numbers that follow from the parameters, by expressions; a setup.py next to the case file may add others, and the packing.
    `controls`: wrong physics, in words, with the declared quantities whose checks it fails. `needs`: capabilities that an engine has to
    have where a condition between the parameters holds. `findings`: known causes of failures. `walls`: see `case.walls`. `paired`: the
    initial packing decides what comes out, and engines are compared packing by packing. `rates`: particle-steps per second and core that
    were measured, by engine.
    """

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
    derived: Mapping[str, Expression] = field(default_factory=dict)
    quantities: Mapping[str, Declared] = field(default_factory=dict)
    controls: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    references: tuple[Mapping[str, str], ...] = ()
    picture: Mapping[str, Value] = field(default_factory=dict)
    walls: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    needs: Mapping[str, Expression] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    paired: bool = False
    rates: Mapping[str, float] = field(default_factory=dict)

    def picture_of(self, values: Mapping[str, Value]) -> dict[str, Any] | None:
        """How the report shows a run with these parameters and derived numbers: [picture] with its expressions evaluated; None without."""
        return {key: Expression(value)(values) if isinstance(value, str) and key not in PICTURE_WORDS else value
                for key, value in self.picture.items()} or None

    def missing_capabilities(self, engine: str, values: Mapping[str, Value]) -> list[str]:
        """What a run with the parameters `values` needs and `engine` lacks, in words."""
        where = f"[needs] of case {self.name}"
        return engines.facts(engine).missing_capabilities(
            name for name, condition in self.needs.items() if condition.evaluated(values, where=where))

    def deck(self, engine: str) -> Path:
        """Deck of `engine` in this folder."""
        return self.folder / engines.facts(engine).deck

    def declared(self, name: str) -> tuple[Declared, str] | None:
        """The declaration of the measured quantity `name`, and the part that stands for its `*`; None when there is none."""
        if name in self.quantities:
            return self.quantities[name], ""
        for pattern, one in self.quantities.items():
            before, star, after = pattern.partition("*")
            if star and name.startswith(before) and name.endswith(after) and len(name) > len(before) + len(after):
                return one, name[len(before) : len(name) - len(after)]
        return None

    def unmeasured(self, names: Iterable[str]) -> list[str]:
        """Names of the declared checks that are none of the measured quantities `names`."""
        found = {known[0].name for name in names if (known := self.declared(name))}
        return [name for name, one in self.quantities.items() if one.tolerance is not None and name not in found]

    def cause(self, name: str, declared: str, variant: str) -> str:
        """The known cause of a failure of the quantity `name`, declared under `declared`, in `variant`; "" when none is known."""
        return next((one.cause for one in self.findings
                     if {name, declared} & set(one.quantities) and variant in (one.variants or (variant,))), "")

    def formal_order(self, along: str) -> Expression:
        """Formal order of the scheme in the parameter `along`, as the first study along it says; 1 where there is none."""
        return next((study.formal_order for study in self.studies.values() if study.along == along), FIRST_ORDER)

    def with_derived(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """`values` and the numbers that follow from them by the expressions of [derived]; DembarkError for one without a value."""
        known: dict[str, Value] = dict(values)
        for name, expression in self.derived.items():
            known[name] = expression.evaluated(known, name, f"[derived] of case {self.name}")
        return known

    def particle_count(self, values: Mapping[str, Value]) -> int | None:
        """Number of bodies in a run with these parameters; None when the case does not say."""
        known = self.with_derived(values)
        found = self.particles(known) if self.particles else known.get("grain_count", known.get("log_count"))
        return round(found) if isinstance(found, int | float) else None
