"""Makes the small pictures of the cases, images/cases/<case>.jpg, from the results of a profile.

    python docs/case_pictures.py results/quick

A case whose runs have no picture gets its first figure of the report. Needs pdftoppm (package poppler-utils). The pictures are not in the
folders of the cases, whose files are inputs of the runs.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import weasyprint
from PIL import Image, ImageOps

DECKS = Path(__file__).resolve().parents[1] / "input_decks"
PICTURES = Path(__file__).with_name("images") / "cases"
WIDTH, HEIGHT = 480, 360  # pixels, at most
LARGEST = 40_000  # bytes
STYLE = "@page { size: 480px 360px; margin: 0 } img { width: 480px; max-height: 360px; object-fit: contain }"


def figure(results: Path, case: str) -> Image.Image | None:
    """The first figure of `case` in the report, as pixels; None where there is none."""
    drawn = sorted((results / "figures").glob(f"{case}-*.svg"))
    if not drawn:
        return None
    with tempfile.TemporaryDirectory() as folder:
        page = f'<style>{STYLE}</style><img src="{drawn[0].resolve().as_uri()}">'
        weasyprint.HTML(string=page).write_pdf(f"{folder}/figure.pdf")
        subprocess.run(["pdftoppm", "-r", "96", "-png", "-singlefile", f"{folder}/figure.pdf", f"{folder}/figure"], check=True)
        image = Image.open(f"{folder}/figure.png").convert("RGB")
    # The page is as high as a picture may be, most figures are not.
    return image.crop(ImageOps.invert(image).getbbox())


def main(folder: str) -> None:
    """Write the pictures of all cases of a profile."""
    results = Path(folder)
    for case in sorted(path.parent.name for path in DECKS.glob("*/case.toml")):
        pictures = sorted(results.glob(f"{case}/*/*/picture.png"))
        image = Image.open(pictures[0]).convert("RGB") if pictures else figure(results, case)
        if image is None:
            print(f"{case}: nothing drawn in {results}")
            continue
        image.thumbnail((WIDTH, HEIGHT))
        target = PICTURES / f"{case}.jpg"
        for quality in range(85, 20, -10):
            image.save(target, quality=quality, optimize=True)
            if target.stat().st_size <= LARGEST:
                break


if __name__ == "__main__":
    main(sys.argv[1])
