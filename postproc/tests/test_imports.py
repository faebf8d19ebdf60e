"""What `dembark run` imports before its engine starts: nothing that only measuring, drawing or MDAnalysis needs."""

import subprocess
import sys

SLOW = {"MDAnalysis", "matplotlib", "pandas", "pint", "pyvista", "scipy", "threadpoolctl", "xarray"}
CODE = """
import sys
from dembark.validation import cli, show
from dembark.validation.case.folders import find
from dembark.validation.judge import measuring
from dembark.validation.runs import perform
measuring.check(find("silo"))
print(*sys.modules)
"""


def test_the_engine_does_not_wait_for_what_is_needed_later() -> None:
    loaded = subprocess.run([sys.executable, "-c", CODE], check=True, capture_output=True, text=True).stdout.split()
    assert "dembark.input_decks.silo.fields" in loaded
    assert not SLOW & set(loaded)
