"""The first pages: verdicts case by case, missing results, failed checks with their causes, bias and scatter, and open checks with what
decides them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from dembark.validation.case.model import EVIDENCE
from dembark.validation.judge.result import as_json, as_row
from dembark.validation.judge.tally import MEANING, Tally, families, tally

from . import scatter
from .facts import Fact, facts
from .gather import ReportData, Row

# Lines of each list that the PDF holds; what is left out is counted, and in the HTML. Checks are those of all cases together, of which
# each case shows as many as the others, but no fewer than CHECKS_OF_CASE.
MOST = {"failed": 8, "open": 18, "missing": 6, "checks": 300}
CHECKS_OF_CASE = 6

# The kinds of evidence in order of importance of a failure.
_WEIGHT = ("experiment", "theory", "identity", "", "code")

UNKNOWN = "The cause is not known."

_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class OpenLine:
    """Checks of a case that stayed open for one reason: how many, which, of which evidence, and what would decide them."""

    case: str
    reason: str
    count: int
    names: str
    decides: str
    evidence: list[str]


def open_lines(rows: Iterable[Row]) -> list[OpenLine]:
    """One line for each case and reason; numbers in brackets, which differ from quantity to quantity, are left out of the reason. As in the
    tally a family counts once, with the reason of its first open member, and not where it failed."""
    found: dict[tuple[str, str], list[list[Row]]] = {}
    for standing, family in families(rows, lambda row: row.record):
        if standing == "open":
            members = [row for row in family if row.record.standing == "open"]
            reason = re.sub(r" \([^()]*\d[^()]*\)", "", members[0].record.reason) or "there is no value to judge"
            found.setdefault((members[0].case, reason), []).append(members)
    return [OpenLine(case, reason, len(groups), _names(every), _range(row.record.decides for row in every),
                     sorted({row.record.evidence or "none" for row in every}))
            for (case, reason), groups in found.items() for every in [[row for group in groups for row in group]]]


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


@dataclass(frozen=True)
class CaseLine:
    """A case on the first page: `counts` by kind of evidence, and one sentence on what failed or is open."""

    case: str
    counts: Tally
    remark: str


def case_lines(rows: Sequence[Row], missing: Mapping[str, int]) -> list[CaseLine]:
    """One line for each case; `missing`: how many of its results there are not."""
    of_case: dict[str, list[Row]] = {case: [] for case in missing}
    for row in rows:
        of_case.setdefault(row.case, []).append(row)
    return [CaseLine(case, tally(row.record for row in group), _remark(group, missing.get(case, 0))) for case, group in of_case.items()]


def _remark(rows: Sequence[Row], missing: int) -> str:
    """The causes of what failed; else why most of the open checks are open."""
    lacking = [f"{missing} result{'s are' if missing > 1 else ' is'} missing."] if missing else []
    failed, undecided = [row for row in rows if row.record.standing == "failed"], open_lines(rows)
    causes = list(dict.fromkeys(row.record.cause for row in failed))
    known = next(filter(None, causes), "")
    if failed:
        lacking += [known or f"{UNKNOWN[:-1]} ({_names(failed)})."]
        lacking += [f"{len(causes) - 1} more cause{'s' * (len(causes) > 2)}, see below."] if len(causes) > 1 else []
    elif undecided:
        most = max(undecided, key=lambda one: one.count)
        lacking += [f"Open: {most.reason}{f'; decided by {most.decides}' if most.decides else ''}."]
    return " ".join(lacking)


def cause(fact: Fact) -> str:
    """Why a failed fact fails; "" where that is not known."""
    return next((row.record.cause for row in fact.rows if row.record.standing == "failed" and row.record.cause), "")


def failed_groups(found: Iterable[Fact]) -> list[tuple[str, list[Fact]]]:
    """The failed facts of the same case and cause together, with the cause, those of the most important evidence first."""
    groups: dict[tuple[str, str], list[Fact]] = {}
    for one in sorted((one for one in found if one.standing == "failed"), key=lambda one: _WEIGHT.index(one.worst.record.evidence)):
        groups.setdefault((one.worst.case, cause(one)), []).append(one)
    return [(why or UNKNOWN, group) for (_, why), group in groups.items()]


def context(gathered: ReportData) -> Mapping[str, Any]:
    """What the template shows on the first pages."""
    rows = gathered.rows
    found, counted = scatter.points(rows), tally(row.record for row in rows)
    judged = facts(rows)
    lacking = {page.case: 0 for page in gathered.pages}
    for page in gathered.pages:
        lacking[page.case] += len(page.missing)
    most = MOST | {"checks": max(CHECKS_OF_CASE, MOST["checks"] // max(1, len(lacking)))}
    return {"tally": counted, "kinds": [kind for kind in (*EVIDENCE, "") if kind or "" in counted.by_evidence], "meaning": MEANING,
            "cases": case_lines(rows, lacking), "failed": failed_groups(judged), "facts": judged, "open": open_lines(rows),
            "missing": gathered.missing, "points": found, "points_by_kind": scatter.kinds(found), "left_out": scatter.left_out(rows),
            "scatter_lines": len(scatter.lines(found)), "most": most}


def write_tables(folder: Path, rows: Sequence[Row], found: Sequence[scatter.Point]) -> None:
    """quantities.csv and scatter.csv."""
    quantities = [{"case": row.case, "variant": row.anchor.removeprefix(f"{row.case}-"), "who": row.who} | as_row(as_json(row.record))
                  for row in rows]
    table = pd.DataFrame(quantities).drop(columns=["engine", "reference_engine"], errors="ignore")
    table.rename(columns={"who": "engine", "name": "quantity"}).to_csv(folder / "quantities.csv", index=False)
    points = [asdict(one) | dict(zip(("case", "quantity"), one.line, strict=True)) for one in found]
    pd.DataFrame(points, columns=[*_POINTS]).rename(columns=_POINTS).to_csv(folder / "scatter.csv", index=False)


_POINTS = {"case": "case", "quantity": "quantity", "engine": "engine", "evidence": "evidence", "value": "measured",
           "reference": "reference", "half": "relative_half_width", "reference_half": "reference_relative_half_width"}
