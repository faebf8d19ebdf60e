"""A report of three engines compares each pair, is no longer for it, and names an engine that was left out."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import full_size
import pdf_pages
import pytest
from third_engine import Third

from dembark.common.files import read_json, write_json
from dembark.validation import engines, report
from dembark.validation.report import figures
from dembark.validation.report.build import write_pdf
from dembark.validation.report.gather import gather

build_module = sys.modules[write_pdf.__module__]
CASES = ("angle_of_repose", "debarking_drum", "log_pile", "oblique_impact", "plug_flow", "silo", "transport", "water_tank")


def test_engines_that_nobody_knows_look_different_from_those_that_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "ENGINES", (*engines.ENGINES, Third))
    known = {engines.facts(name).colour for name in engines.names()}
    assert all(figures.look(name).colour not in known for name in ("gone", "older", "other", "a", "b", "c"))


def laid_out(folder: Path, monkeypatch: pytest.MonkeyPatch, **size: object) -> list[str]:
    """Text of the pages of a report of eight cases: of fewer, a line too many is a page too many."""
    full_size.write(folder, CASES, variants=2, **size)
    pages: list[str] = []
    monkeypatch.setattr(build_module, "write_pdf", lambda html, path: pages.extend(pdf_pages.pages(html)))
    report.build(folder)
    return pages


@pytest.mark.full
def test_a_report_of_three_engines_has_no_more_pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    two = laid_out(tmp_path / "two/quick", monkeypatch)
    monkeypatch.setattr(engines, "ENGINES", (*engines.ENGINES, Third))
    three = laid_out(tmp_path / "three/quick", monkeypatch, engines=("liggghts", "yade", "third"))
    assert len(three) <= len(two)
    assert "The Third" in " ".join(three)
    who = {row["engine"] for row in csv.DictReader((tmp_path / "three/quick/figures/quantities.csv").open())}
    assert {"YADE / LIGGGHTS", "The Third / LIGGGHTS", "YADE / The Third"} <= who


def test_the_report_names_what_was_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "ENGINES", (*engines.ENGINES, Third))
    folder = full_size.write(tmp_path / "quick", ("silo",), variants=1, quantities=1, profiles=0)
    assert gather(folder).left_out == ""
    plan = read_json(folder / "plan.json")
    write_json(folder / "plan.json", {**plan, "left_out": {"third": "not found"}})
    assert gather(folder).left_out == "Left out, because not installed on this machine: The Third."
