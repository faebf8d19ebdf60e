"""Builds report.html, report.pdf and figures/ of a campaign's folder, alone or against another campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dembark.common.errors import RunError
from dembark.common.files import disk_error, write_whole
from dembark.validation.campaigns.report import against as other
from dembark.validation.campaigns.report import figures, tables
from dembark.validation.campaigns.report.gather import Campaign, gather
from dembark.validation.campaigns.report.sweeps import Point, Sweep, numerical_errors, words
from dembark.validation.report import figures as shared
from dembark.validation.report.build import embed, environment, machine, style, write_pdf

_HERE = Path(__file__).parent
# A page that shows everything shows nothing: the rest is in the tables.
_PANELS = 12


def build(folder: Path, against: Path | None = None) -> Path:
    """Write `report.html`, `report.pdf` and `figures/` into a campaign's `folder` and return the path of the HTML file.

    `against`: folder of another campaign, whose quantities are set beside these. RunError when there is nothing measured or a file
    cannot be written; the HTML comes last, so that it never stands there with an older PDF.
    """
    campaign = gather(folder)
    if not campaign.contents:
        raise RunError(f"nothing to report in {folder}", "the campaign has no measured run yet", "see 'dembark status'")
    drawn = folder / "figures"
    try:
        drawn.mkdir(parents=True, exist_ok=True)
        for old in drawn.iterdir():
            old.unlink()
        context = _context(campaign, drawn) | _comparison(campaign, against, drawn)
        html = environment(_HERE).get_template("campaign.html.j2").render(context)
        write_pdf(html, folder / "report.pdf")
        return write_whole(folder / "report.html", html.encode())
    except OSError as error:
        raise disk_error(error, folder) from None


def _context(campaign: Campaign, drawn: Path) -> dict[str, Any]:
    groups = _pairs(campaign)
    shared.write_csv(drawn / "scatter.csv",
                     ("kind", "quantity", "measured", "reference", "relative_half_width", "reference_relative_half_width"),
                     ([key, *one] for key, group in groups.items() for one in group))
    judged = [*campaign.contents, *campaign.comparisons]
    verdicts = [one["verdict"] for content in judged for one in content["quantities"] if one["tolerance"] is not None]
    return {
        "campaign": campaign,
        "counts": {kind: verdicts.count(kind) for kind in ("pass", "fail", "info")} | {"missing": len(campaign.missing)},
        "scatter": embed(shared.scatter_figure(groups), drawn, "scatter", "all quantities: measured against reference, bias and scatter"),
        "sweeps": [_sweep(sweep, campaign, drawn) for sweep in campaign.sweeps],
        "errors": numerical_errors(campaign.sweeps),
        "runs": campaign.contents,
        "machine": machine([(content["engine"], content["provenance"]) for content in campaign.contents]),
        "style": style(),
        "words": words,
    }


def _pairs(campaign: Campaign) -> dict[str, list[Any]]:
    groups: dict[str, list[Any]] = {}
    for content in campaign.contents:
        name = f"{content['case']} {content['variant']}"
        groups.setdefault(content["engine"], []).extend(shared.pairs((f"{name}: {one['label']}", one) for one in content["quantities"]))
    for content in campaign.comparisons:
        name = f"{content['case']} {content['variant']}"
        groups.setdefault("engines", []).extend(shared.pairs((f"{name}: {one['label']}", one) for one in content["quantities"]))
    return {key: groups[key] for key in sorted(groups, key=lambda key: (key == "engines", key))}


def _sweep(sweep: Sweep, campaign: Campaign, drawn: Path) -> dict[str, Any]:
    quantities = sweep.quantities()
    chosen, name = quantities[:_PANELS], sweep.name
    tables.write_table_csv(drawn / f"{name}.csv", sweep)
    write_whole(drawn / f"{name}.tex", tables.latex(sweep, quantities).encode())
    study = figures.study_figure(sweep, chosen)
    compared = {one["variant"]: one for one in campaign.comparisons if one["case"] == sweep.case}
    maps = {engine: figures.map_figure(sweep, engine, chosen) for engine in sweep.engines}
    return {
        "sweep": sweep,
        "shown": len(chosen),
        "left_out": len(quantities) - len(chosen),
        "study": study and embed(study, drawn, f"{name}-study", f"quantities along {sweep.along}"),
        "maps": [embed(figure, drawn, f"{name}-map-{engine}", f"maps of {engine}") for engine, figure in maps.items() if figure],
        "verdicts": [_verdicts(sweep, point, compared.get(point.variant)) for point in sweep.points],
    }


def _verdicts(sweep: Sweep, point: Point, comparison: Mapping[str, Any] | None) -> dict[str, Any]:
    """One line of the table of checks: numbers of verdicts of each engine and of the engines against each other, and what failed."""
    groups = {shared.engine_name(engine): metrics for engine, metrics in sorted(point.metrics.items())}
    groups |= {"against each other": comparison} if comparison else {}
    judged = {name: [one for one in content["quantities"] if one["tolerance"] is not None] for name, content in groups.items()}
    counts = {name: {kind: sum(one["verdict"] == kind for one in found) for kind in ("pass", "fail", "info")} for name, found in judged.items()}
    failed = [f"{name}: {one['label']}" for name, found in judged.items() for one in found if one["verdict"] == "fail"]
    return {"values": {axis: point.values[axis] for axis in sweep.axes}, "counts": counts, "failed": failed}


def _comparison(campaign: Campaign, against: Path | None, drawn: Path) -> dict[str, Any]:
    if against is None:
        return {"against": None}
    before = gather(against)
    if not before.contents:
        raise RunError(f"nothing to compare with in {against}", "it has no measured run", "name the folder of another campaign")
    rows = other.differences(before.contents, campaign.contents)
    shared.write_csv(drawn / "against.csv",
                     ("case", "variant", "engine", "quantity", "unit", "before", "after", "relative_change", "change_over_joint_half_width", "state"),
                     ([row["case"], row["variant"], row["engine"], row["name"], row["unit"], *(_value(row[one]) for one in ("before", "after")),
                       row["change"], row["significance"], row["state"]] for row in rows))
    return {
        "against": against.name,
        "against_rows": [row for row in rows if row["state"] == "changed"],
        "against_counts": {state: sum(row["state"] == state for row in rows) for state in other.STATES},
        "against_figure": embed(figures.against_figure(rows), drawn, "against", "changes between the campaigns"),
        "facts": _facts(before.contents, campaign.contents),
    }


def _facts(before: Sequence[Any], after: Sequence[Any]) -> list[tuple[str, str, str]]:
    one, two = other.facts(before), other.facts(after)
    return [(name, one.get(name, "–"), two.get(name, "–")) for name in dict.fromkeys([*one, *two])]


def _value(quantity: Any) -> float | None:
    return None if quantity is None else quantity["value"]
