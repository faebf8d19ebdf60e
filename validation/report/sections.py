"""The section of a case: its checks in one table, the main figures; and for the HTML everything else."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from dembark.common.parallel import parallel_map
from dembark.postproc import field_figures, pictures
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.judge.tally import Tally, tally

from . import figures, front
from .facts import Fact, facts, quantities
from .figures import engine_name
from .gather import Page, ReportData, variations

# Of a case in the PDF: variants with figures, and panels of a figure. Of the first variant all main figures are printed, of others none,
# and of each study PANELS panels.
VARIANTS, PANELS = 1, 2
_PANELS_OF_STUDIES = 6  # at most in one figure


@dataclass(frozen=True)
class Shown:
    """A figure: its file for the HTML, its caption, the files with its data, its image in the PDF, "" when that leaves it out, and whether
    the HTML shows it at once. Files are relative to the report."""

    file: str
    caption: str
    data: Sequence[str] = ()
    printed: Markup | str = ""
    main: bool = False


@dataclass
class Part:
    """A variant within a case's section, for the HTML: figures, and values without a check."""

    page: Page
    values: list[Fact]
    figures: list[Shown]
    variations: list[Any]
    remarks: list[str]


@dataclass
class Section:
    """A case: its `checks`, those that the PDF shows as `printed`, `counts` of all, figures, and `parts`."""

    case: str
    title: str
    description: str
    source: Sequence[str]
    missing: list[str]
    unmeasured: list[str]  # declared checks that none of the runs measured
    checks: list[Fact]
    printed: list[Fact]
    counts: Tally
    open: list[front.OpenLine]
    pictures: list[Shown]
    figures: list[Shown]
    parts: list[Part] = field(default_factory=list)


def embed(figure: Figure, folder: Path, name: str, caption: str, files: Sequence[str] = (), main: bool = True,
          printed: bool = True) -> Shown:
    """The figure as a file `name`.svg next to its data, and inside the PDF if `main` and `printed`."""
    (folder / f"{name}.svg").write_bytes(figures.svg(figure))
    return Shown(f"figures/{name}.svg", caption[:1].upper() + caption[1:], [f"figures/{file}" for file in files],
                 _image(figures.png(figure)) if main and printed else "", main)


def _image(data: bytes) -> Markup:
    return Markup('<img alt="" src="data:image/png;base64,{}">').format(base64.b64encode(data).decode())


def printed(checks: Iterable[Fact]) -> list[Fact]:
    """What the PDF shows of the checks: those that failed, and those against experiment and theory or of unstated evidence; of many
    variants the worst."""
    return quantities(one for one in checks if one.standing == "failed" or one.worst.record.evidence not in ("identity", "code"))


def sections(gathered: ReportData, folder: Path) -> list[Section]:
    """All cases of the results, their data written into `folder`."""
    drawn = parallel_map(partial(_figures, folder=folder), gathered.pages)
    of_case: dict[str, list[tuple[Page, list[Shown]]]] = {}
    for page, (shown, wrong) in zip(gathered.pages, drawn, strict=True):
        page.missing += wrong
        of_case.setdefault(page.case, []).append((page, shown))
    studies = parallel_map(_studies, [[page for page, _ in of_page if page.is_study] for of_page in of_case.values()])
    return [_section(gathered, case, of_page, printed) for (case, of_page), printed in zip(of_case.items(), studies, strict=True)]


def _section(gathered: ReportData, name: str, of_page: list[tuple[Page, list[Shown]]], studies: list[Shown]) -> Section:
    pages = [page for page, _ in of_page]
    rows = [row for page in pages for row in page.rows()]
    known = gathered.cases.get(name)
    judged = facts(rows)
    checks = sorted((one for one in judged if one.is_check), key=lambda one: one.order)
    parts = [_part(page, pages, shown, [one for one in judged if not one.is_check and one.worst.anchor == page.anchor])
             for page, shown in of_page]
    variants = [part for part in parts if not part.page.is_study]
    main = [*(one for part in variants[:VARIANTS] for one in part.figures if one.main), *studies]
    drawn = next((shown for part in variants if (shown := _pictures(part.page))), [])
    return Section(name, known.title if known else name.replace("_", " "), known.description if known else "",
                   known.source if known else (), [f"{page.words}: {text}" for page in pages for text in page.missing],
                   known.unmeasured(row.record.name for row in rows) if known else [], checks, printed(checks),
                   tally(row.record for row in rows), front.open_lines(rows), drawn, main, parts)


def _pictures(page: Page) -> list[Shown]:
    found = []
    for engine in sorted(page.results):
        path = page.folder / engine / pictures.PICTURE
        if path.is_file():
            moving = path.with_name(pictures.ANIMATION)
            files = [f"{page.case}/{page.variant}/{engine}/{moving.name}"] if moving.is_file() else []
            found.append(Shown(str(path.relative_to(page.folder.parents[1])),
                               f"{engine_name(engine)}, {page.words}: last frame of the first replica.", files, _image(path.read_bytes())))
    return found


def _part(page: Page, pages: list[Page], shown: list[Shown], values: list[Fact]) -> Part:
    shared = [text for one in page.results.values() for text in one.remarks]
    remarks = [f"{engine_name(engine)}: {text}" if shared.count(text) < len(page.results) else text
               for engine, one in sorted(page.results.items()) for text in one.remarks]
    return Part(page, values, shown, variations(page, pages), list(dict.fromkeys(remarks)))


def _figures(page: Page, folder: Path) -> tuple[list[Shown], list[str]]:
    """All figures of a page, and what cannot be drawn."""
    fields, wrong = _fields(page, folder)
    return [*_profiles(page, folder), *fields], wrong


def _profiles(page: Page, folder: Path) -> list[Shown]:
    """The profiles of a page as figures of PANELS panels; the first is a main one. Their data are written next to the report."""
    curves = _curves(page)
    names = figures.profile_names(curves)
    for name in names:
        figures.write_csv(folder / f"{page.anchor}-{name}.csv", *figures.profile_table(dict(figures.of_name(curves, name))))
    found = []
    for start in range(0, len(names), PANELS):
        chosen = names[start : start + PANELS]
        stem = f"{page.anchor}-profiles" + (f"-{start // PANELS + 1}" if start else "")
        found.append(embed(figures.profile_figure(curves, chosen), folder, stem,
                           f"{page.name}: engines over the reference; bands: 95 % intervals over replicas, where there are several.",
                           [f"{page.anchor}-{name}.csv" for name in chosen], main=not start, printed=not page.is_study))
    return found


def _studies(pages: Sequence[Page]) -> list[Shown]:
    """The first PANELS profiles of each study of a case side by side, for the PDF; in the HTML each stands by itself."""
    panels = []
    for page in pages:
        curves, study = _curves(page), page.words.removeprefix("study ")
        panels += [[(engine, {**one, "title": f"{study}: {one['title']}"}) for engine, one in figures.of_name(curves, name)]
                   for name in figures.profile_names(curves)[:PANELS]]
    if not panels:
        return []
    # As many in each figure, and no panel alone in its row but the last.
    count = 2 * math.ceil(len(panels) / (2 * math.ceil(len(panels) / _PANELS_OF_STUDIES)))
    return [Shown("", f"{pages[0].case.replace('_', ' ').capitalize()}, studies; bands: 95 % intervals over replicas, where there "
                  "are several.", printed=_image(figures.png(figures.panels_figure(panels[start : start + count]))))
            for start in range(0, len(panels), count)]


def _curves(page: Page) -> figures.Curves:
    return {engine: one.profiles for engine, one in sorted(page.results.items()) if one.profiles}


def _look(engine: str) -> field_figures.Look:
    facts = figures.look(engine)
    return field_figures.Look(facts.title, facts.colour, facts.marker)


def _fields(page: Page, folder: Path) -> tuple[list[Shown], list[str]]:
    """The page's figures of fields, as figures.py of the case draws them; their data are written next to the report, and why there are none
    is reported."""
    try:
        shown = sorted(page.results)
        datasets = field_figures.read(page.folder, shown)
        path = find(page.case).folder / "figures.py" if datasets else None
        if path is None or not path.is_file():
            return [], []
        drawn = deck.load_module(path, f"dembark_figures_{page.case}").draw(datasets, {engine: _look(engine) for engine in shown})
    except Exception as error:  # noqa: BLE001 - figures.py may be the user's: whatever is wrong in it is reported in one line
        return [], [f"fields.nc cannot be drawn: {error}"]
    found = []
    for one in drawn:
        for name, table in one.tables.items():
            figures.write_csv(folder / f"{page.anchor}-fields-{name}.csv", *table)
        found.append(embed(one.figure, folder, f"{page.anchor}-fields-{one.name}", f"{page.name}: {one.title}. {one.caption}",
                           [f"{page.anchor}-fields-{name}.csv" for name in one.tables]))
    return found, []


def verification(gathered: ReportData, folder: Path) -> list[dict[str, Any]]:
    """The items of the verification for the template; the data of their figures are written next to the report."""
    found = []
    for item in gathered.items:
        figure, stem = figures.verification_figure(item), f"verification-{item.name}"
        if figure is not None:
            figures.write_csv(folder / f"{stem}.csv", *figures.verification_table(item))
        found.append({"item": item,
                      "figure": figure and embed(figure, folder, stem, item.caption or item.title, [f"{stem}.csv"], main=False)})
    return found
