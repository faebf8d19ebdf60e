"""The tutorials run from beginning to end in an empty folder and leave the pictures that they show."""

from __future__ import annotations

from pathlib import Path

import pytest
from blocks import built, load_script

tutorials = load_script("tutorials")
# Runs of a minute or more.
LONG = {"first_run", "fields", "own_case"}


@pytest.mark.parametrize("page", [pytest.param(page, marks=pytest.mark.full if page.stem in LONG else (), id=page.stem)
                                  for page in tutorials.PAGES])
def test_runs_in_an_empty_folder(page: Path, tmp_path: Path) -> None:
    built("liggghts")
    tutorials.run(page, tmp_path)
    shown = tutorials.PICTURE.findall(page.read_text(encoding="utf-8"))
    assert shown and all((tmp_path / name).is_file() for name in shown)
