"""Parameters of a sample that were fitted to targets: what is known of each, the best run, and files with the result."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dembark.common.files import write_atomic
from dembark.validation.campaigns import fitted
from dembark.validation.campaigns.sampling import Row, Sample
from dembark.validation.campaigns.spec import SweepSpec
from dembark.validation.campaigns.targets import CurveTarget
from dembark.validation.case.resolve import merged

from .posterior import Allowed, Array, Output, Posterior, Surrogate, everywhere, posterior
from .sensitivity import variance_of_mean
from .sweeps import Point, Sweep

# Points that a fit needs, for each parameter.
LEAST_POINTS = 5
# Standard deviation of the quantile of a parameter over that of its prior: below it is identified, above it is not.
IDENTIFIED, UNIDENTIFIED = 1.0 / 3.0, 0.8
# Correlation of two parameters from which on only a combination of them is known.
COMBINED = 0.8
# Share of the variance of a quantity that its surrogate has to predict.
PREDICTED = 0.8
# Share of the variance of a curve that its components make up, and of that of each component that is predicted.
SHARE, LEAST_PREDICTED = 0.99, 0.3
# Samples of the posterior of which the predictive intervals of the targets are taken, at most.
PREDICTIVE = 2000
# Distance of curves, in standard uncertainties, from which on the target is not reached, however its errors are correlated.
FAR = 1.96


@dataclass(frozen=True)
class Fitted:
    """A parameter: median and 95 % interval of its posterior, most probable value, and how its width is to that of the prior."""

    name: str
    median: float
    low: float
    high: float
    best: float
    width: float

    @property
    def standing(self) -> str:
        """identified, partly identified or not identified."""
        return "identified" if self.width < IDENTIFIED else "not identified" if self.width > UNIDENTIFIED else "partly identified"


@dataclass(frozen=True)
class Reached:
    """A target, what the surrogate gives at the most probable point, with the half-width of its 95 % interval, and the share of the
    variance that it predicts of points that it has not seen. `low` to `high`: the posterior predictive 95 % interval, in which the
    measurement lies that is repeated on the fitted model."""

    name: str
    target: float
    uncertainty: float
    value: float
    half: float
    predicted: float
    low: float
    high: float


@dataclass(frozen=True)
class Fit:
    """The fit in one engine and variant: parameters, targets, and the folder name `best_run` of the point whose measurements are nearest to
    the targets; `values` (n, parameters) are samples of the posterior. `why` there is no fit, "" where there is. `curves`: names of target
    curves, and how far they are from the most probable ones (root mean square, in standard uncertainties). `points` and `runs`: what the
    fit cost."""

    engine: str
    base: str
    parameters: tuple[Fitted, ...] = ()
    targets: tuple[Reached, ...] = ()
    combined: tuple[tuple[str, str, float], ...] = ()
    best_run: str = ""
    values: Array | None = None
    density: Array | None = None
    why: str = ""
    curves: tuple[tuple[str, float], ...] = ()
    points: int = 0
    runs: int = 0

    @property
    def words(self) -> list[str]:
        """What is known and what is not, in sentences."""
        return list(self._words())

    def _words(self) -> Iterator[str]:
        for standing in ("identified", "partly identified", "not identified"):
            if names := [one.name.replace("_", " ") for one in self.parameters if one.standing == standing]:
                yield f"{standing.capitalize()}: {', '.join(names)}."
        for one, other, rho in self.combined:
            yield (f"Only a combination of {one.replace('_', ' ')} and {other.replace('_', ' ')} is known (correlation {rho:.2f}): another "
                   "target, in which they act differently, would separate them.")
        for each in self.targets:
            if each.predicted < PREDICTED:
                yield (f"The surrogate predicts only {max(0.0, each.predicted):.0%} of the variance of {each.name.replace('_', ' ')}: "
                       "more samples are needed, or more packings.")
            if abs(each.value - each.target) > each.half + 1.96 * each.uncertainty:
                yield f"No parameters within the ranges reach the target of {each.name.replace('_', ' ')}."
        inside = sum(each.low <= each.target <= each.high for each in self.targets)
        yield f"The posterior predictive 95 % intervals contain {inside} of {len(self.targets)} targets."
        for name, distance in self.curves:
            yield (f"The most probable curve {name.replace('_', ' ')} is {distance:.1f} standard uncertainties from the target, root mean "
                   f"square{': no parameters within the ranges reach it' if distance > FAR else ''}.")
        yield f"Cost: {self.points} points, {self.runs} runs."


def fits(sweep: Sweep, spec: SweepSpec) -> list[Fit]:
    """The fit in each engine and variant; none where the sample has no targets."""
    if spec.sample is None or not spec.sample.targets:
        return []
    return [_fit(spec, spec.sample, engine, base, [one for one in sweep.points if one.values.get("variant", base) == base])
            for engine in sweep.engines for base in spec.variants]


def _fit(spec: SweepSpec, sample: Sample, engine: str, base: str, points: Sequence[Point]) -> Fit:
    complete, why = _complete(sample, engine, points)
    if why:
        return Fit(engine, base, why=why)
    places = np.array([point.quantiles for point in complete], float)
    outputs: list[Output] = []
    distances: dict[str, Callable[[Array], float]] = {}
    for name, target in sample.targets.items():
        if isinstance(target, CurveTarget):
            parts, distances[name] = of_curve(name, target, places, [point.curve(engine, name) or {} for point in complete])
            outputs += parts
        else:
            row = [one for point in complete if (one := point.quantity(engine, name))]
            variances = np.array([variance_of_mean(one) or 0.0 for one in row])
            outputs.append(Output(name, np.array([one.value for one in row], float), variances, target.value, target.uncertainty))
    if still := [one.name for one in outputs if not np.ptp(one.values) > 0.0]:
        return Fit(engine, base, why=f"{still[0]} is the same at all points")
    known = posterior(places, outputs, _allowed(spec, sample, base))
    distance = sum((one.values - one.target) ** 2 / (one.variances + one.uncertainty**2) for one in outputs)
    drawn = np.array([one.values(known.quantiles[:, at]) for at, one in enumerate(sample.variables.values())], float).T
    return Fit(engine, base, _parameters(sample, known, drawn), tuple(_reached(known, outputs)), tuple(_combined(sample, known)),
               complete[int(np.argmin(distance))].variant, drawn, known.density, curves=_curves(known, outputs, distances),
               points=len(complete), runs=sum(int(point.results[engine].provenance.get("replicas") or 1) for point in complete))


def _complete(sample: Sample, engine: str, points: Sequence[Point]) -> tuple[list[Point], str]:
    """The points at which all targets were measured, and why there is no fit, "" where there are enough."""
    curves = {name: one for name, one in sample.targets.items() if isinstance(one, CurveTarget)}
    for name, one in curves.items():
        measured = {each["name"]: each for point in points if engine in point.results for each in point.results[engine].profiles}
        if measured and name not in measured:
            return [], f"the case measures no curve {name}, but {', '.join(measured)}"
        # Of every point: places may depend on the parameters, and a curve may have no values at its ends.
        known = [pairs for point in points if (pairs := _known(point.curve(engine, name)))]
        low, high = max((pairs[0][0] for pairs in known), default=-np.inf), min((pairs[-1][0] for pairs in known), default=np.inf)
        if one.at[0] < low or one.at[-1] > high:
            return [], (f"the target {name} reaches from {one.at[0]:g} to {one.at[-1]:g}, what is measured at all points from {low:g} to "
                        f"{high:g}: leave out the places beyond")
    complete = [point for point in points if all(_known(point.curve(engine, name)) if name in curves else point.quantity(engine, name)
                                                 for name in sample.targets)]
    least = LEAST_POINTS * len(sample.variables)
    enough = len(complete) >= least
    return complete, "" if enough else f"{len(complete)} points with all targets were measured, {least} are needed"


def of_curve(name: str, target: CurveTarget, places: Array,
             measured: Sequence[Mapping[str, Any]]) -> tuple[list[Output], Callable[[Array], float]]:
    """A curve, `measured` at the points of a sample with the quantiles `places`, as few numbers, to which the fit is made; and how far a
    curve with such numbers is from the target, root mean square, in its standard uncertainties.

    The curves over the standard deviations of the target, its correlation taken out, are written in their principal components, as by
    D. Higdon et al., J. Am. Stat. Assoc. 103 (2008) 570; the target then has the uncertainty 1 in each. The first ones count that make up
    99 % of the variance, without those that the parameters do not predict: these hold what scatters from run to run.
    """
    from threadpoolctl import threadpool_limits

    at, values, deviations = (np.array(one) for one in (target.at, target.values, target.uncertainties))
    away = np.abs(at[:, None] - at)
    correlated = np.exp(-away / target.correlation) if target.correlation > 0.0 else np.eye(len(at))
    root = np.linalg.cholesky(correlated * np.outer(deviations, deviations))
    whiten = np.linalg.inv(root)
    table = np.array([_at(one, at) for one in measured]) @ whiten.T
    middle = table.mean(axis=0)
    left, sizes, components = np.linalg.svd(table - middle, full_matrices=False)
    wanted = components @ (whiten @ values - middle)
    share = np.cumsum(sizes**2) / max((sizes**2).sum(), 1e-300)
    parts = {k: Output(f"{name}, component {k + 1}", left[:, k] * sizes[k], np.zeros(len(table)), float(wanted[k]), 1.0)
             for k in range(1 + int(np.searchsorted(share, SHARE)))}
    with threadpool_limits(1):
        parts = {k: one for k, one in parts.items() if k == 0 or Surrogate(places, one).explained > LEAST_PREDICTED}

    def distance(scores: Array) -> float:
        curve = root @ (middle + scores @ components[list(parts)])
        return float(np.sqrt(np.mean(((curve - values) / deviations) ** 2)))

    return list(parts.values()), distance


def _at(measured: Mapping[str, Any], places: Array) -> Array:
    """The measured curve at `places`."""
    return np.interp(places, *np.array(_known(measured)).T)


def _known(measured: Mapping[str, Any] | None) -> list[tuple[float, float]]:
    """Places of a measured curve, ascending, that have a value, with it."""
    pairs = zip(measured["place"], measured["value"], strict=True) if measured else ()
    return sorted((x, y) for x, y in pairs if x is not None and y is not None)


def _curves(known: Posterior, outputs: Sequence[Output],
            distances: Mapping[str, Callable[[Array], float]]) -> tuple[tuple[str, float], ...]:
    """How far the curves of the most probable point are from their targets."""
    reached = list(_reached(known, outputs))
    return tuple((name, distance(np.array([one.value for one in reached if one.name.startswith(f"{name}, component ")])))
                 for name, distance in distances.items())


def _allowed(spec: SweepSpec, sample: Sample, base: str) -> Allowed:
    """Whether points break no condition of the case, and no range of a parameter."""
    variables = list(sample.variables.values())
    everything = bool(spec.derived) or any("min" not in one.numbers for one in variables)
    # Of those that the sampled parameters have no part in, each point keeps all.
    conditions = [one for one in spec.case.constraints if one.expression.names & sample.variables.keys()]
    if not everything and not conditions:
        return everywhere
    fixed = merged(spec.case, spec.profile, base, spec.fixed)

    def fine(row: Row) -> bool:
        if everything:
            return not spec.broken(row, (base,))
        return all(one.expression(fixed | row) in (None, True) for one in conditions)

    def allowed(places: Array) -> NDArray[np.bool_]:
        columns = [one.values(places[:, at]) for at, one in enumerate(variables)]
        return np.array([fine(dict(zip(sample.variables, values, strict=True))) for values in zip(*columns, strict=True)], bool)

    return allowed


def _parameters(sample: Sample, known: Posterior, drawn: Array) -> tuple[Fitted, ...]:
    best = drawn[int(known.density.argmax())]
    widths = known.quantiles.std(axis=0) * math.sqrt(12.0)
    low, median, high = np.quantile(drawn, [0.025, 0.5, 0.975], axis=0)
    return tuple(Fitted(name, *(float(one[at]) for one in (median, low, high, best, widths))) for at, name in enumerate(sample.variables))


def _reached(known: Posterior, outputs: Sequence[Output]) -> Iterator[Reached]:
    best = known.quantiles[int(known.density.argmax())][None]
    some = known.quantiles[::math.ceil(len(known.quantiles) / PREDICTIVE)]
    random = np.random.default_rng(0)
    for surrogate, one in zip(known.surrogates, outputs, strict=True):
        (value,), (variance,) = surrogate(best)
        means, variances = surrogate(some)
        again = means + np.sqrt(variances + one.uncertainty**2) * random.standard_normal(len(some))
        low, high = np.quantile(again, [0.025, 0.975])
        yield Reached(one.name, one.target, one.uncertainty, float(value), 1.96 * math.sqrt(variance), surrogate.explained, float(low),
                      float(high))


def _combined(sample: Sample, known: Posterior) -> Iterator[tuple[str, str, float]]:
    from scipy.stats import spearmanr

    names = list(sample.variables)
    for at, one in enumerate(names):
        for other in range(at + 1, len(names)):
            rho = float(spearmanr(known.quantiles[:, at], known.quantiles[:, other]).statistic)
            if abs(rho) > COMBINED:
                yield one, names[other], rho


def write_files(folder: Path, name: str, fit: Fit, spec: SweepSpec) -> None:
    """Write `posterior.csv`, samples with their log density, and `fitted.toml`, a campaign of the most probable point, into `folder`.
    Parameters that the sweep derives are in the samples, too."""
    folder.mkdir(parents=True, exist_ok=True)
    table = pd.DataFrame(fit.values, columns=[one.name for one in fit.parameters])
    rows = [spec.changes(fit.base, row) for row in table.to_dict("records")] if spec.derived else []
    table = table.assign(**{name: [row[name] for row in rows] for name in spec.derived}, **{fitted.DENSITY: fit.density})
    content = table.to_csv(index=False).encode()
    write_atomic(folder / fitted.POSTERIOR, content)
    write_atomic(folder / fitted.FITTED, fitted_toml(name, fit, spec, content).encode())


def fitted_toml(name: str, fit: Fit, spec: SweepSpec, samples: bytes) -> str:
    """A campaign with one point, the most probable one, to check the fit in the engine itself, and what `samples` of the posterior and
    targets belong to it, for predictions."""
    best = {one.name: round(one.best) if spec.case.parameters[one.name].is_whole else one.best for one in fit.parameters}
    lines = ["# The most probable parameters; median and 95 % interval of each:",
             *(f"# {one.name}: {one.median:.4g}, {one.low:.4g} to {one.high:.4g}, {one.standing}" for one in fit.parameters),
             "[campaign]", f"name = {json.dumps(f'{name}-fitted')}", "", "[[sweeps]]", f"case = {json.dumps(spec.case.name)}",
             f"profile = {json.dumps(spec.profile)}", f"variant = {json.dumps(fit.base)}", f"engines = {json.dumps([fit.engine])}",
             *([f"replicas = {spec.replicas}"] if spec.replicas else []), f"list = [{_table(best)}]", f"fixed = {_table(spec.fixed)}",
             f"derived = {_table({key: one.text for key, one in spec.derived.items()})}", "", "[posterior]",
             f"file = {json.dumps(fitted.POSTERIOR)}", f"sha256 = {json.dumps(fitted.checksum(samples))}", "", "[posterior.targets]",
             *(f"{key} = {_table(one.facts())}" for key, one in (spec.sample.targets.items() if spec.sample else ())), ""]
    return "\n".join(lines)


def _table(values: Mapping[str, Any]) -> str:
    """An inline table of TOML; None is `auto`."""
    return "{ " + ", ".join(f"{key} = {json.dumps('auto' if value is None else value)}" for key, value in values.items()) + " }"
