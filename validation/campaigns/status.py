"""How far a campaign is, told from its folder alone: neither engines nor the process that submitted it are needed."""

from __future__ import annotations

import fcntl
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError
from dembark.common.files import read_json
from dembark.validation.campaigns import folder, submit
from dembark.validation.campaigns.estimate import wall_clock
from dembark.validation.jobs import progress_folder
from dembark.validation.judge.tally import Tally, of_folder
from dembark.validation.progress import State, headline, watched


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
        return all(state.state in ("finished", "kept") for state in self.states)


def look(results: Path) -> Status:
    """The state of the campaign in `results`; DembarkError when that is no campaign's folder."""
    folder.own_file(results)
    entries = (read_json(results / "runs.json") or {}).get("runs", [])
    if not entries:
        raise DembarkError(f"the campaign in {results} has not been started", "", f"start it with 'dembark resume {results}'")
    running = _locked(results)
    names = [f"{entry['case']} {entry['variant']} {entry['engine']} {entry['replica']}" for entry in entries]
    told = watched(progress_folder(results), names)()
    states = tuple(_state(results, entry, state, running) for entry, state in zip(entries, told, strict=True))
    report = results / "report.html"
    return Status(folder.read_name(results), running, states, time_left(results, entries, states), len(_measured(results, entries)),
                  of_folder(results), report if report.is_file() else None)


def _locked(results: Path) -> bool:
    """Whether a process holds the campaign's lock; a shared lock for a moment disturbs no other question like this one."""
    try:
        with (results / folder.LOCK).open("r", encoding="utf-8") as handle:
            fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


def _state(results: Path, entry: Mapping[str, Any], state: State, running: bool) -> State:
    """What the run's own record says counts before what its job told, which may have been ended without a word."""
    record = read_json(results / entry["folder"] / "run.json")
    if record is not None and record.get("inputs") == entry["inputs"]:
        return state if state.state in ("finished", "kept") else replace(state, state="kept")
    if state.state == "running" and not running:
        return replace(state, state="waiting")
    if state.state in ("finished", "kept"):
        return replace(state, state="waiting", step=0)
    if state.state == "waiting" and entry["state"] == "failed":
        return replace(state, state="failed", message=entry["message"])
    return state


def time_left(results: Path, entries: Sequence[Mapping[str, Any]], states: Sequence[State]) -> float | None:
    """Seconds until all runs are done if as many go on at a time as now; None when nothing runs or a run's cost is not known.

    A waiting run takes its estimate, times what the finished ones took over theirs.
    """
    costs = submit.remembered(results)
    walls = [costs.get(str(Path(entry["folder"]).parent), {}).get("wall_time") for entry in entries]
    took = [(state.ended - state.started, wall) for state, wall in zip(states, walls, strict=True)
            if state.state == "finished" and wall and state.ended > state.started and not state.resumed_from]
    factor = sum(real for real, _ in took) / sum(wall for _, wall in took) if took else 1.0
    left = []
    for state, wall in zip(states, walls, strict=True):
        if state.state in ("finished", "kept", "failed"):
            continue
        seconds = state.left if state.left is not None else wall * factor if wall else None
        if seconds is None:
            return None
        left.append((seconds, 1))
    at_once = sum(state.state == "running" for state in states)
    if not left:
        return 0.0
    return wall_clock(left, at_once) if at_once else None


def _measured(results: Path, entries: Sequence[Mapping[str, Any]]) -> set[Path]:
    places = {Path(entry["folder"]).parent for entry in entries}
    return {place for place in places if (results / place / "metrics.json").is_file()}
