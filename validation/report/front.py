"""The first pages: verdicts by kind of evidence, failed checks, missing results, and open checks with their reasons."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from dembark.validation.case.model import EVIDENCE
from dembark.validation.judge.result import QuantityRecord
from dembark.validation.judge.tally import MEANING, Counts, Tally, families, tally
from dembark.validation.report import figures, scatter
from dembark.validation.report.gather import Row

# Lines of each list that the first pages of the PDF hold; what is left out is counted, and in the HTML.
MOST = {"failed": 8, "open": 18, "missing": 6}

# The kinds of evidence in order of importance of a failure.
_WEIGHT = ("experiment", "theory", "identity", "", "code")

_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")

# Of a quantity in all tables, see `cells`.
COLUMNS = ("quantity", "label", "unit", "value", "low", "high", "reference", "reference_low", "reference_high", "deviation",
           "deviation_kind", "tolerance", "verdict", "evidence", "reason", "decides", "cause", "family", "detail",
           "source", "control")


@dataclass(frozen=True)
class OpenLine:
    """Checks of a case that stayed open for one reason: how many, which, and what would decide them."""

    case: str
    anchor: str
    reason: str
    count: int
    names: str
    decides: str


def open_lines(rows: Iterable[Row]) -> list[OpenLine]:
    """One line for each case and reason; numbers in brackets, which differ from quantity to quantity, are left out of the reason. A
    family counts once."""
    found: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        if row.record.standing == "open":
            reason = re.sub(r" \([^()]*\d[^()]*\)", "", row.record.reason) or "there is no value to judge"
            found.setdefault((row.case, reason), []).append(row)
    return [OpenLine(case, group[0].anchor, reason, len(families(row.record for row in group)), _names(group),
                     _range(row.record.decides for row in group)) for (case, reason), group in found.items()]


def _range(texts: Iterable[str]) -> str:
    """What decides several checks: where texts differ in one number only, its smallest and largest value; else the most frequent first."""
    found: dict[str, list[float]] = {}
    for text in filter(None, texts):
        found.setdefault(_NUMBER.sub("#", text, count=1), []).append(float(match[0]) if (match := _NUMBER.search(text)) else math.nan)
    lines = []
    for text, numbers in sorted(found.items(), key=lambda item: -len(item[1])):
        low, high = min(numbers), max(numbers)
        lines.append(text.replace("#", f"{low:g}" if low == high else f"{low:g} to {high:g}"))
    return "; ".join(lines[:2])


def _names(group: Sequence[Row]) -> str:
    """The first of the quantities, and how many more there are."""
    names = list(dict.fromkeys(row.record.title for row in group))
    first = names[0] if len(names[0]) <= 42 else names[0][:40].rsplit(" ", 1)[0] + " …"
    return first + (f" and {len(names) - 1} more" if len(names) > 1 else "")


def badness(row: Row) -> float:
    """Deviation over tolerance; what failed counts as worse than everything else."""
    one = row.record
    size = abs(one.deviation) / one.tolerance if one.deviation is not None and one.tolerance else abs(one.deviation or 0.0)
    return size + (1e9 if one.standing == "failed" else 0.0)


def evidence(counted: Tally) -> list[dict[str, Any]]:
    """Rows of the table of verdicts: each kind of evidence with its counts, and all together."""
    # A row also shows that nothing is compared with experiments.
    kinds = {kind: Counts() for kind in EVIDENCE} | dict(counted.by_evidence)
    return [*({"kind": kind or "not stated", "meaning": MEANING[kind] if kind else "not stated by the case", "counts": counts}
              for kind, counts in kinds.items()), {"kind": "all", "meaning": "", "counts": counted}]


def context(rows: Sequence[Row], missing: Sequence[str]) -> Mapping[str, Any]:
    """What the template shows on the first pages."""
    counted = tally(row.record for row in rows)
    found = scatter.points(rows)
    failed = sorted((row for row in rows if row.record.standing == "failed"),
                    key=lambda row: (_WEIGHT.index(row.record.evidence), row.case, row.record.cause))
    alike = (list(group) for _, group in groupby(failed, lambda row: (row.record.evidence, row.case, row.record.cause)))
    groups = [(sorted(group, key=badness, reverse=True), _names(group)) for group in alike]
    return {"tally": counted, "evidence": evidence(counted), "failed": failed, "failed_groups": groups,
            "open": open_lines(rows), "missing": missing, "points": found, "kinds": scatter.kinds(found),
            "left_out": scatter.left_out(rows), "scatter_lines": len(scatter.lines(found)), "most": MOST}


def cells(one: QuantityRecord) -> list[Any]:
    """A quantity as part of the row of a table, see COLUMNS."""
    return [one.name, one.label, one.unit, one.value, *(one.interval or (None, None)), one.reference,
            *(one.reference_interval or (None, None)), one.deviation, one.deviation_kind, one.tolerance, one.verdict, one.evidence,
            one.reason, one.decides, one.cause, one.family, one.detail, one.source, one.control]


def write_tables(folder: Path, rows: Sequence[Row], found: Sequence[scatter.Point]) -> None:
    """quantities.csv and scatter.csv."""
    figures.write_csv(folder / "quantities.csv", ("case", "variant", "engine", *COLUMNS),
                      ([row.case, row.anchor.removeprefix(f"{row.case}-"), row.who, *cells(row.record)] for row in rows))
    figures.write_csv(folder / "scatter.csv", ("case", "quantity", "engine", "evidence", "measured", "reference", "relative_half_width",
                                               "reference_relative_half_width"),
                      ((*one.line, one.engine, one.evidence, one.value, one.reference, one.half, one.reference_half) for one in found))
