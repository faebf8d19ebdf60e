"""What a report shows, collected from a results folder: results, comparisons, and the runs that should be there but are not."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError
from dembark.validation import verification
from dembark.validation.case.folders import files, load
from dembark.validation.case.model import STUDY_PREFIX, Case
from dembark.validation.judge.result import ComparedRecord, Comparison, QuantityRecord, Result, results, unplanned
from dembark.validation.results import plan, states
from dembark.validation.verification.item import Item

from .figures import engine_name

_SINGLE = "Single runs: what else a profile would run is not listed here."
# What stands for the case of quantities of the instruments.
VERIFIED = "verification"
# What comparisons of variants leave out: they are due to differ, or say how long and often a run is repeated.
_REPEATS = ("seed", "replicas", "frames", "grain_count", "settle_time", "measure_time")


@dataclass(frozen=True)
class Row:
    """A judged quantity and where it was measured: `place` is the variant for people, `anchor` that of its section, `engine` "" when no
    engine measured it."""

    case: str
    place: str
    anchor: str
    engine: str
    record: QuantityRecord

    @property
    def who(self) -> str:
        """The engine, or the pair of a comparison, for people."""
        if isinstance(self.record, ComparedRecord):
            return f"{engine_name(self.record.engine)} / {engine_name(self.record.reference_engine)}"
        return engine_name(self.engine) if self.engine else "dembark"


@dataclass
class Page:
    """One variant of a case: `results` by engine, the `comparison` of the engines, `missing` runs in words."""

    case: str
    variant: str
    folder: Path
    title: str = ""
    description: str = ""
    results: dict[str, Result] = field(default_factory=dict)
    comparison: Comparison | None = None
    missing: list[str] = field(default_factory=list)

    @property
    def is_study(self) -> bool:
        """Whether it looks at several variants together."""
        return self.variant.startswith(STUDY_PREFIX)

    @property
    def anchor(self) -> str:
        """Identifier within the document and stem of file names."""
        return f"{self.case}-{self.variant}"

    @property
    def words(self) -> str:
        """The variant for people."""
        return self.variant.replace("_", " ").replace("-", " ")

    @property
    def name(self) -> str:
        """Case and variant for people."""
        return f"{self.case.replace('_', ' ')}, {self.words}"

    def rows(self) -> Iterator[Row]:
        """All that was judged, engine by engine, then the comparison of the engines."""
        for engine, one in sorted(self.results.items()):
            yield from (Row(self.case, self.words, self.anchor, engine, record) for record in one.quantities)
        for record in self.comparison.quantities if self.comparison else ():
            yield Row(self.case, self.words, self.anchor, record.engine, record)


@dataclass(frozen=True)
class ReportData:
    """A results folder: its `pages`, the verification of the instruments, `missing` runs and unreadable results in one line each, and
    the content of `plan.json`."""

    folder: Path
    pages: list[Page]
    items: list[Item]
    cases: Mapping[str, Case]
    unread: list[str]
    summary: Mapping[str, Any]

    @property
    def rows(self) -> list[Row]:
        """Everything judged."""
        verified = [Row(VERIFIED, item.title, VERIFIED, "", record) for item in self.items for record in item.quantities]
        return [*(row for page in self.pages for row in page.rows()), *verified]

    def title(self, case: str) -> str:
        """The case in few words, for tables."""
        if case == VERIFIED:
            return "Verification"
        return self.cases[case].title.partition(":")[0] if case in self.cases else case.replace("_", " ")

    @property
    def left_out(self) -> str:
        """Optional engines that are not installed, and results that nobody asked for, in a sentence each; empty when there are none."""
        names = [engine_name(engine) for engine in self.summary.get("left_out", {})]
        others = [f"{' '.join(place.parts[:-1]).replace('_', ' ')} ({engine_name(place.name)})" for place in unplanned(self.folder)]
        return " ".join([*([f"Left out, because not installed on this machine: {', '.join(names)}."] if names else []),
                         *([f"Not shown, because not asked for: {', '.join(others)}."] if others else [])])

    @property
    def missing(self) -> list[str]:
        """A line for each run that is missing and each result that cannot be read."""
        return [*(f"{page.name}: {line}" for page in self.pages for line in page.missing), *self.unread]


def gather(folder: Path) -> ReportData:
    """Everything that `plan.json` expects in a results folder, and everything that is there; without it, nothing is known to be missing."""
    summary = plan(folder) or {"description": _SINGLE}
    cases, unread = _cases(summary.get("cases", ()))
    pages: dict[tuple[str, str], Page] = {}

    def page(case: str, variant: str) -> Page:
        return pages.setdefault((case, variant), Page(case, variant, folder / case / variant))

    expected = list(_expected(folder))
    for case, variant, _, line in expected:
        page(case, variant).missing += [line] if line else []
    measured, compared, damaged = results(folder)
    unread += damaged
    for found in measured:
        one = page(found.case, found.variant)
        one.results[found.engine] = found
        one.title, one.description = found.title, found.description
    for comparison in compared:
        page(comparison.case, comparison.variant).comparison = comparison
    failed = {run[:3] for run in expected if run[3]}
    for case, variant, engine in sorted({run[:3] for run in expected} - failed):
        if engine not in pages[case, variant].results:
            pages[case, variant].missing.append(f"{engine_name(engine)}: could not be measured")

    def order(one: Page) -> tuple[Any, ...]:
        """Variants as the case lists them, for the first ones are shown with all their figures; then those of campaigns by name."""
        names = list(cases[one.case].variants) if one.case in cases else []
        return one.case, one.is_study, names.index(one.variant) if one.variant in names else len(names), one.variant

    ordered = sorted(pages.values(), key=order)
    return ReportData(folder, ordered, verification.read(folder), cases, unread, summary)


def _cases(only: Collection[str]) -> tuple[dict[str, Case], list[str]]:
    """The cases by name, all or `only` these, and a line for each that cannot be read: a report of old results must not fail because a case
    is being edited."""
    found: dict[str, Case] = {}
    unread: list[str] = []
    for path in files():
        if only and path.parent.name not in only:
            continue
        try:
            found[path.parent.name] = load(path)
        except DembarkError as error:
            unread.append(f"case {path.parent.name}: {error}")
    return found, unread


def _expected(folder: Path) -> Iterator[tuple[str, str, str, str]]:
    """(case, variant, engine, why it is missing or '') of every planned run."""
    for state in states(folder):
        case, variant, engine, replica = Path(state.folder).parts
        why = state.message or ("missing" if state.state == "waiting" else state.state)
        reason = "" if state.state == "finished" else f"{engine_name(engine)}, replica {replica.removeprefix('replica-')}: {why}"
        yield case, variant, engine, reason


@dataclass(frozen=True)
class Variation:
    """Two variants in one engine that differ in one parameter: its values `own` and `other`, and the quantities of both."""

    engine: str
    parameter: str
    own: Any
    other: Any
    variant: str
    pairs: list[tuple[QuantityRecord, QuantityRecord]]


def variations(page: Page, pages: list[Page]) -> list[Variation]:
    """Variants of the same case that differ from `page` in one parameter only."""
    found = []
    for other in pages:
        if other.case != page.case or other is page or page.is_study or other.is_study:
            continue
        for engine in sorted(page.results.keys() & other.results.keys()):
            one, two = page.results[engine], other.results[engine]
            changed = [key for key in one.parameters.keys() | two.parameters.keys()
                       if one.parameters.get(key) != two.parameters.get(key) and key not in _REPEATS]
            if len(changed) == 1:
                pairs = [(mine, its) for mine in one.quantities if mine.compared and (its := two.find(mine.name))]
                found.append(Variation(engine, changed[0].replace("_", " "), one.parameters.get(changed[0]), two.parameters.get(changed[0]),
                                    other.words, pairs))
    return found
