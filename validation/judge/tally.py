"""How many checks passed, failed and stayed open, by kind of evidence: what every place says that speaks of verdicts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from dembark.common.files import read_json
from dembark.validation.case.model import EVIDENCE
from dembark.validation.judge.result import QuantityRecord, from_json, results

VERIFICATION = "verification.json"
# What each kind of evidence means, for people; "" is that of cases that do not say.
MEANING = {"experiment": "measured values", "theory": "laws and exact solutions", "code": "another code or engine",
           "identity": "conservation laws, the scheme against itself", "": "not stated"}


@dataclass(frozen=True)
class Counts:
    """Numbers of quantities: checks that passed, failed or could not be decided (open), and those that nothing was due of."""

    passed: int = 0
    failed: int = 0
    open: int = 0
    information: int = 0

    @property
    def checks(self) -> int:
        """Checks, with a verdict or open."""
        return self.passed + self.failed + self.open

    @property
    def sentence(self) -> str:
        """`12 checks passed, 1 FAILED, 3 open`."""
        if not self.checks:
            return "no checks"
        plural = "s" if self.checks > 1 else ""
        failed = f"{self.failed} FAILED" if self.failed else "none failed"
        return f"{self.passed} of {self.checks} check{plural} passed, {failed}" + (f", {self.open} open" if self.open else "")


@dataclass(frozen=True)
class Tally(Counts):
    """Counts of all quantities, and `by_evidence` of each kind that occurs among the checks, in the order of EVIDENCE; `unread`: a line
    for each result that could not be read and is not counted. `random`: checks that rest on intervals, of which `by_chance` are expected
    to fail if every model held exactly."""

    by_evidence: Mapping[str, Counts] = field(default_factory=dict)
    random: int = 0
    by_chance: float = 0.0
    unread: tuple[str, ...] = ()

    @property
    def sentences(self) -> list[str]:
        """A line for each kind of evidence, `theory (laws and exact solutions): 3 of 4 checks passed, 1 FAILED`, and each unread result."""
        lines = [f"{kind or 'evidence'} ({MEANING[kind]}): {counts.sentence}" for kind, counts in self.by_evidence.items()]
        return [*lines, *([self.multiplicity] if self.random else []), *(f"not counted: {line}" for line in self.unread)]

    @property
    def multiplicity(self) -> str:
        """How many checks rest on intervals, and how many of these would fail by chance."""
        return (f"chance: {self.random} of the checks rest{'s' if self.random == 1 else ''} on intervals; if every model held exactly, "
                f"{self.by_chance:.1g} of them would fail")


def tally(quantities: Iterable[QuantityRecord]) -> Tally:
    """Count `quantities` by how they stand, and by kind of evidence."""
    kinds: dict[str, Counter[str]] = {kind: Counter() for kind in (*EVIDENCE, "")}
    chances: list[float] = []
    for one in quantities:
        kinds[one.evidence][one.standing] += 1
        if one.chance is not None and one.standing != "information":
            chances.append(one.chance)
    total = sum(kinds.values(), Counter())
    by_evidence = {kind: Counts(*_numbers(counts)) for kind, counts in kinds.items() if counts.keys() - {"information"}}
    return Tally(*_numbers(total), by_evidence=by_evidence, random=len(chances), by_chance=sum(chances))


def _numbers(counts: Counter[str]) -> tuple[int, int, int, int]:
    return counts["passed"], counts["failed"], counts["open"], counts["information"]


def of_folder(folder: Path) -> Tally:
    """The tally of everything judged in a results folder: quantities, comparisons of engines, and the verification of the instruments."""
    found, compared, unread = results(folder)
    verified = [one for item in (read_json(folder / VERIFICATION) or {}).get("items", []) for one in item["quantities"]]
    counted = tally([*(one for each in found for one in each.quantities), *(one for each in compared for one in each.quantities),
                     *(from_json(one, QuantityRecord, VERIFICATION) for one in verified)])
    return replace(counted, unread=tuple(unread))
