"""The commands for campaigns: `dembark campaigns`, `submit`, `resume`, `status`; and `export`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from dembark.common.errors import DembarkError, pasteable
from dembark.common.lock import lock
from dembark.common.parallel import cores_here
from dembark.common.units import duration, size_text
from dembark.validation import results, show
from dembark.validation.campaigns import estimate, expand
from dembark.validation.campaigns.plan import Plan
from dembark.validation.campaigns.spec import locate, read, shipped_campaigns

from . import cluster, folder, site, workflow
from .folder import Options
from .monitor import state_table

File = Annotated[str, typer.Argument(metavar="CAMPAIGN", help="File of a campaign, or name of one of 'dembark campaigns'.")]
Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of a campaign.")]
Executor = Annotated[str | None, typer.Option(help="local, slurm, or the TOML file of a site.")]
Cores = Annotated[int | None, typer.Option(min=1, help="Cores of this machine to use; default: all.")]
Jobs = Annotated[int | None, typer.Option(min=1, help="Runs of an array at the same time; default: the value in the site's file.")]
Out = Annotated[Path | None, typer.Option(help="Folder of the campaign; default: results/campaigns/<name>.")]
Dry = Annotated[bool, typer.Option("--dry-run", help="Check the file and show the runs and their cost, without running them.")]
WriteOnly = Annotated[bool, typer.Option("--write-only", help="Write the job scripts, and a script that submits them, but do not submit. "
                                         "For a container, where the scheduler's commands are missing; it is not asked about resources.")]

app = typer.Typer()


@app.command("campaigns")
def show_campaigns() -> None:
    """List the campaigns that come with the cases."""
    table = Table("campaign", "cases", "points", "what", box=None, pad_edge=False)
    for name, path in shipped_campaigns().items():
        spec = read(path)
        cases = ", ".join(dict.fromkeys(sweep.case.name for sweep in spec.sweeps))
        table.add_row(name, cases, str(len(expand.points(spec))), " ".join(spec.description.split()))
    show.console().print(table)


@app.command()
def submit(campaign: File, dry_run: Dry = False, executor: Executor = None, out: Out = None, cores: Cores = None,
           jobs: Jobs = None, write_only: WriteOnly = False) -> None:
    """Run a campaign here, or submit it to a cluster. It makes all runs, their measurements and the report; what is finished is kept."""
    _start(locate(campaign), dry_run, executor, out, cores, jobs, write_only)


@app.command()
def calibrate(campaign: File, dry_run: Dry = False, executor: Executor = None, out: Out = None, cores: Cores = None,
              jobs: Jobs = None, write_only: WriteOnly = False) -> None:
    """Fit parameters to targets. It runs a campaign whose sample has targets, as 'submit' does; its report has the fit."""
    file = locate(campaign)
    if not any(sweep.sample and sweep.sample.targets for sweep in read(file).sweeps):
        raise DembarkError(f"{file} has no targets", "", "give them in [sweeps.sample.targets]: NAME = { value = ..., uncertainty = ... }")
    target = _start(file, dry_run, executor, out, cores, jobs, write_only)
    for path in sorted(target.glob("calibration/*/*/*/fitted.toml")):
        show.console().print(str(path), markup=False, soft_wrap=True)


def _start(file: Path, dry_run: bool, executor: str | None, out: Path | None, cores: int | None, jobs: int | None,
           write_only: bool) -> Path:
    """Run or submit the campaign `file`, or show its runs; returns its folder."""
    chosen = folder.choose(executor or "local", cores, jobs)
    where = _site(chosen)
    plan = expand.campaign(read(file))
    target = (out or Path("results") / "campaigns" / plan.label).resolve()
    if not dry_run:
        _submit(plan, file, target, chosen, where, write_only)
        return target
    folder.refuse_foreign(target, plan.label)
    _check(chosen, plan, where, write_only)
    found = estimate.estimates(plan, estimate.Rates(target))
    estimate.dry_run(show.console(), plan, found, target, None if where else _cores(chosen))
    return target


@app.command()
def resume(directory: Folder, executor: Executor = None, cores: Cores = None, jobs: Jobs = None, write_only: WriteOnly = False) -> None:
    """Continue a campaign that was stopped. It uses the executor, cores and jobs of the submission unless others are given."""
    target = directory.resolve()
    file = folder.own_file(target)
    folder.restore(target)
    before = folder.options(target)
    same = executor in (None, before.executor)
    chosen = folder.choose(executor or before.executor, cores or before.cores, jobs or (before.jobs if same else None))
    where = _site(chosen)
    _submit(expand.campaign(read(file)), file, target, chosen, where, write_only)


def _site(chosen: Options) -> site.Site | None:
    """The chosen site, None for this machine; with the environment that its preamble makes, the engines are found, here and in the jobs."""
    if chosen.executor == "local":
        return None
    found = site.find(chosen.executor)
    os.environ.update(found.environment())
    return found


def _cores(chosen: Options) -> int:
    return chosen.cores or cores_here()


def _check(chosen: Options, plan: Plan, where: site.Site | None, write_only: bool = False) -> None:
    """DembarkError for runs with more cores or memory than this machine has, or that the scheduler would refuse."""
    if where:
        if not write_only:
            cluster.check(plan, where)
        return
    if write_only:
        raise DembarkError("--write-only is for a cluster", "with --executor local", "name a site with --executor")
    if chosen.jobs is not None:
        raise DembarkError("--jobs is for a cluster", "with --executor local", "use --cores for the runs of this machine")
    for place, used in plan.resources.items():
        if used.cores > _cores(chosen):
            raise DembarkError(f"{place} needs {used.cores} cores", f"there are {_cores(chosen)}",
                               "lower ranks or threads, or raise --cores")
        if used.memory and used.memory > _memory():
            raise DembarkError(f"{place} needs {size_text(used.memory)} of memory", f"this machine has {size_text(_memory())}",
                               "lower memory")


def _memory() -> float:
    return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))


def _submit(plan: Plan, file: Path, target: Path, chosen: Options, where: site.Site | None, write_only: bool) -> None:
    """Run or submit `plan`, that of the campaign `file`, in the folder `target`; refused while another process does."""
    cancel = None if where else workflow.cancelled_by_signal()
    folder.refuse_foreign(target, plan.label)
    _check(chosen, plan, where, write_only)
    with lock(target / workflow.LOCK, f"the campaign in {target} is being run by another process"):
        expected = {one.series.place: one.wall_time for one in estimate.estimates(plan, estimate.Rates(target))}
        folder.enter(target, file, plan, chosen, expected)
        if where:
            lines = cluster.submit(plan, target, where, chosen.jobs, write_only)
        elif cancel:
            outcome = workflow.perform(plan, target, cancel, _cores(chosen), _memory(), target / folder.LOG, expected)
    if where:
        again = pasteable("dembark", "resume", target)
        for line in (*lines, f"see {pasteable('dembark', 'status', target)}; what ended too early is submitted again by {again}"):
            print(f"dembark: {line}", file=sys.stderr)
    else:
        show.show_outcome(outcome, "the campaign", f"go on with {pasteable('dembark', 'resume', target)}: what is finished is kept")


@app.command()
def status(directory: Folder) -> None:
    """Show the progress of a campaign. Each run is listed with its simulated time and the time left."""
    found = folder.look(directory.resolve())
    console = show.console()
    console.print(state_table(found.states))
    console.print(found.headline, markup=False, soft_wrap=True)
    for state in found.states:
        if state.message:
            console.print(f"{state.state}: {state.name}: {state.message}", markup=False, style="red", soft_wrap=True)
    if found.running and found.left:
        console.print(f"about {duration(found.left)} left")
    show.print_tally(console, found.tally, f"{found.measured} series measured; ")
    if found.report:
        console.print(str(found.report), markup=False, soft_wrap=True)
    if not found.running and not found.concluded:
        lacking = "measurements or the report are missing: " if found.complete else ""
        if folder.options(directory.resolve()).executor != "local":
            lacking += "unless its jobs wait in the queue of the cluster, "
        console.print(f"{lacking}go on with {pasteable('dembark', 'resume', directory)}", markup=False, soft_wrap=True)


@app.command()
def export(
    directory: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of results: of a profile, a campaign or a run.")],
    table: Annotated[str, typer.Option(help="quantities, comparisons or runs.")] = "quantities",
    out: Annotated[Path | None, typer.Option(help="File to write, .csv, .json or .parquet; default: CSV to standard output.")] = None,
) -> None:
    """Write the results in a folder as one table."""
    text = results.export(directory, table, out)
    if out is None:
        print(text, end="")
    else:
        show.console().print(str(out), markup=False, soft_wrap=True)
