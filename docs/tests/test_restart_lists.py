"""The lists of fixes that go on exactly in docs/how-to/restarts.md are those of the code."""

from __future__ import annotations

import re

import pytest
from blocks import ROOT


@pytest.mark.parametrize("engine", ["LIGGGHTS", "LAMMPS"])
def test_fixes_that_go_on_exactly(engine: str) -> None:
    code = (ROOT / "plugins" / engine.lower() / "exact_fixes.h").read_text(encoding="utf-8")
    listed = re.findall(r'\{"([^"]+)",\s*"[^"]+"\}', code)
    assert listed == sorted(listed)
    page = (ROOT / "docs/how-to/restarts.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| {engine} \| (.*) \|$", page, re.MULTILINE)
    assert re.findall(r"`([^`]+)`", row) == listed
