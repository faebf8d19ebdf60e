"""The lists of fixes that go on exactly in docs/how-to/restarts.md are those of the code."""

from __future__ import annotations

import re

import pytest
from blocks import ROOT


@pytest.mark.parametrize("engine", ["LIGGGHTS", "LAMMPS"])
def test_fixes_that_go_on_exactly(engine: str) -> None:
    code = (ROOT / "plugins" / engine.lower() / "exact_fixes.h").read_text(encoding="utf-8")
    listed = dict(re.findall(r'\{"([^"]+)",\s*"([^"]+)"\}', code))
    assert list(listed) == sorted(listed)
    page = (ROOT / "docs/how-to/restarts.md").read_text(encoding="utf-8")
    table = page.split(f"| {engine}: fixes that go on exactly | why |\n|---|---|\n")[1].split("\n\n")[0]
    rows = [line.strip("|").split(" | ") for line in table.splitlines()]
    assert {style: why.strip() for styles, why in rows for style in re.findall(r"`([^`]+)`", styles)} == listed
