"""Whether engines are equivalent, pair by pair, by two one-sided tests; or, where nothing is random, whether the difference is within a
bound of the quantity.

Two one-sided tests (TOST, D. J. Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987) 657) at 2.5 % each: the difference is shown to be above
-10 % and below +10 %, which is so when its 95 % interval is within them. That engines do not differ significantly shows nothing: runs that
are noisy enough never do.

Packings differ by more than what varies within one, so random runs are compared only by intervals over three packings or more in each
engine; with fewer the difference is shown, and nothing is checked. Engines that solve the same equations should differ by chance alone: a
difference beyond chance fails, though it may be within 10 %. A page compares many quantities, of which one in twenty lies beyond its 95 %
interval although nothing is wrong, so what counts as beyond chance is what is outside of the interval that holds all differences of the
page together with 99 %.

All engines start from the same packings. In a case whose packing decides what comes out (`paired`), the difference is the mean of the
differences in each packing, with their own interval: what a packing does to all engines alike is no part of it. Where motion is chaotic,
engines differ as much as packings do, and pairs would only cost degrees of freedom.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from dembark.common.errors import RunError
from dembark.postproc.statistics import CONFIDENCE as INTERVAL
from dembark.postproc.statistics import joint_limit, replica_mean, rescaled

from .decision import DIFFER, PACKINGS, enough_packings, packings
from .result import METRICS, ComparedRecord, Comparison, QuantityRecord, Result, read

CAP = 0.10
# Of all comparisons of a page together.
CONFIDENCE = 0.99
# Pairs of the same packing show differences of the schemes, of second order in the time step. A difference that only they show to be more
# than chance fails from here on.
_SEEN = 0.01


def compare(folder: Path) -> Comparison:
    """The engines that have a `metrics.json` below the folder of a case and variant, compared. RunError for fewer than two.

    Of each pair of engines the first in alphabetical order is the reference. All pairs of the page share the allowance for chance.
    """
    measured = sorted((read(path) for path in folder.glob(f"*/{METRICS}")), key=lambda one: one.engine)
    if len(measured) < 2:
        raise RunError(f"nothing to compare in {folder}",
                       f"there is a measurement of {measured[0].engine if measured else 'no engine'} only")
    first = measured[0]
    both = [(one, other, *two) for one, other in combinations(measured, 2) for two in _shared(one, other)]
    pairs = [replace(pair(reference, value, one.engine, other.engine, len(both), min(_planned(one), _planned(other))),
                     family=f"{first.case}, {first.variant}: {value.name} in the engines") for one, other, reference, value in both]
    return Comparison(first.case, first.variant, tuple(one.engine for one in measured), tuple(pairs), first.profile, CAP)


def _planned(one: Result) -> int:
    """How many packings the run was to have."""
    return int(one.parameters.get("replicas", 1))


def _shared(first: Result, second: Result) -> list[tuple[QuantityRecord, QuantityRecord]]:
    """The quantities in which two engines are compared, with their samples where these are of the same packings."""
    by_name = {one.name: one for one in first.quantities if one.compared}
    pairs = [(by_name[one.name], one) for one in second.quantities if one.compared and one.name in by_name]
    if first.provenance.get("seeds") == second.provenance.get("seeds"):
        return pairs
    return [(replace(one, samples=()), replace(other, samples=())) for one, other in pairs]


def pair(reference: QuantityRecord, value: QuantityRecord, reference_engine: str, engine: str, comparisons: int = 1,
         planned: int = PACKINGS) -> ComparedRecord:
    """One quantity of two engines with its verdict; `comparisons`: how many are made on its page, of all pairs of engines; `planned`: how
    many packings the engine with fewer was to run.

    pass: the joint 95 % interval of the difference is within 10 %. fail: the difference is beyond what chance does to one of all
    `comparisons`. info: the joint interval reaches beyond 10 %, is unknown, or comes from fewer than three packings in either engine, which
    cannot hold what varies from one packing to the next. Where fewer than three were planned, nothing is checked.

    A quantity of a deterministic run has an `agreement` instead, in its own unit: pass within it, fail beyond it.
    """
    both = (value, reference)
    deviation: float | None = None
    kind, half, chance, decided = "relative", None, None, ""
    tolerance: float | None = CAP
    bounds = [one.agreement for one in both if one.agreement is not None]
    if value.value is None or reference.value is None:
        verdict, reason = "fail", "no value to compare"
    elif bounds:
        kind, tolerance, deviation = "absolute", max(bounds), value.value - reference.value
        same = abs(deviation) <= tolerance
        verdict, reason = ("pass", "") if same else ("fail", "the values must agree")
    else:
        # Of nothing there is no tenth: that nothing happens in both engines agrees, that it does in one alone does not.
        deviation = (value.value - reference.value) / abs(reference.value) if reference.value else None
        few, unknown = min(packings(value.basis), packings(reference.basis)), next((one for one in both if one.half is None), None)
        if planned < PACKINGS and (unknown is not None or few < PACKINGS):
            tolerance, verdict, reason = None, "info", f"{PACKINGS} packings in each engine are needed to compare them"
        elif deviation is None or (value.value == 0.0 and value.half is None):
            verdict, reason = "info", "a tenth of 0 decides nothing"
            other = value if value.value else reference
            if not other.value:
                verdict, reason = "pass", ""
            elif other.half is not None and abs(other.value) > other.half:
                verdict, reason = "fail", "the other engine's is 0" if value.value else "the other engine's is not 0"
        elif unknown is not None or few < PACKINGS:
            verdict, decided = "info", f"{PACKINGS} packings in each engine or more" if few < PACKINGS else DIFFER
            reason = "an interval comes from fewer packings than planned" if unknown is None else (
                f"an interval is unknown: {unknown.basis or 'the run is too short'}")
        else:
            chance_of = _chance(value, reference, 1.0 - (1.0 - CONFIDENCE) / comparisons)
            half = abs(reference.value) * chance_of(0)[0]
            verdict, reason = _judged(abs(deviation), *chance_of(0))
            chance = (1.0 - CONFIDENCE) / comparisons if verdict != "info" else 0.0
            if verdict == "info" and math.isfinite(few):
                needed = enough_packings(lambda count: _judged(abs(deviation), *chance_of(count))[0] != "info", int(few))
                decided = f"{needed} in each engine"
    return ComparedRecord(
        name=value.name, label=value.label, unit=value.unit, value=value.value, interval=value.interval, reference=reference.value,
        reference_interval=reference.interval, deviation=deviation, deviation_kind=kind, tolerance=tolerance, verdict=verdict,
        reason=reason, decides=decided, chance=chance, detail="agreement of the engines", source=reference_engine, engine=engine,
        reference_engine=reference_engine, joint_half_width=half)


def _chance(value: QuantityRecord, reference: QuantityRecord, confidence: float) -> Callable[[int], tuple[float, float, float]]:
    """For any number of packings in each engine, all over the reference: the half-width of the 95 % interval of the difference, that with
    `confidence`, and the size from which a difference beyond that fails. 0: with
    the packings that were run; else with that many packings of the same scatter."""
    scale, both = abs(reference.value or 0.0), (value, reference)
    differences = np.subtract(value.samples, reference.samples) if len(value.samples) == len(reference.samples) else np.zeros(0)

    def found(count: int) -> tuple[float, float, float]:
        counts = [packings(one.basis) for one in both]
        sizes = [one if math.isinf(one) else count or one for one in counts]
        halves = [rescaled(one.half or 0.0, now, then) for one, now, then in zip(both, counts, sizes, strict=True)]
        half, limit = (joint_limit(halves[0], halves[1], sizes[0], sizes[1], level) / scale for level in (INTERVAL, confidence))
        pairs = len(differences)
        if pairs < PACKINGS:
            return half, limit, 0.0
        paired, widest = (rescaled(replica_mean(list(differences), level).half, pairs, count or pairs, level) / scale
                          for level in (INTERVAL, confidence))
        return paired, widest, min(limit, _SEEN)

    return found


def _judged(difference: float, half: float, limit: float, seen: float) -> tuple[str, str]:
    """Verdict and reason from |difference|, its half-width, what chance explains, and the size from which more than that fails; all over
    the reference."""
    limit = max(half, limit)
    if difference > max(limit, seen):
        within = ", although within 10 %" if difference <= CAP else ""
        return "fail", f"larger than expected by chance{within}: the joint interval is ±{half:.1%}, chance explains ±{limit:.1%}"
    if difference + half > CAP:
        return "info", (f"the joint interval (±{half:.0%}) is wider than 10 %" if half > CAP else
                        f"the joint interval (±{half:.1%}) extends beyond 10 %")
    return "pass", ""
