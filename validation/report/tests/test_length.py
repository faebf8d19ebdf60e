"""A report is short enough to be read: at most 80 pages for `standard` and 40 for `quick`, of which the first four hold all verdicts; and
small enough to be opened."""

from __future__ import annotations

import sys
from pathlib import Path

import full_size
import pdf_pages as pdf
import planned
import pytest
from matplotlib.figure import Figure

from dembark.validation import report
from dembark.validation.case.folders import discover
from dembark.validation.report import figures
from dembark.validation.report.build import write_pdf

pytestmark = pytest.mark.full
build_module = sys.modules[write_pdf.__module__]

LIMITS = {"quick": 40, "standard": 80}
# Of report.html, in bytes.
SIZE = 8_000_000


def check_length(profile: str, pages: int) -> None:
    """AssertionError when a report of `profile` has more pages than it may."""
    assert pages <= LIMITS[profile], f"the report of profile {profile} has {pages} pages, allowed are {LIMITS[profile]}"


@pytest.fixture
def laid_out(monkeypatch: pytest.MonkeyPatch):
    """`laid_out(folder)`: text of each page of the report of a results folder. Figures are empty, of the size of the real ones, and no PDF
    is written, for what takes most of the time changes nothing of the layout."""
    kept: list[str] = []

    def empty(figure: Figure) -> bytes:
        width, height = figure.get_size_inches()
        return f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}in" height="{height}in" viewBox="0 0 {width} {height}"/>'.encode()

    monkeypatch.setattr(figures, "svg", empty)
    monkeypatch.setattr(figures, "png", empty)
    monkeypatch.setattr(build_module, "write_pdf", lambda html, path: kept.append(html.replace("data:image/png;base64,PHN2Zy",
                                                                                               "data:image/svg+xml;base64,PHN2Zy")))

    def lay_out(folder: Path) -> list[str]:
        report.build(folder)
        return pdf.pages(kept[-1])

    return lay_out


@pytest.mark.full
@pytest.mark.parametrize("profile", LIMITS)
def test_a_whole_profile_is_short_and_begins_with_its_verdicts(profile, laid_out, tmp_path):
    pages = laid_out(planned.write(tmp_path / profile))
    check_length(profile, len(pages))
    assert "Verdicts of each case" in pages[0] and "Bias and scatter" in " ".join(pages[:4])
    first = next(iter(discover().values())).title
    assert any(first in text for text in pages[1:6])
    assert (tmp_path / profile / "report.html").stat().st_size < SIZE
    assert [number for number, text in enumerate(pages) if not text.strip()] == []


@pytest.mark.full
def test_a_report_that_is_too_long_is_told(laid_out, tmp_path):
    """The negative control: more cases than pages."""
    cases = tuple(f"case_{number}" for number in range(8 * LIMITS["quick"]))
    pages = laid_out(full_size.write(tmp_path / "quick", cases, variants=1, quantities=1, profiles=0))
    with pytest.raises(AssertionError, match=r"the report of profile quick has \d+ pages, allowed are 40"):
        check_length("quick", len(pages))


@pytest.mark.slow
@pytest.mark.parametrize("profile", LIMITS)
def test_the_pdf_with_all_figures_is_as_short(profile, tmp_path):
    folder = planned.write(tmp_path / profile)
    report.build(folder)
    check_length(profile, pdf.page_count((folder / "report.pdf").read_bytes()))
