"""Facts: the rows of all tables of judged values, with the engines as columns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from dembark.validation.judge.result import ComparedRecord, Interval
from dembark.validation.judge.tally import ORDER

from .gather import Row


@dataclass(frozen=True)
class Cell:
    """The value of an engine with its 95 % interval, and how it stands; "" where the fact is the agreement of engines."""

    value: float | None
    interval: Interval | None
    standing: str = ""


@dataclass(frozen=True)
class Fact:
    """Judged values of one fact, of one case and one kind of evidence."""

    rows: tuple[Row, ...]

    @cached_property
    def worst(self) -> Row:
        """The value that decides how the fact stands; of several the one with the largest deviation over its tolerance."""
        return min(self.rows, key=_rank)

    @property
    def standing(self) -> str:
        """As of `worst`."""
        return self.worst.record.standing

    @property
    def is_pair(self) -> bool:
        """Whether engines are compared with each other."""
        return isinstance(self.worst.record, ComparedRecord)

    @property
    def kind(self) -> str:
        """The evidence, for people."""
        return "agreement of the engines" if self.is_pair else self.worst.record.evidence

    @property
    def order(self) -> int:
        """Place of the standing in a sorted table: what failed is first."""
        return ORDER.index(self.standing)

    @property
    def is_check(self) -> bool:
        """Whether anything was due."""
        return self.standing != "information"

    @property
    def places(self) -> list[str]:
        """The variants for people."""
        return list(dict.fromkeys(row.place for row in self.rows))

    @property
    def titles(self) -> list[str]:
        """The quantities for people."""
        return list(dict.fromkeys(row.record.title for row in self.rows))

    @property
    def title(self) -> str:
        """The quantity, or the name of a family of several."""
        return self.titles[0] if len(self.titles) == 1 else self.worst.record.family.partition(": ")[2] or self.worst.record.title

    @cached_property
    def cells(self) -> dict[str, Cell]:
        """The worst value of each engine; of a comparison the values compared."""
        found: dict[str, Cell] = {}
        for row in sorted(self.rows, key=_rank, reverse=True):
            one = row.record
            if isinstance(one, ComparedRecord):
                found[one.reference_engine] = Cell(one.reference, one.reference_interval)
            found[row.engine] = Cell(one.value, one.interval, "" if isinstance(one, ComparedRecord) else one.standing)
        return found

    @property
    def members(self) -> list[Fact]:
        """What it unites: quantities, variants, and pairs of engines; empty when it is one of these alone."""
        groups: dict[tuple[str, ...], list[Row]] = {}
        for row in self.rows:
            groups.setdefault((row.anchor, row.place, row.record.name, _pair(row)), []).append(row)
        return [Fact(tuple(group)) for group in groups.values()] if len(groups) > 1 else []

    def label(self, member: Fact) -> str:
        """What `member` is among the others."""
        row = member.worst
        parts = [row.place] * (len(self.places) > 1) + [row.record.title] * (len(self.titles) > 1) + [_pair(row)] * bool(_pair(row))
        return ", ".join(parts) or row.record.name.replace("_", " ")

    @property
    def notes(self) -> list[str]:
        """What is to be known of it: why it stands so, the reference, the intervals, and what fails it; each once."""
        worst, records = self.worst.record, [row.record for row in self.rows]
        parts = [worst.reason, worst.decides and f"decided by {worst.decides}", worst.cause if self.standing == "failed" else ""]
        for one in records:
            # Of engines that are compared, these say nothing that the row does not.
            parts += [] if self.is_pair else [one.detail, one.source]
            parts += [one.calibrated, one.control and f"fails with: {one.control}", one.basis and f"95 % intervals: {one.basis}"]
        return list(dict.fromkeys(filter(None, parts)))


def _rank(row: Row) -> tuple[int, float]:
    """Smaller is worse: by standing, then by the deviation over the tolerance."""
    one = row.record
    return ORDER.index(one.standing), -abs(one.deviation or 0.0) / (one.tolerance or 1.0)


def _pair(row: Row) -> str:
    return row.who if isinstance(row.record, ComparedRecord) else ""


def facts(rows: Iterable[Row]) -> list[Fact]:
    """`rows` by families, in the order of their first members; without a family, one quantity of a variant in all engines is a fact."""
    found: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        one = row.record
        found.setdefault((one.evidence, one.family or f"{row.anchor} {row.place} {one.name} {_pair(row)}"), []).append(row)
    return [Fact(tuple(group)) for group in found.values()]


def quantities(found: Iterable[Fact]) -> list[Fact]:
    """The facts of each quantity of a case as one, for tables that are too short for all its variants."""
    groups: dict[tuple[str, ...], list[Row]] = {}
    for one in found:
        row = one.worst
        groups.setdefault((row.case, row.record.evidence, row.record.name, str(bool(_pair(row)))), []).extend(one.rows)
    return [Fact(tuple(group)) for group in groups.values()]


def engines(found: Iterable[Fact]) -> list[str]:
    """The columns of a table of these facts."""
    return sorted({engine for one in found for engine in one.cells})
