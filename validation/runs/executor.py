"""The executor: runs with the longest first; measurements, studies, comparisons and the report as soon as what they need is there.

A run that fails stops nothing else. One that was ended from outside is started again, up to the plan's number of retries; one that failed
by its own fault is not. Steps work in a few processes that stay, so that what they import is imported once.
"""

from __future__ import annotations

import multiprocessing
import socket
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol

from dembark.common.errors import DembarkError, Interrupted, Killed, RunError
from dembark.common.parallel import prepare_worker
from dembark.validation.runs.plan import RETRIES, Resources, Run
from dembark.validation.runs.simulate import Progress, simulate
from dembark.validation.runs.steps import Step
from dembark.validation.runs.table import Table

_GRACE = 30.0
_LOOK = 0.2


class Backend(Protocol):
    """Where simulations run; `here`: on this machine, whose cores they share with the steps."""

    here: bool

    def fits(self, used: Resources, busy: Sequence[Resources]) -> bool:
        """Whether a run may start beside those that are under way (if `here`, also beside the steps)."""

    def start(self, run: Run, out: Path, used: Resources, progress: Progress) -> Future[object]:
        """Begin with a run; the future raises Killed when it was ended from outside, another DembarkError when it failed.

        `progress` is called with what has changed of the run, `state` among it when that is queued or running.
        """

    def start_step(self, step: Step) -> Future[object] | None:
        """Begin with a step if that is to work elsewhere than in a process of this machine."""

    def close(self) -> None:
        """End or take back what is under way and leave nothing behind; all futures end."""


class Local:
    """Each simulation in an engine process of its own on this machine, attended to by a thread of this process."""

    here = True

    def __init__(self, cores: int, memory: float | None, cancel: threading.Event) -> None:
        self._cores, self._memory, self._cancel = cores, memory, cancel
        self._pool = ThreadPoolExecutor(max(1, cores))

    def fits(self, used: Resources, busy: Sequence[Resources]) -> bool:
        """See Backend; it must not ask for more cores or memory than are left, unless nothing else is under way."""
        memory = sum(one.memory or 0.0 for one in (used, *busy))
        return not busy or (used.cores + sum(one.cores for one in busy) <= self._cores and (self._memory is None or memory <= self._memory))

    def start(self, run: Run, out: Path, used: Resources, progress: Progress) -> Future[object]:
        """See Backend; the run begins when a thread is free."""
        progress(state="running", host=socket.gethostname())
        return self._pool.submit(simulate, run, out, self._cancel, used, progress)

    def start_step(self, step: Step) -> Future[object] | None:
        """See Backend; all steps are left to processes of this machine."""
        return None

    def close(self) -> None:
        """See Backend; it waits for what is under way."""
        self._pool.shutdown()


class Workers:
    """A few processes that work on steps and stay, so that what they import is imported once."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._pool: ProcessPoolExecutor | None = None

    def start(self, step: Step) -> Future[object]:
        """Begin with a step; the future raises BrokenProcessPool when its process, or another one, was killed."""
        try:
            if self._pool is None:
                self._pool = ProcessPoolExecutor(self._count, multiprocessing.get_context("spawn"), prepare_worker)
            return self._pool.submit(step.call, *step.arguments)
        except BrokenProcessPool:
            self.close()
            return self.start(step)

    def close(self) -> None:
        """End the processes, whatever they are at."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()
            self._pool = None


@dataclass(frozen=True)
class Task:
    """A run, the folder of its series and what it may use."""

    run: Run
    out: Path
    used: Resources

    @property
    def name(self) -> str:
        """That of the run."""
        return self.run.name


@dataclass
class _Work:
    """What is under way, what it uses, and whether it is this machine's."""

    item: Task | Step
    used: Resources
    here: bool


class Executor:
    """Executes what is waiting in `table`: runs in `backend`, at most `retries` times more when they were ended from outside, and steps on
    `cores` cores of this machine.

    `before` is called before the report begins, `after` with each other step that was made.
    """

    def __init__(self, table: Table, backend: Backend, cancel: threading.Event, retries: int = RETRIES, cores: int = 1,
                 before: Callable[[], None] = lambda: None, after: Callable[[Step], None] = lambda _: None) -> None:
        self._table, self._backend, self._cancel, self._retries, self._cores = table, backend, cancel, retries, max(1, cores)
        self._before, self._after = before, after
        self._workers = Workers(self._cores)
        self._under_way: dict[Future[object], _Work] = {}
        self._kills: Counter[str] = Counter()
        # Of all that came to no good end, in the order of its end.
        self.errors: dict[str, DembarkError] = {}

    def execute(self, tasks: Sequence[Task], steps: Sequence[Step]) -> None:
        """All `tasks` that are not finished, in their order, and all `steps` that are not up to date; Interrupted when cancelled."""
        self._tasks = [task for task in tasks if self._table.state(task.name).state != "finished"]
        self._steps = list(steps)
        self._open = {one.name for one in self._tasks} | {one.name for one in self._steps}
        try:
            while not self._cancel.is_set():
                before = len(self._open)
                self._start()
                # What is up to date makes others ready without anything being under way.
                if not self._under_way and len(self._open) == before:
                    break
                for future in wait(self._under_way, timeout=_LOOK, return_when=FIRST_COMPLETED).done:
                    self._end(future)
        except BaseException:
            self._cancel.set()
            raise
        finally:
            interrupted = self._cancel.is_set()
            self._workers.close()
            self._backend.close()
            for future in wait(self._under_way, timeout=_GRACE).done:
                self._end(future, again=False)
        if interrupted:
            raise Interrupted("interrupted", "finished runs are kept and will not be repeated")

    def _start(self) -> None:
        # Steps first: they are short, and their numbers are what people wait for.
        for step in [one for one in self._steps if self._open.isdisjoint(one.needs)]:
            if not self._room():
                break
            self._steps.remove(step)
            self._start_step(step)
        for task in [*self._tasks]:
            busy = [work.used for work in self._under_way.values() if work.here == self._backend.here]
            if self._backend.fits(task.used, busy):
                self._tasks.remove(task)
                future = self._backend.start(task.run, task.out, task.used, partial(self._progress, task.name))
                self._under_way[future] = _Work(task, task.used, self._backend.here)

    def _room(self) -> bool:
        """Whether a core of this machine is free for a step."""
        busy = [work.used.cores for work in self._under_way.values() if work.here]
        return not busy or sum(busy) < self._cores

    def _start_step(self, step: Step) -> None:
        if step.kind == "report":
            self._before()
        finished = self._table.state(step.name).state == "finished"
        if step.up_to_date():
            if not finished:
                self._table.transition(step.name, "finished")
            self._open.discard(step.name)
            return
        if finished:
            self._table.transition(step.name, "waiting")
        self._table.transition(step.name, "running", host=socket.gethostname())
        elsewhere = self._backend.start_step(step)
        self._under_way[elsewhere or self._workers.start(step)] = _Work(step, Resources(), elsewhere is None)

    def _progress(self, name: str, state: str = "", **facts: object) -> None:
        if state and state != self._table.state(name).state:
            self._table.transition(name, state, **facts)
        elif facts:
            self._table.note(name, **facts)

    def _end(self, future: Future[object], again: bool = True) -> None:
        item = self._under_way.pop(future).item
        try:
            future.result()
        except (Killed, Interrupted, BrokenProcessPool, CancelledError) as error:
            self._stopped(item, error, again and not self._cancel.is_set())
        except DembarkError as error:
            self._failed(item, error)
        else:
            self._table.transition(item.name, "finished")
            self._open.discard(item.name)
            if isinstance(item, Step):
                self._after(item)

    def _stopped(self, item: Task | Step, error: BaseException, again: bool) -> None:
        told = error if isinstance(error, DembarkError) else RunError(f"{item.name} was ended from outside")
        self._kills[item.name] += 1
        if again and self._kills[item.name] > self._retries:
            self._failed(item, told)
            return
        self._table.transition(item.name, "stopped", message=_without_name(item, told))
        if not again:
            self.errors[item.name] = told
            return
        self._table.transition(item.name, "waiting")
        if isinstance(item, Task):
            self._tasks.insert(0, item)
        else:
            self._steps.insert(0, item)

    def _failed(self, item: Task | Step, error: DembarkError) -> None:
        self.errors[item.name] = error
        self._table.transition(item.name, "failed", message=_without_name(item, error))
        self._open.discard(item.name)


def _without_name(item: Task | Step, error: DembarkError) -> str:
    return str(error).removeprefix(f"{item.name} failed, ")
