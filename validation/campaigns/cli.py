"""The commands for campaigns: `dembark campaigns`, `submit`, `resume`, `status`, `export`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

if TYPE_CHECKING:
    from dembark.validation.runs.perform import Outcome

File = Annotated[str, typer.Argument(metavar="CAMPAIGN", help="File of a campaign, or name of one of 'dembark campaigns'.")]
Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of a campaign.")]
Executor = Annotated[str | None, typer.Option(help="local, slurm, or the TOML file of a site.")]
Cores = Annotated[int | None, typer.Option(min=1, help="Cores of this machine to use; default: all.")]
Jobs = Annotated[int | None, typer.Option(min=1, help="Cluster jobs at the same time; default: the value in the site's file.")]
Out = Annotated[Path | None, typer.Option(help="Folder of the campaign; default: results/campaigns/<name>.")]
Dry = Annotated[bool, typer.Option("--dry-run", help="Check the file and show the runs and their cost, without running them.")]

app = typer.Typer()


@app.command("campaigns")
def show_campaigns() -> None:
    """List the campaigns that come with the cases."""
    from dembark.validation.campaigns.expand import points
    from dembark.validation.campaigns.spec import read, shipped
    from dembark.validation.show import console

    table = Table("campaign", "cases", "points", "what", box=None, pad_edge=False)
    for name, path in shipped().items():
        spec = read(path)
        cases = ", ".join(dict.fromkeys(sweep.case.name for sweep in spec.sweeps))
        table.add_row(name, cases, str(len(points(spec))), " ".join(spec.description.split()))
    console().print(table)


@app.command()
def submit(campaign: File, dry_run: Dry = False, executor: Executor = None, out: Out = None, cores: Cores = None,
           jobs: Jobs = None) -> None:
    """Run a campaign here or on a cluster. It makes all runs, their measurements and the report; what is finished is kept."""
    from dembark.validation.campaigns import estimate, expand, folder
    from dembark.validation.campaigns import submit as work
    from dembark.validation.campaigns.spec import locate
    from dembark.validation.runs.job import cancelled_by_signal
    from dembark.validation.show import console

    file = locate(campaign)
    chosen = folder.choose(executor or "local", cores, jobs)
    work.prepare(chosen)
    plan = expand.plan(file=file)
    results = (out or Path("results") / "campaigns" / plan.label).resolve()
    if not dry_run:
        _conclude(work.submit(plan, file, results, chosen, cancelled_by_signal(), _say), results)
        return
    folder.refuse_foreign(results, plan.label)
    work.check(chosen, plan)
    found = work.forecast(plan, results)
    estimate.dry_run(console(), plan, found, results, work.cores_here(chosen) if chosen.executor == "local" else None)


@app.command()
def resume(directory: Folder, executor: Executor = None, cores: Cores = None, jobs: Jobs = None) -> None:
    """Continue a campaign that was stopped. It uses the options of the submission unless others are given."""
    from dembark.validation.campaigns import expand, folder
    from dembark.validation.campaigns import submit as work
    from dembark.validation.runs.job import cancelled_by_signal

    results = directory.resolve()
    file = folder.own_file(results)
    folder.restore(results)
    before = folder.options(results)
    same = executor in (None, before.executor)
    chosen = folder.choose(executor or before.executor, cores or before.cores, jobs or (before.jobs if same else None))
    work.prepare(chosen)
    _conclude(work.submit(expand.plan(file=file), file, results, chosen, cancelled_by_signal(), _say), results)


def _say(line: str) -> None:
    print(f"dembark: {line}", file=sys.stderr)


def _conclude(outcome: Outcome, results: Path) -> None:
    from dembark.validation.show import show_outcome

    show_outcome(outcome, "the campaign", f"go on with 'dembark resume {results}': what is finished is kept")


@app.command()
def status(directory: Folder) -> None:
    """Show the progress of a campaign. Each run is listed with its simulated time and the time left."""
    from dembark.common.units import duration
    from dembark.validation import show
    from dembark.validation.campaigns.folder import look
    from dembark.validation.runs.progress import state_table

    results = directory.resolve()
    found = look(results)
    console = show.console()
    console.print(state_table(found.states))
    console.print(found.headline, markup=False, soft_wrap=True)
    for state in found.states:
        if state.state == "failed":
            console.print(f"failed: {state.name}: {state.message}", markup=False, style="red", soft_wrap=True)
    if found.running and found.left:
        console.print(f"about {duration(found.left)} left")
    show.print_tally(console, found.tally, f"{found.measured} series measured; ")
    if found.report:
        console.print(str(found.report), markup=False, soft_wrap=True)
    if not found.running and not found.complete:
        console.print(f"go on with 'dembark resume {directory}'", markup=False, soft_wrap=True)


@app.command()
def export(
    directory: Folder,
    table: Annotated[str, typer.Option(help="runs, steps, quantities, comparisons or points.")] = "quantities",
    out: Annotated[Path | None, typer.Option(help="File to write; default: standard output.")] = None,
) -> None:
    """Write a table of a campaign's results as CSV."""
    from dembark.validation.campaigns import store
    from dembark.validation.show import console

    if out is None:
        print(store.as_csv(directory, table), end="")
    else:
        store.export(directory, table, out)
        console().print(str(out), markup=False, soft_wrap=True)
