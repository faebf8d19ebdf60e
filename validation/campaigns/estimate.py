"""What a campaign will cost before it starts: steps as the decks announce them, time from measured rates, and room on the disk."""

from __future__ import annotations

import os
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from dembark.common.errors import DembarkError, Interrupted
from dembark.validation import engines
from dembark.validation.campaigns.expand import Plan
from dembark.validation.campaigns.rates import Rate, Rates
from dembark.validation.campaigns.sizes import size_text
from dembark.validation.runs.plan import Run, Series
from dembark.validation.runs.process import chunks, running
from dembark.validation.runs.progress import OutputParser

_PATIENCE = 60.0


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


def announced(run: Run, cancel: threading.Event) -> tuple[int, float]:
    """Steps and time step (s) that the deck of `run` announces: its engine is started and ended again as soon as it has said them."""
    words = run.engine.command(run.case.deck(run.engine.name), run.values)
    parser, deadline = OutputParser(), time.monotonic() + _PATIENCE
    with tempfile.TemporaryDirectory(prefix="dembark-") as folder, running(words, Path(folder), run.engine.environment()) as process:
        for chunk in chunks(process):
            if cancel.is_set():
                raise Interrupted("interrupted")
            parser.feed(chunk)
            if parser.steps or time.monotonic() > deadline:
                break
    if not parser.steps:
        raise DembarkError(f"{run.name} does not start", f"its deck says no 'dembark: steps <N> time_step <dt>' ({words[0]})",
                           f"try it with 'dembark run {run.case.name} --engine {run.engine.name}'")
    return parser.steps, parser.time_step


def _asked(run: Run) -> Run:
    """The same run in LIGGGHTS where that is at hand, which starts much faster than YADE; both decks take the same steps."""
    if run.engine.name == "liggghts" or "liggghts" not in run.case.engines:
        return run
    try:
        return Run(run.case, run.variant, run.profile, engines.find("liggghts"), run.replica, run.values)
    except DembarkError:
        return run


def estimates(plan: Plan, rates: Rates, cancel: threading.Event,
              told: Callable[[int, int], None] = lambda done, total: None) -> list[Estimate]:
    """One estimate for each series of `plan`, in its order; `told` hears how many of the decks were asked.

    DembarkError when a deck does not start, Interrupted when `cancel` is set.
    """
    asked: dict[tuple[object, ...], Run] = {_key(one.runs[0]): _asked(one.runs[0]) for one in plan.series}
    found: dict[tuple[object, ...], tuple[int, float]] = {}
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        told(0, len(asked))
        for key, answer in zip(asked, pool.map(lambda run: announced(run, cancel), asked.values()), strict=True):
            found[key] = answer
            told(len(found), len(asked))
    return [_estimate(one, found[_key(one.runs[0])], rates, plan.resources[one.place].cores) for one in plan.series]


def _key(run: Run) -> tuple[object, ...]:
    return run.case.name, *run.values.values()


def _estimate(one: Series, answer: tuple[int, float], rates: Rates, cores: int) -> Estimate:
    run = one.runs[0]
    return Estimate(one, *answer, run.particles, rates.of(run.case.name, run.engine.name, cores), cores, run.output_size)


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
