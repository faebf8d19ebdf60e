"""The report of a campaign's folder, alone or against another campaign: its chapters in the report that profiles have too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dembark.common.errors import RunError
from dembark.common.files import write_whole
from dembark.validation.campaigns.report import against as other
from dembark.validation.campaigns.report import figures, tables
from dembark.validation.campaigns.report.sweeps import Point, Sweep, numerical_errors, sweeps
from dembark.validation.judge.result import Comparison, Result
from dembark.validation.judge.tally import tally
from dembark.validation.report.build import write
from dembark.validation.report.figures import write_csv
from dembark.validation.report.gather import Gathered, gather
from dembark.validation.report.look import engine_name
from dembark.validation.report.sections import embed

# A page that shows everything shows nothing: the rest is in the tables.
_PANELS = 9


def build(folder: Path, against: Path | None = None) -> Path:
    """Write `report.html`, `report.pdf` and `figures/` into a campaign's `folder` and return the path of the HTML file.

    `against`: folder of another campaign, whose quantities are set beside these. RunError when there is nothing measured or a file
    cannot be written; the HTML comes last, so that it never stands there with an older PDF.
    """
    gathered = gather(folder)
    if not _results(gathered):
        raise RunError(f"nothing to report in {folder}", "the campaign has no measured run yet", "see 'dembark status'")
    return write(gathered, lambda drawn: _chapters(gathered, against, drawn))


def _results(gathered: Gathered) -> list[Result]:
    return [one for page in gathered.pages for one in page.results.values()]


def _chapters(gathered: Gathered, against: Path | None, drawn: Path) -> dict[str, Any]:
    name = gathered.summary.get("campaign") or gathered.folder.name
    found = sweeps(gathered.summary.get("sweeps", ()), gathered.pages, gathered.cases)
    return {"title": f"Campaign {name}", "sweeps": [_sweep(one, gathered, drawn) for one in found], "errors": numerical_errors(found),
            "against": None if against is None else _comparison(gathered, name, against, drawn)}


def _sweep(sweep: Sweep, gathered: Gathered, drawn: Path) -> dict[str, Any]:
    quantities = sweep.quantities()
    chosen, name = quantities[:_PANELS], sweep.name
    tables.write_table_csv(drawn / f"{name}.csv", sweep)
    write_whole(drawn / f"{name}.tex", tables.latex(sweep, quantities).encode())
    study = figures.study_figure(sweep, chosen)
    shown = [embed(study, drawn, f"{name}-study",
                   "Quantities along the sweep with 95 % intervals; grey and dashed: the reference of each point.")] if study else []
    maps = {engine: figures.map_figure(sweep, engine, chosen) for engine in sweep.engines}
    shown += [embed(one, drawn, f"{name}-map-{engine}",
                    f"{engine_name(engine)} over both parameters; a red frame marks a check that failed.")
              for engine, one in maps.items() if one]
    compared = {page.variant: page.comparison for page in gathered.pages if page.case == sweep.case}
    return {"sweep": sweep, "shown": len(chosen), "left_out": len(quantities) - len(chosen), "figures": shown,
            "verdicts": [_verdicts(sweep, point, compared.get(point.variant)) for point in sweep.points]}


def _verdicts(sweep: Sweep, point: Point, comparison: Comparison | None) -> dict[str, Any]:
    """One line of the table of checks: the tally of each engine and of the engines beside each other, and what failed."""
    groups: dict[str, Any] = {engine_name(engine): result.quantities for engine, result in sorted(point.results.items())}
    groups |= {"engines beside each other": comparison.quantities} if comparison else {}
    return {"values": {axis: point.values[axis] for axis in sweep.axes}, "counts": {who: tally(found) for who, found in groups.items()},
            "failed": [f"{who}: {one.title}" for who, found in groups.items() for one in found if one.standing == "failed"]}


def _comparison(gathered: Gathered, name: str, against: Path, drawn: Path) -> dict[str, Any]:
    before, after = _results(gather(against)), _results(gathered)
    if not before:
        raise RunError(f"nothing to compare with in {against}", "it has no measured run", "name the folder of another campaign")
    rows = other.differences(before, after)
    write_csv(drawn / "against.csv",
              ("case", "variant", "engine", "quantity", "before", "after", "relative_change", "change_over_joint_half_width", "state"),
              ([row.case, row.variant, row.engine, row.name, *(one and one.value for one in (row.before, row.after)), row.change,
                row.significance,
                row.state] for row in rows))
    shown = embed(figures.against_figure(rows), drawn, "against",
                  "Change of each quantity over its joint half-width; grey: within the interval.",
                  ["against.csv"])
    return {"name": against.name, "own_name": name, "rows": [row for row in rows if row.state == "changed"], "figure": shown,
            "counts": {state: sum(row.state == state for row in rows) for state in other.STATES}, "facts": other.facts(before, after)}
