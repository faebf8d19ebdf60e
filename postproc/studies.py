"""What studies share: the measured quantities of their points, intervals of what is computed from these, exponents, and the error
compared with a datum."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .convergence import SAFETY_UNSEEN_ORDER, convergence
from .statistics import Estimate, combined

Array = NDArray[np.float64]


def quantity(point: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """The quantity `name` of the result `point`, the content of a metrics.json."""
    return next(one for one in point["quantities"] if one["name"] == name)


def measured(point: Mapping[str, Any], name: str, factor: float = 1.0) -> Estimate:
    """The quantity `name` of the result `point`, times `factor`; half-width inf where it has no interval."""
    one = quantity(point, name)
    half = 0.5 * (one["interval"][1] - one["interval"][0]) if one["interval"] else math.inf
    return Estimate(one["value"] * factor, half * factor, one.get("basis", ""))


def propagated(measure: Callable[[Array], float], values: Array, halves: Array, source: str = "the points") -> Estimate:
    """`measure(values)` with the half-width that independent intervals `halves` of `values` (n,) give it, to first order; inf where one of
    them is unknown. `source` says in the basis what the values are."""
    middle = measure(values)
    if not np.isfinite(halves).all():
        return Estimate(middle, math.inf, f"one of {source} has no interval")
    parts = [measure(values + np.where(np.arange(len(values)) == index, half, 0.0)) - middle for index, half in enumerate(halves)]
    return Estimate(middle, combined(parts), f"propagated from {source}")


@dataclass(frozen=True)
class Comparison:
    """ASME V&V 20: the `error` E = S - D of a simulated value S against the datum D, and U_val, the `uncertainty` that it is known within,
    the root of the sum of squares of its parts; `text` lists all of them."""

    error: float
    uncertainty: float
    text: str


def compared(value: float, datum: Estimate, **parts: float) -> Comparison:
    """S = `value` compared with the `datum`, whose half-width is U_D; the other `parts` of U_val by what U is an index of, as num=0.1 for
    U_num."""
    error, every = value - datum.value, {**parts, "D": datum.half}
    joint = math.hypot(*every.values())
    listed = ", ".join(f"U_{name} = {part:.2g}" for name, part in every.items())
    return Comparison(error, joint, f"E = {error:.3g} {'exceeds' if abs(error) > joint else 'is within'} U_val = {joint:.2g}; {listed}")


def numerical(sizes: Sequence[float], values: Sequence[float]) -> float:
    """U_num of the value at the finest of the refinements `sizes`; where no order shows, three times the range of `values` (L. Eça,
    M. Hoekstra, J. Comput. Phys. 262 (2014) 104)."""
    found = convergence(sizes, values).uncertainty
    return SAFETY_UNSEEN_ORDER * float(np.ptp(values)) if found is None else found


def fitted_exponent(x: Array, y: Array) -> float:
    """p of y = c x^p by least squares on logarithmic axes, for positive x and y (n,)."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
