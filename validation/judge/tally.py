"""How many checks passed, failed and stayed open, by kind of evidence: the numbers that screen and reports show.

One fact is one check: quantities of a family, such as a measured angle in three engines, count once. The family fails when one of them
fails, and is open when one of them is open.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from dembark.common.errors import DembarkError
from dembark.common.files import read_json
from dembark.validation.case.folders import find
from dembark.validation.case.model import EVIDENCE

from .result import QuantityRecord, Result, from_json, results

Item = TypeVar("Item")

VERIFICATION = "verification.json"
# What each kind of evidence means, for people; "" is that of cases that do not say.
MEANING = {"experiment": "measurements, formulas fitted to them", "theory": "laws and exact solutions", "code": "another code or engine",
           "identity": "conservation laws, the scheme against itself", "": "not stated"}


@dataclass(frozen=True)
class Counts:
    """Numbers of quantities: checks that passed, failed or could not be decided (open), and those without a check; apart from
    them checks that passed but are not counted, for no wrong physics is known to fail them (uncontrolled), and checks that did not fail
    against what the parameters were fitted to (calibrated)."""

    passed: int = 0
    failed: int = 0
    open: int = 0
    information: int = 0
    uncontrolled: int = 0
    calibrated: int = 0

    @property
    def checks(self) -> int:
        """Checks that count, with a verdict or open."""
        return self.passed + self.failed + self.open

    @property
    def sentence(self) -> str:
        """`12 checks passed, 1 FAILED, 3 open`."""
        plural = "s" if self.checks > 1 else ""
        failed = f"{self.failed} FAILED" if self.failed else "none failed"
        text = f"{self.passed} of {self.checks} check{plural} passed, {failed}" if self.checks else "no checks"
        return (text + (f", {self.open} open" if self.open else "")
                + (f"; {self.uncontrolled} without a negative control not counted" if self.uncontrolled else "")
                + (f"; {self.calibrated} calibrated, not counted" if self.calibrated else ""))


@dataclass(frozen=True)
class Tally(Counts):
    """Counts of all quantities, and `by_evidence` of each kind that occurs among the checks, in the order of EVIDENCE; `unread`: a line
    for each result that could not be read and is not counted. `random`: checks that rest on intervals, of which `by_chance` are expected
    to fail if every model held exactly. `members`: judged quantities that the checks unite. `unmeasured`: declared checks that no result
    measured, `case: names`."""

    members: int = 0
    by_evidence: Mapping[str, Counts] = field(default_factory=dict)
    random: int = 0
    by_chance: float = 0.0
    unread: tuple[str, ...] = ()
    unmeasured: tuple[str, ...] = ()

    @property
    def sentences(self) -> list[str]:
        """A line for each kind of evidence, `theory (laws and exact solutions): 3 of 4 checks passed, 1 FAILED`, and each unread result."""
        lines = [f"{kind or 'evidence'} ({MEANING[kind]}): {counts.sentence}" for kind, counts in self.by_evidence.items()]
        united = f"families: {self.members} judged values make {self.checks} checks: values that measure the same thing count once"
        return [*lines, *([united] if self.members > self.checks else []), *([self.multiplicity] if self.random else []),
                *([f"declared, but measured by no run: {'; '.join(self.unmeasured)}"] if self.unmeasured else []),
                *(f"not counted: {line}" for line in self.unread)]

    @property
    def multiplicity(self) -> str:
        """How many checks rest on intervals, and how many of these would fail by chance."""
        return (f"chance: {self.random} of the checks rest{'s' if self.random == 1 else ''} on intervals; if every model held exactly, "
                f"at most {self.by_chance:.1g} failures would be expected")


NOT_COUNTED = ("uncontrolled", "calibrated")
# How a family stands: as the first of these does that occurs among its members.
ORDER = ("failed", "calibrated", "open", "passed", "uncontrolled", "information")


def families(items: Iterable[Item], record: Callable[[Item], QuantityRecord]) -> list[tuple[str, list[Item]]]:
    """`items`, each with the quantity `record`, by families, in the order of their first members, with how each family stands; an item
    without a family stands by itself."""
    found: dict[tuple[str, str], list[Item]] = {}
    for number, item in enumerate(items):
        one = record(item)
        found.setdefault((one.evidence, one.family or str(number)), []).append(item)
    return [(min((record(item).standing for item in family), key=ORDER.index), family) for family in found.values()]


def tally(quantities: Iterable[QuantityRecord]) -> Tally:
    """Count the families of `quantities` by how they stand, and by kind of evidence."""
    kinds: dict[str, Counter[str]] = {kind: Counter() for kind in (*EVIDENCE, "")}
    members, chances = 0, []
    for standing, family in families(quantities, lambda one: one):
        checks = [one for one in family if one.standing != "information"]
        kinds[family[0].evidence][standing] += 1
        members += sum(one.standing not in NOT_COUNTED for one in checks)
        # Members are correlated: their sum is an upper limit of the probability that one of them fails.
        if known := [one.chance for one in checks if one.chance is not None and one.standing != "calibrated"]:
            chances.append(min(1.0, sum(known)))
    total = sum(kinds.values(), Counter())
    by_evidence = {kind: Counts(*_numbers(counts)) for kind, counts in kinds.items() if counts.keys() - {"information"}}
    return Tally(*_numbers(total), members=members, by_evidence=by_evidence, random=len(chances), by_chance=sum(chances))


def _numbers(counts: Counter[str]) -> tuple[int, int, int, int, int, int]:
    return tuple(counts[one] for one in ("passed", "failed", "open", "information", "uncontrolled", "calibrated"))  # type: ignore[return-value]


def of_folder(folder: Path) -> Tally:
    """The tally of everything judged in a results folder: quantities, comparisons of engines, and the verification of the instruments."""
    found, compared, unread = results(folder)
    verified = [one for item in (read_json(folder / VERIFICATION) or {}).get("items", []) for one in item["quantities"]]
    counted = tally([*(one for each in found for one in each.quantities), *(one for each in compared for one in each.quantities),
                     *(from_json(one, QuantityRecord, VERIFICATION) for one in verified)])
    return replace(counted, unread=tuple(unread), unmeasured=tuple(_unmeasured(found)))


def _unmeasured(found: Iterable[Result]) -> Iterator[str]:
    names: dict[str, set[str]] = {}
    for one in found:
        names.setdefault(one.case, set()).update(quantity.name for quantity in one.quantities)
    for case, measured in sorted(names.items()):
        try:
            gone = find(case).unmeasured(measured)
        except DembarkError:  # a case that is no longer there has results all the same
            continue
        if gone:
            yield f"{case}: {', '.join(gone)}"
