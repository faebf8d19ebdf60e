"""From a plan to its results: all runs, measurements and the report in one folder, or the runs of one series in a folder of the user's."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Self

from dembark.common.errors import DembarkError
from dembark.common.files import read_json, write_json
from dembark.common.lock import lock
from dembark.validation.campaigns import expand, store
from dembark.validation.judge.result import METRICS, RUNS, Result
from dembark.validation.judge.tally import Tally, of_folder
from dembark.validation.runs.executor import Backend, Executor, Local, Task
from dembark.validation.runs.plan import Plan, Resources, Series, studies
from dembark.validation.runs.progress import Monitor
from dembark.validation.runs.steps import Step, draw, measure_series, steps
from dembark.validation.runs.table import State, Table, summary

if TYPE_CHECKING:
    from dembark.validation.metrics import Early

LOCK = ".lock"
# Makes the place where a plan's runs work, once its table is there.
Place = Callable[[Table], Backend]


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
    planned, results = expand.plan(profile, None, cases, engines), results_root.resolve() / profile
    count = cores or os.cpu_count() or 1
    with lock(results / LOCK, f"another validation works in {results}"):
        return perform(planned, results, lambda _: Local(count, None, cancel), cancel, count)


def perform(plan: Plan, results: Path, place: Place, cancel: threading.Event, cores: int = 1, log: Path | None = None,
            estimates: Mapping[Path, float | None] | None = None) -> Outcome:
    """Make all runs of `plan` in the folder `results`, measure them and build the report; events also go to the file `log`.

    Runs that finished earlier with the same inputs are kept. A run that fails stops nothing else: the report is built from what
    there is and names it as missing. Interrupted when `cancel` is set. The caller holds the lock of the folder. `estimates`: expected wall
    times (s) by places of series. `cores` of this machine are for the steps, and for the runs if these work here.
    """
    folders = {str(one.place / run.folder_name): run for one in plan.series for run in one.runs}
    tasks = [Task(run, results / one.place, plan.resources.get(one.place, Resources())) for one in plan.series for run in one.runs]
    todo, table, problems = steps(plan, results), Table(results, plan.label), list[str]()
    table.enter(folders, results, {step.name: step.kind for step in todo}, plan.whole)
    if estimates:
        for task in tasks:
            table.note(task.name, estimate=estimates.get(task.out.relative_to(results)))

    def write_summary() -> None:
        write_json(results / RUNS, {**plan.facts, "runs": summary(table.states(), folders)})

    def collect(places: Sequence[Path], whole: bool = False) -> None:
        try:
            store.collect(results, plan.label, places, plan.facts.get("sweeps", ()) if whole else None)
        except DembarkError as error:
            problems.append(str(error))

    def before_report() -> None:
        write_summary()
        collect([*(one.place for one in plan.series), *(one.place for one in studies(plan.series))], plan.whole)

    def after(step: Step) -> None:
        if step.kind in ("measure", "study"):
            collect([step.place])

    def shown() -> list[State]:
        """All runs, and of the steps those that have begun: many need not be done again."""
        return [state for state in table.states() if state.kind == "run" or state.state == "running"]

    write_summary()
    with Monitor(shown, log=log) as monitor:
        table.listener = monitor.event
        executor = Executor(table, place(table), cancel, plan.retries, cores, before_report, after)
        executor.execute(tasks, todo)
    unfinished = [f"{state.name}: {state.message or state.state}" for state in table.runs() if state.state != "finished"]
    made = {step.name for step in todo}
    problems += [str(error) for name, error in executor.errors.items() if name in made]
    problems += [table.problem] if table.problem else []
    report = results / "report.html"
    return Outcome(len(tasks), tuple(unfinished), tuple(dict.fromkeys(problems)), of_folder(results), report if report.is_file() else None,
                   tuple(f"{name}: {why}" for name, why in plan.facts.get("left_out", {}).items()))


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
        raise DembarkError(f"cannot make the folder {out}", error.strerror or str(error)) from None
    cores = jobs * used.cores if jobs else max(used.cores, os.cpu_count() or 1)
    table, folders = Table(), {run.name: run.folder_name for run in one.runs}
    table.enter({run.folder_name: run for run in one.runs}, out, {})
    shown = one.runs[0].case.picture
    rendered = bool(shown) and "cross_section" not in shown
    with _Beside(out, rendered and cores > used.cores * len(one.runs)) as beside:
        # Why a run failed is told once, at the end.
        with Monitor(table.states, reasons=False) as monitor:

            def event(state: State) -> None:
                monitor.event(state)
                if state.state == "running":
                    beside.begin()
                if state.state == "finished":
                    beside.finished(out / folders[state.name], state.name == one.runs[0].name)

            table.listener = event
            executor = Executor(table, Local(cores, None, cancel), cancel, retries=0)
            executor.execute([Task(run, out, used) for run in one.runs], ())
        if executor.errors:
            first, *others = executor.errors.values()
            for message in dict.fromkeys(map(str, others)):
                if message != str(first):
                    print(f"dembark: {message}", file=sys.stderr)
            raise first
        return measure_series(out, one.runs, beside.drawn, beside.early())


class _Beside:
    """What is done in threads while the engines run: the import of what measures and draws, the pictures, and what of each finished replica
    needs no other one. When the block ends by an error, nothing more of it begins and nothing is waited for."""

    def __init__(self, out: Path, warm: bool) -> None:
        """`warm`: the process that renders is started early, for it has something to do and a core to itself."""
        self._out, self._warm, self._reading, self._drawing = out, warm, ThreadPoolExecutor(1), ThreadPoolExecutor(1)
        self._loaded: Future[Early] | None = None
        self._read: list[Future[None]] = []
        self.drawn: Future[list[str]] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        for pool in (self._reading, self._drawing):
            pool.shutdown(wait=kind is None, cancel_futures=True)

    def begin(self) -> Future[Early]:
        """Import, once an engine runs: before that, imports would only hold it up."""
        if self._loaded is None:
            self._loaded = self._reading.submit(_load)
            self._drawing.submit(_load_drawing, self._warm)
        return self._loaded

    def finished(self, folder: Path, first: bool) -> None:
        """The replica in `folder` is finished; the pictures are of the `first` one and need not wait for the others."""
        loaded = self.begin()
        self._read.append(self._reading.submit(lambda: loaded.result().read(folder)))
        if first:
            self.drawn = self._drawing.submit(draw, self._out)

    def early(self) -> Early:
        """What was read, after the last of it."""
        wait(self._read)
        return self.begin().result()


def _load() -> Early:
    """Import what measures."""
    for name in ("scipy.optimize", "scipy.interpolate"):
        import_module(name)
    from dembark.validation.metrics import Early

    return Early()


def _load_drawing(warm: bool) -> None:
    """Import what draws and what writes fields; start the process that renders, which takes a second or two, if that is to be `warm`."""
    if warm:
        from dembark.postproc import render

        render.warm()
    # xarray, which labels fields, imports the last two when it writes its first file.
    for name in ("dembark.postproc.pictures.packings", "dembark.postproc.pictures.sections", "dembark.postproc.output", "pint", "h5netcdf"):
        import_module(name)


def refuse_foreign(one: Series, out: Path) -> None:
    """DembarkError when `out` holds something else than results of these runs, so that nothing is replaced by accident."""
    wanted = {run.folder_name: run.inputs for run in one.runs}
    for path in sorted(out.glob("replica-*/run.json")) if out.is_dir() else []:
        record = read_json(path) or {}
        if wanted.get(path.parent.name) != record.get("inputs"):
            raise DembarkError(f"{path.parent} holds a result of other inputs", "",
                               "choose another --out, or --force to replace it when the new run is finished")
    if out.exists() and (not out.is_dir() or (any(out.iterdir()) and not any(out.glob("replica-*")) and not _ours(out))):
        raise DembarkError(f"--out {out} is not empty and holds no results", "", "choose a new folder")


def _ours(out: Path) -> bool:
    return all(path.name in ("failed", "superseded", METRICS) or path.name.startswith(".replica-") for path in out.iterdir())
