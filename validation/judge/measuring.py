"""Runs a case's measure.py and joins what it measured with what case.toml declares of each quantity."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from dembark.common.choices import pick
from dembark.common.errors import DembarkError, RunError
from dembark.postproc import DumpError
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.statistics import Estimate
from dembark.validation.case import deck
from dembark.validation.case.expressions import Expression
from dembark.validation.case.model import Case, Declared, Study
from dembark.validation.judge.result import QuantityRecord

if TYPE_CHECKING:
    from dembark.postproc.replica import Replica

# Keys of [picture] that are expressions in parameters and derived numbers.
_NUMBERS = ("scale", "radius", "drum_radius", "drum_speed", "speed")


def measure(case: Case, replicas: Sequence[Replica]) -> Measurement:
    """What the measure.py of the case returns for `replicas`; DembarkError or RunError in one line for whatever goes wrong in it."""
    return _call(case, "measure", lambda function: function(replicas))


def study(case: Case, planned: Study, points: Sequence[Mapping[str, Any]]) -> Measurement:
    """What the measure.py of the case returns for the study `planned`; `points` are the contents of the variants' metrics.json."""
    return _call(case, "study", lambda function: function(planned.name, points, planned.along))


def check(case: Case) -> ModuleType:
    """The measure.py of the case, loaded; DembarkError, with file and line, when it is missing or cannot be loaded."""
    deck.require_measure(case)
    path = case.folder / "measure.py"
    module = deck.load_module(path, f"dembark_measure_{case.name}")
    for name in ("measure", *(["study"] if case.studies else [])):
        if not callable(getattr(module, name, None)):
            raise DembarkError(f"{path} has no function {name}", "",
                               "it needs measure(replicas) and, with [studies], study(name, points, along)")
    return module


def _call(case: Case, name: str, call: Callable[[Callable[..., Any]], Any]) -> Measurement:
    path, module = case.folder / "measure.py", check(case)
    try:
        found = call(getattr(module, name))
    except DumpError as error:
        raise RunError(f"a run of case {case.name} could not be measured", str(error)) from None
    except Exception as error:
        # The caller of `measure` knows the runs and says what of them is too small.
        if name == "measure" or isinstance(error, DembarkError):
            raise
        raise deck.failed(path, error) from error
    if not isinstance(found, Measurement):
        raise DembarkError(f"{name} of {path} returned {type(found).__name__}", "", "return a Measurement, see docs/cases.md")
    return found


def quantities(case: Case, found: Measurement) -> tuple[QuantityRecord, ...]:
    """The measured quantities as declared, with verdicts, in the order of the declaration; DembarkError for one that is not declared."""
    order = list(case.quantities)
    matched = [(*declared(case, name), name, value) for name, value in found.values.items()]
    return tuple(_judged(*entry) for entry in sorted(matched, key=lambda entry: order.index(entry[0].name)))


def declared(case: Case, name: str) -> tuple[Declared, str]:
    """The declaration of the quantity `name`, and what stands in the place of its `*`; DembarkError when there is none."""
    if name in case.quantities:
        return case.quantities[name], ""
    for pattern, one in case.quantities.items():
        before, star, after = pattern.partition("*")
        if star and name.startswith(before) and name.endswith(after) and len(name) > len(before) + len(after):
            return one, name[len(before) : len(name) - len(after)]
    raise DembarkError(f"quantity {name} is measured but not declared", f"{case.folder / 'case.toml'}", f"add a table [quantities.{name}]")


def _judged(one: Declared, part: str, name: str, value: Value) -> QuantityRecord:
    if one.tolerance == "bound" and value.bound is None and value.reference is not None and not value.reason:
        raise DembarkError(f"quantity {name} is declared with tolerance = \"bound\"", "", "give bound=... in its Value")
    if value.bound is not None and one.tolerance != "bound":
        raise DembarkError(f"quantity {name} has a bound", "its tolerance is not the word \"bound\"", "take the bound away or declare it")
    if value.bound is not None and value.estimate.half != 0.0:
        # The noise of a run must not decide what it is allowed.
        raise DembarkError(f"quantity {name} has a bound and an interval", "a bound is for runs in which nothing is random",
                           "declare its tolerance as a number, with the reason")
    tolerance = None if value.reference is None else value.bound if one.tolerance == "bound" else one.tolerance
    return judged(
        name, one.label.replace("*", part), one.unit, value.estimate, reference=value.reference,
        tolerance=None if tolerance is None else float(tolerance), absolute=one.absolute, deviation_half=value.half, source=one.source,
        detail=value.detail or one.detail or one.why, reason=value.reason, verdict=value.verdict, compared=one.compared and value.compared,
        agreement=None if one.agreement is None else one.agreement * value.scale, evidence=one.evidence)


def picture(case: Case, known: Mapping[str, Any]) -> dict[str, Any] | None:
    """How the report shows a run: the table [picture] with its expressions evaluated for the numbers `known`; None without one."""
    if not case.picture:
        return None
    return {key: Expression(value)(known) if key in _NUMBERS and isinstance(value, str) else value for key, value in case.picture.items()}


@cache
def _citations() -> dict[str, dict[str, str]]:
    return tomllib.loads(Path(__file__).with_name("references.toml").read_text(encoding="utf-8"))


def references(case: Case) -> tuple[dict[str, str], ...]:
    """The publications that the case names."""
    known = _citations()
    return tuple(known[pick(name, known, "reference", f"[case] of {case.folder / 'case.toml'}")] for name in case.references)


def statements(case: Case) -> list[str]:
    """What the publications of the case are cited for, a sentence each."""
    return [f"{one['short']}: {one['statement']}" for one in references(case) if one["statement"]]


def judged(name: str, label: str, unit: str, estimate: Estimate, *, reference: Estimate | None = None, tolerance: float | None = None,
           absolute: bool = False, deviation_half: float | None = None, verdict: str = "", reason: str = "", detail: str = "",
           source: str = "", compared: bool = True, agreement: float | None = None, evidence: str = "") -> QuantityRecord:
    """A quantity with its verdict, as results hold it (see QuantityRecord); numbers that are not finite become None.

    The deviation from the reference is relative unless `absolute`; `deviation_half` is the half-width of its own interval, where value
    and reference of one run are correlated. `tolerance` None means: nothing to pass or fail. `verdict` is one that was reached by another
    rule, told in `detail`; `reason` tells why there is none.
    """
    deviation, joint = None, estimate.half
    if reference is not None:
        scale = 1.0 if absolute else reference.value
        deviation = (estimate.value - reference.value) / scale if scale else math.nan
        joint = math.hypot(estimate.half, reference.half) / abs(scale) if scale else math.nan
    if not verdict:
        verdict = "info"
        if not reason and tolerance is not None and deviation is not None:
            verdict, reason = judge(deviation, joint if deviation_half is None else deviation_half, tolerance)
    return QuantityRecord(
        name=name, label=label, value=_finite(estimate.value), unit=unit, interval=_interval(estimate), basis=estimate.basis,
        reference=_finite(reference.value if reference else None), reference_interval=_interval(reference) if reference else None,
        deviation=_finite(deviation), deviation_kind="absolute" if absolute else "relative", tolerance=_finite(tolerance), verdict=verdict,
        reason=reason, detail=detail, source=source, evidence=evidence, compared=compared, deviation_half_width=_finite(deviation_half),
        agreement=agreement)


def judge(deviation: float, half: float, tolerance: float) -> tuple[str, str]:
    """Verdict and reason of a deviation with interval half-width `half`.

    pass: all of the interval is within the tolerance. fail: the deviation is beyond it. info, which is open: the interval reaches beyond
    the tolerance, or is wider than it, so that neither verdict would mean anything.
    """
    if not math.isfinite(deviation):
        return "fail", "no finite number"
    if not half <= tolerance:
        wide = f"±{half:.2g}" if math.isfinite(half) else "unknown"
        return "info", f"its interval ({wide}) is wider than what is allowed"
    if abs(deviation) > tolerance:
        return "fail", ""
    return ("pass", "") if abs(deviation) + half <= tolerance else ("info", f"its interval (±{half:.2g}) reaches beyond what is allowed")


def _finite(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None


def _interval(estimate: Estimate) -> tuple[float, float] | None:
    low, high = estimate.interval
    return (float(low), float(high)) if math.isfinite(low) and math.isfinite(high) else None
