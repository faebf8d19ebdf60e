"""Makes the writers of synthetic runs and of synthetic results importable."""

import sys
from pathlib import Path

_HERE = Path(__file__).resolve()
sys.path[:0] = [str(_HERE.parent), *(str(_HERE.parents[3] / folder / "tests") for folder in ("input_decks", "postproc", "validation"))]
