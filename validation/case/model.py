"""What a case is: parameters, profiles, variants, planned runs, studies, and the quantities that are measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from dembark.common.choices import Value
from dembark.validation import engines
from dembark.validation.case.expressions import Expression
from dembark.validation.case.parameters import Parameter

STUDY_PREFIX = "study-"
# What a deck may be asked to write, and the file that it goes to; a case asks for the first three unless it says otherwise.
OUTPUTS = {"grains": "grains.dump", "contacts": "contacts.dump", "times": "time.csv", "impacts": "impacts.txt"}
STANDARD_OUTPUTS = ("grains", "contacts", "times")
# Kinds of evidence: what a reference is.
EVIDENCE = ("experiment", "theory", "code", "identity")


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
class Declared:
    """A quantity as its case declares it, before anything is measured; `name` and `label` may hold one `*` for a part that the measurement
    names.

    evidence : experiment, theory, code or identity: what its reference is; empty where there is none
    tolerance : largest allowed deviation from the reference, relative unless `absolute`; "bound": a bound that the theory gives for the
        parameters of the run, which the measurement computes; None: nothing to pass or fail
    why : the reason of the tolerance
    agreement : largest allowed difference of two engines where nothing is random, in the unit of the value or, with `agreement_of`, in that
    compared : whether engines are compared in it
    """

    name: str
    label: str
    unit: str = "1"
    evidence: str = ""
    tolerance: float | str | None = None
    why: str = ""
    absolute: bool = False
    source: str = ""
    detail: str = ""
    agreement: float | None = None
    compared: bool = True


@dataclass(frozen=True)
class Case:
    """A case folder: its parameters, profiles and variants (overrides of parameters by name), what a profile runs and what is measured.

    `derived`: numbers that follow from the parameters, by expressions; a setup.py beside the case file may add others, and the packing.
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
    references: tuple[str, ...] = ()
    picture: Mapping[str, Value] = field(default_factory=dict)

    def deck(self, engine: str) -> Path:
        """Deck of `engine` in this folder."""
        return self.folder / engines.facts(engine).deck

    def particle_count(self, values: Mapping[str, Value]) -> int | None:
        """Number of bodies in a run with these parameters; None when the case does not say."""
        found = self.particles(values) if self.particles else None
        if found is None:
            found = values.get("grain_count", values.get("log_count"))
        return round(found) if isinstance(found, int | float) else None
