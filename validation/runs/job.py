"""One run, or one measurement, as the job of a scheduler: `python -m dembark.validation.runs.job ...` on the node does exactly what the
executor does on its own machine, and reports its progress in a small file beside the results."""

from __future__ import annotations

import argparse
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

from dembark.common.errors import DembarkError, Interrupted, Killed
from dembark.common.files import write_json
from dembark.common.lock import Busy
from dembark.validation.campaigns import expand
from dembark.validation.runs.plan import Resources, Run, Series
from dembark.validation.runs.simulate import simulate
from dembark.validation.runs.steps import measure_series

_PAUSE = 10.0


def cancelled_by_signal() -> threading.Event:
    """An event that SIGINT and SIGTERM set from now on, instead of ending this process at once."""
    event = threading.Event()

    def handler(_number: int, _frame: FrameType | None) -> None:
        event.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)
    return event


class Report:
    """The progress of a job for whoever has submitted it: a JSON file, written whole, about once a second at most."""

    def __init__(self, path: Path) -> None:
        self._path, self._written = path, 0.0
        self._facts: dict[str, Any] = {}

    def __call__(self, **facts: Any) -> None:
        """Add `facts` to what was told; they are written at once when `state` is among them."""
        self._facts |= facts
        if "state" not in facts and time.monotonic() - self._written < 1.0:
            return
        self._written = time.monotonic()
        # Telling the progress is never worth a run: a full disk is reported by what needs the space.
        with suppress(DembarkError):
            write_json(self._path, self._facts)


def _simulate(run: Run, out: Path, used: Resources, cancel: threading.Event, progress: Report) -> None:
    while True:
        try:
            simulate(run, out, cancel, used, progress)
            return
        except Busy:
            # A job that the scheduler has forgotten still works on it.
            if cancel.wait(_PAUSE):
                raise Interrupted(f"{run.name} was interrupted") from None


def _series(options: argparse.Namespace) -> Series:
    case, _, engine = Path(options.place).parts
    planned = expand.plan(options.profile, options.campaign, (case,), (engine,))
    (one,) = [one for one in planned.series if one.place == Path(options.place)]
    if options.inputs and options.inputs not in {run.inputs for run in one.runs}:
        raise DembarkError("the inputs have changed since the job was submitted", f"{options.place}", "submit again")
    return one


def _arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m dembark.validation.runs.job", description=__doc__)
    parser.add_argument("--profile")
    parser.add_argument("--campaign", type=Path, help="file of a campaign, in the place of a profile")
    parser.add_argument("--results", type=Path, required=True, help="results/<profile>, or the campaign's folder")
    parser.add_argument("--place", required=True, help="<case>/<variant>/<engine>")
    parser.add_argument("--inputs", help="hash of the inputs of a run; without it the series is measured")
    parser.add_argument("--report", type=Path, required=True, help="file for the progress")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--restart-interval", type=float, help="wall time between restart files (s)")
    return parser.parse_args(words)


def main(words: Sequence[str] | None = None) -> int:
    """Do one job; returns the exit code."""
    options = _arguments(words)
    cancel, progress = cancelled_by_signal(), Report(options.report)
    progress(state="running", host=socket.gethostname(), pid=os.getpid())
    try:
        one = _series(options)
        out = options.results.resolve() / one.place
        if options.inputs:
            (run,) = [run for run in one.runs if run.inputs == options.inputs]
            _simulate(run, out, Resources(options.ranks, options.threads, restart_interval=options.restart_interval), cancel, progress)
        else:
            measure_series(out, one.runs)
    except DembarkError as error:
        # Another attempt may follow what was ended from outside; it is not the run that failed.
        progress(state="stopped" if isinstance(error, Killed | Interrupted) else "failed", message=str(error))
        print(f"dembark: {error}", file=sys.stderr)
        return error.exit_code
    progress(state="finished")
    return 0


if __name__ == "__main__":
    sys.exit(main())
