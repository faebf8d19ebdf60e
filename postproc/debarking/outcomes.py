"""The outcome of debarking of one load of logs, with intervals from time within the load: what a case and the command both report."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from ..impacts import Impacts
from ..resampling import resampled
from ..statistics import Estimate, time_blocks
from .dose import Doses, Logs, doses, plane_of
from .laws import ForceRange, RemovalLaw, force_bound

Array = NDArray[np.float64]

# Events expected at most, with 97.5 % confidence, where none was seen (F. Garwood, Biometrika 28 (1936) 437).
_NONE_SEEN = -math.log(0.025)
_SPANS = 4  # of a revolution, whose scatter makes the intervals
CLEAN = 0.9  # the degree of debarking of the time to it


@dataclass(frozen=True)
class Load:
    """The impacts of a load of `logs` between `begin` and `end` (s) of a drum with the `period` (s) of a revolution.

    least_speed : m/s, approach from which a contact is an impact
    stiffness : N/m, of a log's surface; NaN: unknown, and no wood loss
    radius : m, of the drum; NaN: unknown, and no bound of the forces
    name : in messages
    """

    impacts: Impacts
    logs: Logs
    begin: float
    end: float
    period: float
    least_speed: float = 0.0
    stiffness: float = math.nan
    radius: float = math.nan
    name: str = ""

    @property
    def bound(self) -> float:
        """Force (N) that no impact exceeds by its energy; NaN without the radius of the drum or the stiffness."""
        return force_bound(2.0 * math.pi / self.period, self.radius, self.stiffness, float(self.logs.masses.max()))

    @property
    def edges(self) -> Array:
        """The quarter revolutions of the window (t + 1,) in s; a rest of less is left out."""
        count = math.floor((self.end - self.begin) / self.period * _SPANS + 1e-6)
        return np.asarray(self.begin + self.period / _SPANS * np.arange(max(count, 1) + 1), float)


@dataclass(frozen=True)
class Outcome:
    """`values` by name, per revolution where they are rates; `doses` they come from; `left` (t + 1, n, m): share of bark at the edges of
    time, None without a law."""

    load: Load
    forces: ForceRange
    law: RemovalLaw | None
    doses: Doses
    left: Array | None
    values: dict[str, Estimate]

    @property
    def revolutions(self) -> Array:
        """At the edges of time (t + 1,), from the begin of the window."""
        return np.asarray((self.doses.edges - self.doses.edges[0]) / self.load.period)

    @property
    def degree(self) -> Array:
        """Degree of debarking (t + 1,): share of the logs' surface without bark; NaN without a law."""
        if self.left is None:
            return np.full(len(self.doses.edges), np.nan)
        around = self.load.logs.circumferences
        return np.asarray((1.0 - self.left.mean(axis=2)) @ around / around.sum())

    def even(self, revolutions: Array) -> Array:
        """Degree of debarking after `revolutions`, if every log goes on at its mean rate and is hit evenly around."""
        assert self.law is not None
        logs, total = self.load.logs, self.doses.edges[-1] - self.doses.edges[0]
        impacts, friction = (table.sum(axis=(0, 2)) / total for table in (self.doses.effective, self.doses.friction))
        return self.law.even(impacts, friction, logs.circumferences, logs.length, [float(one) * self.load.period for one in revolutions])


def outcome(load: Load, forces: ForceRange, law: RemovalLaw | None = None, sectors: int = 12) -> Outcome:
    """The outcome of a load: doses of impacts in the range of `forces`, and with a `law` the degree of debarking."""
    logs = load.logs
    if law is not None and law.width is not None:
        plane_of(load.impacts)  # what an impact clears along the length of a log is not known in space
    found = doses(load.impacts, logs, forces, load.edges, sectors=sectors, least_speed=load.least_speed, stiffness=load.stiffness)
    left = None
    if law is not None:
        start = np.zeros((1, len(logs.ids), sectors))
        impacts, friction = (np.concatenate([start, table.cumsum(axis=0)]) for table in (found.effective, found.friction))
        left = law.left(impacts, friction, logs.circumferences / sectors, logs.length)
    result = Outcome(load, forces, law, found, left, {})
    result.values.update(_values(result))
    return result


def _values(result: Outcome) -> dict[str, Estimate]:
    load, found = result.load, result.doses
    logs, count = load.logs, len(load.logs.ids)
    useful, damaging, friction, excess = (table.sum(axis=(1, 2)) for table in (found.useful, found.damaging, found.friction, found.excess))
    blocks = time_blocks(useful + damaging) if len(useful) >= 4 else None

    def counted(series: Array) -> Estimate:
        if blocks is not None and not series.any():
            return Estimate(0.0, _SPANS * _NONE_SEEN / len(series) / count, "none seen, which bounds a Poisson rate")
        return rate(series, count)

    def rate(series: Array, scale: float) -> Estimate:
        return over(lambda keep: _SPANS * float(series[keep].mean()) / scale)

    def over(measure: Callable[[NDArray[np.bool_]], float]) -> Estimate:
        if blocks is None:
            return Estimate(measure(np.ones(len(useful), bool)), math.inf, "less than a revolution")
        return resampled(lambda keep, _: measure(keep), blocks)

    def share() -> Estimate:
        seen = float(useful.sum() + damaging.sum())
        if blocks is not None and seen and not damaging.any():
            return Estimate(0.0, -math.expm1(-_NONE_SEEN / seen), "none seen, which bounds the share")
        return over(damaging_share)

    def damaging_share(keep: NDArray[np.bool_]) -> float:
        total = useful[keep].sum() + damaging[keep].sum()
        return float(damaging[keep].sum() / total) if total else math.nan

    def dispersion(keep: NDArray[np.bool_]) -> float:
        per_sector = found.effective[keep].sum(axis=0)
        mean = per_sector.mean(axis=1)
        hit = mean > 0.0
        return float((per_sector.var(axis=1, ddof=1)[hit] / mean[hit]).mean()) if hit.any() else math.nan

    loss = rate(excess, float(logs.masses.sum()))
    values = {"useful_impacts": counted(useful), "damaging_impacts": counted(damaging), "damaging_share": share(),
              "friction_work": rate(friction, logs.surface),
              "wood_loss_index": loss if damaging.any() else Estimate(loss.value, math.inf, "no damaging impact was seen")}
    if found.useful.shape[2] > 1:
        values["sector_dispersion"] = over(dispersion)
    if result.law is not None:
        alone = "one load: only several loads give an interval"
        values["debarking_degree"] = Estimate(float(result.degree[-1]), math.inf, alone)
        values["debarking_time"] = Estimate(_time_to(CLEAN, result), math.inf, alone)
    return values


def _time_to(degree: float, result: Outcome) -> float:
    """s until the even degree is reached; NaN where it never is."""
    last = 1.0
    while result.even(np.array([last]))[0] < degree:
        last *= 2.0
        if last > 1e9:
            return math.nan
    turns = brentq(lambda turn: result.even(np.array([turn]))[0] - degree, 0.0, last)
    return float(turns) * result.load.period
