"""report.html in a real browser, in wide and narrow windows: nothing is wider than the window, filters hide, headings sort."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import full_size
import pytest

from dembark.validation import report
from dembark.validation.report.build import write_pdf

CHROMIUM = shutil.which("chromium")
pytestmark = [pytest.mark.full, pytest.mark.skipif(not CHROMIUM, reason="needs the program chromium")]

# Opens the report in a frame of WIDTH pixels, does ACTION there and writes down what it sees.
PROBE = """<!DOCTYPE html><meta charset="utf-8"><iframe id="page" src="SOURCE" style="width: WIDTHpx; height: 900px; border: 0"></iframe>
<pre id="seen"></pre><script>
document.getElementById("page").addEventListener("load", event => {
  const page = event.target.contentDocument, window_ = event.target.contentWindow, root = page.documentElement;
  const first = () => [...page.querySelectorAll("table.cases tbody tr")].map(row => row.cells[0].textContent.trim());
  const shown = () => [...page.querySelectorAll("table.cases tbody tr, .chapter[data-case]")].filter(one => one.checkVisibility()).length;
  const seen = {width: window_.innerWidth, content: root.scrollWidth, rows: first(), shown: shown()};
  seen.spilling = [...page.querySelectorAll("table, figure, p, h2")].filter(one => one.checkVisibility()
    && one.getBoundingClientRect().right > window_.innerWidth + 1).map(one => one.tagName + " " + one.className);
  const form = page.getElementById("filter");
  seen.form = form.checkVisibility();
  form.case.value = "silo";
  form.dispatchEvent(new Event("change", {bubbles: true}));
  seen.filtered = shown();
  form.case.value = "";
  form.dispatchEvent(new Event("change", {bubbles: true}));
  const head = page.querySelector("table.cases thead th");
  head.click();
  seen.upward = first();
  head.click();
  seen.downward = first();
  document.getElementById("seen").textContent = JSON.stringify(seen);
});
</script>"""


def look(folder: Path, width: int) -> dict[str, object]:
    """What the browser sees of the report of `folder` in a frame of `width` pixels."""
    probe = folder / "probe.html"
    probe.write_text(PROBE.replace("SOURCE", "report.html").replace("WIDTH", str(width)), encoding="utf-8")
    words = [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files", "--window-size=1600,1000",
             f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=60000", "--dump-dom", probe.as_uri()]
    dom = subprocess.run(words, capture_output=True, text=True, check=True, timeout=300).stdout
    found = re.search(r'<pre id="seen">(.+?)</pre>', dom, re.DOTALL)
    assert found, dom[-2000:]
    return json.loads(html.unescape(found[1]))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of several cases."""
    written = full_size.write(tmp_path_factory.mktemp("browser") / "quick", ("silo", "plug_flow", "log_pile"), variants=2)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys.modules[write_pdf.__module__], "write_pdf", lambda html, path: None)
        report.build(written)
    return written


@pytest.mark.parametrize("width", [1400, 400])
def test_the_report_fits_its_window_filters_and_sorts(folder: Path, width: int) -> None:
    seen = look(folder, width)
    assert seen["width"] == width
    assert seen["content"] <= width
    assert seen["spilling"] == []
    assert seen["form"]
    # One row and one chapter of the case that is chosen.
    assert seen["filtered"] == 2 < seen["shown"]
    assert seen["upward"] == sorted(seen["rows"])
    assert seen["downward"] == sorted(seen["rows"], reverse=True)


def test_what_is_too_wide_is_seen(folder: Path) -> None:
    """Negative control: a table of fixed width."""
    page = folder / "report.html"
    before = page.read_text(encoding="utf-8")
    try:
        page.write_text(before.replace("</style>", "table.cases { min-width: 900px }</style>", 1), encoding="utf-8")
        assert look(folder, 400)["content"] > 400
    finally:
        page.write_text(before, encoding="utf-8")
