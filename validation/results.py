"""The results in a folder as tables: every measured quantity, every comparison of engines, and every run with its state.

    from dembark.validation import results
    results.quantities("results/quick").query("name == 'stress_ratio_k'").plot.scatter("parameters.wall_friction", "value")

The files are the only state. `plan.json` says which runs were asked for, `run.json` in a run's folder that it is finished and from which
inputs, `metrics.json` and `comparison.json` what was measured. The status file of a run, next to its folder, says how far it is.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dembark.common.choices import pick
from dembark.common.errors import DembarkError, RunError
from dembark.common.files import read_json, write_atomic
from dembark.common.lock import is_held
from dembark.validation.judge.result import COMPARISON, METRICS, PLAN, as_row, result_files

if TYPE_CHECKING:
    import pandas as pd

RECORD = "run.json"


@dataclass(frozen=True)
class State:
    """A run, or another `kind` of step: waiting, running, stopped (ended from outside, to be continued), failed or finished.

    `folder`: place of the run in the results; `inputs`: hash of its inputs; `estimate`: expected wall time (s). `began` and `ended` are s
    since 1970; of a finished run that was read from its record, 0 and its wall time. `attempt` counts the starts, `resumed_from` is the
    step at which the last one went on.
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
    inputs: str = ""
    folder: str = ""
    estimate: float | None = None

    @property
    def took(self) -> float:
        """Wall time (s) between its begin and its end; 0 where that is unknown."""
        return self.ended - self.began if self.ended else 0.0

    @property
    def left(self) -> float | None:
        """Expected remaining seconds of a running one; None before there is a rate."""
        done = self.step - self.resumed_from
        if self.state != "running" or done <= 0 or not self.steps:
            return None
        # The clock of the host that began it may be ahead.
        return max(0.0, time.time() - self.began) * (self.steps - self.step) / done

    def as_json(self) -> dict[str, Any]:
        """Its fields."""
        return asdict(self)


_FIELDS = frozenset(one.name for one in fields(State))


def status_file(place: Path) -> Path:
    """Where a run that will be `place` when it is finished writes how far it is."""
    return place.with_name(f".{place.name}.status.json")


def lock_file(place: Path) -> Path:
    """The lock that is held while a run is computed that will be `place`."""
    return place.with_name(f".{place.name}.lock")


def plan(folder: Path) -> dict[str, Any]:
    """What was asked for in a results folder; empty where only single runs were made."""
    return read_json(folder / PLAN) or {}


def record(place: Path, inputs: str) -> dict[str, Any] | None:
    """The run.json of the finished run with these `inputs` (their hash) at `place`; None when it is not finished."""
    found = read_json(place / RECORD)
    return found if found is not None and found.get("inputs") == inputs else None


def states(folder: Path) -> list[State]:
    """The planned runs of a results folder in the order of the plan, as the files have them; empty without a plan."""
    return [_state(folder, run) for run in plan(folder).get("runs", ())]


def run_name(place: Path) -> str:
    """Short name of the run at `place`, the folder CASE/VARIANT/ENGINE/replica-N: case, variant, engine, N. Steps wait for runs by it."""
    *words, replica = place.parts[-4:]
    return " ".join((*words, replica.rpartition("-")[2]))


def state(folder: Path, place: str) -> State:
    """The planned run at `place` in a results folder, without a look at the others; DembarkError when it is not in the plan."""
    for run in plan(folder).get("runs", ()):
        if run["folder"] == place:
            return _state(folder, run)
    raise DembarkError(f"{place} is not a planned run", f"of {folder / PLAN}", "submit again")


def _state(results: Path, run: Mapping[str, Any]) -> State:
    place = results / run["folder"]
    facts: dict[str, Any] = {"name": run_name(place), "folder": run["folder"], "inputs": run["inputs"], "estimate": run.get("estimate")}
    done = record(place, run["inputs"])
    if done is not None:
        return State(**facts, state="finished", step=done.get("steps", 0), steps=done.get("steps", 0),
                     time_step=done.get("time_step", 0.0), attempt=done.get("attempts", 1),
                     resumed_from=([0, *done.get("resumed_at", [])])[-1], host=done.get("provenance", {}).get("host", ""),
                     ended=done.get("provenance", {}).get("wall_time", 0.0))
    status = read_json(status_file(place)) or {}
    if status.get("inputs") != run["inputs"]:
        status = {}
    known = {key: value for key, value in status.items() if key in _FIELDS} | facts
    if lock_file(place).exists() and is_held(lock_file(place)):
        return State(**known | {"state": "running", "message": ""})
    if known.get("state") == "running":
        known |= {"state": "stopped", "message": "its process was ended"}
    return State(**known)


def runs(folder: Path | str) -> pd.DataFrame:
    """One row a run: the planned ones with their state, and finished ones that no plan names (`dembark run`).

    Columns: case, variant, engine, replica, folder, state, message, attempt, resumed_from, step, steps, time_step, inputs and, of a
    finished run, `parameters.*` (SI units) and `provenance.*` (wall_time in s, host, commit, versions, ...), as its run.json has them.
    """
    folder = _existing(folder)
    planned = {state.folder: state for state in states(folder)}
    found = (path.parent.relative_to(folder) for path in sorted(folder.glob(f"**/replica-*/{RECORD}")))
    places = dict.fromkeys([*planned, *(str(place) for place in found if not any(part == "superseded" or part.startswith(".")
                                                                                 for part in place.parts))])
    rows = []
    for place in places:
        content, planned_state = read_json(folder / place / RECORD) or {}, planned.get(place)
        if planned_state is None:
            row = {"folder": place, "state": "finished", "inputs": content.get("inputs", ""), "step": content.get("steps"),
                   "attempt": content.get("attempts", 1)}
        else:
            row = {key: value for key, value in planned_state.as_json().items() if key not in ("name", "kind", "host", "began", "ended")}
            content = content if planned_state.state == "finished" else {}
        parts = ("", "", "", *Path(place).parts)
        named = dict(zip(("case", "variant", "engine"), parts[-4:-1], strict=True)) | {"replica": int(place.rpartition("-")[2])}
        rows.append(named | row | {key: content[key] for key in ("case", "variant", "engine", "steps", "time_step", "resume", "parameters",
                                                                "provenance") if key in content})
    return _table(rows)


def quantities(folder: Path | str) -> pd.DataFrame:
    """One row a measured quantity of each series and study below `folder`, or in it.

    Columns: case, variant, engine, profile, those of QuantityRecord (name, label, unit, value, verdict, reference, deviation, tolerance,
    evidence, ...) with the 95 % intervals as low, high, reference_low, reference_high, then `parameters.*` in SI units, `measured.*` (at,
    commit) and `provenance.*` of the runs. DembarkError when there is no such folder, or a result in it cannot be read.
    """
    return _table(_rows(_existing(folder), METRICS))


def comparisons(folder: Path | str) -> pd.DataFrame:
    """One row for each quantity of two engines: `value` of `engine`, `reference` that of `reference_engine`; else as `quantities`."""
    return _table(_rows(_existing(folder), COMPARISON))


def _rows(folder: Path, kind: str) -> Iterator[dict[str, Any]]:
    single = folder / kind
    for path in [single] if single.is_file() else [path for path in result_files(folder) if path.name == kind]:
        if (content := read_json(path)) is None:
            raise RunError(f"{path} cannot be read", "it holds no JSON", "measure it again, by 'dembark report', 'run' or 'resume'")
        common = {key: content[key] for key in ("case", "variant", "engine", "profile") if key in content}
        further = {key: dict(content[key]) for key in ("parameters", "measured", "provenance") if key in content}
        for one in content.get("quantities", ()):
            yield common | as_row(one) | further


def _existing(folder: Path | str) -> Path:
    path = Path(folder).resolve()
    if not path.is_dir():
        raise DembarkError(f"{folder} is not a folder", "", "give results/<profile>, the folder of a campaign, or that of a run")
    return path


def _table(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd
    return pd.json_normalize(list(rows))


TABLES = {"quantities": quantities, "comparisons": comparisons, "runs": runs}
_FORMATS = (".csv", ".json", ".parquet")


def export(folder: Path | str, table: str, target: Path | None = None) -> str:
    """The `table` (quantities, comparisons, runs) of a results folder as CSV text; or into the file `target`, whose name ends in .csv,
    .json or .parquet. DembarkError for another name, a folder without results, and where Parquet files need a package that is not
    installed."""
    found = TABLES[pick(table, TABLES, "table", "in --table")](folder)
    if found.empty:
        if TABLES["quantities"](folder).empty:
            raise DembarkError(f"no results in {folder}", "", "give the folder of a profile, a campaign or a run")
        raise DembarkError(f"no {table} in {folder}", "it has results, of quantities")
    if target is None:
        return found.to_csv(index=False)
    suffix = target.suffix.lower()
    if suffix not in _FORMATS:
        raise DembarkError(f"{target} has an unknown format", "", f"let its name end in {', '.join(_FORMATS)}")
    if suffix == ".csv":
        content = found.to_csv(index=False).encode()
    elif suffix == ".json":
        content = found.to_json(orient="records", indent=1).encode()
    else:
        try:
            content = found.to_parquet(index=False)
        except ImportError as error:
            raise DembarkError("Parquet files need another package", str(error).partition(".")[0],
                               "install pyarrow, or export CSV") from None
    write_atomic(target, content)
    return ""
