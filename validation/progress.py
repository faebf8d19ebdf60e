"""How far the runs are: a live table in a terminal, otherwise one plain line an event and every ten seconds a run."""

from __future__ import annotations

import json
import re
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.table import Table

from dembark.common.files import read_json

INTERVAL = 10.0
_COLOURS = {"running": "cyan", "finished": "green", "kept": "green", "failed": "bold red", "stopped": "yellow", "waiting": "dim"}
_STEPS = re.compile(r"dembark: steps (\d+) time_step (\S+)")
_STEP = re.compile(r"\s*(\d+)\s+[-+]?(?:\d|\.\d|nan|inf)")


@dataclass(frozen=True)
class State:
    """State of a run: waiting, running, finished, kept (nothing to do), failed, or stopped from outside, to be started again; times in s,
    `started` as seconds since 1970.

    `attempt` counts the starts of a run that was ended from outside, `resumed_from` is the step where the present one went on.
    """

    name: str
    state: str = "waiting"
    step: int = 0
    steps: int = 0
    time_step: float = 0.0
    started: float = 0.0
    ended: float = 0.0
    message: str = ""
    attempt: int = 1
    resumed_from: int = 0

    @property
    def left(self) -> float | None:
        """Expected remaining seconds; None before there is a rate to tell it from."""
        done = self.step - self.resumed_from
        if self.state != "running" or done <= 0 or not self.steps:
            return None
        return (time.time() - self.started) * (self.steps - self.step) / done


class OutputParser:
    """Reads an engine's output: the line `dembark: steps N time_step dt`, lines that begin with the step, `dembark: finished`."""

    def __init__(self) -> None:
        self.steps, self.step, self.time_step, self.finished = 0, 0, 0.0, False
        self._unfinished = b""

    def hear(self, chunk: bytes) -> bool:
        """Take some bytes of the output, lines or parts of them; True when they brought news."""
        *lines, self._unfinished = (self._unfinished + chunk).split(b"\n")
        return any([self.feed(line.decode(errors="replace")) for line in lines])

    def feed(self, line: str) -> bool:
        """Take one line; True when it brought news."""
        announced = _STEPS.match(line)
        if announced:
            self.steps, self.time_step = int(announced.group(1)), float(announced.group(2))
            return True
        if line.startswith("dembark: finished"):
            self.finished = True
            return True
        step = _STEP.match(line)
        if step and self.steps and self.step < int(step.group(1)) <= self.steps:
            self.step = int(step.group(1))
            return True
        return False


def duration(seconds: float) -> str:
    """`45 s`, `3 min 20 s`, `2 h 5 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


class Board:
    """The states of runs in this process; safe to use from several threads."""

    def __init__(self, names: Sequence[str] = ()) -> None:
        self._states = {name: State(name) for name in names}
        self._guard = threading.Lock()

    def post(self, name: str, **news: str | int | float) -> None:
        """Change the state of run `name`."""
        with self._guard:
            self._states[name] = replace(self._states.get(name, State(name)), **news)  # type: ignore[arg-type]

    def states(self) -> list[State]:
        """All states, in the order in which the runs became known."""
        with self._guard:
            return list(self._states.values())


class FileBoard(Board):
    """A board whose news also go to one small file a run in `folder`, for a process that watches the jobs of a workflow."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder
        self._written = 0.0

    def post(self, name: str, **news: str | int | float) -> None:
        super().post(name, **news)
        if not news.keys() & {"state", "attempt"} and time.monotonic() - self._written < 1.0:
            return
        self._written = time.monotonic()
        try:
            path = self._folder / (name.replace(" ", "-") + ".json")
            part = path.with_suffix(".part")
            part.write_text(json.dumps(asdict(self._states[name])), encoding="utf-8")
            part.replace(path)
        except OSError:
            # Telling the progress is never worth a run: a full disk is reported by what needs the space.
            pass


def watched(folder: Path, names: Sequence[str]) -> Callable[[], list[State]]:
    """A function that gives the states of the runs `names` as their jobs wrote them to `folder`; what did not change is not read again."""
    paths = {name: folder / (name.replace(" ", "-") + ".json") for name in names}
    known: dict[str, tuple[int, State]] = {}

    def state(name: str) -> State:
        try:
            changed = paths[name].stat().st_mtime_ns
        except OSError:
            return State(name)
        if name not in known or known[name][0] != changed:
            content = read_json(paths[name])
            known[name] = (changed, State(**content) if content else State(name))
        return known[name][1]

    return lambda: [state(name) for name in names]


def describe(state: State) -> str:
    """One plain line about a run."""
    took = duration(state.ended - state.started)
    match state.state:
        case "running" if state.steps:
            eta = "" if state.left is None else f", about {duration(state.left)} left"
            simulated = f"{state.step * state.time_step:.4g}/{state.steps * state.time_step:.4g} s simulated"
            return f"{state.name}: step {state.step}/{state.steps} ({100 * state.step // state.steps} %), {simulated}{eta}"
        case "running" if state.attempt > 1:
            return f"{state.name}: attempt {state.attempt}, goes on at step {state.resumed_from}"
        case "running":
            return f"{state.name}: started"
        case "finished":
            return f"{state.name}: finished in {took}{f' in attempt {state.attempt}' if state.attempt > 1 else ''}"
        case "kept":
            return f"{state.name}: already finished; reusing"
        case "stopped":
            return f"{state.name}: stopped after {took}: {state.message}"
        case "failed":
            return f"{state.name}: FAILED after {took}: {state.message}"
    return f"{state.name}: {state.state}"


def headline(states: Sequence[State]) -> str:
    """`3 of 12 done, 2 running, 6 waiting, 1 failed`; a stopped run waits to be started again."""
    same = {"kept": "finished", "stopped": "waiting"}
    count = Counter(same.get(state.state, state.state) for state in states)
    return f"{count['finished']} of {len(states)} done, {count['running']} running, {count['waiting']} waiting, {count['failed']} failed"


def state_table(states: Sequence[State], rows: int | None = None) -> Table:
    """One row a run: state, share of its steps, simulated time, and the time left or taken; at most `rows` of them.

    When there are more, those are left out first that say least: finished, then waiting ones.
    """
    table = Table("run", "state", "step", "simulated", "left or took", title=headline(states), title_justify="left", box=None,
                  pad_edge=False)
    shown = list(states)
    if rows is not None and len(states) > rows:
        order = ("running", "failed", "stopped", "waiting", "finished", "kept")
        first = sorted(range(len(states)), key=lambda index: (order.index(states[index].state), -states[index].ended, index))
        shown = [states[index] for index in sorted(first[:max(1, rows - 1)])]
    for state in shown:
        # The last step that an engine prints need not be the last one that it does.
        done = state.steps if state.state == "finished" else state.step
        step = f"{100 * done // state.steps} % of {state.steps}" if state.steps else ""
        simulated = f"{done * state.time_step:.3g} s of {state.steps * state.time_step:.3g} s" if state.steps else ""
        left = duration(state.left) if state.left is not None else duration(state.ended - state.started) if state.ended else ""
        word = f"{state.state}, attempt {state.attempt}" if state.attempt > 1 else state.state
        table.add_row(state.name, f"[{_COLOURS[state.state]}]{word}[/]", step, simulated, left)
    if len(shown) < len(states):
        table.add_row(f"... and {len(states) - len(shown)} more")
    return table


class Monitor:
    """Shows what `states` returns while the `with` block runs: a live table in a terminal, else lines; `log` gets the lines always.

    `reasons`: lines of failed and stopped runs say why, which whoever asked may rather do itself.
    """

    def __init__(self, states: Callable[[], list[State]], console: Console | None = None, interval: float = INTERVAL,
                 log: Path | None = None, reasons: bool = True) -> None:
        self._reasons = reasons
        self._states = states
        self._console = console or Console(file=sys.stderr, highlight=False, soft_wrap=True)
        self._interval = interval
        self._log = log
        self._end = threading.Event()
        self._told: dict[str, tuple[State, float]] = {}
        self._live: Live | None = None
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Monitor:
        if self._console.is_terminal:
            self._live = Live(get_renderable=self._table, console=self._console, refresh_per_second=2)
            self._live.start()
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._end.set()
        self._thread.join()
        if self._live:
            self._live.stop()
        self._tell()

    def _watch(self) -> None:
        while not self._end.wait(min(0.5, self._interval)):
            self._tell()

    def _tell(self) -> None:
        now = time.monotonic()
        for state in self._states():
            before, when = self._told.get(state.name, (State(state.name), 0.0))
            if (state.state, state.attempt, state.message) != (before.state, before.attempt, before.message):
                event, line = True, describe(replace(state, steps=0))
            elif state.state == "running" and state.steps and now - when >= self._interval:
                event, line = False, describe(state)
            else:
                continue
            if not self._live:
                shown = line if self._reasons else line.removesuffix(f": {state.message}")
                self._console.print(f"dembark: {shown}", markup=False)
            if event:
                self._note(line)
            self._told[state.name] = (state, now)

    def _note(self, line: str) -> None:
        if self._log:
            try:
                with self._log.open("a", encoding="utf-8") as file:
                    file.write(f"{datetime.now().astimezone().isoformat(timespec='seconds')} {line}\n")
            except OSError:
                self._log = None  # as for the board: a full disk is reported by what needs the space

    def _table(self) -> Table:
        return state_table(self._states(), max(3, self._console.height - 4))
