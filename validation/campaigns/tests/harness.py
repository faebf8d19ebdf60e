"""The fixtures of the harness's own tests, for those of campaigns: a small case and a stand-in for both engines."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

_FILE = Path(__file__).resolve().parents[2] / "tests" / "conftest.py"
_SPEC = importlib.util.spec_from_file_location("harness_fixtures", _FILE)
_MODULE = importlib.util.module_from_spec(_SPEC)
sys.modules[_SPEC.name] = _MODULE
_SPEC.loader.exec_module(_MODULE)

decks, stand_in, environment, stand_in_analysis, command = (
    getattr(_MODULE, name) for name in ("decks", "stand_in", "environment", "stand_in_analysis", "command"))
wait_for, lives, engine_pid = (getattr(_MODULE, name) for name in ("wait_for", "lives", "engine_pid"))


def start(folder: Path, environment: dict[str, str], *words: str) -> subprocess.Popen[str]:
    """The command `dembark` in `folder`."""
    return subprocess.Popen([sys.executable, "-m", "dembark.validation.cli", *words], cwd=folder, env=environment,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
