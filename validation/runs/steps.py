"""The steps after the runs: measure a series, look at a study, compare engines, build the report; and when each has to be done again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dembark.common.errors import DembarkError, RunError
from dembark.common.files import read_json, retire, write_json, write_whole
from dembark.postproc import pictures
from dembark.validation import analysis, provenance
from dembark.validation.case.folders import files
from dembark.validation.judge import inputs
from dembark.validation.judge.result import COMPARISON, METRICS, RUNS, Result, result_files, write
from dembark.validation.judge.tally import VERIFICATION
from dembark.validation.runs.plan import Plan, PlannedStudy, Run, finished, studies, variants

if TYPE_CHECKING:
    from dembark.validation.metrics import Early

# A campaign's folder holds a copy of its file.
CAMPAIGN_FILE = "campaign.toml"
_DRAWN = "pictures.json"
# What draws and lays out reports, and the code that verifies the instruments for them.
_REPORTING = ("validation/report", "validation/campaigns/report", "validation/verification", "postproc/field_figures.py")


@dataclass(frozen=True)
class Step:
    """`call(*arguments)` makes `target`, after all runs and steps called `needs` have ended; `place` is its folder.

    `inputs` gives the hash of the present inputs; the target holds that of the inputs that it was made from.
    """

    name: str
    kind: str
    place: Path
    needs: tuple[str, ...]
    target: Path
    inputs: Callable[[], str]
    call: Callable[..., object]
    arguments: tuple[Any, ...]

    def up_to_date(self) -> bool:
        """Whether the target is there and was made from the present inputs."""
        return self.target.is_file() and inputs.stored(self.target) == self.inputs()


def steps(plan: Plan, results: Path) -> list[Step]:
    """All steps after the runs of `plan`, each after those that it needs."""
    found = []
    for one in plan.series:
        folder = results / one.place
        found.append(Step(name("measure", one.place), "measure", one.place, tuple(run.name for run in one.runs), folder / METRICS,
                          partial(of_series, folder, one.runs), measure_series, (folder, one.runs)))
    for planned in studies(plan.series):
        needs = tuple(name("measure", one.place) for one in planned.series)
        found.append(Step(name("study", planned.place), "study", planned.place, needs, results / planned.place / METRICS,
                          partial(of_study, results, planned), measure_study, (results, planned)))
    for place, group in variants(plan.series).items():
        if len(group) > 1:
            needs = tuple(name("study" if isinstance(one, PlannedStudy) else "measure", one.place) for one in group)
            sources = tuple(results / one.place / METRICS for one in group)
            found.append(Step(name("compare", place), "compare", place, needs, results / place / COMPARISON,
                              partial(of_comparison, sources), compare_engines, (results / place, sources)))
    found.append(Step("report", "report", Path(), tuple(step.name for step in found), results / "report.html",
                      partial(of_report, results), build_report, (results,)))
    return found


def of_series(folder: Path, runs: Iterable[Run]) -> str:
    """Hash of the inputs of a series' results: measurement, verdicts and pictures of the finished ones of `runs`."""
    runs = list(runs)
    case = runs[0].case
    records = [path for run in runs if finished((path := folder / run.folder_name / "run.json").parent, run)]
    return inputs.digest([run.inputs for run in runs], inputs.of_measurement(case, records), inputs.of_verdicts(case),
                         inputs.of_pictures(case, records))


def of_study(results: Path, planned: PlannedStudy) -> str:
    """Hash of the inputs of a study."""
    case = planned.series[0].runs[0].case
    return inputs.digest(asdict(planned.study) | {"formal_order": planned.study.formal_order.text},
                         inputs.of_study(case, [results / one.place / METRICS for one in planned.series]))


def of_comparison(metrics: Iterable[Path]) -> str:
    """Hash of the inputs of a comparison of engines."""
    return inputs.digest(inputs.of_code("validation/judge/compare.py"), [inputs.content(path) for path in metrics])


def of_report(results: Path) -> str:
    """Hash of the inputs of a report: results, the list of runs, the files of the cases, and the code that lays it out."""
    read = (results / RUNS, results / CAMPAIGN_FILE, *result_files(results))
    kept = {str(path.relative_to(results)): inputs.content(path) for path in read}
    cases = [path for path in files() if path.parent.name in {name.split("/")[0] for name in kept}]
    drawing = [str(path) for case in cases if (path := case.with_name("figures.py")).is_file()]
    return inputs.digest(kept, {path.parent.name: inputs.content(path) for path in cases}, inputs.of_code(*_REPORTING, *drawing))


def name(kind: str, place: Path) -> str:
    """Name of a step: its kind, case, variant and engine."""
    return " ".join((kind, *place.parts))


@contextmanager
def _told(what: str, why: Callable[[Exception], Iterable[str]] = lambda error: [f"{type(error).__name__}: {error}"]) -> Iterator[None]:
    """Whatever goes wrong in an analysis or a report is a failure to be told in one line: `what`, and `why`."""
    try:
        yield
    except DembarkError:
        raise
    except Exception as error:
        raise RunError(what, *why(error)) from error


def draw(folder: Path) -> list[str]:
    """Draw the pictures of the replicas in `folder`; remarks where one cannot be drawn."""
    from dembark.validation.metrics import picture

    return pictures.draw(folder, picture(folder))


def measure_series(folder: Path, runs: Iterable[Run], drawn: Future[list[str]] | None = None, early: Early | None = None) -> Result:
    """Measure and judge the finished ones of `runs` and write `folder/metrics.json`; results of other inputs are put aside first. What was
    measured or drawn of the same inputs is kept.

    `drawn`: what `draw` returns, where the pictures are being drawn already; `early`: what was read already. Raises RunError when none is
    finished or the measurement fails; then there is no metrics.json, rather than an old one.
    """
    wanted = {run.folder_name: run for run in runs}
    for path in folder.glob("replica-*"):
        if path.name not in wanted or not finished(path, wanted[path.name]):
            retire(path)
    done = [run for name, run in wanted.items() if (folder / name).is_dir()]
    target = folder / METRICS
    if not done:
        retire(target)
        raise RunError(f"nothing to measure in {folder}", "none of its runs is finished")
    inputs_hash = of_series(folder, wanted.values())
    target.unlink(missing_ok=True)
    with _told(f"{folder} could not be measured", lambda error: analysis.reasons(folder, error, done[0].case)):
        from dembark.validation.metrics import measure

        # A process of its own draws, which measuring need not wait for.
        with ThreadPoolExecutor(1) as beside:
            drawing = beside.submit(_drawn, folder, done, drawn)
            found = measure(folder, len(wanted), early)
        return write(target, replace(found, remarks=(*found.remarks, *drawing.result()), inputs_hash=inputs_hash))


def _drawn(folder: Path, runs: Sequence[Run], drawn: Future[list[str]] | None) -> list[str]:
    """Remarks on the pictures of `runs`, which are drawn unless those in `folder` are of the same inputs."""
    record = folder / _DRAWN
    inputs_hash = inputs.of_pictures(runs[0].case, [folder / run.folder_name / "run.json" for run in runs])
    kept = read_json(record) or {}
    if drawn is None and kept.get(inputs.KEY) == inputs_hash and all((folder / name).is_file() for name in kept["files"]):
        return list(kept["remarks"])
    record.unlink(missing_ok=True)
    remarks = drawn.result() if drawn else draw(folder)
    there = [name for name in (pictures.PICTURE, pictures.ANIMATION) if (folder / name).is_file()]
    write_json(record, {inputs.KEY: inputs_hash, "files": there, "remarks": remarks})
    return remarks


def measure_study(results: Path, planned: PlannedStudy) -> None:
    """Write `metrics.json` of a study from those of its variants; RunError when one of them is missing or the study fails."""
    target, inputs_hash = results / planned.place / METRICS, of_study(results, planned)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.unlink(missing_ok=True)
    with _told(f"{results / planned.place} could not be measured"):
        from dembark.validation.metrics import study

        write(target, replace(study(planned.study, [results / one.place for one in planned.series]), inputs_hash=inputs_hash))


def compare_engines(folder: Path, metrics: Sequence[Path]) -> None:
    """Write `folder/comparison.json` (folder = results/<profile>/<case>/<variant>) when two of `metrics` or more are there; an old one goes
    aside otherwise. RunError when the comparison fails."""
    target, inputs_hash = folder / COMPARISON, of_comparison(metrics)
    if sum(path.is_file() for path in metrics) < 2:
        retire(target)
        return
    target.unlink(missing_ok=True)
    with _told(f"{folder} could not be compared"):
        from dembark.validation.judge.compare import compare

        write(target, replace(compare(folder), measured=provenance.measured(), inputs_hash=inputs_hash))


def build_report(results: Path) -> None:
    """Write report.html and report.pdf into `results` (results/<profile> or a campaign's folder); RunError when that fails."""
    build: Callable[[Path], Path]
    inputs_hash = of_report(results)
    if (results / CAMPAIGN_FILE).is_file():
        from dembark.validation.campaigns.report.build import build
    else:
        from dembark.validation import verification
        from dembark.validation.report import build

        # The report of a profile includes the verification of the instruments, that of some cases does not.
        if (read_json(results / RUNS) or {}).get("cases"):
            (results / VERIFICATION).unlink(missing_ok=True)
        else:
            verification.write(results)
    # Better none than one of other results.
    report = results / "report.html"
    report.unlink(missing_ok=True)
    with _told(f"the report of {results} could not be built"):
        build(results)
        write_whole(report, inputs.stamp(report.read_text(encoding="utf-8"), inputs_hash).encode())
