"""Runs as jobs of a site's scheduler: submitted, looked after, taken back; nothing is left in its queue or submitted twice."""

from __future__ import annotations

import hashlib
import re
import shlex
import sys
import threading
import time
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path

from dembark.common.errors import DembarkError, Interrupted, Killed, RunError
from dembark.common.files import read_json, write_whole
from dembark.validation.case.folders import variables
from dembark.validation.runs.plan import Plan, Resources, Run, finished
from dembark.validation.runs.simulate import Progress, no_progress
from dembark.validation.runs.site import Row, Site, word
from dembark.validation.runs.steps import Step

# How long a scheduler may be silent before that is told (s).
_SILENCE = 120.0
_MOST_NUMBERS = 500


def prefix(results: Path) -> str:
    """What the names of all jobs of the folder `results` begin with; the same after every restart, at most 42 characters."""
    folder = results.resolve()
    readable = re.sub(r"[^A-Za-z0-9]+", "-", folder.name)[:20].strip("-")
    return f"dembark_{readable}_{hashlib.sha256(str(folder).encode()).hexdigest()[:12]}_"


@dataclass(eq=False)
class _Job:
    title: str
    name: str
    used: Resources
    words: list[str]
    report: Path
    done: Callable[[], bool]
    progress: Progress
    number: str = ""
    gone: float | None = None
    future: Future[object] = field(default_factory=Future)


class Queue:
    """The scheduler of `site` as a backend; `known` gives the number of the job that a run had when its submitter was killed.

    A job of an earlier start that lives is adopted, not submitted again; those of runs that are no longer `planned` are cancelled. `say`
    gets lines for people.
    """

    here = False

    def __init__(self, site: Site, results: Path, plan: Plan, say: Callable[[str], None], limit: int | None = None,
                 known: Callable[[str], str] = lambda _: "") -> None:
        self._site, self._results, self._plan, self._say, self._known = site, results, plan, say, known
        self._limit = limit or site.jobs["at_a_time"]
        self._prefix = prefix(results)
        self._planned = {self._name(run.inputs) for one in plan.series for run in one.runs}
        self._jobs: list[_Job] = []
        self._told: set[str] = set()
        self._looked = False
        self._answered = time.monotonic()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        (results / ".jobs").mkdir(parents=True, exist_ok=True)
        self._thread.start()

    def _name(self, inputs: str) -> str:
        return self._prefix + inputs[:8]

    def fits(self, used: Resources, busy: Sequence[Resources]) -> bool:
        """See Backend; the scheduler looks after cores and memory, only the number of jobs is limited here."""
        return len(busy) < self._limit

    def start(self, run: Run, out: Path, used: Resources, progress: Progress) -> Future[object]:
        """See Backend; the run is submitted as a job."""
        interval = [] if used.restart_interval is None else ["--restart-interval", str(used.restart_interval)]
        words = ["--inputs", run.inputs, "--ranks", str(used.ranks), "--threads", str(used.threads), *interval]
        report = out / f".{run.folder_name}.job.json"
        job = _Job(run.name, self._name(run.inputs), used, words, report, lambda: finished(out / run.folder_name, run), progress)
        return self._add(job, out)

    def start_step(self, step: Step) -> Future[object] | None:
        """Begin with a measurement where the plan wants a job for it; None for all other steps."""
        if step.kind != "measure" or self._plan.measure is None:
            return None
        out = self._results / step.place
        job = _Job(step.name, self._name(hashlib.sha256(step.name.encode()).hexdigest()), self._plan.measure, [], out / ".measure.job.json",
                   lambda: False, no_progress)
        return self._add(job, out)

    def _add(self, job: _Job, out: Path) -> Future[object]:
        out.mkdir(parents=True, exist_ok=True)
        place = ["--place", str(out.relative_to(self._results)), "--results", str(self._results), "--report", str(job.report)]
        job.words = [*self._plan.words, *place, *job.words]
        job.progress(state="queued")
        self._jobs.append(job)
        return job.future

    def close(self) -> None:
        """Take back what is still in the queue."""
        self._end.set()
        self._thread.join()
        try:
            rows = self._site.rows(self._prefix)
            mine = {job.number for job in self._jobs}
            left = [row.job for row in rows or () if self._site.lives(row) and (row.name or row.job in mine)]
            if rows is None:
                self._say("jobs may be left in the queue: the scheduler does not answer")
            elif left:
                self._cancel(left)
                self._say(f"{len(left)} jobs were still in the queue and are cancelled")
        except DembarkError as error:
            self._say(f"jobs may be left in the queue: {error}")
        for job in self._jobs:
            job.future.set_exception(Interrupted(f"{job.title} was interrupted"))

    def _watch(self) -> None:
        while not self._end.is_set():
            try:
                self._look()
            except DembarkError as error:
                self._once(str(error))
            self._end.wait(self._site.jobs["poll"])

    def _once(self, line: str) -> None:
        if line not in self._told:
            self._told.add(line)
            self._say(line)

    def _look(self) -> None:
        rows = self._site.rows(self._prefix)
        if rows is None:
            # A scheduler that is away for a while is no reason to give up: jobs go on without it.
            if time.monotonic() - self._answered > _SILENCE:
                self._once("the scheduler does not answer; waiting for it")
            return
        self._answered = time.monotonic()
        by_number = {row.job: row for row in rows}
        alive = {row.name: row for row in rows if row.name and self._site.lives(row)}
        if not self._looked:
            self._looked = True
            self._take_over(alive.values())
        for job in [*self._jobs]:
            if job.number:
                self._attend(job, by_number.get(job.number))
            else:
                self._submit(job, alive.get(job.name) or by_number.get(self._known(job.title)))
            if job.future.done():
                self._jobs.remove(job)

    def _take_over(self, alive: Collection[Row]) -> None:
        """Deal with jobs of an earlier start: those of runs that are planned go on and are found by their names."""
        strange = [row.job for row in alive if row.name not in self._planned]
        mine = [row.job for row in alive if row.name in self._planned]
        if strange:
            self._cancel(strange)
            self._say(f"{len(strange)} jobs of an earlier start cancelled")
        if mine:
            self._say(f"waiting for {len(mine)} jobs of an earlier start: {', '.join(sorted(mine)[:10])}")

    def _cancel(self, numbers: Sequence[str]) -> None:
        for first in range(0, len(numbers), _MOST_NUMBERS):
            # One that ended in the meantime is no failure.
            self._site.ask("cancel", numbers[first:first + _MOST_NUMBERS])

    def _submit(self, job: _Job, earlier: Row | None) -> None:
        if earlier is not None and self._site.lives(earlier):
            job.number = earlier.job
            job.progress(job=job.number)
            return
        job.report.unlink(missing_ok=True)
        script, log = self._results / ".jobs" / f"{job.name}.sh", self._results / ".jobs" / f"{job.name}.log"
        call = shlex.join([sys.executable, "-m", "dembark.validation.runs.job", *job.words])
        # Sites may start jobs without the environment of the submitter.
        cases = "".join(f"export {name}={shlex.quote(value)}\n" for name, value in variables().items())
        write_whole(script, f"#!/bin/bash\n{cases}{self._site.preamble}\nexec {call}\n".encode())
        script.chmod(0o755)
        done = self._site.ask("submit", name=job.name, title=shlex.quote(job.title.replace(" ", "_")), log=log, script=script,
                              **self._site.asked(job.used))
        number = None if done.returncode else self._site.number(done.stdout)
        if number is not None:
            job.number = number
            job.progress(job=number)
        elif not self._site.transient(done.stderr + done.stdout):
            job.future.set_exception(RunError(f"{job.title} failed", "its job was refused", word(done)))

    def _attend(self, job: _Job, row: Row | None) -> None:
        # Empty before the job has begun.
        told = read_json(job.report) or {}
        facts = {key: told[key] for key in ("step", "steps", "time_step", "attempt", "resumed_from", "host") if key in told}
        if told.get("state") == "running":
            job.progress(state="running")
        if facts and told.get("state") == "running":
            job.progress(**facts)
        if row is not None and self._site.lives(row):
            if self._site.hopeless(row):
                self._once(f"job {row.job} ({job.title}) will not start: {row.reason}; cancel it, or change what keeps it")
            job.gone = None
            return
        # The files tell how it ended; those of a node may be seen late.
        if job.done() or told.get("state") == "finished":
            job.progress(**facts)
            job.future.set_result(None)
        elif told.get("state") == "failed":
            job.future.set_exception(RunError(told["message"]))
        elif told.get("state") == "stopped":
            job.future.set_exception(Killed(told["message"]))
        elif job.gone is None:
            job.gone = time.monotonic()
        elif time.monotonic() - job.gone > self._site.jobs["latency"]:
            how = f"as {row.state}" if row else "and is forgotten by the scheduler"
            log = self._results / ".jobs" / f"{job.name}.log"
            job.future.set_exception(Killed(f"{job.title} failed", f"its job {job.number} ended {how}", f"see {log}"))
