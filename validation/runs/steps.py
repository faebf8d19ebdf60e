"""The steps after the runs: measure a series, look at a study, compare engines, build the report; and when each has to be done again."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from dembark import common, postproc, validation
from dembark.common.errors import DembarkError, RunError
from dembark.common.files import retire, write_json
from dembark.validation import analysis, pictures, provenance
from dembark.validation.runs.plan import Plan, PlannedStudy, Run, finished, studies, variants

# A campaign's folder holds a copy of its file.
CAMPAIGN_FILE = "campaign.toml"
_REPORTING = {"report", "verification"}
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
    for package in (common, validation, postproc):
        folder = Path(package.__file__).parent
        for path in sorted(folder.rglob("*.*")):
            parts = set(path.relative_to(folder).parts)
            wanted = parts & _REPORTING and not parts & {"tests"} if reporting else not parts & (_REPORTING | _ELSEWHERE)
            if path.suffix in (".py", ".j2", ".css") and wanted:
                total.update(path.read_bytes())
    return total.hexdigest()


def steps(plan: Plan, results: Path) -> list[Step]:
    """All steps after the runs of `plan`, each after those that it needs."""
    found = []
    for one in plan.series:
        folder, own = results / one.place, one.runs[0].case.folder / "measure.py"
        found.append(Step(name("measure", one.place), "measure", one.place, tuple(run.name for run in one.runs), folder / "metrics.json",
                          (own, *(folder / run.folder_name / "run.json" for run in one.runs)), measure_series, (folder, one.runs),
                          "".join(run.inputs for run in one.runs)))
    for planned in studies(plan.series):
        parts = tuple(results / one.place / "metrics.json" for one in planned.series)
        found.append(Step(name("study", planned.place), "study", planned.place, tuple(name("measure", one.place) for one in planned.series),
                          results / planned.place / "metrics.json", parts, measure_study, (results, planned)))
    for place, group in variants(plan.series).items():
        if len(group) > 1:
            kinds = tuple(name("study" if isinstance(one, PlannedStudy) else "measure", one.place) for one in group)
            sources = tuple(results / one.place / "metrics.json" for one in group)
            found.append(Step(name("compare", place), "compare", place, kinds, results / place / "comparison.json", sources,
                              compare_engines, (results / place, sources)))
    sources = (results / "runs.json", results / CAMPAIGN_FILE, *(step.target for step in found))
    found.append(Step("report", "report", Path(), tuple(step.name for step in found), results / "report.html", sources, build_report,
                      (results,)))
    return found


def name(kind: str, place: Path) -> str:
    """Name of a step: `measure silo dry yade`."""
    return " ".join((kind, *place.parts))


def _now() -> dict[str, Any]:
    """When, and by which version of the code, something is measured; the runs themselves may be older."""
    return {**provenance.commit(), "at": datetime.now(UTC).isoformat(timespec="seconds")}


@contextmanager
def _told(what: str) -> Iterator[None]:
    """Whatever goes wrong in an analysis or a report is a failure to be told in one line."""
    try:
        yield
    except DembarkError:
        raise
    except Exception as error:
        raise RunError(what, f"{type(error).__name__}: {error}") from error


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
    except Exception as error:  # as in _told, with what is too small in the runs
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
    with _told(f"{results / planned.place} could not be measured"):
        write_json(target, study(planned.study, [results / one.place for one in planned.series]) | {"measured": _now()})


def compare_engines(folder: Path, metrics: Sequence[Path]) -> None:
    """Write `folder/comparison.json` (folder = results/<profile>/<case>/<variant>) when all of `metrics` are there; an old one goes aside
    otherwise. RunError when the comparison fails."""
    from dembark.validation.compare import compare

    target = folder / "comparison.json"
    if not all(path.is_file() for path in metrics):
        retire(target)
        return
    target.unlink(missing_ok=True)
    with _told(f"{folder} could not be compared"):
        write_json(target, compare(folder) | {"measured": _now()})


def build_report(results: Path) -> None:
    """Write report.html and report.pdf into `results` (results/<profile> or a campaign's folder); RunError when that fails."""
    if (results / CAMPAIGN_FILE).is_file():
        from dembark.validation.campaigns import report
    else:
        from dembark.validation import report, verification

        # The report of a profile includes the verification of the instruments.
        verification.write(results)
    # Better none than one of other results.
    (results / "report.html").unlink(missing_ok=True)
    with _told(f"the report of {results} could not be built"):
        report.build(results)
