"""Makes the writers of synthetic runs importable."""

import sys
from pathlib import Path

_HERE = Path(__file__).resolve()
sys.path[:0] = [str(_HERE.parents[2] / "tests")]
