"""docs/reference/parameters.md has each number of a contact once, with the range, the unit and the default of the table in the code."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest
from blocks import ROOT

from dembark import _physics
from dembark.postproc.impacts import COLUMNS

NUMBERS = _physics.contact_parameters()
CHOICES = _physics.contact_choices()
PAGE = (ROOT / "docs/reference/parameters.md").read_text(encoding="utf-8")
ROWS = [[cell.strip() for cell in line.strip("|").split("|")]
        for section in re.findall(r"^## (?:Contact|Options|Liquid)\n(.*?)(?=^## )", PAGE, re.MULTILINE | re.DOTALL)
        for line in section.splitlines() if line.startswith("| ")]


def test_columns_of_impacts_stand_in_the_order_of_the_file() -> None:
    """A reader of the binary form has no other list."""
    table = PAGE.partition("### File of impacts")[2].partition("\n\nThe angle")[0]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    assert tuple(re.findall(r"`(\w+)`", " ".join(rows))) == COLUMNS


def row_of(entry: dict[str, Any]) -> list[str]:
    """The one row that gives a name of the table to an engine."""
    found = [row for row in ROWS if {f"`{entry['name']}`", f"`{entry['camel_case']}`"} & set(re.findall(r"`\w+`", " ".join(row[3:])))]
    assert len(found) == 1, entry["name"]
    return found[0]


def text(value: float) -> str:
    """As the page writes numbers."""
    return {0.5: "½", 0.5 * math.pi: "π/2", 1e30: "unlimited"}.get(value, f"{value:g}").replace("-", "\N{MINUS SIGN}")


def range_of(entry: dict[str, Any]) -> str:
    words = f"{'>' if entry['low_open'] else '≥'} {text(entry['low'])}"
    if math.isfinite(entry["high"]):
        words += f", ≤ {text(entry['high'])}"
    return words + ("" if entry["unit"] == "1" else " " + entry["unit"].replace("^2", "²").replace("^3", "³"))


@pytest.mark.parametrize("entry", NUMBERS, ids=lambda entry: str(entry["name"]))
def test_numbers(entry: dict[str, Any]) -> None:
    _, limits, default, *_ = row_of(entry)
    assert limits.split(";")[0] == range_of(entry)
    assert re.split(r"[;: ]", default)[0] == ("required" if math.isnan(entry["default"]) else text(entry["default"]))


@pytest.mark.parametrize("entry", CHOICES, ids=lambda entry: str(entry["name"]))
def test_choices(entry: dict[str, Any]) -> None:
    _, values, default, *_ = row_of(entry)
    assert re.findall(r"`(\w+)`", values) == entry["values"]
    assert default == f"`{entry['values'][0]}`"
