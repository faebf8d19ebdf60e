"""The command `dembark`."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from dembark.common.choices import pick
from dembark.common.errors import DembarkError, RunError, pasteable
from dembark.common.extras import missing_extra
from dembark.common.parallel import cores_here
from dembark.common.units import seconds
from dembark.postproc import cli as postproc
from dembark.validation import body, doctor, engines, provenance, show
from dembark.validation.campaigns import fitted
from dembark.validation.campaigns.plan import Resources, predicted, series
from dembark.validation.case import cli as cases
from dembark.validation.case import folders
from dembark.validation.case.resolve import resolve, settings
from dembark.validation.judge import measurement
from dembark.validation.judge.result import METRICS
from dembark.validation.judge.tally import tally
from dembark.validation.runs import cli as campaigns
from dembark.validation.runs import restarts, workflow
from dembark.validation.runs.folder import restore
from dembark.validation.runs.steps import CAMPAIGN_FILE

_ABOUT = f"""Granular contact laws and their validation, in {engines.titles("and")}.

Cases of your own: 'dembark new-case NAME' writes one; '--cases FOLDER' (before the command) or DEMBARK_CASES adds a folder of them."""

app = typer.Typer(name="dembark", help=_ABOUT,
                  pretty_exceptions_enable=False, rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]})

_SET = 'Set a parameter; repeat for more. Units are allowed: --set "grain_diameter=4 mm".'
_OUT = "Folder for the results; default: results/<profile>/<case>/<variant>/<engine>; required with --set."
_FITTED = "The fitted.toml of a calibration: each packing has a draw of its posterior, and intervals are those of a prediction."
_MEMBERS = "How many draws of the posterior, with --parameters; default: 5."
_INTERVAL = "Wall time between restart files, from which an interrupted run continues: '10 min', or none; default: 10 min."

MEMBERS = 5

Profile = Annotated[str, typer.Option(help="Size of the runs: quick, standard, full, ...")]
Strict = Annotated[bool, typer.Option("--strict", help="Exit with code 1 when a check failed.")]
Results = Annotated[Path, typer.Option(help="Folder of all results; each profile has a subfolder.")]


def _show_version(wanted: bool) -> None:
    if wanted:
        facts = provenance.commit()
        changed = ", with changes" if facts["dirty"] else ""
        print(f"dembark {provenance.package_version('dembark')}"
              + (f" (commit {facts['commit'][:12]}{changed})" if facts["commit"] else ""))
        raise typer.Exit


@app.callback()
def _common(
    _version: Annotated[bool, typer.Option("--version", is_eager=True, callback=_show_version,
                                          help="Show the version, and the commit of a checkout.")] = False,
    own: Annotated[list[Path] | None, typer.Option("--cases", metavar="FOLDER", help="Folder of your own cases; repeat for more.")] = None,
) -> None:
    """Options that need no command."""
    for folder in own or ():
        folders.add_own_root(folder)


def _strictly(failed: int, strict: bool) -> None:
    """RunError when checks failed and that is to count."""
    if failed and strict:
        raise RunError(f"{failed} checks failed" if failed > 1 else "1 check failed", "--strict makes this an error")


@app.command()
def run(
    case: Annotated[str, typer.Argument(help="Name of a case, see 'dembark cases'.")],
    engine: Annotated[str, typer.Option(help=f"One of {', '.join(engines.names())}.")],
    profile: Profile = "quick",
    variant: Annotated[str | None, typer.Option(help="Variant of the case; default: the first one.")] = None,
    change: Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help=_SET)] = None,
    parameters: Annotated[Path | None, typer.Option(help=_FITTED)] = None,
    members: Annotated[int | None, typer.Option(min=3, help=_MEMBERS)] = None,
    out: Annotated[Path | None, typer.Option(help=_OUT)] = None,
    ranks: Annotated[int, typer.Option(min=1, help=f"MPI processes for each run ({engines.titles('and', lambda one: one.ranks)}).")] = 1,
    threads: Annotated[int, typer.Option(min=1, help="Threads for each run.")] = 1,
    jobs: Annotated[int | None, typer.Option(min=1, help="Replicas run at the same time; default: as many as fit the cores.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace results of other inputs once the new ones are finished.")] = False,
    restart_interval: Annotated[str | None, typer.Option(metavar="TIME", help=_INTERVAL)] = None,
    strict: Strict = False,
) -> None:
    """Run a case in one engine and measure it. Each quantity is shown with its reference and its verdict."""
    one = folders.find(case)
    changes = settings(change or ())
    chosen = variant if variant is not None else next(iter(one.variants))
    pick(engine, engines.names(), "engine", "in --engine")
    engines.facts(engine).check_ranks(ranks)
    interval = _interval(restart_interval)
    # Everything that the user wrote is checked before an engine is looked for.
    resolve(one, profile, chosen, changes)
    if out is None and (changes or parameters):
        option = "--set" if changes else "--parameters"
        raise DembarkError("--out is missing", f"with {option} the run is not the one of the profile", "name a folder for its results")
    if members is not None and parameters is None:
        raise DembarkError(f"--members {members}", "there is no posterior to draw from", "give --parameters fitted.toml")
    measurement.load(one)
    if parameters is None:
        planned = series(one, chosen, profile, engines.find(engine), changes)
    else:
        planned = predicted(one, chosen, profile, engines.find(engine), fitted.read(parameters), members or MEMBERS, changes)
    if restart_interval is not None and not restarts.writes_restarts(planned.runs[0]):
        raise DembarkError(f"--restart-interval {restart_interval}", f"{one.deck(engine)} writes no restart files",
                           "leave it out; see docs/how-to/restarts.md for what a deck needs")
    folder = (out or Path("results") / profile / planned.place).resolve()
    used = Resources(ranks, threads, restart_interval=interval)
    result = workflow.perform_series(planned, folder, workflow.cancelled_by_signal(), used, jobs, force)
    console = show.console()
    console.print(show.quantity_table(result, console.width))
    for line in show.open_lines(result):
        console.print(line, markup=False, soft_wrap=True)
    if gone := one.unmeasured(quantity.name for quantity in result.quantities):
        console.print(f"declared, not measured in this run: {', '.join(gone)}", markup=False, soft_wrap=True)
    counted = tally(result.quantities)
    show.print_tally(console, counted)
    console.print(str(folder / METRICS), markup=False, soft_wrap=True)
    _strictly(counted.failed, strict)


def _interval(text: str | None) -> float | None:
    """Wall time (s) between states of a run, 0 for none; None when it is not said."""
    if text is None:
        return None
    try:
        return 0.0 if text == "none" else seconds(text)
    except DembarkError as error:
        raise DembarkError(f"--restart-interval: {error}", "or none") from None


@app.command()
def validate(
    profile: Profile = "quick",
    cores: Annotated[int | None, typer.Option(min=1, help="Number of cores to use; default: all.")] = None,
    results: Results = Path("results"),
    case: Annotated[list[str] | None, typer.Option(help="Only this case; repeat for more.")] = None,
    engine: Annotated[list[str] | None, typer.Option(help="Only this engine.")] = None,
    strict: Strict = False,
) -> None:
    """Run all cases of a profile and build the report. Finished runs are kept."""
    outcome = workflow.validate(profile, workflow.cancelled_by_signal(), cores, results, tuple(case or ()), tuple(engine or ()))
    show.show_outcome(outcome, "the validation", "start again: what is finished is kept")
    _strictly(outcome.tally.failed, strict)


@app.command("report")
def make_report(
    directory: Annotated[Path | None, typer.Argument(metavar="[FOLDER]", help="Folder of a campaign, instead of a profile.")] = None,
    profile: Profile = "quick",
    results: Results = Path("results"),
) -> None:
    """Build the report again from the results in a folder. What is finished but not measured yet is measured first."""
    folder = directory.resolve() if directory else results.resolve() / profile
    if (folder / CAMPAIGN_FILE).is_file():
        restore(folder)
    if not any(folder.glob("*/*/*/metrics.json")) and not any(folder.glob("*/*/*/replica-*/run.json")):
        raise DembarkError(f"no results in {folder}", "", "give the folder of a campaign; a run has its metrics.json" if directory else
                           f"run 'dembark validate --profile {profile}' first, or give --results")
    outcome = workflow.conclude(folder, workflow.cancelled_by_signal(), cores_here())
    for line in outcome.problems:
        show.console().print(f"problem: {line}", markup=False, style="red", soft_wrap=True)
    if old := workflow.outdated(folder):
        campaign = ("dembark", "resume", folder)
        again = campaign if (folder / CAMPAIGN_FILE).is_file() else ("dembark", "validate", "--profile", profile, "--results", results)
        more = f" and {len(old) - 1} more" if len(old) > 1 else ""
        print(f"dembark: the runs of {' '.join(old[0].parts)}{more} are of another case, deck or engine than those of now; make them again "
              f"with {pasteable(*again)}", file=sys.stderr)
    show.console().print(f"{folder / 'report.html'}\n{folder / 'report.pdf'}", markup=False, soft_wrap=True)


app.add_typer(cases.app)
app.add_typer(campaigns.app)
app.add_typer(body.app)


@app.command("doctor")
def examine() -> None:
    """Show what is installed and what is missing. The exit code is 1 when something required is missing."""
    findings = doctor.examine()
    show.console().print(show.finding_table(findings))
    if any(finding.required and not finding.found for finding in findings):
        raise typer.Exit(1)


_PASSED_ON = {"ignore_unknown_options": True, "allow_extra_args": True, "help_option_names": []}


def _on_dumps(name: str) -> Callable[[typer.Context], None]:
    """The command `name` of dembark.postproc, with the words given to it."""
    def work(context: typer.Context) -> None:
        raise typer.Exit(postproc.run([name, *context.args]))

    return work


for _name, _help in (("fields", "Coarse-grain trajectories to fields."), ("walls", "Measure stresses on walls and inclusions."),
                     ("debark", "Degree of debarking and wood damage from impacts."),
                     ("render", "Draw pictures and films of runs and dumps."),
                     ("tracks", "Follow single grains, of runs and of experiments.")):
    app.command(_name, add_help_option=False, context_settings=_PASSED_ON, help=_help)(_on_dumps(_name))


def _start(name: str) -> Callable[[typer.Context], None]:
    """The command that becomes the engine called `name`, with the words given to it."""
    def start(context: typer.Context) -> None:
        found = engines.find(name)
        environment = found.environment()
        if "DISPLAY" in os.environ:
            environment["DISPLAY"] = os.environ["DISPLAY"]
        sys.stdout.flush()
        os.execve(found.executable, [str(found.executable), *context.args], environment)

    return start


for _facts in map(engines.facts, engines.names()):
    if _facts.interactive:
        app.command(_facts.name, add_help_option=False, context_settings=_PASSED_ON,
                    help=f"Start {_facts.program}. All further arguments are passed to it.")(_start(_facts.name))


def main(words: list[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 a run or report failed, 2 the user's mistake, 130 interrupted."""
    try:
        given = sys.argv[1:] if words is None else words
        code = app(args=given or ["--help"], prog_name="dembark", standalone_mode=False)
    except DembarkError as error:
        print(f"dembark: {error}", file=sys.stderr)
        return error.exit_code
    except ModuleNotFoundError as error:
        print(f"dembark: {missing_extra(error, 'this command')}", file=sys.stderr)
        return DembarkError.exit_code
    except (typer.Abort, KeyboardInterrupt):
        print("dembark: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        # Typer's own usage errors have this method; everything else is a defect and keeps its trace.
        message = getattr(error, "format_message", None)
        if message is None:
            raise
        print(f"dembark: {' '.join(message().split()).rstrip('.')}, see 'dembark --help'", file=sys.stderr)
        return 2
    return code if isinstance(code, int) else 0


def script() -> None:
    """The console script `dembark`."""
    sys.exit(main())


if __name__ == "__main__":
    sys.exit(main())
