"""The steps of a workflow: simulate one replica, measure a series, compare engines, build the report. Snakemake calls them as
`python -m dembark.validation.jobs <step> ...`; the commands of `dembark` use the same functions."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import FrameType
from typing import Any

from dembark.common.errors import DembarkError, Interrupted, Killed, RunError
from dembark.common.files import read_json, retire, write_json
from dembark.validation import analysis, pictures, provenance
from dembark.validation.campaigns import store
from dembark.validation.campaigns.folder import FILE as CAMPAIGN_FILE
from dembark.validation.campaigns.source import Source
from dembark.validation.plan import PlannedStudy, Run, Series, finished, studies, summary
from dembark.validation.progress import FileBoard, Monitor, State, watched
from dembark.validation.simulate import Resources, simulate

PROGRESS_VARIABLE = "DEMBARK_PROGRESS"


def cancelled_by_signal() -> threading.Event:
    """An event that SIGINT and SIGTERM set from now on, instead of ending this process at once."""
    event = threading.Event()

    def handler(number: int, frame: FrameType | None) -> None:
        event.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)
    return event


def progress_folder(results: Path) -> Path:
    """Where the jobs of results/<profile> tell how far they are."""
    return results / ".progress"


def _now() -> dict[str, Any]:
    """When, and by which version of the code, something is measured; the runs themselves may be older."""
    return {**provenance.commit(), "at": datetime.now(UTC).isoformat(timespec="seconds")}


def measure_series(folder: Path, runs: Iterable[Run]) -> dict[str, Any]:
    """Write `folder/metrics.json` from the finished ones of `runs` and return it; results of other inputs are put aside first.

    Raises RunError when none is finished or the measurement fails; then there is no metrics.json, rather than an old one.
    """
    from dembark.validation.metrics import measure

    wanted = {run.folder_name: run for run in runs}
    for path in folder.glob("replica-*"):
        if path.name not in wanted or not finished(path, wanted[path.name]):
            retire(path)
    done = [run for name, run in wanted.items() if (folder / name).is_dir()]
    target = folder / "metrics.json"
    if not done:
        retire(target)
        raise RunError(f"nothing to measure in {folder}", "none of its runs is finished")
    target.unlink(missing_ok=True)
    try:
        with analysis.warnings_kept() as remarks:
            content = measure(folder)
    except DembarkError:
        raise
    except Exception as error:  # whatever goes wrong in the analysis is a failed measurement, to be told in one line
        raise RunError(f"{folder} could not be measured", *analysis.reasons(folder, error, done[0].case)) from error
    content["remarks"] = [*content.get("remarks", ()), *remarks, *pictures.draw(folder, content.get("picture"))]
    if "replicas" in content["parameters"]:
        content["parameters"]["replicas"] = len(wanted)  # those of an earlier request for fewer or more are kept, and know its number
    content["measured"] = _now()
    content["inputs"] = [run.inputs for run in done]
    content["replicas_missing"] = sorted(run.replica for run in wanted.values() if run not in done)
    write_json(target, content)
    return content


def measure_study(results: Path, planned: PlannedStudy) -> None:
    """Write `metrics.json` of a study from those of its variants; RunError when one of them is missing or the study fails."""
    from dembark.validation.metrics import study

    target = results / planned.place / "metrics.json"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.unlink(missing_ok=True)
    try:
        content = study(planned.study, [results / one.place for one in planned.series]) | {"measured": _now()}
    except DembarkError:
        raise
    except Exception as error:  # see measure_series
        raise RunError(f"{results / planned.place} could not be measured", f"{type(error).__name__}: {error}") from error
    write_json(target, content)


def compare_engines(folder: Path) -> None:
    """Write `folder/comparison.json` (folder = results/<profile>/<case>/<variant>); RunError when that fails."""
    from dembark.validation.compare import compare

    target = folder / "comparison.json"
    target.unlink(missing_ok=True)
    try:
        write_json(target, compare(folder) | {"measured": _now()})
    except DembarkError:
        raise
    except Exception as error:  # see measure_series
        raise RunError(f"{folder} could not be compared", f"{type(error).__name__}: {error}") from error


def build_report(results: Path) -> None:
    """Write report.html and report.pdf into `results` (results/<profile> or a campaign's folder); RunError when that fails.

    The report of a profile includes the verification of the instruments, which is computed anew before.
    """
    from dembark.validation import verification

    try:
        if not (results / CAMPAIGN_FILE).is_file():
            verification.write(results)
        _builder(results)(results)
    except DembarkError:
        raise
    except Exception as error:  # see measure_series
        raise RunError(f"the report of {results} could not be built", f"{type(error).__name__}: {error}") from error


def _builder(results: Path) -> Callable[[Path], object]:
    if (results / CAMPAIGN_FILE).is_file():
        from dembark.validation.campaigns import report as of_campaign

        return of_campaign.build
    from dembark.validation import report

    return report.build


def variants(all_series: Sequence[Series]) -> dict[Path, list[Series | PlannedStudy]]:
    """Series, and studies, by the folder of their case and variant; those with more than one are compared."""
    groups: dict[Path, list[Series | PlannedStudy]] = {}
    for one in (*all_series, *studies(all_series)):
        groups.setdefault(one.place.parent, []).append(one)
    return groups


def failures(results: Path, all_series: Iterable[Series]) -> dict[str, str]:
    """Reasons of the runs that failed or were stopped in the workflow that ran last, by name of the run."""
    names = [run.name for one in all_series for run in one.runs]
    return {state.name: state.message for state in watched(progress_folder(results), names)()
            if state.state in ("failed", "stopped")}


def write_summary(results: Path, source: Source, all_series: Sequence[Series], messages: Mapping[str, str]) -> list[dict[str, Any]]:
    """Write `runs.json`: which runs the report should have, which of them are finished, failed or missing, and a campaign's sweeps."""
    entries = summary(all_series, results, messages)
    write_json(results / "runs.json", {**source.facts(), "runs": entries})
    return entries


def collect_all(results: Path, source: Source, all_series: Sequence[Series], messages: Mapping[str, str], whole: bool = True) -> None:
    """Bring the store up to what `results` holds; `whole`: these are all series that there are to be."""
    store.collect(results, source.label, all_series, messages, whole, source.facts().get("sweeps", ()))


def salvage(results: Path, all_series: Sequence[Series]) -> list[str]:
    """Measure and compare what can be after some runs failed, so that a report can be built; returns what went wrong."""
    problems = []
    for one in all_series:
        folder = results / one.place
        content = read_json(folder / "metrics.json")
        done = [run.inputs for run in one.runs if finished(folder / run.folder_name, run)]
        if done and content and content.get("inputs") == done:
            continue
        try:
            measure_series(folder, one.runs)
        except DembarkError as error:
            problems.append(str(error))
    for planned in studies(all_series):
        try:
            measure_study(results, planned)
        except DembarkError as error:
            problems.append(str(error))
    for place, group in variants(all_series).items():
        if len(group) > 1 and all((results / one.place / "metrics.json").is_file() for one in group):
            try:
                compare_engines(results / place)
            except DembarkError as error:
                problems.append(str(error))
        else:
            retire(results / place / "comparison.json")
    return problems


def _series_at(source: Source, place: str) -> Series:
    case, _, engine = Path(place).parts
    (one,) = [one for one in source.series([case], [engine]) if one.place == Path(place)]
    return one


def _simulate(options: argparse.Namespace, source: Source, results: Path) -> None:
    one = _series_at(source, options.place)
    (run,) = [run for run in one.runs if run.replica == options.replica]
    cancel = cancelled_by_signal()
    board = FileBoard(progress_folder(results))
    resources = Resources(options.ranks, options.threads, options.restart_interval)

    def states() -> list[State]:
        # Whoever started the workflow shows the progress of all jobs; without it each job tells its own.
        return [] if os.environ.get(PROGRESS_VARIABLE) else board.states()

    with Monitor(states), _failing_once(run, results):
        simulate(run, results / one.place, board, cancel, resources)
    mark = Path(options.mark)
    mark.parent.mkdir(parents=True, exist_ok=True)
    mark.touch()


@contextmanager
def _failing_once(run: Run, results: Path) -> Iterator[None]:
    """Attempts of a run that failed by its own fault are not repeated by the workflow that is going on; those of a killed one are."""
    submission = os.environ.get(PROGRESS_VARIABLE)
    told = progress_folder(results) / f"{run.inputs[:16]}.final"
    before = read_json(told) if submission else None
    if before and before.get("submission") == submission:
        raise RunError(str(before.get("message")))
    try:
        yield
    except (Killed, Interrupted):
        raise
    except RunError as error:
        if submission:
            write_json(told, {"submission": submission, "message": str(error)})
        raise


def _study_at(source: Source, place: str) -> PlannedStudy:
    case, _, engine = Path(place).parts
    (one,) = [one for one in studies(source.series([case], [engine])) if one.place == Path(place)]
    return one


def step_name(step: str, place: str | Path = "") -> str:
    """Name under which a step other than a simulation tells its progress: `measure silo dry yade`."""
    return " ".join((step, *Path(place).parts))


@contextmanager
def _told(name: str, board: FileBoard) -> Iterator[None]:
    board.post(name, state="running", started=time.time())
    try:
        yield
    except DembarkError as error:
        board.post(name, state="failed", ended=time.time(), message=str(error))
        raise
    board.post(name, state="finished", ended=time.time())


def _arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m dembark.validation.jobs", description=__doc__)
    parser.add_argument("step", choices=("simulate", "measure", "study", "compare", "report"))
    parser.add_argument("--profile")
    parser.add_argument("--campaign", type=Path, help="file of a campaign, in the place of a profile")
    parser.add_argument("--results", type=Path, required=True, help="results/<profile>, or the campaign's folder")
    parser.add_argument("--case", action="append")
    parser.add_argument("--engine", action="append")
    parser.add_argument("--place", help="<case>/<variant>/<engine>, or <case>/<variant> to compare")
    parser.add_argument("--replica", type=int)
    parser.add_argument("--mark", help="file to touch when the run is finished")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--restart-interval", type=float, default=Resources.restart_interval, help="wall time between restart files (s)")
    parser.add_argument("--elsewhere", action="store_true", help="this is not the submitting host, which alone writes the store")
    return parser.parse_args(words)


def _step(options: argparse.Namespace, source: Source, results: Path) -> None:
    """A step other than a simulation."""
    chosen = source.series(options.case or (), options.engine or ()) if options.step == "report" else []
    if options.step == "measure":
        one = _series_at(source, options.place)
        measure_series(results / one.place, one.runs)
        if not options.elsewhere:
            store.collect(results, source.label, [one])
    elif options.step == "study":
        measure_study(results, _study_at(source, options.place))
    elif options.step == "compare":
        compare_engines(results / options.place)
    else:
        messages = failures(results, chosen)
        write_summary(results, source, chosen, messages)
        collect_all(results, source, chosen, messages, whole=not (options.case or options.engine))
        build_report(results)


def main(words: Sequence[str] | None = None) -> int:
    """Run one step; returns the exit code."""
    options = _arguments(words)
    results: Path = options.results.resolve()
    progress_folder(results).mkdir(parents=True, exist_ok=True)
    try:
        source = Source(options.profile, options.campaign)
        if options.step == "simulate":
            _simulate(options, source, results)
            return 0
        with _told(step_name(options.step, options.place or ""), FileBoard(progress_folder(results))):
            _step(options, source, results)
    except DembarkError as error:
        print(f"dembark: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
