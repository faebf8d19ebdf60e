"""The folder of a campaign: whose it is, the copy of the campaign's file that counts in it, how it was submitted and how far it is."""

from __future__ import annotations

import getpass
import os
import socket
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError, pasteable
from dembark.common.files import write_atomic, write_json
from dembark.common.lock import is_held
from dembark.validation import engines, provenance, results
from dembark.validation.campaigns import targets
from dembark.validation.campaigns.estimate import wall_clock
from dembark.validation.campaigns.plan import Plan
from dembark.validation.campaigns.spec import read
from dembark.validation.case.folders import INSTEAD, VARIABLE, add_own_root, shipped_root, variables
from dembark.validation.judge.result import METRICS, PLAN
from dembark.validation.judge.tally import Tally, of_folder
from dembark.validation.results import State

from .monitor import headline
from .steps import CAMPAIGN_FILE
from .workflow import LOCK

LOG = "campaign.log"


@dataclass(frozen=True)
class Options:
    """How a campaign is run: `local`, `slurm` or the file of a site; cores of this host and jobs at a time (None = all)."""

    executor: str = "local"
    cores: int | None = None
    jobs: int | None = None


def choose(executor: str, cores: int | None, jobs: int | None) -> Options:
    """Options with the path of a site's file made absolute, for a later `resume` from elsewhere."""
    return Options(str(Path(executor).resolve()) if Path(executor).is_file() else executor, cores, jobs)


def refuse_foreign(folder: Path, name: str) -> None:
    """DembarkError when `folder` holds anything but an earlier state of the campaign `name`."""
    if not folder.exists():
        return
    if not folder.is_dir():
        raise DembarkError(f"{folder} is a file", "", "choose a folder with --out")
    copy = folder / CAMPAIGN_FILE
    if copy.is_file():
        owner = read_name(folder)
        if owner != name:
            raise DembarkError(f"{folder} belongs to the campaign {owner}", f"this one is {name}", "choose another folder with --out")
    elif any(path.name != LOCK for path in folder.iterdir()):
        raise DembarkError(f"{folder} is not empty and holds no campaign", "", "choose a new folder with --out")


def read_name(folder: Path) -> str:
    """Name of the campaign whose folder it is."""
    return str(results.plan(folder).get("campaign") or read(folder / CAMPAIGN_FILE).name)


def own_file(folder: Path) -> Path:
    """The campaign's file in its folder; DembarkError when it is not a campaign's folder."""
    copy = folder / CAMPAIGN_FILE
    if not copy.is_file():
        raise DembarkError(f"{folder} is not a campaign's folder", f"it has no {CAMPAIGN_FILE}",
                           "start one with 'dembark submit FILE --out FOLDER'")
    return copy.resolve()


def options(folder: Path) -> Options:
    """How the campaign was submitted last."""
    given = results.plan(folder).get("submitted", {}).get("options", {})
    return Options(**{key: value for key, value in given.items() if key in Options.__dataclass_fields__})


def _variables() -> list[str]:
    """Environment variables that say which engines and cases are meant; `resume` sets them again where the shell does not."""
    return [*(variable for name in engines.names() for variable in engines.facts(name).variables), INSTEAD, VARIABLE,
            *dict.fromkeys(engines.facts(name).launcher for name in engines.names())]


def restore(folder: Path) -> None:
    """Set the variables for engines and cases as they were at the last submission, unless they are set; its folders of own cases are added
    to those that are named now. DembarkError when one of these is gone."""
    for name, value in results.plan(folder).get("submitted", {}).get("environment", {}).items():
        if name == VARIABLE:
            for root in map(Path, filter(None, value.split(os.pathsep))):
                if not root.is_dir():
                    raise DembarkError(f"{root} is gone", f"the campaign in {folder} has its own cases there", "bring it back")
                add_own_root(root)
        elif name in _variables():
            os.environ.setdefault(name, value)


def environment() -> dict[str, str]:
    """What other processes need to find the same engines and cases: the variables that are set, paths made absolute."""
    return {name: _absolute(os.environ[name]) for name in _variables() if name in os.environ} | variables()


def enter(folder: Path, file: Path, plan: Plan, chosen: Options, estimates: Mapping[Path, float | None]) -> None:
    """Write the copy of the campaign's file into `folder`, those of its tables, and plan.json: what is to be done, who submits it, from
    where, with what. DembarkError when targets are not those that the folder's calibration began with."""
    refuse_changed_targets(folder, plan)
    text = file.read_bytes()
    for table in plan.tables:
        (folder / targets.FOLDER).mkdir(exist_ok=True)
        write_atomic(folder / targets.FOLDER / table.name, table.read_bytes())
    used = {run.engine.name: run.engine.version for one in plan.series for run in one.runs}
    write_atomic(folder / CAMPAIGN_FILE, text)
    submitted: dict[str, Any] = {
        "at": datetime.now(UTC).isoformat(timespec="seconds"), "file": str(file), "options": asdict(chosen), "host": socket.gethostname(),
        "user": _user(), "decks": str(shipped_root()), "environment": environment(), **provenance.commit(),
        "versions": {"dembark": provenance.package_version("dembark"), **used}}
    write_json(folder / PLAN, {"submitted": submitted, **plan.as_json(estimates)})


def refuse_changed_targets(folder: Path, plan: Plan) -> None:
    """DembarkError when `plan` has other targets than the one in `folder`."""
    both = zip(results.plan(folder).get("sweeps", ()), plan.facts.get("sweeps", ()), strict=False)
    for number, (before, now) in enumerate(both, start=1):
        known = before.get("sample", {}).get("targets")
        if known:
            targets.refuse_changed(folder, number, known, now.get("sample", {}).get("targets", {}))


def _absolute(value: str) -> str:
    """A path as it is from every folder; another text, such as none, as it is."""
    return str(Path(value).absolute()) if value and Path(value).exists() else value


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return str(os.getuid())


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
        return f"{self.name}: {headline(self.states)}" + ("" if self.running or self.complete else "; no process runs it now")

    @property
    def complete(self) -> bool:
        """Whether every run is finished."""
        return all(state.state == "finished" for state in self.states)

    @property
    def concluded(self) -> bool:
        """Whether every run is finished and measured, and there is a report."""
        return self.complete and self.measured == len({Path(state.folder).parent for state in self.states}) and self.report is not None


def look(folder: Path) -> Status:
    """The state of the campaign in `folder`, from its files alone; DembarkError when it is not a campaign's."""
    own_file(folder)
    states = tuple(results.states(folder))
    if not states:
        raise DembarkError(f"the campaign in {folder} has not been started", "", f"start it with {pasteable('dembark', 'resume', folder)}")
    running = is_held(folder / LOCK) or any(state.state == "running" for state in states)
    report = folder / "report.html"
    measured = {Path(state.folder).parent for state in states if (folder / state.folder).with_name(METRICS).is_file()}
    return Status(read_name(folder), running, states, time_left(states), len(measured), of_folder(folder),
                  report if report.is_file() else None)


def time_left(states: Sequence[State]) -> float | None:
    """Seconds until all runs are done if as many go on at a time as now; None when nothing runs or a run's cost is not known.

    A waiting run takes its estimate, times what the finished ones took over theirs.
    """
    took = [(state.took, state.estimate) for state in states
            if state.state == "finished" and state.estimate and state.took > 0.0 and not state.resumed_from]
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
