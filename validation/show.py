"""Tables for a terminal: cases, the keys of a case, findings of the doctor and quantities with their verdicts."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from dembark.common.errors import RunError
from dembark.validation.case.model import Case
from dembark.validation.doctor import Finding
from dembark.validation.judge.result import Result
from dembark.validation.judge.tally import Tally

if TYPE_CHECKING:
    from dembark.validation.runs.workflow import Outcome

_SHOWN = {"passed": "[green]pass[/]", "failed": "[bold red]FAIL[/]", "open": "[yellow]open[/]", "information": "",
          "uncontrolled": "not counted", "calibrated": "calibrated"}
# Columns of the table of quantities that a narrow terminal does without, in this order, and the least width of the names there.
_NARROW = ("reference interval", "evidence", "95 % interval", "unit", "tolerance")
_LEAST = 20
# Columns of other tables that are names and numbers.
_UNBROKEN = ("case", "key", "value", "unit", "state")


def console() -> Console:
    """That of this process; a table that is piped into a file is not squeezed into 80 columns, unless COLUMNS says so."""
    found = Console(highlight=False)
    return found if found.is_terminal or os.environ.get("COLUMNS", "").isdecimal() else Console(highlight=False, width=200)


def _plain(*columns: str, title: str = "") -> Table:
    table = Table(title=escape(title) or None, title_justify="left", box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold", no_wrap=column in _UNBROKEN)
    return table


def number(value: Any) -> str:
    """A number with the digits that matter; other things as they are, nothing for None."""
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def interval(value: Any) -> str:
    """`1.2 ... 1.4` for a pair, nothing for None or a pair without numbers."""
    return f"{number(value[0])} ... {number(value[1])}" if value and None not in value else ""


def case_table(cases: Iterable[Case]) -> Table:
    """One row a case: name, title, engines, profiles, variants."""
    table = _plain("case", "title", "engines", "profiles", "variants")
    for case in cases:
        table.add_row(*map(escape, (case.name, case.title, ", ".join(case.engines), ", ".join(case.profiles), ", ".join(case.variants))))
    return table


def key_table(case: Case) -> Table:
    """One row a key: name, default, unit, what is allowed and what it means."""
    table = _plain("key", "value", "unit", "allowed", "meaning")
    for key in case.parameters.values():
        value = "not set" if key.value is None else f"{key.value:g}" if isinstance(key.value, float) else str(key.value)
        table.add_row(*map(escape, (key.name, value, key.unit, key.range, key.doc)))
    return table


def overrides_table(case: Case) -> Table:
    """One row a profile or variant with what it changes; profiles also say what they run."""
    table = _plain("profile or variant", "changes", "runs")
    for name, changes in case.profiles.items():
        runs = ", ".join(f"{run.variant} ({', '.join(run.engines)})" for run in case.runs.get(name, ()))
        table.add_row(escape(f"profile {name}"), escape(_changes(changes)), escape(runs))
    for name, changes in case.variants.items():
        table.add_row(escape(f"variant {name}"), escape(_changes(changes)), "")
    return table


def _changes(changes: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} = {number(value)}" for key, value in changes.items()) or "nothing"


def finding_table(findings: Iterable[Finding]) -> Table:
    """One row a finding: ok, MISSING (required) or absent (optional), and the version or the advice."""
    table = _plain("what", "state", "found, or what to do")
    for finding in findings:
        state = "[green]ok[/]" if finding.found else "[bold red]MISSING[/]" if finding.required else "[yellow]absent[/]"
        table.add_row(escape(finding.what), state, escape(finding.found or finding.advice))
    return table


def quantity_table(result: Result, width: int = 200) -> Table:
    """One row a quantity: value with interval, reference, deviation, tolerance, kind of evidence and verdict.

    Numbers are never split. Where `width` characters are too few for all columns, some are left out, which the title says.
    """
    columns: dict[str, list[str]] = {name: [] for name in ("quantity", "value", "95 % interval", "unit", "reference", "reference interval",
                                                           "deviation", "tolerance", "evidence", "verdict")}
    for one in result.quantities:
        cells = (escape(one.title), number(one.value), interval(one.interval), escape(one.unit), number(one.reference),
                 interval(one.reference_interval), number(one.deviation), number(one.tolerance), one.evidence, _SHOWN[one.standing])
        for cell, column in zip(cells, columns.values(), strict=True):
            column.append(cell)
    needed = {name: max(map(cell_len, (name, *(Text.from_markup(cell).plain for cell in cells)))) for name, cells in columns.items()}
    needed["quantity"] = min(_LEAST, needed["quantity"])
    left_out = []
    for name in _NARROW:
        if sum(needed[kept] for kept in columns) + 2 * (len(columns) - 1) > width:
            del columns[name]
            left_out.append(name)
    title = f"{result.case} {result.variant} {result.engine} ({result.profile})"
    more = f"; a wider window also shows {', '.join(left_out)}" if left_out else ""
    table = Table(title=escape(title + more), title_justify="left", box=None, pad_edge=False)
    for name in columns:
        table.add_column(name, overflow="fold", no_wrap=name != "quantity", min_width=None if name == "quantity" else needed[name])
    for row in zip(*columns.values(), strict=True):
        table.add_row(*row)
    return table


def open_lines(result: Result) -> list[str]:
    """Why quantities are open, failed, or have little meaning, and what would decide them: a line for each reason."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for one in result.quantities:
        decided = f"decided by {one.decides}" if one.decides else ""
        if one.verdict != "pass" and (reason := "; ".join(filter(None, (one.reason, one.cause, decided)))):
            reasons.setdefault((one.standing, reason), []).append(one.title)
    return [f"{standing}: {', '.join(names)}: {reason}" for (standing, reason), names in reasons.items()]


def print_tally(here: Console, counted: Tally, before: str = "") -> None:
    """How many checks passed, failed and are open: of all together, after what stands `before`, and a line for each kind of evidence."""
    here.print(before + counted.sentence, style="bold red" if counted.failed else "bold", soft_wrap=True)
    for line in counted.sentences:
        here.print(f"  {line}", markup=False, soft_wrap=True)


def show_outcome(outcome: Outcome, what: str, advice: str) -> None:
    """What a workflow came to, for people; RunError with `advice` when something of it is missing."""
    here = console()
    for line in outcome.unfinished:
        here.print(f"not finished: {line}", markup=False, style="red", soft_wrap=True)
    for line in outcome.left_out:
        here.print(f"left out: {line}", markup=False, soft_wrap=True)
    for line in outcome.problems:
        here.print(f"problem: {line}", markup=False, style="red", soft_wrap=True)
    print_tally(here, outcome.tally, f"{outcome.runs - len(outcome.unfinished)} of {outcome.runs} runs finished; ")
    if outcome.report:
        here.print(str(outcome.report), markup=False, soft_wrap=True)
    if not outcome.complete:
        count = len(outcome.unfinished) + len(outcome.problems) + (outcome.report is None)
        raise RunError(f"{what} is incomplete", f"{count} problem{'s' * (count > 1)} (above)", advice)
