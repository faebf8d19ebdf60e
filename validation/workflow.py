"""Runs the Snakefile for a profile, shows how far its runs are, and sees to it that there is a report in the end."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from dembark.validation.errors import DembarkError, Interrupted
from dembark.validation.files import lock, read_json
from dembark.validation.jobs import (
    PROGRESS_VARIABLE,
    build_report,
    failures,
    progress_folder,
    salvage,
    step_name,
    variants,
    write_summary,
)
from dembark.validation.plan import Series, campaign, finished, studies
from dembark.validation.progress import FileBoard, Monitor, State, watched

_GRACE = 30.0


@dataclass(frozen=True)
class Outcome:
    """What came out: runs that are not finished (with reasons), further problems, numbers of checks, and the report if built."""

    runs: int
    unfinished: tuple[str, ...]
    problems: tuple[str, ...]
    checks: int
    failed_checks: int
    report: Path | None

    @property
    def complete(self) -> bool:
        """Every run is finished and everything was measured and reported; checks may have failed."""
        return not self.unfinished and not self.problems and self.report is not None


def _snakemake(results: Path, profile: str, cores: int, cases: Sequence[str], engines: Sequence[str]) -> list[str]:
    config = [f"profile={profile}", f"results={results.parent}", f"cases={' '.join(cases)}", f"engines={' '.join(engines)}"]
    guard = ["setpriv", "--pdeathsig", "KILL", "--"] if shutil.which("setpriv") else []
    return [*guard, sys.executable, "-m", "snakemake", "--snakefile", str(Path(__file__).with_name("Snakefile")),
            "--cores", str(cores), "--keep-going", "--nolock", "--rerun-incomplete", "--rerun-triggers", "mtime",
            "--scheduler", "greedy", "--nocolor", "--directory", str(results / ".workflow"), "--config", *config]


def _states(results: Path, all_series: Sequence[Series]) -> Callable[[], list[State]]:
    """All runs, and of the steps after them those that have begun (many need not be done again)."""
    runs = watched(progress_folder(results), [run.name for one in all_series for run in one.runs])
    measured = [step_name("measure", one.place) for one in all_series]
    looked_at = [step_name("study", one.place) for one in studies(all_series)]
    steps = [*measured, *looked_at, *(step_name("compare", place) for place in variants(all_series)), step_name("report")]
    later = watched(progress_folder(results), steps)
    return lambda: [*runs(), *(state for state in later() if state.state != "waiting")]


def _wait(process: subprocess.Popen[bytes], cancel: threading.Event) -> int:
    while process.poll() is None:
        if not cancel.wait(0.2):
            continue
        # Every job ends its engine and clears up; then Snakemake, which starts no more jobs, ends by itself.
        os.killpg(process.pid, signal.SIGTERM)
        try:
            process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        raise Interrupted("interrupted", "finished runs are kept and will not be repeated")
    return process.returncode


def count_checks(results: Path) -> tuple[int, int]:
    """Numbers of quantities with a verdict pass or fail, and of those that fail, in all results below `results`."""
    verdicts = [quantity.get("verdict") for name in ("metrics.json", "comparison.json") for path in sorted(results.glob(f"*/*/**/{name}"))
                if "superseded" not in path.parts for quantity in (read_json(path) or {}).get("quantities", [])]
    return sum(verdict in ("pass", "fail") for verdict in verdicts), verdicts.count("fail")


def validate(profile: str, cancel: threading.Event, cores: int | None = None, results_root: Path = Path("results"),
             cases: Sequence[str] = (), engines: Sequence[str] = ()) -> Outcome:
    """Run everything that the cases list for `profile` and build the report in results_root/<profile>.

    Runs that finished earlier with the same inputs are kept. A run that fails stops nothing else: the report is built from what
    there is and names it as missing. Raises DembarkError for a plan that cannot be made, Interrupted when `cancel` is set.
    """
    all_series = campaign(profile, cases, engines)
    results = results_root.resolve() / profile
    with lock(results / ".lock", f"another validation works in {results}"):
        shutil.rmtree(progress_folder(results), ignore_errors=True)
        progress_folder(results).mkdir(parents=True)
        board = FileBoard(progress_folder(results))
        for run, folder in ((run, results / one.place / run.folder_name) for one in all_series for run in one.runs):
            if finished(folder, run):
                board.post(run.name, state="kept")
        environment = {**os.environ, PROGRESS_VARIABLE: "1"}
        with (results / "workflow.log").open("wb") as log, Monitor(_states(results, all_series)):
            process = subprocess.Popen(_snakemake(results, profile, cores or os.cpu_count() or 1, cases, engines), env=environment,
                                       stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, start_new_session=True)
            code = _wait(process, cancel)
        return _conclude(profile, results, all_series, code)


def _conclude(profile: str, results: Path, all_series: Sequence[Series], code: int) -> Outcome:
    problems = salvage(results, all_series) if code else []
    entries = write_summary(results, profile, all_series, failures(results, all_series))
    unfinished = [f"{entry['case']} {entry['variant']} {entry['engine']} {entry['replica']}: {entry['message'] or 'missing'}"
                  for entry in entries if entry["state"] != "finished"]
    report = results / "report.html"
    if code:
        report.unlink(missing_ok=True)
        try:
            build_report(results)
        except DembarkError as error:
            problems.append(str(error))
    if code and (not (unfinished or problems) or any(entry["state"] == "missing" for entry in entries)):
        # Not a run but the workflow itself failed, or a run's job died before it could say why; the log may tell.
        problems.append(f"the workflow ended with exit code {code}, see {results / 'workflow.log'}")
    checks, failed = count_checks(results)
    return Outcome(len(entries), tuple(unfinished), tuple(problems), checks, failed, report if report.is_file() else None)
