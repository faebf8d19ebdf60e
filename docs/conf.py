"""Sphinx: the site of the documentation. `make docs` builds it into build/docs; nothing is written next to the sources.

The source folder is the top of the checkout, so that links between pages are the same here and in a viewer of the repository. Tables of
the cases and the list of the Python modules are inserted while the pages are read.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
import tomllib
from pathlib import Path
from typing import Any

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

from dembark.validation.case.folders import load
from dembark.validation.case.model import Case

ROOT = Path(__file__).resolve().parents[1]

project = "dembark"
author = "the authors of dembark"
with (ROOT / "pyproject.toml").open("rb") as _file:
    version = release = tomllib.load(_file)["project"]["version"]

extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "docs/index"
include_patterns = ["docs/**.md", "input_decks/*/README.md", "input_decks/*/reference/README.md", "*.md"]
exclude_patterns = [".*", "build", "results", "dembark", "plugins", "postproc", "validation", "common", "benchmarks", "packaging"]

html_theme = "furo"
html_title = f"dembark {version}"
html_copy_source = html_show_sphinx = False

myst_heading_anchors = 4
# Fragments of decks and output are no language that Pygments knows.
highlight_language = "text"
suppress_warnings = ["misc.highlighting_failure"]

default_role = "literal"
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # docstrings state shapes and units
# Types in signatures are those of libraries; their pages are not on this machine.
nitpick_ignore_regex = [("py:.*", ".*")]

PACKAGES = {
    "Physics": ("dembark.physics",),
    "Trajectories, fields, walls": ("dembark.postproc",),
    "Results and cases": ("dembark.validation.judge", "dembark.validation.case"),
    "Set-up of cases": ("dembark.input_decks.common.packing", "dembark.input_decks.common.setup"),
}
# Commands, and parts of the harness that a user does not call.
NOT_PUBLIC = {"cli", "words", "run", "tests"}


def modules(package: str) -> list[str]:
    """The public modules of a package, the package first; a module itself."""
    found = [package]
    for one in pkgutil.iter_modules(getattr(importlib.import_module(package), "__path__", ())):
        if one.name.startswith("_") or one.name in NOT_PUBLIC:
            continue
        found += modules(f"{package}.{one.name}") if one.ispkg else [f"{package}.{one.name}"]
    return found


def api() -> str:
    """The directives of all public modules."""
    parts = []
    for title, packages in PACKAGES.items():
        parts.append(f"## {title}\n")
        for module in (name for package in packages for name in modules(package)):
            # What a package re-exports is described in the module that defines it.
            members = "" if hasattr(importlib.import_module(module), "__path__") else "   :members:\n"
            parts.append(f"### `{module}`\n\n```{{eval-rst}}\n.. automodule:: {module}\n{members}```\n")
    return "\n".join(parts)


def picture(case: str) -> str:
    """The picture of a case, relative to the top; empty when it has none."""
    found = f"docs/images/cases/{case}.jpg"
    return found if (ROOT / found).is_file() else ""


def gallery(names: list[str]) -> str:
    """A table of cases, and the entries of the contents."""
    rows = ["| | case | engines |", "|---|---|---|"]
    for name in names:
        case = load(ROOT / "input_decks" / name / "case.toml")
        drawn = f"![{case.title}](../{picture(name)})" if picture(name) else ""
        first = re.split(r"(?<=\.)\s", " ".join(case.description.split()))[0]
        rows.append(f"| {drawn} | [{case.title}](../input_decks/{name}/README.md). {first} | {', '.join(case.engines)} |")
    tree = "\n".join(f"../{page.relative_to(ROOT).with_suffix('')}" for name in names
                     for page in sorted((ROOT / "input_decks" / name).glob("**/README.md")))
    return "\n".join(rows) + f"\n\n```{{toctree}}\n:hidden:\n\n{tree}\n```\n"


def facts(case: Case) -> str:
    """What case.toml states: variants, and quantities with evidence and tolerance."""
    rows = ["## Quantities of `case.toml`", "", "| quantity | | evidence | tolerance | source |", "|---|---|---|---|---|"]
    for name, one in case.quantities.items():
        limit = "" if one.tolerance is None else f"{one.tolerance}"
        cells = (f"`{name}`", f"{one.label} ({one.unit})", one.evidence, limit, one.source)
        rows.append("| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |")
    return "\n".join([f"Variants: {', '.join(f'`{name}`' for name in case.variants)}.", "", *rows, ""])


def insert(app: Sphinx, page: str, source: list[str]) -> None:
    """Replace the marks of a page, and complete the page of a case."""
    del app
    source[0] = re.sub(r"<!-- cases: ([\w ]+) -->", lambda mark: gallery(mark.group(1).split()), source[0])
    source[0] = source[0].replace("<!-- api -->", api())
    if re.fullmatch(r"input_decks/\w+/README", page):
        name = page.split("/")[1]
        if picture(name) and picture(name) not in source[0]:
            title, _, rest = source[0].partition("\n")
            source[0] = f"{title}\n\n![A run of this case](../../{picture(name)})\n{rest}"
        source[0] += "\n" + facts(load(ROOT / "input_decks" / name / "case.toml"))


def as_text(app: Sphinx, what: str, name: str, one: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are plain text with names in backticks: other marks are no markup, and indented lines stay as they are written."""
    del app, what, name, one, options
    paragraphs = [part.split("\n") for part in re.split(r"\n(?:[ \t]*\n)+", "\n".join(lines).strip("\n"))]
    lines[:] = []
    for paragraph in paragraphs:
        spans = re.split(r"``([^`]+)``|`([^`]+)`", "\n".join(paragraph))
        text = re.sub(r"([|*\\`]|_\b)", r"\\\1", spans[0])
        for double, single, after in zip(spans[1::3], spans[2::3], spans[3::3], strict=True):
            text += f"``{(double or single).replace(chr(10), ' ')}``" + (r"\ " if after[:1].isalnum() else "")
            text += re.sub(r"([|*\\`]|_\b)", r"\\\1", after)
        indented = any(line.startswith(" ") for line in paragraph)
        lines += [f"| {line}" if indented else line for line in text.split("\n")] + [""]


def foreign(app: Sphinx, what: str, name: str, one: Any, skip: bool, options: Any) -> bool | None:
    """Leave out what a module has from libraries."""
    del app, what, name, options
    return True if not skip and not getattr(one, "__module__", "dembark").startswith("dembark") else None


def front_page(app: Sphinx, error: Exception | None) -> None:
    """A page at the top of the site that leads to the first one."""
    if not error and app.builder.name == "html":
        Path(app.outdir, "index.html").write_text('<meta http-equiv="refresh" content="0; url=docs/index.html">\n', encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Connect the functions above."""
    for name in ("lammps", "picture", "cpp yade"):
        app.add_lexer(name, TextLexer)
    app.connect("source-read", insert)
    app.connect("autodoc-process-docstring", as_text)
    app.connect("autodoc-skip-member", foreign)
    app.connect("build-finished", front_page)
