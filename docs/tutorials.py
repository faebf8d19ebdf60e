"""Runs a tutorial as a reader would: its files are written, its commands and its Python run, in the order of the page.

    python docs/tutorials.py first_run

runs docs/tutorials/first_run.md in build/tutorials/first_run and copies the pictures that the page shows to docs/images/tutorials.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs/tutorials").glob("*.md"))
# A block of code: its head, which is a kind and where it is a file its name, and its text.
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PICTURE = re.compile(r"!\[[^\]]*\]\(\.\./images/tutorials/([\w.]+)\)")
# Programs that belong to this environment and checkout.
PROGRAMS = f"{Path(sys.executable).parent}{os.pathsep}{ROOT / 'build/bin'}{os.pathsep}"


def run(page: Path, folder: Path) -> None:
    """Run a tutorial in `folder`: ```sh and ```python blocks, and ```KIND FILE blocks, which are written. Blocks of Python continue each
    other. AssertionError with the output of the block that fails."""
    environment = os.environ | {"PATH": PROGRAMS + os.environ["PATH"], "MPLBACKEND": "agg"}
    known = ""
    for head, text in FENCE.findall(page.read_text(encoding="utf-8")):
        kind, _, name = head.partition(" ")
        if name:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")
        elif kind == "python":
            known += text
        elif kind == "sh":
            _call(["bash", "-euc", text], folder, environment)
    if known:
        _call([sys.executable, "-c", known], folder, environment)


def _call(words: list[str], folder: Path, environment: dict[str, str]) -> None:
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, f"{words[-1]}\n{(done.stdout + done.stderr)[-3000:]}"


def main(name: str) -> None:
    """Run a tutorial and keep its pictures."""
    page, folder = ROOT / f"docs/tutorials/{name}.md", ROOT / f"build/tutorials/{name}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    run(page, folder)
    for picture in PICTURE.findall(page.read_text(encoding="utf-8")):
        if (folder / picture).is_file():
            shutil.copy(folder / picture, ROOT / "docs/images/tutorials" / picture)


if __name__ == "__main__":
    main(sys.argv[1])
