"""Tables for a terminal: what a campaign will run and cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dembark.validation.campaigns.estimate import Estimate, rate_sources, total, wall_clock, warnings
from dembark.validation.campaigns.expand import Plan
from dembark.validation.campaigns.sizes import core_hours, size_text
from dembark.validation.runs.plan import Series, finished
from dembark.validation.runs.progress import duration


def _left(one: Series, results: Path) -> int:
    return sum(not finished(results / one.place / run.folder_name, run) for run in one.runs)


def dry_run(console: Console, plan: Plan, found: Sequence[Estimate], results: Path, cores: int | None) -> None:
    """The runs of a campaign with steps, cost and disk space; totals, of what is not finished in `results`; where the rates are from.

    `cores` of this machine give the time that it will take; None when the runs are jobs of a cluster.
    """
    left = {one.series.place: _left(one.series, results) for one in found}
    console.print(runs_table(found, left))
    runs, to_do = sum(len(one.series.runs) for one in found), sum(left.values())
    work = total(one.core_seconds and one.core_seconds * left[one.series.place] for one in found)
    steps = total(one.particle_steps and one.particle_steps * left[one.series.place] for one in found)
    room = total(one.size and one.size * left[one.series.place] for one in found)
    done = f", {runs - to_do} finished already" if runs > to_do else ""
    console.print(f"{plan.spec.name}: {runs} runs{done}; to do: {steps:.2g} particle-steps, {core_hours(work)} core-hours, "
                  f"{size_text(room)} on the disk", style="bold", soft_wrap=True)
    unknown = [str(one.series.place) for one in found if one.core_seconds is None]
    if unknown:
        console.print(f"not in the sum, because their case does not say how many particles they have: {', '.join(unknown)}", soft_wrap=True)
    if cores is not None and to_do:
        costs = [(one.wall_time, one.cores) for one in found if one.wall_time is not None for _ in range(left[one.series.place])]
        console.print(f"on {cores} cores about {duration(wall_clock(costs, cores))}")
    for source, words in rate_sources(found).items():
        console.print(f"particle-steps per second and core {source}: {', '.join(words)}", markup=False, soft_wrap=True)
    for line in warnings(plan, found, results, room):
        console.print(f"warning: {line}", markup=False, style="yellow", soft_wrap=True)
    console.print(f"folder: {results}", markup=False, soft_wrap=True)


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
