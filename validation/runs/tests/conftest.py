"""The small case and the stand-in engine are those of the tests of the harness."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "campaigns" / "tests"))
