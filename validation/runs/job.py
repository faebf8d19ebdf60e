"""One element of a job array: `python -m dembark.validation.runs.job FOLDER LIST INDEX` simulates the run that line INDEX of the file LIST
names, or measures what is finished and writes the report."""

from __future__ import annotations

import argparse
import shlex
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

from dembark.common.errors import DembarkError
from dembark.common.lock import Busy
from dembark.validation import results
from dembark.validation.campaigns import expand
from dembark.validation.campaigns.spec import read

from .simulate import simulate
from .steps import CAMPAIGN_FILE
from .workflow import cancelled_by_signal, conclude

# Stands in the list of runs for the measurements and the report.
REPORT = "report"
_LOOK = 5.0  # s, between two tries to measure


def _arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m dembark.validation.runs.job", description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of the campaign")
    parser.add_argument("list", type=Path, help="file with the folder of a run in each line, or 'report'")
    parser.add_argument("index", type=int, help="line of the file, from 0; beyond its end there is nothing to do")
    parser.add_argument("--again", action="store_true", help="leave out runs that failed by their own fault")
    parser.add_argument("--cores", type=int, default=1, help="processes that measure")
    return parser.parse_args(words)


def _simulate(folder: Path, place: str, again: bool, cancel: threading.Event) -> None:
    state = results.state(folder, place)
    if state.state == "finished" or (again and state.state == "failed"):
        return
    case, _, engine, _ = Path(place).parts
    plan = expand.campaign(read(folder / CAMPAIGN_FILE), (case,), (engine,))
    run = plan.folders.get(place)
    if run is None or run.inputs != state.inputs:
        raise DembarkError("the inputs have changed since the job was submitted", place,
                           f"submit again: {shlex.join(['dembark', 'resume', str(folder)])}")
    try:
        simulate(run, (folder / place).parent, cancel, plan.resources[Path(place).parent])
    except Busy as error:
        print(f"dembark: {error}", file=sys.stderr)


def _report(folder: Path, cores: int, cancel: threading.Event) -> None:
    """Wait for another submission that measures: it may have begun before the last runs of this one ended."""
    while True:
        try:
            conclude(folder, cancel, cores)
            return
        except Busy:
            if cancel.wait(_LOOK):
                raise


def main(words: Sequence[str] | None = None) -> int:
    """Do one element; returns the exit code."""
    given, cancel = _arguments(words), cancelled_by_signal()
    folder = given.folder.resolve()
    elements = given.list.read_text(encoding="utf-8").splitlines()
    if given.index >= len(elements):
        return 0
    try:
        if elements[given.index] == REPORT:
            _report(folder, given.cores, cancel)
        else:
            _simulate(folder, elements[given.index], given.again, cancel)
    except DembarkError as error:
        print(f"dembark: {elements[given.index]}: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
