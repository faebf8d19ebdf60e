"""The checks of each case: a module with `quantities(replicas) -> (quantities, profiles, remarks)`, `picture(parameters)` for the
report, and `REFERENCES`.

A case folder may bring its own `checks.py`; else the module here that has the case's name counts.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from dembark.common.errors import RunError


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
        spec.loader.exec_module(module)
        return module
    if not (Path(__file__).with_name(f"{case}.py")).is_file():
        raise RunError(f"case {case} has no checks", str(own or ""), "add a checks.py to its folder")
    return importlib.import_module(f"{__name__}.{case}")
