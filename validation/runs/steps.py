"""The steps after the runs: measure a series, look at a study, compare engines, build the report; and when each has to be done again."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dembark import common, postproc, validation
from dembark.common.errors import DembarkError, RunError
from dembark.common.files import retire
from dembark.postproc import pictures
from dembark.validation import analysis, provenance
from dembark.validation.judge.result import COMPARISON, METRICS, Result, write
from dembark.validation.runs.plan import Plan, PlannedStudy, Run, finished, studies, variants

if TYPE_CHECKING:
    from dembark.validation.metrics import Early

# A campaign's folder holds a copy of its file.
CAMPAIGN_FILE = "campaign.toml"
_REPORTING = {"report", "verification", "figures"}
_ELSEWHERE = {"runs", "campaigns", "tests"}


@dataclass(frozen=True)
class Step:
    """`call(*arguments)` makes `target` of `sources`, after all runs and steps called `needs` have ended; `place` is its folder.

    `wanted`: hash of the inputs of runs, which tells a result that is to be measured from one of earlier inputs.
    """

    name: str
    kind: str
    place: Path
    needs: tuple[str, ...]
    target: Path
    sources: tuple[Path, ...]
    call: Callable[..., object]
    arguments: tuple[Any, ...]
    wanted: str = ""

    def inputs(self) -> str:
        """Hash of the contents of its sources, and of the code that reads them."""
        total = hashlib.sha256((_code(self.kind == "report") + self.wanted).encode())
        for path in self.sources:
            total.update(path.read_bytes() if path.is_file() else b"missing")
        return total.hexdigest()


@cache
def _code(reporting: bool) -> str:
    total = hashlib.sha256()
    for folder in (Path(place) for package in (common, validation, postproc) for place in package.__path__):
        for path in sorted(folder.rglob("*.*")):
            parts = set(path.relative_to(folder).parts)
            wanted = parts & _REPORTING and not parts & {"tests"} if reporting else not parts & (_REPORTING | _ELSEWHERE)
            if path.suffix in (".py", ".toml", ".j2", ".css") and wanted:
                total.update(path.read_bytes())
    return total.hexdigest()


def steps(plan: Plan, results: Path) -> list[Step]:
    """All steps after the runs of `plan`, each after those that it needs."""
    found = []
    for one in plan.series:
        folder, own = results / one.place, one.runs[0].case.folder / "measure.py"
        found.append(Step(name("measure", one.place), "measure", one.place, tuple(run.name for run in one.runs), folder / METRICS,
                          (own, *(folder / run.folder_name / "run.json" for run in one.runs)), measure_series, (folder, one.runs),
                          "".join(run.inputs for run in one.runs)))
    for planned in studies(plan.series):
        parts = tuple(results / one.place / METRICS for one in planned.series)
        found.append(Step(name("study", planned.place), "study", planned.place, tuple(name("measure", one.place) for one in planned.series),
                          results / planned.place / METRICS, parts, measure_study, (results, planned)))
    for place, group in variants(plan.series).items():
        if len(group) > 1:
            kinds = tuple(name("study" if isinstance(one, PlannedStudy) else "measure", one.place) for one in group)
            sources = tuple(results / one.place / METRICS for one in group)
            found.append(Step(name("compare", place), "compare", place, kinds, results / place / COMPARISON, sources,
                              compare_engines, (results / place, sources)))
    sources = (results / "runs.json", results / CAMPAIGN_FILE, *(step.target for step in found))
    found.append(Step("report", "report", Path(), tuple(step.name for step in found), results / "report.html", sources, build_report,
                      (results,)))
    return found


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
    """Measure the finished ones of `runs` and write `folder/metrics.json`; results of other inputs are put aside first.

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
    target.unlink(missing_ok=True)
    with _told(f"{folder} could not be measured", lambda error: analysis.reasons(folder, error, done[0].case)):
        from dembark.validation.metrics import measure

        # A process of its own draws, which measuring need not wait for.
        with ThreadPoolExecutor(1) as beside:
            drawn = drawn or beside.submit(draw, folder)
            found = measure(folder, len(wanted), early)
        return write(target, replace(found, remarks=(*found.remarks, *drawn.result())))


def measure_study(results: Path, planned: PlannedStudy) -> None:
    """Write `metrics.json` of a study from those of its variants; RunError when one of them is missing or the study fails."""
    target = results / planned.place / METRICS
    target.parent.mkdir(parents=True, exist_ok=True)
    target.unlink(missing_ok=True)
    with _told(f"{results / planned.place} could not be measured"):
        from dembark.validation.metrics import study

        write(target, study(planned.study, [results / one.place for one in planned.series]))


def compare_engines(folder: Path, metrics: Sequence[Path]) -> None:
    """Write `folder/comparison.json` (folder = results/<profile>/<case>/<variant>) when two of `metrics` or more are there; an old one goes
    aside otherwise. RunError when the comparison fails."""
    target = folder / COMPARISON
    if sum(path.is_file() for path in metrics) < 2:
        retire(target)
        return
    target.unlink(missing_ok=True)
    with _told(f"{folder} could not be compared"):
        from dembark.validation.judge.compare import compare

        write(target, replace(compare(folder), measured=provenance.measured()))


def build_report(results: Path) -> None:
    """Write report.html and report.pdf into `results` (results/<profile> or a campaign's folder); RunError when that fails."""
    build: Callable[[Path], Path]
    if (results / CAMPAIGN_FILE).is_file():
        from dembark.validation.campaigns.report.build import build
    else:
        from dembark.validation import verification
        from dembark.validation.report import build

        # The report of a profile includes the verification of the instruments.
        verification.write(results)
    # Better none than one of other results.
    (results / "report.html").unlink(missing_ok=True)
    with _told(f"the report of {results} could not be built"):
        build(results)
