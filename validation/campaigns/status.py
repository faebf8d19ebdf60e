"""How far a campaign is, told from its folder alone: neither engines nor the process that submitted it are needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from dembark.common.errors import DembarkError
from dembark.common.files import read_json
from dembark.common.lock import held
from dembark.validation.campaigns import folder
from dembark.validation.campaigns.estimate import wall_clock
from dembark.validation.judge.tally import Tally, of_folder
from dembark.validation.runs import table
from dembark.validation.runs.progress import headline
from dembark.validation.runs.table import State


@dataclass(frozen=True)
class Status:
    """State of a campaign: its runs in the order of the plan, whether a process runs it now, and the time left (s, None = not known)."""

    name: str
    running: bool
    states: tuple[State, ...]
    left: float | None
    measured: int
    tally: Tally
    report: Path | None

    @property
    def headline(self) -> str:
        """One line."""
        return f"{self.name}: {headline(self.states)}" + ("" if self.running or self.complete else "; nobody runs it now")

    @property
    def complete(self) -> bool:
        """Whether every run is finished."""
        return all(state.state == "finished" for state in self.states)


def look(results: Path) -> Status:
    """The state of the campaign in `results`; DembarkError when that is no campaign's folder."""
    folder.own_file(results)
    found = table.read(results)
    if not found:
        raise DembarkError(f"the campaign in {results} has not been started", "", f"start it with 'dembark resume {results}'")
    running = held(results / folder.LOCK)
    states = tuple(_as_the_files_say(results, state, running) for state in found)
    report = results / "report.html"
    measured = {Path(state.folder).parent for state in states if (results / state.folder).with_name("metrics.json").is_file()}
    return Status(folder.read_name(results), running, states, time_left(states), len(measured), of_folder(results),
                  report if report.is_file() else None)


def _as_the_files_say(results: Path, state: State, running: bool) -> State:
    """A result counts before what the table says of it, and nothing runs when nobody runs the campaign."""
    record = read_json(results / state.folder / "run.json")
    if record is not None and record.get("inputs") == state.inputs:
        return replace(state, state="finished")
    gone = state.state == "finished" or (state.state in table.UNDER_WAY and not running)
    return replace(state, state="waiting", step=0) if gone else state


def time_left(states: Sequence[State]) -> float | None:
    """Seconds until all runs are done if as many go on at a time as now; None when nothing runs or a run's cost is not known.

    A waiting run takes its estimate, times what the finished ones took over theirs.
    """
    took = [(state.ended - state.began, state.estimate) for state in states
            if state.state == "finished" and state.estimate and state.ended > state.began and not state.resumed_from]
    factor = sum(real for real, _ in took) / sum(wall for _, wall in took) if took else 1.0
    left = []
    for state in states:
        if state.state in ("finished", "failed"):
            continue
        seconds = state.left if state.left is not None else state.estimate * factor if state.estimate else None
        if seconds is None:
            return None
        left.append((seconds, 1))
    at_once = sum(state.state == "running" for state in states)
    if not left:
        return 0.0
    return wall_clock(left, at_once) if at_once else None
