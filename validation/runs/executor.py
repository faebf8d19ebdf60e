"""The executor: runs with the longest first; measurements, studies, comparisons and the report as soon as what they need is there.

A run that fails stops nothing else. One that was ended from outside is started again, up to a number of retries; one that failed by its own
fault is not. The states are in memory only: what is finished is decided by the files, and found again from them by the next start.
"""

from __future__ import annotations

import multiprocessing
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError, Interrupted, Killed, RunError
from dembark.common.parallel import prepare_worker
from dembark.validation.campaigns.plan import RETRIES, Resources, Run, is_finished
from dembark.validation.results import State

from .simulate import simulate
from .steps import Step

_GRACE = 30.0
_LOOK = 0.2


@dataclass(frozen=True)
class Task:
    """A run, the folder of its series, what it may use, and its expected wall time (s)."""

    run: Run
    out: Path
    used: Resources
    estimate: float | None = None

    @property
    def name(self) -> str:
        """That of the run."""
        return self.run.name


class States:
    """The states of runs and steps, in the order in which they were added; `listener` gets each state that changes. Safe to use from
    several threads."""

    def __init__(self, tasks: Iterable[Task], steps: Iterable[Step] = ()) -> None:
        self._states = {task.name: State(task.name, "finished" if is_finished(task.out / task.run.folder_name, task.run) else "waiting",
                                         inputs=task.run.inputs, estimate=task.estimate) for task in tasks}
        self._states |= {step.name: State(step.name, kind=step.kind) for step in steps}
        self._guard = threading.RLock()
        self.listener: Callable[[State], None] = lambda _: None

    def __getitem__(self, name: str) -> State:
        return self._states[name]

    def all(self) -> list[State]:
        """All states."""
        with self._guard:
            return list(self._states.values())

    def change(self, name: str, **facts: object) -> None:
        """Change fields of the state called `name`; with a new `state` also its times."""
        with self._guard:
            before = self._states[name]
            changed = facts.get("state", before.state) != before.state
            if changed and facts["state"] == "running":
                facts = {"began": time.time(), "ended": 0.0, "message": "", "step": 0, **facts}
            elif changed and before.state == "running":
                facts = {"ended": time.time(), **facts}
            after = self._states[name] = replace(before, **facts)  # type: ignore[arg-type]
        if changed:
            self.listener(after)


class Executor:
    """Runs on `cores` cores and `memory` (bytes; None: not looked at) of this machine, at most `retries` times more when they were ended
    from outside, each engine attended to by a thread; steps in processes on the cores that are free."""

    def __init__(self, states: States, cancel: threading.Event, cores: int, memory: float | None = None, retries: int = RETRIES) -> None:
        self._states, self._cancel, self._cores, self._memory, self._retries = states, cancel, max(1, cores), memory, retries
        self._threads = ThreadPoolExecutor(self._cores)
        self._processes: ProcessPoolExecutor | None = None
        self._under_way: dict[Future[Any], Task | Step] = {}
        self._kills: Counter[str] = Counter()
        # Of all that came to no good end, in the order of its end.
        self.errors: dict[str, DembarkError] = {}

    def execute(self, tasks: Sequence[Task], steps: Sequence[Step]) -> None:
        """All `tasks` that are not finished, in their order, and all `steps` that are not up to date; Interrupted when cancelled."""
        self._tasks = [task for task in tasks if self._states[task.name].state != "finished"]
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
            self._end_processes()
            self._threads.shutdown()
            for future in wait(self._under_way, timeout=_GRACE).done:
                self._end(future)
        if interrupted:
            raise Interrupted("interrupted", "finished runs are kept and will not be repeated")

    def _start(self) -> None:
        # Steps first: they are short, and their numbers are what people wait for.
        for step in [one for one in self._steps if self._open.isdisjoint(one.needs)]:
            try:
                done = step.up_to_date()
            except Exception as error:  # noqa: BLE001 - a file that is being replaced must not end the runs under way
                self._steps.remove(step)
                self._failed(step, _in_one_line(step, error))
                continue
            if done:
                self._open.discard(step.name)
                self._steps.remove(step)
            elif self._fits(Resources()):
                self._steps.remove(step)
                self._states.change(step.name, state="running")
                self._under_way[self._start_step(step)] = step
        for task in [one for one in self._tasks if self._fits(one.used)]:
            if self._fits(task.used):
                self._tasks.remove(task)
                self._states.change(task.name, state="running")
                future = self._threads.submit(simulate, task.run, task.out, self._cancel, task.used, partial(self._follow, task.name))
                self._under_way[future] = task

    def _fits(self, used: Resources) -> bool:
        """Whether there are cores and memory for it; one alone is started whatever it needs."""
        busy = [one.used if isinstance(one, Task) else Resources() for one in self._under_way.values()]
        memory = sum(one.memory or 0.0 for one in (used, *busy))
        return not busy or (used.cores + sum(one.cores for one in busy) <= self._cores and (self._memory is None or memory <= self._memory))

    def _follow(self, name: str, **facts: object) -> None:
        # Its end is known here when its future ends.
        self._states.change(name, **{key: value for key, value in facts.items() if key in ("step", "steps", "time_step", "attempt",
                                                                                         "resumed_from")})

    def _start_step(self, step: Step) -> Future[Any]:
        """Begin with a step; the future raises BrokenProcessPool when its process, or another one, was killed."""
        if self._processes is None:
            self._processes = ProcessPoolExecutor(self._cores, multiprocessing.get_context("spawn"), prepare_worker)
        try:
            return self._processes.submit(step.call, *step.arguments)
        except BrokenProcessPool:
            self._end_processes()
            return self._start_step(step)

    def _end_processes(self) -> None:
        if self._processes is not None:
            self._processes.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()
            self._processes = None

    def _end(self, future: Future[Any]) -> None:
        item = self._under_way.pop(future)
        try:
            future.result()
        except (Killed, Interrupted, BrokenProcessPool, CancelledError) as error:
            self._stopped(item, error if isinstance(error, DembarkError) else RunError(f"{item.name} was ended from outside"))
        except Exception as error:  # noqa: BLE001 - one that fails stops no other
            self._failed(item, _in_one_line(item, error))
        else:
            self._states.change(item.name, state="finished")
            self._open.discard(item.name)

    def _stopped(self, item: Task | Step, error: DembarkError) -> None:
        self._kills[item.name] += 1
        if self._cancel.is_set():
            self.errors[item.name] = error
            self._states.change(item.name, state="stopped", message=_reason(item, error))
        elif self._kills[item.name] > self._retries:
            self._failed(item, error)
        else:
            self._states.change(item.name, state="stopped", message=_reason(item, error))
            self._states.change(item.name, state="waiting")
            if isinstance(item, Task):
                self._tasks.insert(0, item)
            else:
                self._steps.insert(0, item)

    def _failed(self, item: Task | Step, error: DembarkError) -> None:
        self.errors[item.name] = error
        self._states.change(item.name, state="failed", message=_reason(item, error))
        self._open.discard(item.name)


def _in_one_line(item: Task | Step, error: Exception) -> DembarkError:
    return error if isinstance(error, DembarkError) else RunError(f"{item.name} failed", f"{type(error).__name__}: {error}")


def _reason(item: Task | Step, error: DembarkError) -> str:
    return str(error).removeprefix(f"{item.name} failed, ")
