"""Whether engines are equivalent, pair by pair, by two one-sided tests; or, where nothing is random, whether the difference is within a
bound that the quantity brings along.

Two one-sided tests (TOST, D. J. Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987) 657) at 2.5 % each: the difference is shown to be above
-10 % and below +10 %, which is so when its 95 % interval is within them. That engines do not differ significantly shows nothing: runs that
are noisy enough never do.

Packings differ by more than what varies within one, so random runs are compared only by intervals over three packings or more in each
engine; with fewer the difference is shown, and nothing is due to be checked. Engines that solve the same equations are due to differ by
chance alone: a difference beyond chance fails, though it may be within 10 %. A page compares many quantities, of which one in twenty lies
beyond its 95 % interval although nothing is wrong, so what counts as beyond chance is what is outside of the interval that holds all
differences of the page together with 99 %.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

from dembark.common.errors import RunError
from dembark.postproc.statistics import joint_half, joint_limit
from dembark.validation.judge import result
from dembark.validation.judge.deciding import PACKINGS, decides, packings
from dembark.validation.judge.result import ComparedRecord, Comparison, QuantityRecord, Result

CAP = 0.10
# Of all comparisons of a page together.
CONFIDENCE = 0.99


def compare(folder: Path) -> Comparison:
    """The engines that have a `metrics.json` below the folder of a case and variant, compared. RunError for fewer than two.

    Of each pair of engines the first in alphabetical order is the reference. What chance may do is shared by all pairs of the page.
    """
    measured = sorted((result.read(path) for path in folder.glob(f"*/{result.METRICS}")), key=lambda one: one.engine)
    if len(measured) < 2:
        raise RunError(f"nothing to compare in {folder}",
                       f"there is a measurement of {measured[0].engine if measured else 'no engine'} only")
    first = measured[0]
    both = [(one, other, *two) for one, other in combinations(measured, 2) for two in _shared(one, other)]
    pairs = [replace(pair(reference, value, one.engine, other.engine, len(both)),
                     family=f"{first.case}, {first.variant}: {value.name} in the engines") for one, other, reference, value in both]
    return Comparison(first.case, first.variant, tuple(one.engine for one in measured), tuple(pairs), first.profile, CAP)


def _shared(first: Result, second: Result) -> list[tuple[QuantityRecord, QuantityRecord]]:
    """The quantities in which two engines are compared."""
    by_name = {one.name: one for one in first.quantities if one.compared}
    return [(by_name[one.name], one) for one in second.quantities if one.compared and one.name in by_name]


def pair(reference: QuantityRecord, value: QuantityRecord, reference_engine: str, engine: str, comparisons: int = 1) -> ComparedRecord:
    """One quantity of two engines with its verdict; `comparisons`: how many are made on its page, of all pairs of engines.

    pass: the joint 95 % interval of the difference is within 10 %. fail: the difference is beyond what chance does to one of all
    `comparisons`. info: the joint interval reaches beyond 10 %; or, without a tolerance, it is unknown or comes from fewer than three
    packings in either engine, which cannot hold what varies from one packing to the next.

    A quantity of a deterministic run has an `agreement` instead, in its own unit: pass within it, fail beyond it.
    """
    both = (value, reference)
    deviation: float | None = None
    kind, half, chance, decided = "relative", None, None, ""
    tolerance: float | None = CAP
    bounds = [one.agreement for one in both if one.agreement is not None]
    if value.value is None or reference.value is None or not (bounds or reference.value):
        verdict, reason = "fail", "no value to compare"
    elif bounds:
        kind, tolerance, deviation = "absolute", max(bounds), value.value - reference.value
        same = abs(deviation) <= tolerance
        verdict, reason = ("pass", "") if same else ("fail", "the values must agree")
    else:
        deviation = (value.value - reference.value) / abs(reference.value)
        half = None if value.half is None or reference.half is None else joint_half(value.half, reference.half)
        counts, scale = (packings(value.basis), packings(reference.basis)), abs(reference.value)
        if half is None or min(counts) < PACKINGS:
            tolerance, verdict, reason = None, "info", f"{PACKINGS} packings in each engine are needed to compare them"
        else:
            halves = ((value.half or 0.0) / scale, (reference.half or 0.0) / scale)
            verdict, reason = _judged(abs(deviation), halves, counts, comparisons)
            chance = (1.0 - CONFIDENCE) / comparisons if verdict != "info" else 0.0
            if verdict == "info":
                fewest = min((value.basis, reference.basis), key=packings)
                decided = decides(deviation, half / scale, 0.0, CAP, fewest, "packings in each engine")
    return ComparedRecord(
        name=value.name, label=value.label, unit=value.unit, value=value.value, interval=value.interval, reference=reference.value,
        reference_interval=reference.interval, deviation=deviation, deviation_kind=kind, tolerance=tolerance, verdict=verdict,
        reason=reason, decides=decided, chance=chance, detail="agreement of the engines", source=reference_engine, engine=engine,
        reference_engine=reference_engine, joint_half_width=half)


def _judged(difference: float, halves: tuple[float, float], counts: tuple[float, float], comparisons: int) -> tuple[str, str]:
    """Verdict and reason from |difference| and half-widths over the reference, and the numbers `counts` of packings."""
    half = joint_half(*halves)
    limit = max(half, joint_limit(*halves, *counts, 1.0 - (1.0 - CONFIDENCE) / comparisons))
    if difference > limit:
        within = ", although within 10 %" if difference <= CAP else ""
        return "fail", f"larger than expected by chance{within}: the joint interval is ±{half:.1%}, chance explains ±{limit:.1%}"
    if difference + half > CAP:
        return "info", (f"the joint interval (±{half:.0%}) is wider than 10 %" if half > CAP else
                        f"the joint interval (±{half:.1%}) extends beyond 10 %")
    return "pass", ""
