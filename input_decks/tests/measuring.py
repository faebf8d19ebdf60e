"""What the measure.py of a case makes of a run, judged as its case.toml declares."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from dembark.postproc.measurement import Measurement
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.judge import measuring


def module(case: str) -> ModuleType:
    """measure.py of `case`."""
    return deck.load_module(Path(find(case).folder, "measure.py"), f"measure_{case}")


def defaults(case: str, **changes: Any) -> dict[str, Any]:
    """The parameters of `case` in SI units, some of them changed."""
    return {name: one.value for name, one in find(case).parameters.items()} | changes


def judged(case: str, found: Measurement) -> dict[str, dict[str, Any]]:
    """The measured quantities with their verdicts, by name."""
    return {one.name: one.as_json() for one in measuring.quantities(find(case), found)}


def names(found: Mapping[str, Mapping[str, Any]], verdict: str) -> set[str]:
    """Names of the quantities with this verdict."""
    return {name for name, one in found.items() if one["verdict"] == verdict}
