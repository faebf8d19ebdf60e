"""The lists of fixes that go on exactly in docs/how-to/restarts.md are those of the code."""

from __future__ import annotations

import re

import pytest
from blocks import ROOT


@pytest.mark.parametrize("engine", ["LIGGGHTS", "LAMMPS"])
def test_fixes_that_go_on_exactly(engine: str) -> None:
    listed = []
    for file in ("lammps_family/resume_record.cpp", f"{engine.lower()}/exact_fixes.h"):
        names = re.findall(r'\{"([^"]+)",\s*"[^"]+"\}', (ROOT / "plugins" / file).read_text(encoding="utf-8"))
        assert names and names == sorted(names)
        listed += names
    listed.sort()
    page = (ROOT / "docs/how-to/restarts.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| {engine} \| (.*) \|$", page, re.MULTILINE)
    assert re.findall(r"`([^`]+)`", row) == listed
