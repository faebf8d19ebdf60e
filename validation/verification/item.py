"""What an item of the verification consists of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.measurement import Value
from dembark.postproc.statistics import Estimate
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


def exact(name: str, label: str, error: float, source: str, control: str, *, tolerance: float = ROUND_OFF, detail: str = "",
          unit: str = "1") -> QuantityRecord:
    """An error that is due to be zero to `tolerance`; `control`: what fails it."""
    declared = Declared(name, label, unit, "identity", tolerance, absolute=True, source=source, detail=detail, compared=False,
                        control=control)
    return judged(declared, Value(Estimate(float(error), 0.0), Estimate(0.0, 0.0)))


def order(name: str, label: str, steps: Array, errors: Array, due: float, source: str, control: str, detail: str = "") -> QuantityRecord:
    """Observed order of convergence, the slope of ln(error) over ln(step), against the one of theory; `control`: what fails it."""
    slope = float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
    declared = Declared(name, label, "1", "theory", ORDER_TOLERANCE, absolute=True, source=source, detail=detail, compared=False,
                        control=control)
    return judged(declared, Value(Estimate(slope, 0.0), Estimate(due, 0.0)))
