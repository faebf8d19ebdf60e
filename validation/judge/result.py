"""What was measured and judged, as typed values: the only writer and reader of `metrics.json` and `comparison.json`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

from dembark.common.errors import RunError
from dembark.common.files import read_json, write_json
from dembark.validation.case.model import EVIDENCE

VERDICTS = ("pass", "fail", "info")
METRICS, COMPARISON = "metrics.json", "comparison.json"
# What was asked for in a results folder, and its planned runs; see validation.results.
PLAN = "plan.json"

Interval = tuple[float, float]
Kind = TypeVar("Kind", bound="QuantityRecord | Result | Comparison")


@dataclass(frozen=True)
class QuantityRecord:
    """A quantity as it stands in `metrics.json`: numbers in `unit` (None where there is none), 95 % intervals as (low, high).

    `verdict` is pass, fail or info, with its `reason`; `tolerance` None means that there is no check. `deviation` is value
    minus reference, over the reference when `deviation_kind` is "relative". `evidence`: what the reference is, one of EVIDENCE; "" is not
    stated. `compared`: the engines are to agree in it, within `agreement` (in `unit`) where nothing is random. `control`: wrong physics
    that fails the check; a pass of a check that nothing is known to fail is not counted. `independent`: the reference is not from other
    numbers of the same run. `chance`: probability that the check fails by chance alone, None where there is no chance. `family`: the fact
    that is measured; checks of one family count as one, "" is a check by itself. `cause`: why it fails, where that is known. `decides`:
    what would decide an open check. `samples`: the values of the replicas, in their order, where
    engines are compared packing by packing. `calibrated`: how parameters of the run were fitted to the reference; its agreement is no
    evidence.
    """

    name: str
    value: float | None
    verdict: str
    label: str = ""
    unit: str = "1"
    interval: Interval | None = None
    basis: str = ""
    reference: float | None = None
    reference_interval: Interval | None = None
    deviation: float | None = None
    deviation_kind: str = "relative"
    tolerance: float | None = None
    reason: str = ""
    detail: str = ""
    source: str = ""
    evidence: str = ""
    compared: bool = True
    deviation_half_width: float | None = None
    agreement: float | None = None
    control: str = ""
    independent: bool = True
    chance: float | None = None
    family: str = ""
    cause: str = ""
    decides: str = ""
    samples: tuple[float, ...] = ()
    calibrated: str = ""

    def __post_init__(self) -> None:
        """RunError for a verdict or a kind of evidence that does not exist."""
        for key, allowed in (("verdict", VERDICTS), ("evidence", ("", *EVIDENCE))):
            if getattr(self, key) not in allowed:
                raise RunError(f"{key} = {getattr(self, key)!r}", f"quantity {self.name!r}",
                               f"give one of {', '.join(filter(None, allowed))}")

    @property
    def title(self) -> str:
        """For people."""
        return self.label or self.name.replace("_", " ")

    @property
    def half(self) -> float | None:
        """Half-width of the interval."""
        return None if self.interval is None else 0.5 * (self.interval[1] - self.interval[0])

    @property
    def standing(self) -> str:
        """passed, uncontrolled (passed, but no wrong physics is known to fail it), failed, calibrated (not failed, but the reference was
        fitted), open (a check that could not be decided) or information (no check)."""
        if self.calibrated and self.verdict != "fail" and self.tolerance is not None:
            return "calibrated"
        if self.verdict == "pass":
            return "passed" if self.control else "uncontrolled"
        if self.verdict == "fail":
            return "failed"
        return "open" if self.tolerance is not None else "information"


@dataclass(frozen=True)
class ComparedRecord(QuantityRecord):
    """The same quantity in two engines: `value` of `engine` against `reference`, the value of `reference_engine`."""

    evidence: str = "code"
    control: str = "one engine a quarter off, or by twice the bound"
    engine: str = ""
    reference_engine: str = ""
    joint_half_width: float | None = None


@dataclass(frozen=True)
class Result:
    """The replicas of one case, variant and engine, measured and judged; or a study of several variants, with a `title` of its own.

    `profiles`: curves as `postproc.resampling.profile` makes them; `picture`: how to show the packing; `references`: cited works;
    `measured`: when and by which commit; `inputs`: hash of each replica's inputs; `replicas_missing`: numbers of those that did not finish;
    `inputs_hash`: that of all its inputs, see `judge.inputs`.
    """

    case: str
    variant: str
    engine: str
    quantities: tuple[QuantityRecord, ...]
    profile: str = ""
    title: str = ""
    description: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    profiles: tuple[Mapping[str, Any], ...] = ()
    remarks: tuple[str, ...] = ()
    picture: Mapping[str, Any] | None = None
    references: tuple[Mapping[str, Any], ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    measured: Mapping[str, Any] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    replicas_missing: tuple[int, ...] = ()
    inputs_hash: str = ""

    def find(self, name: str) -> QuantityRecord | None:
        """The quantity of that name; None when there is none."""
        return next((one for one in self.quantities if one.name == name), None)


@dataclass(frozen=True)
class Comparison:
    """The comparison of the engines of one case and variant: no two may differ by more than `cap`, relative."""

    case: str
    variant: str
    engines: tuple[str, ...]
    quantities: tuple[ComparedRecord, ...]
    profile: str = ""
    cap: float = 0.10
    measured: Mapping[str, Any] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    inputs_hash: str = ""


# Keys that JSON leaves out where they have their default.
_OPTIONAL = ("deviation_half_width", "agreement", "independent", "chance", "family", "cause", "decides", "samples", "calibrated", "title",
             "description")


def as_json(value: QuantityRecord | Result | Comparison) -> dict[str, Any]:
    """The value as JSON has it; what is optional and was not given is left out."""
    content: dict[str, Any] = {}
    for one in fields(value):
        item = getattr(value, one.name)
        if one.name == "quantities":
            content[one.name] = [as_json(part) for part in item]
        elif one.name not in _OPTIONAL or item != one.default:
            content[one.name] = list(item) if isinstance(item, tuple) else item
    return content


def as_row(quantity: Mapping[str, Any]) -> dict[str, Any]:
    """A quantity as JSON has it as a row of a table: intervals as low, high, reference_low, reference_high, without samples."""
    row = {key: value for key, value in quantity.items() if key not in ("interval", "reference_interval", "samples")}
    for end in ("", "reference_"):
        row[f"{end}low"], row[f"{end}high"] = quantity.get(f"{end}interval") or (None, None)
    return row


def write(path: Path, value: Kind) -> Kind:
    """Write `metrics.json` or `comparison.json`, completely or not at all; returns `value`."""
    write_json(path, as_json(value))
    return value


def read(path: Path) -> Result:
    """The Result in a `metrics.json`. RunError in one line when there is none or it lacks what every result has; a remark names keys that
    this version of dembark does not know."""
    return _read(path, Result)


def _read(path: Path, kind: type[Kind]) -> Kind:
    content = read_json(path)
    if content is None:
        raise RunError(f"{path} cannot be read", "the file does not exist or holds no JSON")
    return from_json(content, kind, str(path))


def from_json(content: Mapping[str, Any], kind: type[Kind], where: str = "") -> Kind:
    """The value that `as_json` wrote, see `read`; `where` is named in errors."""
    known = {one.name: one.default is one.default_factory is MISSING for one in fields(kind)}
    if missing := [key for key, needed in known.items() if needed and key not in content]:
        raise RunError(f"{where} has no {', '.join(missing)}", "it is not a result of this version of dembark", "measure it again")
    given: dict[str, Any] = {key: tuple(item) if isinstance(item, list) else item for key, item in content.items() if key in known}
    if "quantities" in given:
        part = ComparedRecord if kind is Comparison else QuantityRecord
        given["quantities"] = tuple(from_json(one, part, where) for one in given["quantities"])
        unknown = sorted({key for one in content["quantities"] for key in one.keys() - {field.name for field in fields(part)}}
                         | (content.keys() - known))
        if unknown:
            note = f"Written by another version of dembark; left out: {', '.join(unknown)}. Measure again for complete results."
            given["remarks"] = (*given.get("remarks", ()), note)
    return kind(**given)


def result_files(folder: Path) -> list[Path]:
    """The files of all results and comparisons below a results folder, in the order of their places; where `plan.json` says which were
    asked for, those."""
    planned = (read_json(folder / PLAN) or {}).get("results")
    return _every_file(folder) if planned is None else sorted(path for name in planned if (path := folder / name).is_file())


def unplanned(folder: Path) -> list[Path]:
    """Places of results of planned cases that `plan.json` does not ask for, relative to `folder`: its case was changed, or one was run
    alone."""
    counted = set(result_files(folder))
    cases = {path.relative_to(folder).parts[0] for path in counted}
    others = (path.relative_to(folder) for path in _every_file(folder) if path.name == METRICS and path not in counted)
    return [path.parent for path in others if path.parts[0] in cases]


def _every_file(folder: Path) -> list[Path]:
    return sorted(path for name in (f"*/*/*/{METRICS}", f"*/*/{COMPARISON}") for path in folder.glob(name)
                  if "superseded" not in path.relative_to(folder).parts)


def results(folder: Path) -> tuple[list[Result], list[Comparison], list[str]]:
    """All results and comparisons below a results folder in the order of their places, and a line for each file that cannot be read."""
    found: list[Result] = []
    compared: list[Comparison] = []
    problems: list[str] = []
    for path in result_files(folder):
        try:
            if path.name == METRICS:
                found.append(read(path))
            else:
                compared.append(_read(path, Comparison))
        except RunError as error:
            problems.append(str(error))
    return found, compared, problems
