"""Makes the rig of plugins/tests importable: its decks are used here too."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
