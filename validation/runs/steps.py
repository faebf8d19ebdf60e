"""The steps after the runs: measure a series, look at a study, compare engines, build the report; and when each has to be done again.

They are made from `plan.json` and the files of the runs, with no engine: results may be measured and reported on another machine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError, RunError
from dembark.common.extras import advice
from dembark.common.files import retire, write_atomic
from dembark.postproc import pictures
from dembark.validation import analysis, metrics, provenance, results
from dembark.validation.campaigns import targets
from dembark.validation.campaigns.plan import studies
from dembark.validation.case.folders import files, find
from dembark.validation.case.model import Study
from dembark.validation.judge import comparison, inputs
from dembark.validation.judge.result import COMPARISON, METRICS, Result, result_files, write
from dembark.validation.judge.tally import VERIFICATION
from dembark.validation.results import RECORD

# A campaign's folder holds a copy of its file.
CAMPAIGN_FILE = "campaign.toml"
# What draws and lays out reports.
_REPORTING = ("validation/report", "validation/campaigns/report", "postproc/field_figures.py")


@dataclass(frozen=True)
class Step:
    """`call(*arguments)` makes `target` when all runs and steps called `needs` have ended.

    `inputs` gives the hash of the present inputs; the target holds that of the inputs that it was made from.
    """

    name: str
    kind: str
    needs: tuple[str, ...]
    target: Path
    inputs: Callable[[], str]
    call: Callable[..., object]
    arguments: tuple[Any, ...]

    def up_to_date(self) -> bool:
        """Whether the target is there and was made from the present inputs."""
        return self.target.is_file() and inputs.stored_hash(self.target) == self.inputs()


def steps(folder: Path) -> list[Step]:
    """All steps after the runs that `plan.json` in the results folder names, each after those that it needs."""
    plan = results.plan(folder)
    found: list[Step] = []
    # The report of a profile includes the verification of the instruments, that of some cases or of a campaign does not.
    if not plan.get("cases") and not (folder / CAMPAIGN_FILE).is_file():
        found.append(Step("verification", "verify", (), folder / VERIFICATION, _of_verification, verify, (folder,)))
    planned: dict[Path, dict[str, str]] = {}
    for run in plan.get("runs", ()):
        planned.setdefault(Path(run["folder"]).parent, {})[Path(run["folder"]).name] = run["inputs"]
    for place, runs in planned.items():
        needs = tuple(results.run_name(place / name) for name in runs)
        given = (folder / place, place.parts[0], runs)
        found.append(Step(_name("measure", place), "measure", needs, folder / place / METRICS, partial(_of_series, *given), measure_series,
                          given))
    groups: dict[Path, list[Step]] = {}
    for step in [*found, *_study_steps(folder, planned)]:
        groups.setdefault(step.target.parent.parent, []).append(step)
        if step.kind == "study":
            found.append(step)
    for variant, group in groups.items():
        if len(group) > 1:
            sources = tuple(step.target for step in group)
            found.append(Step(_name("compare", variant.relative_to(folder)), "compare", tuple(step.name for step in group),
                              variant / COMPARISON, partial(_of_comparison, sources), compare_engines, (variant, sources)))
    found.append(Step("report", "report", tuple(step.name for step in found), folder / "report.html", partial(_of_report, folder),
                      build_report, (folder,)))
    return found


def _study_steps(folder: Path, planned: Iterable[Path]) -> list[Step]:
    return [Step(_name("study", place), "study", tuple(_name("measure", one) for one in points), folder / place / METRICS,
                 partial(_of_study, folder, study, points), measure_study, (folder, study, place, points))
            for study, place, points in studies(planned)]


def _of_verification() -> str:
    return inputs.of_code("validation/verification")


def _of_series(folder: Path, name: str, runs: Mapping[str, str]) -> str:
    """Hash of the inputs of the results of a series of the case `name`: measurement, verdicts and pictures of the finished `runs`."""
    case, records = find(name), [folder / one / RECORD for one in _finished(folder, runs)]
    return inputs.digest(list(runs.values()), inputs.of_measurement(case, records), inputs.of_verdicts(case),
                         inputs.of_pictures(case, records))


def _finished(folder: Path, runs: Mapping[str, str]) -> list[str]:
    """Folder names of the `runs` (hash of the inputs by folder name) that are finished."""
    return [name for name, of_run in runs.items() if results.record(folder / name, of_run) is not None]


def _of_study(folder: Path, study: Study, points: Iterable[Path]) -> str:
    points = list(points)
    return inputs.digest(asdict(study) | {"formal_order": study.formal_order.text},
                         inputs.of_study(find(points[0].parts[0]), [folder / point / METRICS for point in points]))


def _of_comparison(sources: Iterable[Path]) -> str:
    return inputs.digest(inputs.of_code("validation/judge/comparison.py"), [inputs.content(path) for path in sources])


def _of_report(folder: Path) -> str:
    """Hash of the inputs of a report: results, the states of the planned runs, the files of the cases, and the code that lays it out."""
    plan = {key: value for key, value in results.plan(folder).items() if key not in ("submitted", "runs")}
    states = [(state.folder, state.inputs, state.state, state.message) for state in results.states(folder)]
    read = (folder / CAMPAIGN_FILE, folder / VERIFICATION, *sorted((folder / targets.FOLDER).glob("*")), *result_files(folder))
    kept = {str(path.relative_to(folder)): inputs.content(path) for path in read}
    cases = [path for path in files() if path.parent.name in {name.split("/")[0] for name in kept}]
    drawing = [str(path) for case in cases if (path := case.with_name("figures.py")).is_file()]
    return inputs.digest(plan, states, kept, {path.parent.name: inputs.content(path) for path in cases},
                         inputs.of_code(*_REPORTING, *drawing))


def _name(kind: str, place: Path) -> str:
    return " ".join((kind, *place.parts))


def _kind_and_text(error: Exception) -> list[str]:
    return [*advice(error)] or [f"{type(error).__name__}: {error}"]


@contextmanager
def _in_one_line(what: str, why: Callable[[Exception], Iterable[str]] = _kind_and_text) -> Iterator[None]:
    """Whatever fails in an analysis or a report becomes one line: `what`, and `why`."""
    try:
        yield
    except DembarkError:
        raise
    except Exception as error:
        raise RunError(what, *why(error)) from error


def measure_series(folder: Path, name: str, runs: Mapping[str, str]) -> Result:
    """Measure and judge the finished ones of `runs` (hash of the inputs by folder name) of the case `name`, draw them, and write
    `folder/metrics.json`.

    Results of other inputs are put aside first. What was measured of the same inputs is kept. RunError when none is finished or
    the measurement fails; then there is no metrics.json, rather than an old one.
    """
    done = _finished(folder, runs)
    for path in folder.glob("replica-*"):
        if path.name not in done:
            retire(path)
    target = folder / METRICS
    if not done:
        retire(target)
        raise RunError(f"nothing to measure in {folder}", "none of its runs is finished")
    case, inputs_hash = find(name), _of_series(folder, name, runs)
    target.unlink(missing_ok=True)
    with _in_one_line(f"{folder} could not be measured", lambda error: analysis.reasons(folder, error, case)):
        # Another process renders: the thread only waits for it.
        with ThreadPoolExecutor(1) as thread:
            drawn = thread.submit(pictures.draw, folder, metrics.picture(folder))
            found = metrics.measure(folder, len(runs))
        return write(target, replace(found, remarks=(*found.remarks, *drawn.result()), inputs_hash=inputs_hash))


def measure_study(folder: Path, study: Study, place: Path, points: Sequence[Path]) -> None:
    """Write `metrics.json` of a study at `place` below `folder` from those of its `points`; RunError when one of them is missing or the
    study fails."""
    target, inputs_hash = folder / place / METRICS, _of_study(folder, study, points)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.unlink(missing_ok=True)
    with _in_one_line(f"{folder / place} could not be measured"):
        write(target, replace(metrics.study(study, [folder / point for point in points]), inputs_hash=inputs_hash))


def compare_engines(folder: Path, sources: Sequence[Path]) -> None:
    """Write `folder/comparison.json` (folder = <results>/<case>/<variant>) when two of the metrics.json `sources` or more are there; an old
    one goes aside otherwise. RunError when the comparison fails."""
    target, inputs_hash = folder / COMPARISON, _of_comparison(sources)
    if sum(path.is_file() for path in sources) < 2:
        retire(target)
        return
    target.unlink(missing_ok=True)
    with _in_one_line(f"{folder} could not be compared"):
        write(target, replace(comparison.compare(folder), measured=provenance.measured(), inputs_hash=inputs_hash))


def verify(folder: Path) -> None:
    """Verify the instruments and write `verification.json` into a results folder; RunError when that fails."""
    with _in_one_line("the instruments could not be verified"):
        # Its libraries are those of an extra.
        from dembark.validation import verification

        verification.write(folder, inputs_hash=_of_verification())


def build_report(folder: Path) -> None:
    """Write report.html and report.pdf into a results folder (results/<profile> or a campaign's); RunError when that fails."""
    page = folder / "report.html"
    # Better none than one of other results.
    page.unlink(missing_ok=True)
    if results.plan(folder).get("cases"):
        (folder / VERIFICATION).unlink(missing_ok=True)
    inputs_hash = _of_report(folder)
    with _in_one_line(f"the report of {folder} could not be built"):
        # Its libraries are those of an extra.
        from dembark.validation import report
        from dembark.validation.campaigns.report import build as campaign_report

        (campaign_report if (folder / CAMPAIGN_FILE).is_file() else report).build(folder)
        write_atomic(page, inputs.stamp(page.read_text(encoding="utf-8"), inputs_hash).encode())
