"""Verdicts: what was measured, joined with what case.toml declares of each quantity."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from dembark.common.errors import DembarkError
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.statistics import Estimate, tail_probability
from dembark.validation.case.model import Case, Declared

from . import prediction
from .decision import decides, packings
from .result import QuantityRecord


def quantities(case: Case, found: Measurement, variant: str = "", parameters: Mapping[str, Any] | None = None,
               fitted: Mapping[str, Any] | None = None) -> tuple[QuantityRecord, ...]:
    """The measured quantities of `variant` as declared, with verdicts, families and known causes of failures, in the order of the
    declaration; what the `parameters` of the run were `fitted` to is marked, see `prediction.marked`. DembarkError for one that is not
    declared."""
    order = list(case.quantities)
    matched = [(*declared(case, name), name, value) for name, value in found.values.items()]
    records = []
    for one, part, name, value in sorted(matched, key=lambda entry: order.index(entry[0].name)):
        record = judged(one, value, name, part)
        cause = case.cause(name, one.name, variant) if record.verdict == "fail" else ""
        samples = record.samples if case.paired else ()
        records.append(replace(record, family=_family(case, one, name, variant), cause=cause, samples=samples))
    if fitted:
        records = prediction.marked(records, case.name, variant, fitted, parameters or {})
    return tuple(records)


def _family(case: Case, one: Declared, name: str, variant: str) -> str:
    """The fact that the quantity `name` measures. Engines solve the same equations and are compared with each other: compared with what
    lies outside of them, they measure one fact."""
    if one.family:
        return f"{case.name}: {one.family}"
    return f"{case.name}, {variant}: {name}" if one.evidence in ("experiment", "code") else ""


def declared(case: Case, name: str) -> tuple[Declared, str]:
    """The declaration of the quantity `name`, and the part that stands for its `*`; DembarkError when there is none."""
    if found := case.declared(name):
        return found
    raise DembarkError(f"quantity {name} is measured but not declared", f"{case.folder / 'case.toml'}", f"add a table [quantities.{name}]")


def judged(one: Declared, value: Value, name: str = "", part: str = "") -> QuantityRecord:
    """A quantity with its verdict, as results hold it (see QuantityRecord); numbers that are not finite become None.

    `name` is that of the measured quantity where the declared one has a `*`, for which `part` stands. DembarkError when the
    value has a bound that the declaration does not name, or none where it does, or where the quantity has an interval.
    """
    name = name or one.name
    reference, scale, (own, of_reference) = value.reference, _scale(one, value), _halves(one, value)
    tolerance, half = _tolerance(one, value, name), math.hypot(own, of_reference, one.input_uncertainty)
    deviation = None if reference is None else (value.estimate.value - reference.value) / scale
    detail = value.detail or one.detail or one.why
    if one.input_uncertainty and reference is not None:
        detail += f"; U_input = {one.input_uncertainty:g}: {one.inputs}"
    verdict, reason, decided = value.verdict, value.inapplicable or value.reason, ""
    if not verdict:
        verdict = "info"
        if not reason and tolerance is not None and deviation is not None:
            verdict, reason = judge(deviation, half, tolerance)
            if reference is not None and reference.value == 0.0 and math.isnan(scale):
                reason = "the reference is 0, of which there are no parts: declare absolute = true, with a tolerance in the unit"
            if verdict == "info":
                known = "inputs" if one.input_uncertainty > of_reference else "a reference"
                decided = decides(deviation, own, math.hypot(of_reference, one.input_uncertainty), tolerance, value.estimate.basis, known)
    return QuantityRecord(
        name=name, label=one.label.replace("*", part.replace("_", " ")), value=_finite(value.estimate.value), unit=one.unit,
        interval=_interval(value.estimate), basis=value.estimate.basis,
        reference=_finite(reference.value if reference else None), reference_interval=_interval(reference) if reference else None,
        deviation=_finite(deviation), deviation_kind="absolute" if one.absolute else "relative", tolerance=_finite(tolerance),
        verdict=verdict, reason=reason, detail=detail, source=one.source, evidence=one.evidence,
        compared=one.compared and value.compared, control=one.control, decides=decided, samples=value.estimate.samples,
        deviation_half_width=_finite(value.half), independent=one.independent and value.half is None,
        chance=chance(half, tolerance, len(value.estimate.samples) or packings(value.estimate.basis)),
        agreement=None if one.agreement is None else one.agreement * value.scale)


def _scale(one: Declared, value: Value) -> float:
    """What a deviation is divided by; NaN where there is no relative deviation, because the reference is zero."""
    return 1.0 if one.absolute or value.reference is None else value.reference.value or math.nan


def _halves(one: Declared, value: Value) -> tuple[float, float]:
    """Half-widths of the deviation that come from the value and from its reference."""
    if value.half is not None or value.reference is None:
        return value.estimate.half if value.half is None else value.half, 0.0
    scale = abs(_scale(one, value))
    return value.estimate.half / scale, value.reference.half / scale


def _tolerance(one: Declared, value: Value, name: str) -> float | None:
    """The largest deviation that is allowed; None where nothing is to be checked."""
    if one.tolerance != "bound":
        if value.bound is not None:
            raise DembarkError(f"quantity {name} has a bound", 'its tolerance is not the word "bound"', "remove the bound or declare it")
        return None if one.tolerance is None or value.reference is None or value.inapplicable else float(one.tolerance)
    if value.bound is None and value.reference is not None and not value.reason:
        raise DembarkError(f"quantity {name} is declared with tolerance = \"bound\"", "", "give bound=... in its Value")
    if value.bound is not None and value.estimate.half != 0.0:
        # The noise of a run must not decide what it is allowed.
        raise DembarkError(f"quantity {name} has a bound and an interval", "a bound is for runs in which nothing is random",
                           "declare its tolerance as a number, with the reason")
    return None if value.reference is None or value.inapplicable else value.bound


def judge(deviation: float, half: float, tolerance: float) -> tuple[str, str]:
    """Verdict and reason of a deviation with interval half-width `half`.

    pass: all of the interval is within the tolerance. fail: the deviation is beyond it or, where the interval is the wider of the two, all
    of the interval is. info, which is open: the interval reaches beyond the tolerance, and neither verdict would mean anything.
    """
    if not math.isfinite(deviation):
        return "fail", "no finite number"
    if abs(deviation) - half > tolerance:
        return "fail", ""
    if not half <= tolerance:
        wide = f"±{half:.2g}" if math.isfinite(half) else "unknown"
        return "info", f"its interval ({wide}) is wider than the tolerance"
    if abs(deviation) > tolerance:
        return "fail", ""
    return ("pass", "") if abs(deviation) + half <= tolerance else ("info", f"its interval (±{half:.2g}) extends beyond the tolerance")


def chance(half: float, tolerance: float | None, count: float) -> float | None:
    """Probability that a check whose true deviation is zero fails by chance, from the half-width of the deviation's interval over `count`
    packings; from within fewer than three it is taken as normal. 0 where the interval is unknown, None where nothing is random."""
    if half == 0.0 or tolerance is None:
        return None
    if not math.isfinite(half):
        return 0.0
    return tail_probability(tolerance if half <= tolerance else tolerance + half, half, count - 1.0 if count >= 3 else math.inf)


def _finite(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None


def _interval(estimate: Estimate) -> tuple[float, float] | None:
    low, high = estimate.interval
    return (float(low), float(high)) if math.isfinite(low) and math.isfinite(high) else None
