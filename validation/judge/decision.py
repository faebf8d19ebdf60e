"""What would decide a check that is open: how many packings, how long a run, or a better reference."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from dembark.postproc.statistics import rescaled

PACKINGS = 3
# Of three or more whose values are all equal.
DIFFER = "packings whose values differ, or a finer reading"
# So many packings are beyond any campaign.
_MOST = 1000


def decides(deviation: float, own: float, reference: float, tolerance: float, basis: str, known: str = "a reference") -> str:
    """What decides a check whose deviation has the half-widths `own` of the value, with this `basis`, and `reference`, of what is `known`.

    All in the unit of the tolerance. A deviation that stays as it is passes once all of its interval is within the tolerance, and fails
    once all of it is beyond or its half-width is no more than that.
    """
    if not (math.isfinite(deviation) and math.isfinite(reference)):
        return "a reference with an interval" if math.isfinite(deviation) else ""
    count, excess = packings(basis), abs(deviation) - tolerance
    target = -excess if excess < 0.0 else max(tolerance, excess)
    if reference >= target:
        return f"{known} known to {_limits(target, reference)}"
    wanted = math.sqrt(target**2 - reference**2)
    enough, longer = f"{PACKINGS} packings or more", f"runs about {max((own / wanted) ** 2, 1.1):.2g} times as long"
    if math.isinf(own) and PACKINGS <= count < math.inf:
        return DIFFER
    if count < PACKINGS or not math.isfinite(own):
        return enough if count == 1.0 or not math.isfinite(own) else f"{enough}, or {longer}"
    if math.isfinite(count):
        return enough_packings(lambda number: rescaled(own, count, number) <= wanted, round(count))
    return longer if "block" in basis else f"inputs known well enough to change the value by at most {_limits(wanted, own)}"


def _limits(wanted: float, now: float) -> str:
    """Both in as few digits as tell them apart."""
    digits = next((count for count in range(2, 6) if f"{wanted:.{count}g}" != f"{now:.{count}g}"), 6)
    return f"±{wanted:.{digits}g}, now ±{now:.{digits}g}"


def packings(basis: str) -> float:
    """Over how many packings an interval with this `basis` was taken; 1 or 2 when it comes from within them, infinite when it rests on no
    packing."""
    found = re.match(r"(?:within )?(\d+) replica", basis)
    return int(found.group(1)) if found else math.inf


def enough_packings(enough: Callable[[int], bool], least: int) -> str:
    """In words: the smallest number of packings from `least` on that is `enough`, as all larger ones are."""
    low, high = least, _MOST
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle + 1, high)
    return f"about {low} packings" if low < _MOST else f"more than {_MOST} packings"
