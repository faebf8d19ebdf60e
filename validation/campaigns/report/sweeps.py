"""A campaign's results by sweep: which parameters vary, and what was measured at each point."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from dembark.postproc.convergence import REFINEMENT, Convergence, convergence, refinement
from dembark.validation.case.model import Case
from dembark.validation.judge.result import QuantityRecord, Result
from dembark.validation.report.gather import Page


@dataclass(frozen=True)
class Point:
    """One point of a sweep: the swept `values` (None = the parameter is not set), the folder name `variant`, `results` by engine, the
    scheme's `formal_orders` in parameters of the method that vary, and the `quantiles` of a sample."""

    values: Mapping[str, Any]
    variant: str
    results: Mapping[str, Result]
    formal_orders: Mapping[str, float] = field(default_factory=dict)
    quantiles: Sequence[float] = ()

    def quantity(self, engine: str, name: str) -> QuantityRecord | None:
        """The measured quantity of that name; None where it was not measured or has no number."""
        found = self.results[engine].find(name) if engine in self.results else None
        return found if found and found.value is not None and math.isfinite(found.value) else None

    def curve(self, engine: str, name: str) -> Mapping[str, Any] | None:
        """The measured curve of that name, as `postproc.resampling.profile` makes it; None where it was not measured."""
        return next((one for one in self.results[engine].profiles if one["name"] == name), None) if engine in self.results else None


@dataclass(frozen=True)
class Sweep:
    """The points of one sweep of a campaign, and the names of the parameters that vary along it, the slowest first; `sample` says how they
    were drawn, empty for a grid or a list."""

    case: str
    title: str
    axes: tuple[str, ...]
    points: tuple[Point, ...]
    name: str = field(default="")
    units: Mapping[str, str] = field(default_factory=dict)
    sample: Mapping[str, Any] = field(default_factory=dict)

    def label(self, axis: str) -> str:
        """An axis for a figure, with its unit: `wall friction`, `grain diameter / m`."""
        unit = self.units.get(axis, "1")
        return axis.replace("_", " ") + ("" if unit == "1" else f" / {unit}" if "/" not in unit else f" / ({unit})")

    @property
    def engines(self) -> list[str]:
        """Engines with at least one measured point."""
        return sorted({engine for point in self.points for engine in point.results})

    def levels(self, axis: str) -> list[Any]:
        """The values along one axis in their order: numbers by size, words as they come."""
        found = list(dict.fromkeys(point.values[axis] for point in self.points))
        return sorted(found) if all(isinstance(one, int | float) for one in found) else found

    def numeric(self, axis: str) -> bool:
        """Whether an axis holds numbers only."""
        return all(isinstance(one, int | float) and not isinstance(one, bool) for one in self.levels(axis))

    @property
    def along(self) -> str | None:
        """The axis that figures run along: the numeric one with most values; None when there is none with two."""
        found = [axis for axis in self.axes if self.numeric(axis) and len(self.levels(axis)) > 1]
        return max(found, key=lambda axis: (len(self.levels(axis)), -self.axes.index(axis)), default=None)

    def quantities(self) -> list[QuantityRecord]:
        """The quantities worth a picture, once each: those that failed first, then those that are checked or that the engines must agree
        in; of a sample those that it names, if it does."""
        named = self.sample.get("quantities", ())
        found: dict[str, QuantityRecord] = {}
        failed: set[str] = set()
        for one in (one for point in self.points for result in point.results.values() for one in result.quantities):
            failed |= {one.name} if one.standing == "failed" else set()
            if one.value is not None and (one.name in named if named else one.compared or one.standing != "information"):
                found.setdefault(one.name, one)
        return sorted(found.values(), key=lambda one: one.name not in failed)

    def formal_order(self, axis: str, others: Mapping[str, Any]) -> float:
        """Formal order of the scheme along `axis` where the other axes have the values `others`; 1 where nothing is known of it."""
        return next((point.formal_orders.get(axis, 1.0) for point in self.points if others.items() <= point.values.items()), 1.0)

    def lines(self, along: str, engine: str, name: str) -> list[tuple[dict[str, Any], list[tuple[float, QuantityRecord]]]]:
        """Measured values against `along`, one line for each combination of the other axes: (those values, [(place, quantity)])."""
        lines: dict[tuple[Any, ...], list[tuple[float, QuantityRecord]]] = {}
        others = [axis for axis in self.axes if axis != along]
        for point in self.points:
            found = point.quantity(engine, name)
            if found is not None:
                lines.setdefault(tuple(point.values[axis] for axis in others), []).append((float(point.values[along]), found))
        return [(dict(zip(others, key, strict=True)), sorted(line, key=lambda one: one[0])) for key, line in lines.items()]


def sweeps(facts: Sequence[Mapping[str, Any]], pages: Iterable[Page], cases: Mapping[str, Case]) -> list[Sweep]:
    """The sweeps of `plan.json`, with what was measured at their points."""
    measured = {(page.case, page.variant): page.results for page in pages}
    return [_sweep(one, number, measured, cases.get(one["case"])) for number, one in enumerate(facts, start=1)]


def _sweep(facts: Mapping[str, Any], number: int, measured: Mapping[tuple[str, str], Mapping[str, Result]], known: Case | None) -> Sweep:
    case, axes = facts["case"], tuple(facts["axes"])
    points = tuple(Point(point["values"], point["variant"], measured.get((case, point["variant"]), {}), point.get("formal_orders", {}),
                         point.get("quantiles", ()))
                   for point in facts["points"])
    along = " × ".join(axis.replace("_", " ") for axis in axes) or "one point"
    title = facts.get("title") or f"{case.replace('_', ' ').capitalize()}: {along}"
    # A case that has gone since leaves its results without units of the axes.
    units = {axis: known.parameters[axis].unit for axis in axes if known and axis in known.parameters}
    return Sweep(case, title, axes, points, f"{case}-{number}", units, facts.get("sample", {}))


def words(values: Mapping[str, Any]) -> str:
    """Parameters for people: `wall friction 0.2, cylinder radius 0.04`."""
    return ", ".join(f"{key.replace('_', ' ')} {value:.6g}" if isinstance(value, float) else f"{key.replace('_', ' ')} {value}"
                     for key, value in values.items())


@dataclass(frozen=True)
class NumericalError:
    """The numerical uncertainty of one quantity at the finest setting of `parameter`, other parameters being `at`."""

    sweep: Sweep
    engine: str
    quantity: QuantityRecord
    parameter: str
    at: str
    finest: float
    formal_order: float
    found: Convergence


def numerical_errors(sweeps: Iterable[Sweep]) -> list[NumericalError]:
    """What the grids and lists along the time step or the stiffness say, for every quantity that is checked or compared."""
    return [_judged(sweep, engine, parameter, others, line)
            for sweep in sweeps if not sweep.sample
            for parameter in sweep.axes if parameter in REFINEMENT and len(sweep.levels(parameter)) > 1
            for one in sweep.quantities() for engine in sweep.engines
            for others, line in sweep.lines(parameter, engine, one.name) if len(line) > 1]


def _judged(sweep: Sweep, engine: str, parameter: str, others: Mapping[str, Any],
            line: Sequence[tuple[float, QuantityRecord]]) -> NumericalError:
    h = [refinement(parameter, place) for place, _ in line]
    halves = [math.inf if one.half is None else one.half for _, one in line]
    finest = min(range(len(h)), key=h.__getitem__)
    formal = sweep.formal_order(parameter, others)
    found = convergence(h, [float(one.value or 0.0) for _, one in line], halves, formal)
    return NumericalError(sweep, engine, line[finest][1], parameter, words(others), line[finest][0], formal, found)
