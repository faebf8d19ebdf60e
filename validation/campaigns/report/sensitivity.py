"""Which parameters of a sample matter for a quantity: elementary effects and Sobol indices, by SALib, with bootstrapped intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dembark.postproc.statistics import student
from dembark.validation.campaigns.sampling import GROUPS, LEVELS, problem
from dembark.validation.judge.decision import packings
from dembark.validation.judge.result import QuantityRecord

from .sweeps import Point, Sweep, words

# What does not matter: below a tenth of the largest mean effect, or a twentieth of the variance.
NEGLIGIBLE = {"morris": 0.1, "saltelli": 0.05}
# Complete groups that are needed for any statement.
LEAST_GROUPS = {"morris": 10, "saltelli": 32}
_RESAMPLES = 1000
# SALib takes 0 for none.
_SEED = 1
# Of one parameter: index, half, other and other_half of its Effect.
_Numbers = tuple[float, float, float, float | None]


@dataclass(frozen=True)
class Effect:
    """What one parameter does: `index` is the mean absolute elementary effect μ* over the range of the parameter (`morris`), or the total
    Sobol index (`saltelli`); `other` the standard deviation σ of the effects, or the first-order index. `half` and `other_half` are
    half-widths of 95 % intervals, None where there is none. `standing`: matters, negligible or undecided."""

    parameter: str
    index: float
    half: float
    other: float
    other_half: float | None
    standing: str


@dataclass(frozen=True)
class Sensitivity:
    """The effects on one quantity in one engine, at the variant `at`: from `used` groups, without `incomplete` ones. `limit`: below it a
    parameter does not matter. `noise`: the index that the scatter of packings alone gives a parameter, None where it is not known. `why`
    there are no effects, "" where there are."""

    quantity: QuantityRecord
    engine: str
    at: str
    design: str
    effects: tuple[Effect, ...] = ()
    used: int = 0
    incomplete: int = 0
    limit: float = math.nan
    noise: float | None = None
    why: str = ""

    def named(self, standing: str) -> str:
        """The parameters of one standing, the strongest first."""
        found = sorted((one for one in self.effects if one.standing == standing), key=lambda one: -one.index)
        return ", ".join(one.parameter.replace("_", " ") for one in found)


@dataclass(frozen=True)
class _Measured:
    """Values (groups, points) and variances of their means over packings, 0 where these are not known, of complete groups."""

    values: NDArray[np.float64]
    places: NDArray[np.float64]
    variances: NDArray[np.float64]
    incomplete: int
    known: bool = field(default=True)


def sensitivities(sweep: Sweep, quantities: Sequence[QuantityRecord]) -> list[Sensitivity]:
    """For each quantity, engine and variant of a sweep what its parameters do; none for a sample of another design."""
    if sweep.sample.get("design") not in GROUPS:
        return []
    parts: dict[Any, list[Point]] = {}
    for point in sweep.points:
        parts.setdefault(point.values.get("variant"), []).append(point)
    return [_analysed(sweep, points, quantity, engine, words({"variant": base} if base else {}))
            for quantity in quantities for engine in sweep.engines for base, points in parts.items()]


def _analysed(sweep: Sweep, points: Sequence[Point], quantity: QuantityRecord, engine: str, at: str) -> Sensitivity:
    design, names = sweep.sample["design"], list(sweep.sample["parameters"])
    measured = _measured(points, len(names) + GROUPS[design], quantity.name, engine)
    given: dict[str, Any] = {"quantity": quantity, "engine": engine, "at": at, "design": design, "used": len(measured.values),
                             "incomplete": measured.incomplete}
    if len(measured.values) < LEAST_GROUPS[design]:
        return Sensitivity(**given, why=f"only {len(measured.values)} complete groups of points, {LEAST_GROUPS[design]} are needed")
    if not np.ptp(measured.values) > 0.0:
        return Sensitivity(**given, why="it is the same at all points")
    found = (_morris if design == "morris" else _saltelli)(names, measured)
    noise = _noise(design, measured)
    limit = NEGLIGIBLE[design] * (max(one[0] for one in found) if design == "morris" else 1.0)
    effects = tuple(Effect(name, *one, standing=_standing(*one[:2], limit, noise)) for name, one in zip(names, found, strict=True))
    return Sensitivity(**given, effects=effects, limit=limit, noise=noise)


def _standing(index: float, half: float, limit: float, noise: float | None) -> str:
    """Where an interval stands to the limit; what packings alone may do is no effect."""
    if index + half <= limit:
        return "negligible"
    return "matters" if index - half > max(limit, noise or 0.0) else "undecided"


def _measured(points: Sequence[Point], size: int, name: str, engine: str) -> _Measured:
    """The complete groups of `size` points."""
    groups = [points[start:start + size] for start in range(0, len(points), size)]
    found = [[point.quantity(engine, name) for point in group] for group in groups]
    complete = [number for number, group in enumerate(found) if all(group)]
    kept: list[list[QuantityRecord]] = [[one for one in found[number] if one] for number in complete]
    variances = [[variance_of_mean(one) for one in group] for group in kept]
    known = all(one is not None for group in variances for one in group)
    return _Measured(np.array([[one.value for one in group] for group in kept], float),
                     np.array([[point.quantiles for point in groups[number]] for number in complete], float),
                     np.array([[one or 0.0 for one in group] for group in variances]), len(groups) - len(kept), known)


def variance_of_mean(one: QuantityRecord) -> float | None:
    """Variance of a mean over packings, from its interval; None where that is not over packings."""
    count = packings(one.basis)
    return (one.half / student(count - 1.0)) ** 2 if one.half is not None and 3 <= count < math.inf else None


def _morris(names: list[str], measured: _Measured) -> list[_Numbers]:
    from SALib.analyze import morris

    found = morris.analyze(problem(names), np.concatenate(list(measured.places)), measured.values.ravel(), num_resamples=_RESAMPLES,
                           num_levels=LEVELS, seed=_SEED)
    return [(float(mean), float(half), float(sigma), None)
            for mean, half, sigma in zip(found["mu_star"], found["mu_star_conf"], found["sigma"], strict=True)]


def _saltelli(names: list[str], measured: _Measured) -> list[_Numbers]:
    from SALib.analyze import sobol

    found = sobol.analyze(problem(names), measured.values.ravel(), calc_second_order=False, num_resamples=_RESAMPLES, seed=_SEED)
    return [(float(total), float(half), float(first), float(first_half))
            for total, half, first, first_half in zip(found["ST"], found["ST_conf"], found["S1"], found["S1_conf"], strict=True)]


def _noise(design: str, measured: _Measured) -> float | None:
    """The index that a parameter without effect has because of the packings: of a total index their share of the variance, of μ* the mean
    absolute difference of two normal numbers over the step of a trajectory."""
    if not measured.known:
        return None
    variance = float(measured.variances.mean())
    if design == "saltelli":
        return variance / float(measured.values.var())
    step = LEVELS / (2.0 * (LEVELS - 1.0))
    return 2.0 * math.sqrt(variance / math.pi) / step


def negligible_everywhere(found: Sequence[Sensitivity]) -> list[str]:
    """Parameters that do not matter for any of the quantities, of which there is at least one analysed."""
    tables = [{one.parameter: one.standing for one in each.effects} for each in found if each.effects]
    return [name for name in (tables[0] if tables else ()) if all(table[name] == "negligible" for table in tables)]


def write_csv(path: Path, found: Sequence[Sensitivity]) -> None:
    """A row for each quantity, engine, variant and parameter; `index` and `other` as in Effect."""
    names: Mapping[str, tuple[str, str]] = {"morris": ("mu_star", "sigma"), "saltelli": ("total", "first_order")}
    rows = [{"quantity": one.quantity.name, "engine": one.engine, "variant": one.at.removeprefix("variant "), "groups": one.used,
             "parameter": each.parameter, names[one.design][0]: each.index, f"{names[one.design][0]}_half": each.half,
             names[one.design][1]: each.other, f"{names[one.design][1]}_half": each.other_half, "limit": one.limit, "noise": one.noise,
             "standing": each.standing} for one in found for each in one.effects]
    pd.DataFrame(rows).to_csv(path, index=False)
