"""What `dembark run` does: all replicas of one series into a folder of the user's choice, measured at the end."""

from __future__ import annotations

import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError, Interrupted
from dembark.common.files import read_json
from dembark.validation.jobs import measure_series
from dembark.validation.plan import Series
from dembark.validation.progress import Board, Monitor
from dembark.validation.simulate import Resources, simulate


def refuse_foreign(one: Series, out: Path) -> None:
    """DembarkError when `out` holds something else than results of these runs, so that nothing is replaced by accident."""
    wanted = {run.folder_name: run.inputs for run in one.runs}
    for path in sorted(out.glob("replica-*/run.json")) if out.is_dir() else []:
        record = read_json(path) or {}
        if wanted.get(path.parent.name) != record.get("inputs"):
            raise DembarkError(f"{path.parent} holds a result of other inputs", "",
                               "choose another --out, or --force to replace it when the new run is finished")
    if out.exists() and (not out.is_dir() or (any(out.iterdir()) and not any(out.glob("replica-*")) and not _ours(out))):
        raise DembarkError(f"--out {out} is not empty and holds no results", "", "choose a new folder")


def _ours(out: Path) -> bool:
    return all(path.name in ("failed", "superseded", "metrics.json") or path.name.startswith(".replica-") for path in out.iterdir())


def execute(one: Series, out: Path, cancel: threading.Event, resources: Resources, jobs: int | None = None,
            force: bool = False) -> dict[str, Any]:
    """Run the replicas that are not finished yet, `jobs` at a time (default: as many as fit the cores), and measure.

    Returns the content of `out/metrics.json`. A replica that fails does not stop the others; the first
    failure is raised when all have ended.
    """
    if not force:
        refuse_foreign(one, out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DembarkError(f"cannot make the folder {out}", error.strerror or str(error)) from None
    board = Board([run.name for run in one.runs])
    at_once = jobs or max(1, (os.cpu_count() or 1) // (resources.ranks * resources.threads))
    problems: list[DembarkError] = []
    # Why a run failed is told once, at the end.
    with Monitor(board.states, reasons=False), ThreadPoolExecutor(at_once) as pool:
        futures = [pool.submit(simulate, run, out, board, cancel, resources) for run in one.runs]
        for future in futures:
            try:
                future.result()
            except DembarkError as error:
                problems.append(error)
    if problems:
        told = next((error for error in problems if isinstance(error, Interrupted)), problems[0])
        for message in dict.fromkeys(str(error) for error in problems if not isinstance(error, Interrupted) and error is not told):
            print(f"dembark: {message}", file=sys.stderr)
        raise told
    return measure_series(out, one.runs)
