"""What an item of the verification consists of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.measurement import Value
from dembark.postproc.statistics import Estimate
from dembark.postproc.studies import fitted_exponent
from dembark.validation.case.model import Declared
from dembark.validation.judge.result import QuantityRecord
from dembark.validation.judge.verdict import judged

Array = NDArray[np.float64]

# Sums of some thousand terms of one sign, to round-off.
ROUND_OFF = 1e-12
# As for the studies of the impact scheme: an observed order of convergence against that of theory.
ORDER_TOLERANCE = 0.1


@dataclass(frozen=True)
class Curve:
    """`value` over `place`; `theory`: drawn as a thin dark line instead of points."""

    label: str
    place: Sequence[float] | Array
    value: Sequence[float] | Array
    theory: bool = False

    def __post_init__(self) -> None:
        for name in ("place", "value"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), float).tolist())


@dataclass(frozen=True)
class Panel:
    """A plot of curves on logarithmic axes, or with a linear one along if `linear`."""

    title: str
    along: str
    across: str
    curves: Sequence[Curve]
    linear: bool = False


@dataclass(frozen=True)
class Item:
    """One thing that is verified: `text` says what is known and how it was tested."""

    name: str
    title: str
    text: str
    quantities: Sequence[QuantityRecord]
    panels: Sequence[Panel] = ()
    caption: str = ""


def check(name: str, label: str, value: float, due: float, tolerance: float, *, evidence: str, source: str, control: str,
          absolute: bool = True, **more: Any) -> QuantityRecord:
    """A `value` that must be `due` within `tolerance`; `control`: what fails it. `more`: other fields of Declared."""
    declared = Declared(name, label, evidence=evidence, tolerance=tolerance, absolute=absolute, source=source, compared=False,
                        control=control, **more)
    return judged(declared, Value(Estimate(float(value), 0.0), Estimate(float(due), 0.0)))


def exact(name: str, label: str, error: float, source: str, control: str, *, tolerance: float = ROUND_OFF, **more: Any) -> QuantityRecord:
    """An error that must be zero to `tolerance`, see `check`."""
    return check(name, label, error, 0.0, tolerance, evidence="identity", source=source, control=control, **more)


def order(name: str, label: str, steps: Array, errors: Array, due: float, source: str, control: str, **more: Any) -> QuantityRecord:
    """Observed order of convergence, the slope of ln(error) over ln(step), against the one of theory, see `check`."""
    slope = fitted_exponent(steps, errors)
    return check(name, label, slope, due, ORDER_TOLERANCE, evidence="theory", source=source, control=control, **more)
