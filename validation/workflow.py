"""Runs the Snakefile for a profile or a campaign, shows how far its runs are, and sees to it that there is a report in the end."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from dembark.common.errors import DembarkError, Interrupted
from dembark.common.files import lock
from dembark.validation.campaigns.source import Source
from dembark.validation.engines import end_with_parent
from dembark.validation.jobs import (
    PROGRESS_VARIABLE,
    build_report,
    collect_all,
    failures,
    progress_folder,
    salvage,
    step_name,
    variants,
    write_summary,
)
from dembark.validation.judge.tally import Tally, of_folder
from dembark.validation.plan import Series, finished, studies
from dembark.validation.progress import FileBoard, Monitor, State, watched

_GRACE = 30.0
_LOOK = 60.0


@dataclass(frozen=True)
class Outcome:
    """What came out: runs that are not finished (with reasons), further problems, the tally of all checks, and the report if built."""

    runs: int
    unfinished: tuple[str, ...]
    problems: tuple[str, ...]
    tally: Tally
    report: Path | None

    @property
    def complete(self) -> bool:
        """Every run is finished and everything was measured and reported; checks may have failed."""
        return not self.unfinished and not self.problems and self.report is not None


@dataclass(frozen=True)
class Way:
    """How Snakemake is to run the jobs: words for its command line, whether they are jobs of a cluster, and who looks after it."""

    words: tuple[str, ...]
    cluster: bool = False
    # Asked now and then with Snakemake's process id: whether it waits for nothing any more and has to be started again.
    stalled: Callable[[int], bool] | None = None


def here(cores: int | None = None) -> Way:
    """On this machine, with as many runs at a time as fit `cores` (default: all)."""
    return Way(("--cores", str(cores or os.cpu_count() or 1)))


def _snakemake(source: Source, results: Path, way: Way, cases: Sequence[str], engines: Sequence[str]) -> list[str]:
    chosen = [f"profile={source.profile}", f"results={results.parent}"]
    if source.file:
        chosen = [f"campaign={source.file}", f"results={results}"]
    config = [*chosen, f"cases={' '.join(cases)}", f"engines={' '.join(engines)}"]
    return [*end_with_parent("KILL"), sys.executable, "-m", "snakemake", "--snakefile", str(Path(__file__).with_name("Snakefile")), *way.words,
            "--keep-going", "--nolock", "--rerun-incomplete", "--rerun-triggers", "mtime",
            "--scheduler", "greedy", "--nocolor", "--directory", str(results / ".workflow"), "--config", *config]


def _states(results: Path, all_series: Sequence[Series]) -> Callable[[], list[State]]:
    """All runs, and of the steps after them those that have begun (many need not be done again)."""
    runs = watched(progress_folder(results), [run.name for one in all_series for run in one.runs])
    measured = [step_name("measure", one.place) for one in all_series]
    looked_at = [step_name("study", one.place) for one in studies(all_series)]
    steps = [*measured, *looked_at, *(step_name("compare", place) for place in variants(all_series)), step_name("report")]
    later = watched(progress_folder(results), steps)
    return lambda: [*runs(), *(state for state in later() if state.state != "waiting")]


def _wait(process: subprocess.Popen[bytes], cancel: threading.Event, way: Way) -> int | None:
    """Exit code of the workflow; None when it had to be ended because it waited for nothing."""
    looked = time.monotonic()
    while process.poll() is None:
        if cancel.wait(0.2):
            _stop(process, way.cluster)
            raise Interrupted("interrupted", "finished runs are kept and will not be repeated")
        if way.stalled and time.monotonic() - looked > _LOOK:
            looked = time.monotonic()
            if way.stalled(process.pid):
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                return None
    return process.returncode


def _stop(process: subprocess.Popen[bytes], cluster: bool) -> None:
    """End the workflow: on this machine every job ends its engine and clears up, on a cluster Snakemake takes its jobs back."""
    if cluster:
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(_GRACE)
    for number in (signal.SIGTERM, signal.SIGKILL):
        with suppress(subprocess.TimeoutExpired, ProcessLookupError):
            if process.poll() is None:
                os.killpg(process.pid, number)
                process.wait(_GRACE)


def validate(profile: str, cancel: threading.Event, cores: int | None = None, results_root: Path = Path("results"),
             cases: Sequence[str] = (), engines: Sequence[str] = ()) -> Outcome:
    """Run everything that the cases list for `profile` and build the report in results_root/<profile>, see `perform`."""
    source, results = Source(profile), results_root.resolve() / profile
    source.series(cases, engines)
    with lock(results / ".lock", f"another validation works in {results}"):
        return perform(source, results, cancel, here(cores), cases, engines)


def perform(source: Source, results: Path, cancel: threading.Event, way: Way, cases: Sequence[str] = (), engines: Sequence[str] = (),
            log: Path | None = None) -> Outcome:
    """Make all runs of `source` in the folder `results`, measure them and build the report; events also go to the file `log`.

    Runs that finished earlier with the same inputs are kept. A run that fails stops nothing else: the report is built from what
    there is and names it as missing. Raises DembarkError for a plan that cannot be made, Interrupted when `cancel` is set.
    The caller holds the lock of the folder.
    """
    all_series = source.series(cases, engines)
    shutil.rmtree(progress_folder(results), ignore_errors=True)
    progress_folder(results).mkdir(parents=True)
    board = FileBoard(progress_folder(results))
    for run, folder in ((run, results / one.place / run.folder_name) for one in all_series for run in one.runs):
        if finished(folder, run):
            board.post(run.name, state="kept")
    write_summary(results, source, all_series, {})
    environment = {**os.environ, PROGRESS_VARIABLE: f"{socket.gethostname()}-{os.getpid()}-{time.time():.0f}"}
    with (results / "workflow.log").open("ab" if log else "wb") as output, Monitor(_states(results, all_series), log=log):
        code = None
        while code is None:
            process = subprocess.Popen(_snakemake(source, results, way, cases, engines), env=environment,
                                       stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, start_new_session=True)
            code = _wait(process, cancel, way)
    return _conclude(source, results, all_series, code, whole=not (cases or engines))


def _conclude(source: Source, results: Path, all_series: Sequence[Series], code: int, whole: bool) -> Outcome:
    problems = salvage(results, all_series) if code else []
    messages = failures(results, all_series)
    entries = write_summary(results, source, all_series, messages)
    unfinished = [f"{entry['case']} {entry['variant']} {entry['engine']} {entry['replica']}: {entry['message'] or 'missing'}"
                  for entry in entries if entry["state"] != "finished"]
    report = results / "report.html"
    try:
        collect_all(results, source, all_series, messages, whole)
        if code:
            report.unlink(missing_ok=True)
            build_report(results)
    except DembarkError as error:
        problems.append(str(error))
    if code and (not (unfinished or problems) or any(entry["state"] == "missing" for entry in entries)):
        # Not a run but the workflow itself failed, or a run's job died before it could say why; the log may tell.
        problems.append(f"the workflow ended with exit code {code}, see {results / 'workflow.log'}")
    return Outcome(len(entries), tuple(unfinished), tuple(problems), of_folder(results), report if report.is_file() else None)
