"""What a campaign will cost before it starts: steps of its decks, time from measured rates, and room on the disk; also as a table."""

from __future__ import annotations

import shutil
import socket
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dembark.common.units import core_hours, duration, size_text
from dembark.validation import engines, results
from dembark.validation.case import deck
from dembark.validation.case.model import Case

from .plan import Plan, Series, is_finished


@dataclass(frozen=True)
class Rate:
    """Particle-steps per second and core, and where the number is from."""

    value: float
    source: str


class Rates:
    """The rates to reckon with for a campaign that has measured some already in the folder `path`, if it is there."""

    def __init__(self, path: Path | None = None) -> None:
        self._runs = None
        if path is None or not path.is_dir():
            return
        runs = results.runs(path)
        if "provenance.particle_steps_per_second" in runs:
            self._runs = runs.dropna(subset="provenance.particle_steps_per_second")
            self._runs["cores"] = self._runs["provenance.ranks"] * self._runs["provenance.threads"]

    def of(self, case: Case, engine: str, cores: int = 1) -> Rate:
        """Rate for runs of `case` in `engine` on `cores` cores.

        The median of the folder's runs of this case, those of this host and this number of cores before others; else the engine's facts.
        """
        runs = self._runs
        if runs is not None:
            runs = runs[(runs["case"] == case.name) & (runs["engine"] == engine)]
            mine = runs[runs["provenance.host"] == socket.gethostname()]
            where = "this host" if len(mine) else "other hosts"
            runs = mine if len(mine) else runs
            alike = runs[runs["cores"] == cores]
            runs = alike if len(alike) else runs
        if runs is not None and len(runs):
            value = (runs["provenance.particle_steps_per_second"] / runs["cores"]).median()
            return Rate(float(value), f"{len(runs)} runs measured on {where}")
        facts = engines.facts(engine)
        if engine in case.rates:
            return Rate(case.rates[engine], f"measured on {facts.measured_on}")
        return Rate(facts.typical_rate, f"of other cases, measured on {facts.measured_on}")


@dataclass(frozen=True)
class Estimate:
    """A run of one series: steps of `time_step` (s), particle-steps, core-seconds, wall time (s) if its cores share the work perfectly,
    and bytes; None = not known."""

    series: Series
    steps: int
    time_step: float
    rate: Rate
    cores: int
    particle_steps: float | None
    core_seconds: float | None
    wall_time: float | None
    size: int | None


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
        rate = rates.of(run.case, run.engine.name, cores)
        work = None if run.particles is None else float(run.particles) * known[key][0]
        time = None if work is None else work / rate.value
        found.append(Estimate(one, *known[key], rate, cores, work, time, None if time is None else time / cores, run.output_size))
    return found


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


def warnings(plan: Plan, found: Iterable[Estimate], folder: Path, room: float) -> list[str]:
    """What is likely to go wrong: less free disk than the `room` (bytes) that is needed, and runs that need longer than they are given."""
    there = next(place for place in (folder, *folder.parents) if place.exists())
    free = shutil.disk_usage(there).free
    lines = [f"{there} has {size_text(free)} free, less than the {size_text(room)} that are needed"] if free < room else []
    for one in found:
        limit = plan.resources[one.series.place].time
        attempts = 1 + plan.retries
        if limit is not None and one.wall_time is not None and one.wall_time > limit * attempts:
            lines.append(f"{one.series.place} needs about {one.wall_time / 3600:.1f} h, more than "
                         f"its {attempts} attempts of {limit / 3600:.1f} h have together")
    return lines


def rate_sources(found: Iterable[Estimate]) -> Mapping[str, Iterable[str]]:
    """Engines and cases by the source of their rate, each once."""
    sources: dict[str, dict[str, None]] = {}
    for one in found:
        run = one.series.runs[0]
        sources.setdefault(one.rate.source, {})[f"{run.case.name} in {run.engine.name} {one.rate.value:.2g}"] = None
    return sources


def dry_run(console: Console, plan: Plan, found: Sequence[Estimate], folder: Path, cores: int | None) -> None:
    """The runs of a campaign with steps, cost and disk space; totals, of what is not finished in `folder`; where the rates are from.

    `cores` of this machine give the time that it will take; None when the runs are jobs of a cluster.
    """
    left = {one.series.place: sum(not is_finished(folder / one.series.place / run.folder_name, run) for run in one.series.runs)
            for one in found}
    console.print(runs_table(found, left))
    for sweep in plan.facts.get("sweeps", ()):
        if "sample" in sweep:
            console.print(sample_line(sweep), markup=False, soft_wrap=True)
    runs, to_do = sum(len(one.series.runs) for one in found), sum(left.values())
    # Of all that is known.
    work, steps, room = (sum((getattr(one, name) or 0.0) * left[one.series.place] for one in found)
                         for name in ("core_seconds", "particle_steps", "size"))
    done = f", {runs - to_do} finished already" if runs > to_do else ""
    console.print(f"{plan.label}: {runs} runs{done}; to do: {steps:.2g} particle-steps, {core_hours(work)} core-hours, "
                  f"{size_text(room)} on the disk", style="bold", soft_wrap=True)
    unknown = [str(one.series.place) for one in found if one.core_seconds is None]
    if unknown:
        console.print(f"not in the sum, because the number of their particles is unknown: {', '.join(unknown)}", soft_wrap=True)
    if cores is not None and to_do:
        costs = [(one.wall_time, one.cores) for one in found if one.wall_time is not None for _ in range(left[one.series.place])]
        console.print(f"on {cores} cores about {duration(wall_clock(costs, cores))}")
    for source, words in rate_sources(found).items():
        console.print(f"particle-steps per second and core {source}: {', '.join(words)}", markup=False, soft_wrap=True)
    for line in warnings(plan, found, folder, room):
        console.print(f"warning: {line}", markup=False, style="yellow", soft_wrap=True)
    console.print(f"folder: {folder}", markup=False, soft_wrap=True)


def sample_line(sweep: Mapping[str, Any]) -> str:
    """A sampled sweep of `plan.json` in one line: design, points and what was left out."""
    sample, points = sweep["sample"], sweep["points"]
    gone = f"; {sample['left_out']} points break a condition and are left out" if sample["left_out"] else ""
    return (f"{sweep['name']}: {sample['design'].replace('_', ' ')}, seed {sample['seed']}, {len(points)} points of "
            f"{', '.join(sample['parameters'])}{gone}")


def runs_table(found: Sequence[Estimate], left: dict[Path, int]) -> Table:
    """One row a series."""
    columns = ("case", "variant", "engine", "runs", "to do", "cores", "steps", "simulated", "particle-steps", "time of one", "core-hours",
               "disk")
    table = Table(*columns, box=None, pad_edge=False)
    for column in table.columns[3:]:
        column.justify = "right"
    for one in found:
        run, count = one.series.runs[0], len(one.series.runs)
        cost = ["?"] * 3
        if one.particle_steps is not None and one.wall_time is not None and one.core_seconds is not None:
            cost = [f"{count * one.particle_steps:.2g}", duration(one.wall_time), core_hours(count * one.core_seconds)]
        table.add_row(escape(run.case.name), escape(run.variant), run.engine.name, str(count), str(left[one.series.place]), str(one.cores),
                      str(one.steps), f"{one.steps * one.time_step:.3g} s", *cost, "?" if one.size is None else size_text(count * one.size))
    return table
