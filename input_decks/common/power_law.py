"""How a measured quantity grows along the parameter of a study: the exponent of a power law, and its curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dembark.postproc.measurement import Array, Estimate, profile
from dembark.postproc.studies import fitted_exponent, measured, propagated

from .estimates import values_and_halves


def ordered(points: Sequence[Mapping[str, Any]], along: str) -> tuple[list[Mapping[str, Any]], Array]:
    """The results `points` in the order of their parameter `along`, and its values (n,)."""
    rising = sorted(points, key=lambda point: float(point["parameters"][along]))
    return rising, np.array([point["parameters"][along] for point in rising], float)


@dataclass(frozen=True)
class PowerLawFit:
    """A positive quantity over a parameter: `place`, `values` and the half-widths `halves` of their intervals, all (n,)."""

    place: Array
    values: Array
    halves: Array

    @classmethod
    def of(cls, points: Sequence[Mapping[str, Any]], name: str, place: Array, factors: Array | float = 1.0) -> PowerLawFit:
        """The quantity `name` of the results `points`, times `factors`, at `place`."""
        values, halves = values_and_halves([measured(point, name) for point in points])
        return cls(place, factors * values, factors * halves)

    @property
    def exponent(self) -> Estimate:
        """Slope of a straight line on logarithmic axes, which is linear in the logarithms, with the interval that those of the values give
        it."""
        return propagated(lambda logs: fitted_exponent(self.place, np.exp(logs)), np.log(self.values), self.halves / self.values)

    def law(self, power: float) -> Array:
        """c place^power (n,) through the middle of the values on logarithmic axes."""
        return np.asarray(np.exp(np.mean(np.log(self.values) - power * np.log(self.place))) * self.place**power)

    def curve(self, name: str, title: str, along: str, across: str, power: float | None = None, label: str = "") -> dict[str, Any]:
        """The values with their intervals, and the law with `power`."""
        return profile(name, title, along, across, self.place, [self.values], half=self.halves, reference_label=label,
                       reference=None if power is None else self.law(power))

    def convergence(self, name: str, title: str, along: str, order: float) -> dict[str, Any]:
        """The values, errors of a scheme, on logarithmic axes with a line of the slope `order`."""
        return profile(name, title, f"log₁₀ {along}", "log₁₀ error", np.log10(self.place), [np.log10(self.values)],
                       reference=np.log10(self.law(order)), reference_label=f"slope {order:g}")
