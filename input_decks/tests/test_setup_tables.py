"""Every case that is compared with an experiment, another code or a published theory of grains in bulk has a table of the source's set-up
and ours, with all rows of the checklist in docs/how-to/cases.md."""

from __future__ import annotations

import re

import pytest

from dembark.validation.case.folders import load, package_root
from dembark.validation.case.model import Case

ROOT = package_root().parent
# In a case without grains `fluid` stands for these.
OF_GRAINS = {"contact", "damping", "limit of friction", "friction", "restitution", "rolling resistance", "grains"}
# Theories of one grain, which cuts (Finnie) or meets a slot (Gaudin), and of what an index means (Lacey): no bulk that could differ.
ALONE = {"Finnie", "Gaudin", "Lacey"}
CASES = [load(path) for path in sorted(package_root().glob("*/case.toml"))]


def rows(text: str) -> list[list[list[str]]]:
    """Tables of a page, each as its rows of cells, without the line below the head."""
    tables: list[list[list[str]]] = []
    before = ""
    for line in text.splitlines():
        if line.startswith("|"):
            if not before.startswith("|"):
                tables.append([])
            if not re.fullmatch(r"[|\-: ]+", line):
                tables[-1].append([cell.strip() for cell in line.strip().strip("|").split("|")])
        before = line
    return tables


def terms(cell: str) -> set[str]:
    """What a row is about: the words between commas of its first cell."""
    return {word.strip() for word in cell.split(",")}


def checklist() -> set[str]:
    page = (ROOT / "docs/how-to/cases.md").read_text(encoding="utf-8")
    (table,) = (one for one in rows(page) if one[0] == ["row", "what to look for"])
    return {word for row in table[1:] for word in terms(row[0])}


def parts(case: Case, *evidence: str) -> list[str]:
    """Sources of all quantities with this evidence, those of one quantity apart."""
    return [part for quantity in case.quantities.values() if quantity.evidence in evidence for part in quantity.source.split(";")]


def first_names(stated: list[str]) -> set[str]:
    """The first name of each source."""
    return {found[0] for part in stated if (found := re.findall(r"[A-Z]\w{2,}", part))}


def sources(case: Case) -> set[str]:
    """First names of the sources of all quantities with the evidence of an experiment or another code; in a case with packings also of
    theories that are published, with a year: an exact solution of a few bodies has none."""
    published = [part for part in parts(case, "theory") if re.search(r"\b\d{4}\b", part)] if "replicas" in case.parameters else []
    return first_names(parts(case, "experiment", "code")) | first_names(published) - ALONE


def missing(text: str, source: str) -> set[str]:
    """What the table of set-ups with a column of `source` lacks: terms of the checklist, or cells; `{"table"}` if there is none."""
    tables = [one for one in rows(text) if any(cell.startswith("ours") for cell in one[0]) and any(source in cell for cell in one[0])]
    if not tables:
        return {"table"}
    found: set[str] = set()
    for table in tables:
        assert all(len(row) == len(table[0]) for row in table), table[0]
        found |= {"read" for cell in table[0] if "read" in cell.split()}
        for row in table[1:]:
            found |= terms(row[0]) if all(row[1:]) else set()
    return checklist() - found - (OF_GRAINS if "fluid" in found and "grains" not in found else {"fluid"})


def compared() -> list[object]:
    return [pytest.param(case.name, source, id=f"{case.name}-{source}") for case in CASES for source in sorted(sources(case))]


def test_theories_of_grains_in_bulk_are_sources_and_exact_solutions_are_not() -> None:
    asked = {case.name: sources(case) for case in CASES}
    assert "Janssen" in asked["silo"] & asked["plane_silo"] and asked["triaxial"] == {"Thornton"}
    assert {name for name in ("adhesive_impact", "bead_chain", "log_pair", "moving_walls") if asked[name]} == set()


@pytest.mark.parametrize(("name", "source"), compared())
def test_the_set_up_of_every_source_is_next_to_ours(name: str, source: str) -> None:
    assert missing((package_root() / name / "README.md").read_text(encoding="utf-8"), source) == set()


def test_a_table_without_a_row_or_a_cell_is_refused() -> None:
    def page(*left_out: str, empty: str = "") -> str:
        lines = [f"| {term} | {'' if term == empty else 'n. s.'} | the same |" for term in sorted(checklist() - {"fluid", *left_out})]
        return "\n".join(["| | Author et al. | ours |", "|---|---|---|", *lines])

    assert missing(page(), "Author") == set()
    assert missing(page(), "Other") == {"table"}
    for term in checklist() - {"fluid"}:
        assert missing(page(term), "Author") == {term}
        assert missing(page(empty=term), "Author") == {term}
    assert missing(page(*OF_GRAINS) + "\n| fluid | water | water |", "Author") == set()
    assert missing(page().replace("ours", "theirs"), "Author") == {"table"}
