"""Numerical uncertainty from runs that differ only in the time step, the stiffness or the like: Richardson extrapolation and the grid
convergence index, as distinct from the scatter that packings have anyway.

Roache, J. Fluids Eng. 116 (1994) 405; the procedure for unequal refinement is that of Celik et al., J. Fluids Eng. 130 (2008) 078001;
which order and safety factor count is decided as by Oberkampf & Roy, Verification and Validation in Scientific Computing (Cambridge 2010),
chapter 8.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

# Roache's safety factors: where three refinements show the formal order, and where the order is taken on trust.
SAFETY, SAFETY_UNSEEN_ORDER = 1.25, 3.0
_ORDER_AGREES, _LOWEST_ORDER = 0.1, 0.5
_HIGHEST_ORDER = 8.0

# How a parameter of the method makes the numerical error small: h = value**exponent, up to a constant. The overlap of Hertz contacts
# under a given load falls with the stiffness to the power 2/3.
REFINEMENT = {"time_step_fraction": 1.0, "time_step": 1.0, "youngs_modulus": -2.0 / 3.0}


@dataclass(frozen=True)
class Convergence:
    """What a series of refinements says about the value at the finest setting.

    `kind`: "monotone" (an `order` was observed), "oscillating", "diverging", "scatter" when a change is not larger than its own 95 %
    interval, or "bound" when two refinements leave no more than a bound. `extrapolated`: value at h = 0, None unless monotone.
    `uncertainty`: half-width of the numerical uncertainty of the finest value, in its unit, safety factor included; None when diverging.
    """

    kind: str
    order: float | None
    extrapolated: float | None
    uncertainty: float | None


def refinement(parameter: str, value: float) -> float:
    """The size h of the numerical error's source for a setting of `parameter`, up to a constant; KeyError for other parameters."""
    return float(value) ** REFINEMENT[parameter]


def observed_order(h: Sequence[float], values: Sequence[float]) -> float:
    """Order p with which `values` (3,) at h[0] < h[1] < h[2] converge: the root of Celik et al.'s equation, 8 for a higher one; NaN when
    there is none.

    The ratio (v2 - v1) / (v1 - v0) of an error a h^p is (h2^p - h1^p) / (h1^p - h0^p), which grows with p.
    """
    first, second = values[1] - values[0], values[2] - values[1]
    if first == 0.0 or second / first <= 0.0:
        return math.nan
    from scipy.optimize import brentq
    wanted = second / first

    def ratio(p: float) -> float:
        # Near p = 0 both differences vanish; their ratio tends to that of the logarithms.
        a, b, c = (size / h[0] for size in h)
        if p < 1e-9:
            return math.log(c / b) / math.log(b / a)
        return float((c**p - b**p) / (b**p - a**p))

    if not ratio(0.0) < wanted:
        return math.nan
    if wanted >= ratio(_HIGHEST_ORDER):
        return _HIGHEST_ORDER
    return float(brentq(lambda p: ratio(p) - wanted, 0.0, _HIGHEST_ORDER, xtol=1e-15))


def convergence(h: Sequence[float], values: Sequence[float], halves: Sequence[float] | None = None,
                formal_order: float = 1.0) -> Convergence:
    """Judge `values` at refinements `h` (any order, two or more, all different) with half-widths `halves` of their 95 % intervals.

    The finest three decide. With only two, or where a change is within its joint interval, no order can be observed: then the bound
    takes `formal_order`, the largest change that the intervals allow and the safety factor 3. An order that is observed within 10 % of the
    formal one takes the formal one and 1.25; any other takes 3 and at most the formal order, at least 1/2, for a high one that is seen
    once would make the uncertainty vanish. ValueError for fewer than two refinements, one that is given
    twice, or h <= 0.
    """
    if not 2 <= len(h) == len(set(h)) or min(h) <= 0.0:
        raise ValueError("convergence needs two refinements or more, all positive and different")
    rows = sorted(zip(h, values, [0.0] * len(values) if halves is None else halves, strict=True))[:3]
    sizes, found, spread = (list(column) for column in zip(*rows, strict=True))
    ratio = sizes[1] / sizes[0]
    change, joint = found[0] - found[1], math.hypot(spread[0], spread[1])
    bound = SAFETY_UNSEEN_ORDER * (abs(change) + joint) / (ratio**formal_order - 1.0)
    if not change and not joint:
        # Equal values hide the change between them: only the range of all says how much one may be (Eça & Hoekstra 2014).
        bound = SAFETY_UNSEEN_ORDER * (max(found) - min(found))
    if abs(change) <= joint or (len(rows) > 2 and abs(found[1] - found[2]) <= math.hypot(spread[1], spread[2])):
        return Convergence("scatter", None, None, bound)
    if len(rows) < 3:
        return Convergence("bound", None, None, bound)
    if (found[2] - found[1]) / (found[1] - found[0]) < 0.0:
        # Celik et al.: half the range is the least that an oscillating series leaves open.
        return Convergence("oscillating", None, None, max(bound, SAFETY * 0.5 * (max(found) - min(found))))
    order = observed_order(sizes, found)
    if not math.isfinite(order):
        return Convergence("diverging", None, None, None)
    agrees = abs(order - formal_order) <= _ORDER_AGREES * formal_order
    counted = formal_order if agrees else min(max(order, _LOWEST_ORDER), formal_order)
    uncertainty = (SAFETY if agrees else SAFETY_UNSEEN_ORDER) * abs(change) / (ratio**counted - 1.0)
    return Convergence("monotone", order, found[0] + change / (ratio**order - 1.0), uncertainty)
