"""What reads and measures knows nothing of the harness above it."""

import re
from pathlib import Path

POSTPROC = Path(__file__).resolve().parents[1]


def test_postproc_does_not_import_the_harness():
    known = re.compile(r"^\s*(from|import) dembark\.(validation|input_decks)\b", re.MULTILINE)
    assert [str(path) for path in POSTPROC.rglob("*.py")
            if "tests" not in path.parts and known.search(path.read_text(encoding="utf-8"))] == []
