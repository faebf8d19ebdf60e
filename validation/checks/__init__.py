"""The checks of each case: a module with `quantities(replicas) -> (quantities, profiles, remarks)`, `picture(parameters)` for the
report, and `REFERENCES`.

A case folder may bring its own `checks.py`; else the module here that has the case's name counts.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import traceback
from pathlib import Path
from types import ModuleType

from dembark.common.errors import DembarkError, RunError


def place(error: BaseException, file: Path) -> str:
    """` (checks.py, line 12)`: the last line of `file` on the way to `error`; '' when it was not on it."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    return f" ({file.name}, line {lines[-1]})" if lines else ""


def require(case: str, folder: Path) -> None:
    """DembarkError when `case` has no checks: its runs could not be measured. Nothing is imported."""
    if not (folder / "checks.py").is_file() and not Path(__file__).with_name(f"{case}.py").is_file():
        raise DembarkError(f"case {case} has no checks", f"there is no {folder / 'checks.py'}",
                           "add one with quantities(replicas), picture(parameters) and REFERENCES, see docs/cases.md")


def find(case: str, folder: Path | None = None) -> ModuleType:
    """Module with the checks of `case`; `folder` is that of its case file, if known. RunError when there is none."""
    own = folder / "checks.py" if folder else None
    if own and own.is_file():
        name = f"dembark_checks_{case}"
        spec = importlib.util.spec_from_file_location(name, own)
        if spec is None or spec.loader is None:
            raise RunError(f"{own} cannot be loaded")
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except Exception as error:  # the file is the user's: whatever is wrong in it is told in one line
            raise DembarkError(f"{own} cannot be loaded", f"{type(error).__name__}: {error}{place(error, own)}") from None
        for name in ("quantities", "picture", "REFERENCES"):
            if not hasattr(module, name):
                raise DembarkError(f"{own} has no {name}", "", "the checks of a case are quantities(replicas), picture(parameters), REFERENCES")
        return module
    require(case, folder or Path("input_decks", case))
    return importlib.import_module(f"{__name__}.{case}")
