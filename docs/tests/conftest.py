"""Makes the modules beside the tests importable: blocks of the documentation, and what runs them."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
