"""Pages of the printed report."""

import re
from pathlib import Path

from weasyprint import HTML

STYLE = Path(__file__).parents[1] / "style.css"


def tags(page):
    return {box.element_tag for box in page._page_box.descendants()}


def test_the_last_line_of_a_section_does_not_stand_alone_on_a_page():
    # A page has 266 mm; heading, filler and figure leave less than a line.
    text = """<section class="chapter"><h2>Case</h2><div style="height: 146mm"></div>
              <figure style="height: 112mm; margin: 0"></figure><p class="small">Set-up after: a publication</p></section>"""
    first, second = HTML(string=f"<style>{STYLE.read_text(encoding='utf-8')}</style>{text}").render().pages
    assert "h2" in tags(first) and "p" not in tags(first)
    assert {"figure", "p"} <= tags(second)


def test_rows_named_by_their_standing_are_not_taken_for_tables() -> None:
    """A rule for `.open` alone would let the names of open checks run across the next column."""
    assert not re.findall(r"(?m)(?:^|[\s,}])\.(?:open|failed|passed|uncontrolled|information)\b", STYLE.read_text(encoding="utf-8"))
