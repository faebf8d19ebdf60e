"""From a plan to its results: all runs, measurements and the report in one folder, or the runs of one series in a folder of the user's."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from dembark.common.errors import DembarkError
from dembark.common.files import disk_error, read_json, write_json
from dembark.common.lock import lock
from dembark.common.parallel import cores_here
from dembark.common.signals import ENDING, interruptible
from dembark.validation import results
from dembark.validation.campaigns import expand
from dembark.validation.campaigns.plan import Plan, Resources, Series
from dembark.validation.campaigns.spec import read
from dembark.validation.judge.result import METRICS, PLAN, Result
from dembark.validation.judge.tally import Tally, of_folder
from dembark.validation.results import RECORD, State

from .executor import Executor, States, Task
from .monitor import Monitor
from .steps import CAMPAIGN_FILE, Step, build_report, measure_series, steps

LOCK = ".lock"


def cancelled_by_signal() -> threading.Event:
    """An event that SIGINT and SIGTERM set from now on, instead of ending this process at once."""
    event = threading.Event()

    def handler(_number: int, _frame: FrameType | None) -> None:
        event.set()

    for number in ENDING:
        signal.signal(number, handler)
    return event


@dataclass(frozen=True)
class Outcome:
    """What came out: runs that are not finished (with reasons), further problems, the tally of all checks, the report if built, and engines
    that were left out, with reasons."""

    runs: int
    unfinished: tuple[str, ...]
    problems: tuple[str, ...]
    tally: Tally
    report: Path | None
    left_out: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Every run is finished and everything was measured and reported; checks may have failed."""
        return not self.unfinished and not self.problems and self.report is not None


def validate(profile: str, cancel: threading.Event, cores: int | None = None, results_root: Path = Path("results"),
             cases: Sequence[str] = (), engines: Sequence[str] = ()) -> Outcome:
    """Run everything that the cases list for `profile` and build the report in results_root/<profile>, see `perform`."""
    planned, folder = expand.profile(profile, cases, engines), results_root.resolve() / profile
    with lock(folder / LOCK, f"another validation works in {folder}"):
        write_json(folder / PLAN, planned.as_json())
        return perform(planned, folder, cancel, cores or cores_here())


def perform(plan: Plan, folder: Path, cancel: threading.Event, cores: int, memory: float | None = None, log: Path | None = None,
            estimates: Mapping[Path, float | None] | None = None) -> Outcome:
    """Make all runs of `plan`, which is in the folder's plan.json, on this machine, measure them and build the report.

    Runs that finished earlier with the same inputs are kept. A run that fails stops nothing else: the report is built from what
    there is and names it as missing. Interrupted when `cancel` is set. The caller holds the lock of the folder. Events also go to the file
    `log`; `estimates`: expected wall times (s) of a run by places of series.
    """
    tasks = [Task(run, folder / one.place, plan.resources.get(one.place, Resources()), (estimates or {}).get(one.place))
             for one in plan.series for run in one.runs]
    return _execute(folder, tasks, steps(folder), cancel, cores, memory, plan.retries, log)


def conclude(folder: Path, cancel: threading.Event, cores: int) -> Outcome:
    """Measure what is finished in a results folder and has not been measured, and build the report anew, without running anything.

    DembarkError when another process works in the folder, RunError when there is nothing to report.
    """
    with lock(folder / LOCK, f"another process works in {folder}"):
        *before, _ = steps(folder)
        outcome = _execute(folder, (), before, cancel, cores)
        with interruptible(*ENDING):
            build_report(folder)
        return outcome


def outdated(folder: Path) -> list[Path]:
    """Places of the series in a results folder that were run with other inputs than case.toml, deck and engine give now; empty where the
    plan cannot be made any more, as without an engine."""
    made = {run["folder"]: run["inputs"] for run in results.plan(folder).get("runs", ())}
    try:
        now = expand.campaign(read(folder / CAMPAIGN_FILE)) if (folder / CAMPAIGN_FILE).is_file() else expand.profile(folder.name)
    except DembarkError:
        return []
    return sorted({Path(place).parent for place, run in now.folders.items() if made.get(place, run.inputs) != run.inputs})


def _execute(folder: Path, tasks: Sequence[Task], todo: Sequence[Step], cancel: threading.Event, cores: int, memory: float | None = None,
             retries: int = 0, log: Path | None = None) -> Outcome:
    states, errors = _watched(tasks, todo, cancel, cores, memory, retries, log)
    unfinished = [f"{state.name}: {state.message or state.state}" for state in states.all()
                  if state.kind == "run" and state.state != "finished"]
    problems = dict.fromkeys(str(errors[step.name]) for step in todo if step.name in errors)
    report = folder / "report.html"
    return Outcome(len(tasks), tuple(unfinished), tuple(problems), of_folder(folder), report if report.is_file() else None,
                   tuple(f"{name}: {why}" for name, why in results.plan(folder).get("left_out", {}).items()))


def _watched(tasks: Sequence[Task], todo: Sequence[Step], cancel: threading.Event, cores: int, memory: float | None = None,
             retries: int = 0, log: Path | None = None, reasons: bool = True) -> tuple[States, Mapping[str, DembarkError]]:
    """Execute `tasks` and `todo` under a monitor: the states at the end, and the errors of what failed."""
    states = States(tasks, todo)

    def shown() -> list[State]:
        """All runs, and of the steps those that have begun: many need not be done again."""
        return [state for state in states.all() if state.kind == "run" or state.state == "running"]

    with Monitor(shown, log=log, reasons=reasons) as monitor:
        states.listener = monitor.event
        executor = Executor(states, cancel, cores, memory, retries)
        executor.execute(tasks, todo)
    return states, executor.errors


def perform_series(one: Series, out: Path, cancel: threading.Event, used: Resources, jobs: int | None = None,
                   force: bool = False) -> Result:
    """Run the replicas of a series that are not finished yet in the folder `out`, `jobs` at a time (default: as many as fit the cores).

    Returns what is in `out/metrics.json`. A replica that fails does not stop the others; the first failure is raised when all have
    ended. DembarkError when `out` holds something else, unless `force` lets results of other inputs be replaced.
    """
    if not force:
        refuse_foreign(one, out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise disk_error(error, out) from None
    cores = jobs * used.cores if jobs else max(used.cores, cores_here())
    # Why a run failed is said once, at the end.
    _, errors = _watched([Task(run, out, used) for run in one.runs], (), cancel, cores, reasons=False)
    if errors:
        first, *others = errors.values()
        for message in dict.fromkeys(map(str, others)):
            if message != str(first):
                print(f"dembark: {message}", file=sys.stderr)
        raise first
    # It is done in this process, where nothing looks at `cancel`.
    with interruptible(*ENDING):
        return measure_series(out, one.runs[0].case.name, {run.folder_name: run.inputs for run in one.runs})


def refuse_foreign(one: Series, out: Path) -> None:
    """DembarkError when `out` holds something else than results of these runs, so that nothing is replaced by accident."""
    wanted = {run.folder_name: run.inputs for run in one.runs}
    for path in sorted(out.glob(f"replica-*/{RECORD}")) if out.is_dir() else []:
        record: dict[str, Any] = read_json(path) or {}
        if path.parent.name not in wanted:
            raise DembarkError(f"{path.parent} is one replica more than asked for", "", "choose another --out, or --force")
        if wanted[path.parent.name] != record.get("inputs"):
            raise DembarkError(f"{path.parent} holds a result of other inputs", "",
                               "choose another --out, or --force to replace it when the new run is finished")
    if out.exists() and (not out.is_dir() or (any(out.iterdir()) and not any(out.glob("replica-*")) and not _ours(out))):
        raise DembarkError(f"--out {out} is not empty and holds no results", "", "choose a new folder")


def _ours(out: Path) -> bool:
    return all(path.name in ("failed", "superseded", METRICS) or path.name.startswith(".replica-") for path in out.iterdir())
