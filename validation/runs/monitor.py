"""How far the runs are: a live table in a terminal, otherwise one plain line an event and every ten seconds a run."""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.table import Table

from dembark.common.units import duration
from dembark.validation.results import State

INTERVAL = 10.0
_COLOURS = {"running": "cyan", "finished": "green", "failed": "bold red", "stopped": "yellow", "waiting": "dim"}


def describe(state: State) -> str:  # noqa: PLR0911 - one return for each state
    """One plain line about a run."""
    took = duration(state.took)
    match state.state:
        case "running" if state.steps:
            eta = "" if state.left is None else f", about {duration(state.left)} left"
            simulated = f"{state.step * state.time_step:.4g}/{state.steps * state.time_step:.4g} s simulated"
            return f"{state.name}: step {state.step}/{state.steps} ({100 * state.step // state.steps} %), {simulated}{eta}"
        case "running" if state.attempt > 1:
            return f"{state.name}: attempt {state.attempt}, resumes at step {state.resumed_from}"
        case "running":
            return f"{state.name}: started"
        case "finished":
            return f"{state.name}: finished in {took}{f' in attempt {state.attempt}' if state.attempt > 1 else ''}"
        case "stopped":
            return f"{state.name}: stopped{f' after {took}' if state.ended else ''}: {state.message}"
        case "failed":
            return f"{state.name}: FAILED after {took}: {state.message}"
    return f"{state.name}: {state.state}"


def headline(states: Sequence[State]) -> str:
    """`3 of 12 done, 2 running, 6 waiting, 1 failed`; a stopped run waits to be started again."""
    count = Counter("waiting" if state.state == "stopped" else state.state for state in states)
    return f"{count['finished']} of {len(states)} done, {count['running']} running, {count['waiting']} waiting, {count['failed']} failed"


def state_table(states: Sequence[State], rows: int | None = None) -> Table:
    """One row a run: state, share of its steps, simulated time, and the time left or taken; at most `rows` of them.

    When there are more, those are left out first that say least: finished, then waiting ones.
    """
    table = Table("run", "state", "step", "simulated", "left or took", title=headline(states), title_justify="left", box=None,
                  pad_edge=False)
    shown = list(states)
    if rows is not None and len(states) > rows:
        order = ("running", "failed", "stopped", "waiting", "finished")
        first = sorted(range(len(states)), key=lambda index: (order.index(states[index].state), -states[index].ended, index))
        shown = [states[index] for index in sorted(first[:max(1, rows - 1)])]
    for state in shown:
        # The last step that an engine prints need not be the last one that it does.
        done = state.steps if state.state == "finished" else state.step
        step = f"{100 * done // state.steps} % of {state.steps}" if state.steps else ""
        simulated = f"{done * state.time_step:.3g} s of {state.steps * state.time_step:.3g} s" if state.steps else ""
        left = duration(state.left) if state.left is not None else duration(state.took) if state.ended else ""
        word = f"{state.state}, attempt {state.attempt}" if state.attempt > 1 else state.state
        table.add_row(state.name, f"[{_COLOURS[state.state]}]{word}[/]", step, simulated, left)
    if len(shown) < len(states):
        table.add_row(f"... and {len(states) - len(shown)} more")
    return table


class Monitor:
    """Shows what `states` returns while the `with` block runs: a live table in a terminal, else lines; `log` gets the lines always.

    `event` is to be called with each state that changes.

    `reasons`: lines of failed and stopped runs say why, which whoever asked may rather do itself.
    """

    def __init__(self, states: Callable[[], list[State]], console: Console | None = None, interval: float = INTERVAL,
                 log: Path | None = None, reasons: bool = True) -> None:
        self._states, self._interval, self._log, self._reasons = states, interval, log, reasons
        self._console = console or Console(file=sys.stderr, highlight=False, soft_wrap=True)
        self._end = threading.Event()
        self._shown: dict[str, tuple[State, float]] = {}
        self._live: Live | None = None
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live = Live(get_renderable=self._table, console=self._console, refresh_per_second=2)
            self._live.start()
        for state in self._states():
            if state.state == "finished" and state.kind == "run":
                self._print(f"{state.name}: already finished; reusing", state)
            self._shown[state.name] = (state, time.monotonic())
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._end.set()
        self._thread.join()
        if self._live:
            self._live.stop()

    def _watch(self) -> None:
        while not self._end.wait(min(0.5, self._interval)):
            self._update()

    def event(self, state: State) -> None:
        """Print that `state` has changed."""
        self._shown[state.name] = (state, time.monotonic())
        if state.state != "waiting":
            self._print(describe(replace(state, steps=0)), state)

    def _update(self) -> None:
        now = time.monotonic()
        for state in self._states():
            before, when = self._shown.setdefault(state.name, (state, now))
            if state.state == "running" and state.attempt > max(1, before.attempt):
                self._print(describe(replace(state, steps=0)), state)
            elif state.state == "running" and state.steps and now - when >= self._interval:
                self._print(describe(state), state, event=False)
            else:
                continue
            self._shown[state.name] = (state, now)

    def _print(self, line: str, state: State, event: bool = True) -> None:
        if not self._live:
            shown = line if self._reasons else line.removesuffix(f": {state.message}")
            self._console.print(f"dembark: {shown}", markup=False)
        if event and self._log:
            try:
                with self._log.open("a", encoding="utf-8") as file:
                    file.write(f"{datetime.now().astimezone().isoformat(timespec='seconds')} {line}\n")
            except OSError:
                self._log = None  # a log is never worth a run: a full disk is reported by what needs the space

    def _table(self) -> Table:
        return state_table(self._states(), max(3, self._console.height - 4))
