"""A case's own measurements: its measure.py, loaded, checked and called."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from dembark.common.errors import DembarkError, RunError
from dembark.postproc import DumpError
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.replica import Replica
from dembark.postproc.statistics import Estimate
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
        raise RunError(f"a run of case {case.name} could not be measured", str(error), "to run it again, delete its folder") from None


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
    where = f"{function} of {_path(case)} returned"
    for name, value in found.values.items():
        for wrong, right in _faults(value):
            raise DembarkError(f"{where} {name} {wrong}", "", f"give {right}, see docs/how-to/cases.md")
    if isinstance(found.remarks, str):
        raise DembarkError(f"{where} one text as remarks", "", "give a list of texts")
    if not all(isinstance(one, Mapping) and {"name", "place", "value"} <= one.keys() for one in found.profiles):
        raise DembarkError(f"{where} profiles that are no curves", "", "make each with profile(name, ...)")
    names = [one["name"] for one in found.profiles]
    if twice := next((name for name in names if names.count(name) > 1), ""):
        raise DembarkError(f"{where} two curves called {twice}", "", "give each a name of its own")
    return found


def _faults(value: Any) -> Iterator[tuple[str, str]]:
    """What is wrong with a measured value, each with what would be right."""
    if not isinstance(value, Value):
        yield f"= {value!r}", "a Value with an Estimate"
        return
    for part, one in (("estimate", value.estimate), *([("reference", value.reference)] if value.reference is not None else [])):
        if not isinstance(one, Estimate):
            yield f"with the {part} {one!r}", "an Estimate, such as Estimate(0.8, 0.0)"
        elif not (_is_number(one.value) and _is_number(one.half)):
            yield f"with the {part} {one.value!r} ± {one.half!r}", "a real number and a half-width"
        elif one.half < 0.0:
            yield f"with the {part} {one.value:g} ± {one.half:g}", "a half-width of 0 or more"
    for part in ("half", "bound"):
        if (given := getattr(value, part)) is not None and not _is_number(given):
            yield f"with {part} = {given!r}", "a real number"
    for part in ("reason", "inapplicable", "verdict", "detail"):
        if not isinstance(given := getattr(value, part), str):
            yield f"with {part} = {given!r}", "a text"


def _is_number(one: Any) -> bool:
    try:
        float(one)
    except (TypeError, ValueError):
        return False
    return not isinstance(one, str)
