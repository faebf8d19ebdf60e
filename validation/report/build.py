"""Builds report.html, report.pdf and figures/ of a results folder."""

from __future__ import annotations

import base64
import logging
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from dembark.common.errors import RunError
from dembark.common.files import disk_error, write_json, write_whole
from dembark.postproc import DumpError
from dembark.validation.report import cross_section, fields, figures, numbers, pictures, verification
from dembark.validation.report.gather import Page, gather, studies
from dembark.validation.verification.item import Item
from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape
from markupsafe import Markup, escape
from matplotlib.figure import Figure

_HERE = Path(__file__).parent
_SIGNS = {"pass": "✓ pass", "fail": "✗ fail", "info": "○ open", "missing": "— missing"}


def build(results_profile_folder: Path) -> Path:
    """Write `report.html`, `report.pdf` and `figures/` into results/<profile> and return the path of the HTML file.

    What failed is shown as failed and what is missing as missing. RunError when there is nothing at all to report or a file cannot
    be written; the HTML comes last, so that it never stands there with an older PDF.
    """
    pages = gather(results_profile_folder)
    if not pages:
        raise RunError(f"nothing to report in {results_profile_folder}", "it has no measured run and no case expects one for this profile")
    folder = results_profile_folder / "figures"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.iterdir():
            old.unlink()
        html = environment().get_template("template.html.j2").render(_context(results_profile_folder, pages, folder))
        write_pdf(html, results_profile_folder / "report.pdf")
        return write_whole(results_profile_folder / "report.html", html.encode())
    except OSError as error:
        raise disk_error(error, results_profile_folder) from None


def environment(*folders: Path) -> Environment:
    """Templates of the report, and those in `folders`, with its filters and functions."""
    found = Environment(
        loader=FileSystemLoader([*folders, _HERE]),
        autoescape=select_autoescape(["html", "j2"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters |= {
        "plain": numbers.plain,
        "compact": numbers.compact,
        "subscripts": _subscripts,
        "percent": numbers.percent,
        "duration": numbers.duration,
        "engine": figures.engine_name,
    }
    found.globals |= {"signs": _SIGNS, "estimate": numbers.with_interval, "colour": figures.colour}
    return found


def _subscripts(text: str) -> Markup:
    """Symbols like σ_zz with real subscripts."""
    return Markup(re.sub(r"\b([σρμKv])_([a-z]+)", r"\1<sub>\2</sub>", str(escape(text))))


def write_pdf(html: str, path: Path) -> None:
    """Lay out the document as PDF; without Pango, which no Python package brings along, there is none, and a line says so."""
    # Its log speaks of CSS meant for screens, which is no news to anybody.
    logging.getLogger("weasyprint").setLevel(logging.ERROR)
    logging.getLogger("fontTools").setLevel(logging.ERROR)
    try:
        from weasyprint import HTML
    except OSError as error:
        path.unlink(missing_ok=True)
        reason = " ".join(str(error).split())[:120]
        print(f"dembark: no {path.name}, for Pango is missing ({reason}); report.html holds the same", file=sys.stderr)
        return
    write_whole(path, HTML(string=html, base_url=str(_HERE)).write_pdf())


def style() -> Markup:
    """The style sheet of the reports."""
    return Markup((_HERE / "style.css").read_text(encoding="utf-8"))


def embed(figure: Figure, folder: Path, name: str, alt: str) -> Markup:
    """The figure as an image inside the document, and as a file beside its data."""
    data = figures.svg(figure)
    (folder / f"{name}.svg").write_bytes(data)
    return Markup('<img alt="{}" src="data:image/svg+xml;base64,{}">').format(alt, base64.b64encode(data).decode())


def checks(pages: list[Page]) -> Iterator[dict[str, Any]]:
    """Rows of the verdict table: everything that can pass or fail, and what is missing."""
    for page in pages:
        for engine, replica, reason in page.missing:
            yield {
                "page": page,
                "engine": figures.engine_name(engine),
                "verdict": "missing",
                "label": "run" if replica is None else f"replica {replica}",
                "reason": reason,
            }
        for engine, metrics in sorted(page.metrics.items()):
            for quantity in metrics["quantities"]:
                if quantity["tolerance"] is not None or quantity["verdict"] != "info":
                    yield quantity | {"page": page, "engine": figures.engine_name(engine)}
        for quantity in (page.comparison or {}).get("quantities", []):
            both = f"{figures.engine_name(quantity['engine'])} / {figures.engine_name(quantity['reference_engine'])}"
            yield quantity | {"page": page, "engine": both}


def overview(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row a page of the verdict table: numbers of its verdicts, each engine's and those of the engines against each other."""
    table: dict[str, dict[str, Any]] = {}
    for row in rows:
        entry = table.setdefault(row["page"].anchor, {"page": row["page"], "counts": {}})
        entry["counts"].setdefault(row["engine"], dict.fromkeys(_SIGNS, 0))[row["verdict"]] += 1
    return list(table.values())


def _context(results: Path, pages: list[Page], folder: Path) -> dict[str, Any]:
    items = verification.compute()
    rows = [*checks(pages), *verification.rows(items)]
    write_json(results / "verification.json", {"quantities": [quantity.as_json() for item in items for quantity in item.quantities]})
    counts = {verdict: sum(row["verdict"] == verdict for row in rows) for verdict in _SIGNS}
    groups: dict[str, list[Any]] = {}
    for page in pages:
        for engine, metrics in page.metrics.items():
            groups.setdefault(engine, []).extend(figures.pairs((f"{page.name}: {one['label']}", one) for one in metrics["quantities"]))
        groups.setdefault("engines", []).extend(
            figures.pairs((f"{page.name}: {one['label']}", one) for one in (page.comparison or {}).get("quantities", []))
        )
    groups = {key: groups[key] for key in sorted(groups, key=lambda key: (key == "engines", key))}
    figures.write_csv(
        folder / "scatter.csv",
        ("kind", "quantity", "measured", "reference", "relative_half_width", "reference_relative_half_width"),
        ([key, *one] for key, group in groups.items() for one in group),
    )
    figures.write_csv(
        folder / "verdicts.csv",
        (
            "case",
            "variant",
            "engine",
            "quantity",
            "value",
            "low",
            "high",
            "unit",
            "reference",
            "deviation",
            "tolerance",
            "verdict",
            "reason",
        ),
        (
            [
                row["page"].case,
                row["page"].variant,
                row["engine"],
                row.get("name", row["label"]),
                row.get("value"),
                *(row.get("interval") or (None, None)),
                row.get("unit"),
                row.get("reference"),
                row.get("deviation"),
                row.get("tolerance"),
                row["verdict"],
                row.get("reason"),
            ]
            for row in rows
        ),
    )
    provenance = [
        (page, engine, metrics["provenance"]) for page in pages if not page.is_study for engine, metrics in sorted(page.metrics.items())
    ]
    return {
        "profile": results.name,
        "rows": rows,
        "troubles": [row for row in rows if row["verdict"] in ("fail", "missing")],
        "overview": overview(rows),
        "counts": counts,
        "summary": summary(counts, pages),
        "verdict": "fail" if counts["fail"] or counts["missing"] else "pass",
        "scatter": embed(
            figures.scatter_figure(groups), folder, "scatter", "all quantities: measured against reference, and bias and scatter"
        ),
        "pages": [_page(page, pages, folder) for page in pages],
        "verification": [_item(item, folder) for item in items],
        "instruments": verification.from_runs(pages),
        "style": style(),
        "references": list(
            {one["short"]: one for page in pages for metrics in page.metrics.values() for one in metrics.get("references", [])}.values()
        ),
        "provenance": provenance,
        "machine": machine((engine, facts) for _, engine, facts in provenance),
    }


def _item(item: Item, folder: Path) -> dict[str, Any]:
    """An item of the verification chapter for the template; the data of its figure are written beside the report."""
    figure = verification.figure(item)
    if figure is not None:
        figures.write_csv(folder / f"verification-{item.name}.csv", *verification.table(item))
    return {
        "item": item,
        "quantities": [quantity.as_json() for quantity in item.quantities],
        "image": figure and embed(figure, folder, f"verification-{item.name}", item.title),
        "csv": f"verification-{item.name}.csv",
    }


def summary(counts: dict[str, int], pages: list[Page]) -> str:
    """One line that says how it went."""
    total = counts["pass"] + counts["fail"]
    parts = [
        f"{counts['pass']} of {total} decided checks pass" if total else "no check could be decided",
        f"{counts['fail']} fail" if counts["fail"] else "none fails",
    ]
    if counts["info"]:
        parts.append(f"{counts['info']} left open for want of size or time to decide")
    text = ", ".join(parts) + "."
    missing = sum(len(page.missing) for page in pages)
    return text + (f" {missing} {'run is' if missing == 1 else 'runs are'} missing." if missing else " All runs are there.")


def _page(page: Page, pages: list[Page], folder: Path) -> dict[str, Any]:
    numerical, physical = studies(page, pages)
    scenes = {engine: _scene(page, engine) for engine in sorted(page.metrics) if page.metrics[engine].get("picture")}
    image, reasons = _picture(scenes) if scenes else (None, [])
    for engine, one in scenes.items():
        if isinstance(one, cross_section.Section) and len(one.times) > 2:
            cross_section.animate(one, folder / f"{page.anchor}-{engine}.gif")
    profiles = {engine: metrics["profiles"] for engine, metrics in sorted(page.metrics.items())}
    names = list(dict.fromkeys(one["name"] for of_engine in profiles.values() for one in of_engine))
    for name in names:
        of_engine = {engine: one for engine, found in profiles.items() for one in found if one["name"] == name}
        figures.write_csv(folder / f"{page.anchor}-{name}.csv", *figures.profile_table(of_engine))
    of_fields, unread = _fields(page, folder)
    quantities = list(dict.fromkeys(one["name"] for metrics in page.metrics.values() for one in metrics["quantities"]))
    table = [
        {
            engine: next((one for one in metrics["quantities"] if one["name"] == name), None)
            for engine, metrics in sorted(page.metrics.items())
        }
        for name in quantities
    ]
    agreement = {one["name"]: one for one in (page.comparison or {}).get("quantities", [])}
    return {
        "page": page,
        "picture": image and embed(image, folder, f"{page.anchor}-packing", f"packings of {page.name}"),
        "picture_reasons": reasons,
        "profiles": embed(figures.profile_figure(profiles), folder, f"{page.anchor}-profiles", f"profiles of {page.name}")
        if names
        else None,
        "bases": {engine: _bases(metrics) for engine, metrics in sorted(page.metrics.items())},
        "csv": [f"{page.anchor}-{name}.csv" for name in names],
        "fields": of_fields,
        "fields_unread": unread,
        "table": table,
        "agreement": agreement,
        "numerical": numerical,
        "physical": physical,
        "remarks": list(
            dict.fromkeys(
                f"{figures.engine_name(engine)}: {text}" if len(page.metrics) > 1 and not _shared(page, text) else text
                for engine, metrics in sorted(page.metrics.items())
                for text in metrics.get("remarks", [])
            )
        ),
        "parameters": next(iter(page.metrics.values()), {}).get("parameters", {}),
    }


def _fields(page: Page, folder: Path) -> tuple[list[dict[str, Any]], str]:
    """The page's figures of fields, their data written beside the report; and why there are none although there is a file."""
    try:
        drawn = fields.figures(fields.read(page.folder, sorted(page.metrics)))
    except (OSError, ValueError, KeyError, AttributeError) as error:
        return [], f"fields.nc cannot be drawn: {error}"
    for one in drawn:
        for name, table in one.tables.items():
            figures.write_csv(folder / f"{page.anchor}-fields-{name}.csv", *table)
    return [
        {
            "title": one.title,
            "image": embed(one.figure, folder, f"{page.anchor}-fields-{one.name}", f"{one.title}, {page.name}"),
            "caption": one.caption,
            "csv": [f"{page.anchor}-fields-{name}.csv" for name in one.tables],
        }
        for one in drawn
    ], ""


def _bases(metrics: dict[str, Any]) -> str:
    """What the intervals of a measurement come from, each way once."""
    ways: dict[str, dict[str, None]] = {}
    for one in metrics["quantities"]:
        kind, _, way = one["basis"].partition(": ")
        ways.setdefault(kind, {})[way] = None
    return "; ".join(kind + (f" ({', '.join(way for way in found if way)})" if any(found) else "") for kind, found in ways.items() if kind)


def _shared(page: Page, text: str) -> bool:
    return all(text in metrics.get("remarks", []) for metrics in page.metrics.values())


def _picture(scenes: dict[str, Any]) -> tuple[Figure | None, list[str]]:
    if any(isinstance(one, cross_section.Section) for one in scenes.values()):
        return cross_section.picture(scenes)
    return pictures.picture(scenes)


def _scene(page: Page, engine: str) -> pictures.Scene | cross_section.Section | str:
    wanted = page.metrics[engine]["picture"]
    replica = next(iter(sorted((page.folder / engine).glob("replica-*/grains.dump"))), None)
    if replica is None:
        return "the run's grains.dump is no longer there"
    try:
        return (cross_section if "cross_section" in wanted else pictures).scene(replica.parent, **wanted)
    except DumpError as error:
        return str(error)


def machine(provenance: Iterable[tuple[str, Mapping[str, Any]]]) -> list[tuple[str, str]]:
    """Facts about code and machine from (engine, provenance) of all measurements; each once, with all values that occur."""
    found: dict[str, dict[str, None]] = {}

    def note(title: str, value: Any) -> None:
        if value not in (None, "", {}):
            found.setdefault(title, {})[str(value)] = None

    for engine, facts in provenance:
        commit = facts.get("commit")
        note("commit", commit and commit + (" with changes that are not in it" if facts.get("dirty") else ""))
        for name, version in facts.get("versions", {}).items():
            note(f"version of {figures.engine_name(name)}", version)
        note(f"{figures.engine_name(engine)} executable", facts.get("engine"))
        note(
            f"{figures.engine_name(engine)} build flags",
            " ".join(f"{key}={value}" for key, value in facts.get("flags", {}).items() if value),
        )
        for key, title in (("host", "host"), ("os", "system"), ("cpu", "processor"), ("cores", "cores"), ("started", "started")):
            note(title, facts.get(key))
    return [(title, ", ".join(values)) for title, values in found.items()]
