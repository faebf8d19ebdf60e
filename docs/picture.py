"""Puts pages of a report side by side into images/report.png.

    python docs/picture.py results/quick/report.pdf 1 3

needs pdftoppm (package poppler-utils).
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

FILE = Path(__file__).with_name("images") / "report.png"


def main(report: str, *pages: str) -> None:
    """Draw `pages` of the PDF `report` in a row."""
    drawn = []
    with tempfile.TemporaryDirectory() as folder:
        for page in pages:
            name = Path(folder) / page
            subprocess.run(["pdftoppm", "-r", "75", "-png", "-singlefile", "-f", page, "-l", page, report, str(name)], check=True)
            drawn.append(Image.open(name.with_suffix(".png")).convert("RGB"))
    gap = 8
    row = Image.new("RGB", (sum(one.width + gap for one in drawn) - gap, max(one.height for one in drawn)), (160, 160, 160))
    left = 0
    for one in drawn:
        row.paste(one, (left, 0))
        left += one.width + gap
    FILE.parent.mkdir(exist_ok=True)
    row.quantize(96).save(FILE, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
