"""The table of a results folder: a row for each run and each step after the runs, and the one function that changes their states.

What is finished is decided by the files: `run.json` with the hash of the run's inputs, written whole by the run itself. The table follows
them, and is made again from them when it is lost. Only the process that holds the folder's lock writes it.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

from dembark.common.errors import RunError
from dembark.common.files import read_json
from dembark.validation.runs import schema
from dembark.validation.runs.plan import Run, finished

# From each state to those that may follow it. `stopped`: ended from outside, to be started again.
ALLOWED = {
    "waiting": ("queued", "running", "finished", "failed", "superseded"),
    "queued": ("running", "waiting", "finished", "failed", "stopped"),
    "running": ("finished", "failed", "stopped"),
    "stopped": ("waiting", "failed", "superseded"),
    "failed": ("waiting", "superseded"),
    "finished": ("waiting", "superseded"),
    "superseded": ("waiting", "finished"),
}
# What is under way when nobody attends to it any more.
UNDER_WAY = ("queued", "running")
_FLUSH = 2.0


@dataclass(frozen=True)
class State:
    """A run, or a step of another `kind`; times in s, `began` and `ended` since 1970.

    `attempt` counts the starts of a run, `resumed_from` is the step where the present one went on. `inputs` is the hash of what it was
    made of, `folder` a run's place in the results, `job` its number in a scheduler, `estimate` its expected wall time (s).
    """

    name: str
    state: str = "waiting"
    kind: str = "run"
    step: int = 0
    steps: int = 0
    time_step: float = 0.0
    began: float = 0.0
    ended: float = 0.0
    message: str = ""
    attempt: int = 0
    resumed_from: int = 0
    host: str = ""
    job: str = ""
    inputs: str = ""
    folder: str = ""
    estimate: float | None = None

    @property
    def left(self) -> float | None:
        """Expected remaining seconds; None before there is a rate to tell it from."""
        done = self.step - self.resumed_from
        if self.state != "running" or done <= 0 or not self.steps:
            return None
        return (time.time() - self.began) * (self.steps - self.step) / done


@cache
def _columns(table: str) -> dict[str, str]:
    """Columns of `table`, runs or steps, by the fields of State that they hold."""
    renamed = {"attempt": "attempts", "resumed_from": "resumed_from_step", "estimate": "estimated_time"}
    renamed |= {"inputs": "run_id"} if table == "runs" else {}
    named = {one.name: renamed.get(one.name, one.name) for one in fields(State)}
    return {key: column for key, column in named.items() if column in schema.TABLES[table]}


def _state(name: str, table: str, row: Mapping[str, Any]) -> State:
    found = {key: row[column] for key, column in _columns(table).items() if row[column] is not None}
    return State(**found | {"name": name})


class Table:
    """States in memory, kept in the store of the folder `results`; None keeps them in memory only. Safe to use from several threads."""

    def __init__(self, results: Path | None = None, label: str = "") -> None:
        self._results, self._label = results, label
        self._states: dict[str, State] = {}
        self._guard = threading.RLock()
        self._changed: set[str] = set()
        self._saved = 0.0
        # Why the store could not be written: no reason to lose a run, for all of it is made again from the files.
        self.problem = ""
        # Called with each state that has changed.
        self.listener: Callable[[State], None] = lambda _: None

    def enter(self, runs: Mapping[str, Run], base: Path, steps: Mapping[str, str], whole: bool = True) -> None:
        """Take up `runs` by their folders below `base`, and `steps` (kinds by name), with the states that the files there tell.

        Runs with other inputs in the same folders are superseded; with `whole`, all that are not among these. RunError when the store
        cannot be written.
        """
        with self._guard:
            before = self._load()
            for folder, run in runs.items():
                known = before.pop((run.inputs, folder), State("", inputs=run.inputs, folder=folder))
                self._states[run.name] = replace(known, name=run.name)
            for name, kind in steps.items():
                self._states[name] = before.pop(("", name), State(name, kind=kind))
            planned = dict(self._states)
            gone = [state for key, state in before.items() if key[0] and (whole or key[1] in runs) and state.state != "superseded"]
            if self._results:
                with schema.writing(self._results / schema.FILE) as connection:
                    have = {(row["run_id"], row["folder"]) for row in connection.execute("SELECT run_id, folder FROM runs")}
                    new = [(folder, run) for folder, run in runs.items() if (run.inputs, folder) not in have]
                    schema.put(connection, "runs", [_static(self._label, folder, run) for folder, run in new])
                    schema.put(connection, "steps", [{"campaign": self._label, "name": name, "kind": kind, "state": "waiting"}
                                                     for name, kind in steps.items() if planned[name].state == "waiting"])
                    for state in gone:
                        if state.state != "finished":  # of those that never finished nothing is to be kept
                            schema.clear(connection, "runs", run_id=state.inputs, folder=state.folder)
            for state in gone:
                if state.state == "finished":
                    self._states[state.name] = state
                    self.transition(state.name, "superseded")
                    del self._states[state.name]
                    self._changed.discard(state.name)
            for folder, run in runs.items():
                self._follow(run.name, finished(base / folder, run))
            for name in steps:
                self._follow(name, self._states[name].state == "finished")

    def _follow(self, name: str, done: bool) -> None:
        """Bring a state that nobody attended to in line with the files."""
        if self._states[name].state in UNDER_WAY:
            self.transition(name, "finished" if done else "stopped")
        if not done and self._states[name].state != "waiting":
            self.transition(name, "waiting")
        if done and self._states[name].state != "finished":
            if "finished" not in ALLOWED[self._states[name].state]:
                self.transition(name, "waiting")
            self.transition(name, "finished", ended=0.0)

    def transition(self, name: str, state: str, **facts: Any) -> State:
        """Change the state of the run or step `name`, and with it any of the other fields; ValueError when it may not follow.

        This is the only place where a state changes. It is in the store when this returns.
        """
        with self._guard:
            before = self._states[name]
            if state not in ALLOWED[before.state]:
                raise ValueError(f"{name} is {before.state} and cannot become {state}")
            times: dict[str, Any] = {}
            if state == "running":
                times = {"began": time.time(), "ended": 0.0, "message": "", "step": 0}
            elif before.state in UNDER_WAY and state in ("finished", "failed", "stopped"):
                times = {"ended": time.time()}
            if state == "finished":
                times["message"] = ""
            self._states[name] = replace(before, state=state, **(times | facts))
            self._changed.add(name)
            self._save()
        self.listener(self._states[name])
        return self._states[name]

    def note(self, name: str, **facts: Any) -> None:
        """Change fields of `name` other than its state; in the store within some seconds."""
        with self._guard:
            self._states[name] = replace(self._states[name], **facts)
            self._changed.add(name)
            if time.monotonic() - self._saved > _FLUSH:
                self._save()

    def state(self, name: str) -> State:
        """The state of one run or step."""
        return self._states[name]

    def states(self) -> list[State]:
        """All states, in the order in which they became known."""
        with self._guard:
            return list(self._states.values())

    def runs(self) -> list[State]:
        """States of the runs."""
        return [state for state in self.states() if state.kind == "run"]

    def _load(self) -> dict[tuple[str, str], State]:
        """What the store knows, by (inputs, folder) or ("", name of a step)."""
        if not self._results:
            return {}
        with schema.writing(self._results / schema.FILE) as connection:
            # A folder may hold runs of other inputs that are superseded: their names are made unique.
            found = {(row["run_id"], row["folder"]): _state(f"{row['folder']} {row['run_id']}", "runs", row)
                     for row in connection.execute("SELECT * FROM runs")}
            return found | {("", row["name"]): _state(row["name"], "steps", row) for row in connection.execute("SELECT * FROM steps")}

    def _save(self) -> None:
        self._saved = time.monotonic()
        states = [self._states[name] for name in sorted(self._changed)]
        if not self._results:
            return
        try:
            with schema.writing(self._results / schema.FILE) as connection:
                for state in states:
                    table = "runs" if state.kind == "run" else "steps"
                    row = {column: getattr(state, key) for key, column in _columns(table).items()}
                    if table == "runs" and state.state == "finished":
                        row |= record_row(self._results / state.folder)
                    schema.change(connection, table, row)
            self._changed.clear()
            self.problem = ""
        except RunError as error:
            self.problem = str(error)


def _static(label: str, folder: str, run: Run) -> dict[str, Any]:
    return {"run_id": run.inputs, "campaign": label, "case_name": run.case.name, "variant": run.variant, "profile": run.profile,
            "engine": run.engine.name, "engine_version": run.engine.version, "engine_identity": run.engine.identity,
            "replica": run.replica, "seed": run.values.get("seed"), "parameters_json": json.dumps(dict(run.values)),
            "particles": run.particles, "folder": folder, "state": "waiting"}


def record_row(folder: Path) -> dict[str, Any]:
    """Columns of a finished run that its run.json tells."""
    record = read_json(folder / "run.json") or {}
    facts = record.get("provenance", {})
    same = ("ranks", "threads", "wall_time", "particle_steps_per_second", "dirty", "host", "cpu", "started")
    resumed = record.get("resumed_at") or [None]
    return {"attempts": record.get("attempts", 1), "resumed_from_step": resumed[-1], "resume": record.get("resume"),
            "step": record.get("steps"), "steps": record.get("steps"), "time_step": record.get("time_step"),
            "commit_hash": facts.get("commit"), **{key: facts.get(key) for key in same}}


def read(results: Path) -> list[State]:
    """States of the runs that belong to the plan, as the store has them; empty when there is no store."""
    path = results / schema.FILE
    if not path.is_file():
        return []
    sql = "SELECT * FROM runs WHERE state != 'superseded' ORDER BY rowid"
    return [_state(" ".join(str(row[key]) for key in ("case_name", "variant", "engine", "replica")), "runs", row)
            for row in schema.rows(path, sql)]


def summary(states: Iterable[State], runs: Mapping[str, Run]) -> list[dict[str, Any]]:
    """One entry a run, by its folder: finished, failed or missing, and why; for the report."""
    by_folder = {state.folder: state for state in states if state.kind == "run"}
    found = []
    for folder, run in runs.items():
        state = by_folder[folder]
        told = {"finished": "finished", "failed": "failed"}.get(state.state, "missing")
        found.append({"case": run.case.name, "variant": run.variant, "engine": run.engine.name, "replica": run.replica, "folder": folder,
                      "inputs": run.inputs, "state": told, "message": "" if told == "finished" else state.message})
    return found
