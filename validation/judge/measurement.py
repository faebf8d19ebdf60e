"""A case's own measurements: its measure.py, loaded, checked and called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from dembark.common.errors import DembarkError, RunError
from dembark.postproc import DumpError
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.replica import Replica
from dembark.validation.case import deck
from dembark.validation.case.model import Case, Study


def load(case: Case) -> ModuleType:
    """The measure.py of the case, loaded anew; DembarkError, with file and line, when it is missing, cannot be loaded, or lacks one of
    `measure` and, in a case with studies, `study`."""
    deck.require_measure(case)
    path = _path(case)
    module = deck.load_module(path, f"dembark_measure_{case.name}")
    for name in ("measure", *(["study"] if case.studies else [])):
        if not callable(getattr(module, name, None)):
            raise DembarkError(f"{path} has no function {name}", "",
                               "it needs measure(replicas) and, with [studies], study(name, points, along)")
    return module


def measure(case: Case, replicas: Sequence[Replica]) -> Measurement:
    """What the measure.py of the case returns for `replicas`. Errors in it pass through: the caller knows the runs, and states what of them
    is too small; RunError for dumps that cannot be read."""
    try:
        return _checked(case, "measure", load(case).measure(replicas))
    except DumpError as error:
        raise RunError(f"a run of case {case.name} could not be measured", str(error)) from None


def study(case: Case, planned: Study, points: Sequence[Mapping[str, Any]]) -> Measurement:
    """What the measure.py of the case returns for the study `planned`; `points` are the contents of the variants' metrics.json.
    DembarkError with file and line for whatever fails in it."""
    try:
        return _checked(case, "study", load(case).study(planned.name, points, planned.along))
    except DembarkError:
        raise
    except Exception as error:
        raise deck.failed(_path(case), error) from error


def _path(case: Case) -> Path:
    return case.folder / "measure.py"


def _checked(case: Case, function: str, found: Any) -> Measurement:
    if not isinstance(found, Measurement):
        raise DembarkError(f"{function} of {_path(case)} returned {type(found).__name__}", "",
                           "return a Measurement, see docs/how-to/cases.md")
    if wrong := next((f"{key} = {value!r}" for key, value in found.values.items() if not isinstance(value, Value)), ""):
        raise DembarkError(f"{function} of {_path(case)} returned {wrong}", "",
                           "give a Value with an Estimate, see docs/how-to/cases.md")
    return found
