"""Samples of the parameters of a sweep: designs of scipy and SALib in the unit cube, mapped to distributions of `scipy.stats`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.common.choices import Value
from dembark.common.errors import DembarkError
from dembark.validation.case.model import Parameter

from .targets import CurveTarget, Target

# Designs that go on: a point that breaks a condition is left out, and more samples begin with the earlier ones.
SEQUENCES = ("sobol", "halton")
# Designs of a sensitivity analysis, and how many points each of their groups has more than there are parameters: a trajectory of elementary
# effects, and the points of two samples and their exchange.
GROUPS = {"morris": 1, "saltelli": 2}
DESIGNS = (*SEQUENCES, "latin_hypercube", *GROUPS)
LEVELS = 4
# The numbers of each distribution of scipy.stats, in the unit of the parameter but for `sigma`.
DISTRIBUTIONS: Mapping[str, tuple[str, ...]] = {
    "uniform": ("min", "max"), "loguniform": ("min", "max"), "triang": ("min", "mode", "max"), "norm": ("mean", "std"),
    "truncnorm": ("mean", "std", "min", "max"), "lognorm": ("median", "sigma")}
# Of a value: the last digits of a quantile differ between machines, and would make other runs.
_DIGITS = 6
# A sequence gives up when more of its points than this, for each sample, were looked at.
_MOST_TRIES = 100

Row = dict[str, Value]


@dataclass(frozen=True)
class Variable:
    """A sampled parameter: the name of its distribution in scipy.stats, and the `numbers` that this takes (DISTRIBUTIONS), in SI units."""

    parameter: Parameter
    distribution: str
    numbers: Mapping[str, float]

    @cached_property
    def _frozen(self) -> Any:
        from scipy import stats

        of, arguments = self.numbers, tuple(self.numbers.values())
        match self.distribution:
            case "uniform" if self.parameter.is_whole:
                return stats.randint(of["min"], of["max"] + 1)
            case "uniform":
                arguments = (of["min"], of["max"] - of["min"])
            case "triang":
                arguments = ((of["mode"] - of["min"]) / (of["max"] - of["min"]), of["min"], of["max"] - of["min"])
            case "truncnorm":
                arguments = (*((of[end] - of["mean"]) / of["std"] for end in ("min", "max")), of["mean"], of["std"])
            case "lognorm":
                arguments = (of["sigma"], 0.0, of["median"])
        return getattr(stats, self.distribution)(*arguments)

    @property
    def words(self) -> str:
        """For people: `uniform, min 0.2, max 0.8`."""
        return ", ".join([self.distribution, *(f"{key} {value:g}" for key, value in self.numbers.items())])

    def values(self, quantiles: NDArray[np.float64]) -> list[float | int]:
        """The values at `quantiles` (0 to 1), with six significant digits and within the limits; whole numbers for a parameter that has
        these, of which a uniform distribution takes each with the same probability."""
        limits = (self.numbers.get("min", -math.inf), self.numbers.get("max", math.inf))
        inside = (min(max(float(f"{value:.{_DIGITS}g}"), limits[0]), limits[1]) for value in self._frozen.ppf(quantiles))
        return [round(value) if self.parameter.is_whole and math.isfinite(value) else value for value in inside]


@dataclass(frozen=True)
class Drawn:
    """The points of a sample, in their order: `rows` of values by parameter, their `quantiles`, and how many points of the sequence were
    `left_out` because they break a condition."""

    rows: tuple[Row, ...]
    quantiles: tuple[tuple[float, ...], ...]
    left_out: int


@dataclass(frozen=True)
class Sample:
    """`samples` points, or groups of GROUPS, of a `design` over `variables`, from the random `seed`; `quantities` are those that the report
    looks at, all that are checked or compared if there are none; `targets` those that the parameters are fitted to."""

    design: str
    samples: int
    variables: Mapping[str, Variable]
    seed: int = 0
    quantities: tuple[str, ...] = ()
    targets: Mapping[str, Target | CurveTarget] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """How many points it has."""
        return self.samples * (len(self.variables) + GROUPS[self.design] if self.design in GROUPS else 1)

    def facts(self) -> dict[str, Any]:
        """For `plan.json`."""
        return {"design": self.design, "samples": self.samples, "seed": self.seed, "quantities": list(self.quantities),
                **({"targets": {name: one.facts() for name, one in self.targets.items()}} if self.targets else {}),
                "parameters": {name: one.words for name, one in self.variables.items()}}

    def draw(self, broken: Callable[[Row], str]) -> Drawn:
        """The points; `broken` says which condition a row breaks, "" for none.

        A sequence leaves such points out and goes on. DembarkError where the design needs every point, or where a sequence finds less than
        one in a hundred.
        """
        rows: list[Row] = []
        quantiles: list[tuple[float, ...]] = []
        left_out, why = 0, ""
        for block in self._blocks():
            columns = [one.values(block[:, number]) for number, one in enumerate(self.variables.values())]
            for place, values in zip(block, zip(*columns, strict=True), strict=True):
                row: Row = dict(zip(self.variables, values, strict=True))
                if reason := broken(row):
                    left_out, why = left_out + 1, reason
                    if self.design not in SEQUENCES:
                        raise DembarkError(f"a point of the {self.design.replace('_', ' ')} breaks a condition", why,
                                           f"narrow the ranges, or choose {' or '.join(SEQUENCES)}, which leave such points out")
                    continue
                rows.append(row)
                quantiles.append(tuple(map(float, place)))
                if len(rows) == self.samples and self.design in SEQUENCES:
                    return Drawn(tuple(rows), tuple(quantiles), left_out)
        if self.design in SEQUENCES:
            raise DembarkError(f"only {len(rows)} of {len(rows) + left_out} points break no condition", why, "narrow the ranges")
        return Drawn(tuple(rows), tuple(quantiles), 0)

    def _blocks(self) -> Iterator[NDArray[np.float64]]:
        """The design in the unit cube, (points, variables); of a sequence block after block."""
        from scipy.stats import qmc

        if self.design in GROUPS:
            yield self._groups()
            return
        given = {"d": len(self.variables), "seed": np.random.default_rng(self.seed)}
        if self.design not in SEQUENCES:
            yield qmc.LatinHypercube(**given).random(self.samples)
            return
        sequence = qmc.Sobol(**given) if self.design == "sobol" else qmc.Halton(**given)
        # A power of two, in which points of Sobol are balanced.
        size = 2 ** math.ceil(math.log2(self.samples))
        for _ in range(_MOST_TRIES):
            yield sequence.random(size)

    def _groups(self) -> NDArray[np.float64]:
        """The groups of a sensitivity analysis one after another; a larger number begins with the same ones."""
        from SALib.sample import morris, sobol

        if self.design == "morris":
            return morris.sample(problem(self.variables), self.samples, num_levels=LEVELS, seed=self.seed)
        return sobol.sample(problem(self.variables), self.samples, calc_second_order=False, seed=self.seed)


def problem(names: Iterable[str]) -> dict[str, Any]:
    """What SALib calls so: the parameters by quantiles."""
    listed = list(names)
    return {"num_vars": len(listed), "names": listed, "bounds": [[0.0, 1.0]] * len(listed)}
