"""A measured quantity with its interval, its reference, and the verdict that follows from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dembark.postproc.statistics import Estimate
from dembark.validation.judge.result import QuantityRecord, as_json


@dataclass(frozen=True)
class Quantity:
    """One line of the verdict table.

    `deviation` from the reference is relative unless `absolute`; `deviation_half` is the half-width of its own interval (value and
    reference of one run are correlated, so it is not that of the two values). `tolerance` None means: nothing to pass or fail;
    `verdict` is one that was reached by another rule, told in `detail`. `reason` tells why a verdict is info, `detail` what the
    number means. `compared`: the engines must agree in it; within `agreement`, in the unit of the value, where nothing is random and
    there is no interval to compare. `evidence` says what the reference is: experiment, theory, code (another code) or identity (a
    conservation law, the scheme against itself); "" only for quantities that have none.
    """

    name: str
    label: str
    unit: str
    estimate: Estimate
    detail: str = ""
    reference: Estimate | None = None
    tolerance: float | None = None
    absolute: bool = False
    deviation_half: float | None = None
    source: str = ""
    reason: str = ""
    verdict: str = ""
    compared: bool = True
    agreement: float | None = None
    evidence: str = ""

    @property
    def deviation(self) -> float | None:
        """Value minus reference, over the reference unless `absolute`; NaN over a reference of zero."""
        if self.reference is None:
            return None
        difference = self.estimate.value - self.reference.value
        return difference if self.absolute else difference / self.reference.value if self.reference.value else math.nan

    def judged(self) -> tuple[str, str]:
        """Verdict and reason: pass or fail by the tolerance; info where there is none or where the run is too small for it."""
        if self.verdict:
            return self.verdict, self.reason
        if self.reason or self.tolerance is None or self.deviation is None:
            return "info", self.reason
        if not math.isfinite(self.deviation):
            return "fail", "no finite number"
        half = self.deviation_half if self.deviation_half is not None else self._half()
        return judge(self.deviation, half, self.tolerance)

    def _half(self) -> float:
        other = self.reference.half if self.reference else 0.0
        joint = math.hypot(self.estimate.half, other)
        return joint if self.absolute or self.reference is None else joint / abs(self.reference.value)

    def record(self) -> QuantityRecord:
        """The quantity with its verdict, as results hold it; numbers that are not finite become None."""
        verdict, reason = self.judged()
        reference = self.reference
        return QuantityRecord(
            name=self.name, label=self.label, value=_number(self.estimate.value), unit=self.unit, interval=_pair(self.estimate),
            basis=self.estimate.basis, reference=None if reference is None else _number(reference.value),
            reference_interval=None if reference is None else _pair(reference),
            deviation=_number(self.deviation), deviation_kind="absolute" if self.absolute else "relative",
            tolerance=_number(self.tolerance),
            verdict=verdict, reason=reason, detail=self.detail, source=self.source, evidence=self.evidence, compared=self.compared,
            deviation_half_width=_number(self.deviation_half), agreement=self.agreement)

    def as_json(self) -> dict[str, Any]:
        """The entry of metrics.json."""
        return as_json(self.record())


def measured(point: Mapping[str, Any], name: str, factor: float = 1.0) -> Estimate:
    """The quantity `name` of a metrics.json's content, times `factor`; half-width inf where it has no interval."""
    one = next(quantity for quantity in point["quantities"] if quantity["name"] == name)
    half = 0.5 * (one["interval"][1] - one["interval"][0]) if one["interval"] else math.inf
    return Estimate(one["value"] * factor, half * factor, one.get("basis", ""))


def judge(deviation: float, half: float, tolerance: float) -> tuple[str, str]:
    """pass or fail of a deviation with interval half-width `half`; info when the interval is wider than the tolerance, for then
    neither verdict would mean anything."""
    if not half <= tolerance:
        wide = f"±{half:.2g}" if math.isfinite(half) else "unknown"
        return "info", f"its interval ({wide}) is wider than what is allowed"
    return ("pass", "") if abs(deviation) <= tolerance else ("fail", "")


def _number(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None


def _pair(estimate: Estimate) -> tuple[float, float] | None:
    low, high = estimate.interval
    return (float(low), float(high)) if math.isfinite(low) and math.isfinite(high) else None
