"""What a campaign will cost before it starts: steps of its decks, time from measured rates, and room on the disk."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dembark.validation.campaigns.expand import Plan
from dembark.validation.campaigns.rates import Rate, Rates
from dembark.validation.campaigns.sizes import size_text
from dembark.validation.case import deck
from dembark.validation.runs.plan import Series


@dataclass(frozen=True)
class Estimate:
    """One series: steps and simulated time (s) of a run, its particles, core-seconds, wall time (s) and bytes; None = not known."""

    series: Series
    steps: int
    time_step: float
    particles: int | None
    rate: Rate
    cores: int
    size: int | None

    @property
    def particle_steps(self) -> float | None:
        """Of one run."""
        return None if self.particles is None else float(self.particles) * self.steps

    @property
    def core_seconds(self) -> float | None:
        """Of one run."""
        return None if self.particle_steps is None else self.particle_steps / self.rate.value

    @property
    def wall_time(self) -> float | None:
        """Of one run, if its cores share the work perfectly (s)."""
        return None if self.core_seconds is None else self.core_seconds / self.cores


def estimates(plan: Plan, rates: Rates) -> list[Estimate]:
    """One estimate for each series of `plan`, in its order; DembarkError when the numbers of a run cannot be made."""
    known: dict[tuple[object, ...], tuple[int, float]] = {}
    found = []
    for one in plan.series:
        run, cores = one.runs[0], plan.resources[one.place].cores
        # The seed changes neither steps nor time step.
        key = (run.case.name, *(value for name, value in run.values.items() if name != "seed"))
        if key not in known:
            setup = deck.prepare(run.case, run.values)
            known[key] = (setup.steps, setup.time_step)
        found.append(Estimate(one, *known[key], run.particles, rates.of(run.case.name, run.engine.name, cores), cores, run.output_size))
    return found


def total(values: Iterable[float | None]) -> float:
    """Sum of what is known."""
    return sum(value for value in values if value is not None)


def wall_clock(costs: Sequence[tuple[float, int]], cores: int) -> float:
    """Time (s) until all runs, given as (wall time in s, cores), are done on `cores` cores, the longest first; runs wait for room.

    A list schedule: each run starts as soon as enough cores are free.
    """
    free = [0.0] * max(1, cores)
    for wall, needed in sorted(costs, reverse=True):
        free.sort()
        count = min(needed, len(free))
        end = free[count - 1] + wall
        free[:count] = [end] * count
    return max(free)


def warnings(plan: Plan, found: Iterable[Estimate], results: Path, room: float) -> list[str]:
    """What is likely to go wrong: less free disk than the `room` (bytes) that is needed, and runs that need longer than they are given."""
    there = next(place for place in (results, *results.parents) if place.exists())
    free = shutil.disk_usage(there).free
    lines = [f"{there} has {size_text(free)} free, less than the {size_text(room)} that are needed"] if free < room else []
    for one in found:
        limit = plan.resources[one.series.place].time
        if limit is not None and one.wall_time is not None and one.wall_time > limit * (1 + plan.spec.retries):
            lines.append(f"{one.series.place} needs about {one.wall_time / 3600:.1f} h, more than the {limit / 3600:.1f} h of each of its "
                         f"{1 + plan.spec.retries} attempts together")
    return lines


def rate_sources(found: Iterable[Estimate]) -> Mapping[str, list[str]]:
    """Engines and cases by the source of their rate."""
    sources: dict[str, list[str]] = {}
    for one in found:
        run = one.series.runs[0]
        word = f"{run.case.name} in {run.engine.name} {one.rate.value:.2g}"
        if word not in sources.setdefault(one.rate.source, []):
            sources[one.rate.source].append(word)
    return sources
