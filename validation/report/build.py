"""Builds report.html, report.pdf and figures/ of a results folder from its results alone: nothing is measured, judged or run here."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from dembark.common.errors import RunError
from dembark.common.files import disk_error, write_atomic
from dembark.common.units import duration
from dembark.validation.judge.result import Result

from . import facts, front, numbers, scatter, sections
from .figures import colour, engine_name, subscripts
from .gather import ReportData, gather

_HERE = Path(__file__).parent
_SIGNS = {"passed": "✓ pass", "failed": "✗ FAIL", "open": "○ open", "information": "", "uncontrolled": "not counted",
          "calibrated": "calibrated"}


def build(folder: Path) -> Path:
    """Write `report.html`, `report.pdf` and `figures/` into results/<profile> and return the path of the HTML file.

    What failed is shown as failed and what is missing as missing. RunError when there is nothing at all to report or a file cannot
    be written; the HTML comes last, so that it never stands there with an older PDF.
    """
    gathered = gather(folder)
    if not gathered.pages:
        raise RunError(f"nothing to report in {folder}", "it has no measured run and no case expects one for this profile")
    return write(gathered,
                 lambda drawn: {"title": f"Validation report, profile {folder.name}", "sections": sections.sections(gathered, drawn),
                                          "verification": sections.verification(gathered, drawn)})


def write(gathered: ReportData, chapters: Any) -> Path:
    """Lay out a report: first pages and provenance of `gathered`, and between them what `chapters(folder of figures)` adds to the
    context."""
    folder = gathered.folder
    drawn = folder / "figures"
    try:
        drawn.mkdir(parents=True, exist_ok=True)
        for old in drawn.iterdir():
            if old.suffix in (".csv", ".svg"):
                old.unlink()
        own = chapters(drawn)
        first = front.context(gathered)
        front.write_tables(drawn, gathered.rows, first["points"])
        figure = scatter.figure(first["points"])
        ratio = figure and sections.embed(figure, drawn, "scatter", "", ["scatter.csv"])
        measured = [one for page in gathered.pages if not page.is_study for _, one in sorted(page.results.items())]
        cited = {one["short"]: one for page in gathered.pages for found in page.results.values() for one in found.references}
        own_files = {name: Markup((_HERE / file).read_text(encoding="utf-8")) for name, file in _FILES.items()}
        context = {**_EMPTY, **own, **first, **own_files, "scatter": ratio, "measured": measured, "references": list(cited.values()),
                   "machine": machine(measured), "left_out_engines": gathered.left_out,
                   "description": gathered.summary.get("description", "")}
        template = _environment(gathered).get_template("report.html.j2")
        write_pdf(template.render(context, full=False), folder / "report.pdf")
        return write_atomic(folder / "report.html", template.render(context, full=True).encode())
    except OSError as error:
        raise disk_error(error, folder) from None


# Within the document, which needs nothing from elsewhere but its figures.
_FILES: Mapping[str, str] = {"style": "style.css", "script": "report.js"}
# Chapters that only some reports have.
_EMPTY: Mapping[str, Any] = {"sections": (), "sweeps": (), "errors": (), "verification": ()}


def _environment(gathered: ReportData) -> Environment:
    found = Environment(loader=FileSystemLoader(_HERE), autoescape=select_autoescape(["html", "j2"]), undefined=StrictUndefined,
                        trim_blocks=True, lstrip_blocks=True)
    found.filters |= {"plain": numbers.plain, "compact": numbers.compact, "subscripts": subscripts,
                      "duration": duration, "engine": engine_name, "case": gathered.title,
                      # A line may end in front of the half-width, not within it.
                      "unbroken": lambda text: text.replace("± ", "±\N{NO-BREAK SPACE}")}
    found.globals |= {"signs": _SIGNS, "estimate": numbers.with_interval, "unit": numbers.with_unit, "deviation": numbers.deviation,
                      "allowed": numbers.tolerance_text, "colour": colour, "engines_of": facts.engines}
    return found


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
        print(f"dembark: no {path.name}, because Pango is missing ({reason}); report.html holds the same", file=sys.stderr)
        return
    write_atomic(path, HTML(string=html, base_url=str(_HERE)).write_pdf())


def machine(measured: Iterable[Result]) -> list[tuple[str, str]]:
    """Facts about code and machine from the provenance of all results; each once, with all values that occur."""
    found: dict[str, dict[str, None]] = {}

    def note(title: str, value: Any) -> None:
        if value not in (None, "", {}):
            found.setdefault(title, {})[str(value)] = None

    for one in measured:
        facts, name = one.provenance, engine_name(one.engine)
        commit = facts.get("commit")
        note("commit", commit and commit + (" with changes that are not in it" if facts.get("dirty") else ""))
        for part, version in facts.get("versions", {}).items():
            note(f"version of {engine_name(part)}", version)
        note(f"{name} executable", facts.get("engine"))
        note(f"{name} build flags", " ".join(f"{key}={value}" for key, value in facts.get("flags", {}).items() if value))
        for key, title in (("host", "host"), ("os", "system"), ("cpu", "processor"), ("cores", "cores")):
            note(title, facts.get(key))
    return [(title, ", ".join(values)) for title, values in found.items()]
