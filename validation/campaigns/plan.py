"""What there is to do: a run is a case, variant, profile, engine and replica with all its numbers, known by a hash of its inputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from dembark.common.choices import Value, pick
from dembark.common.errors import DembarkError
from dembark.validation import engines, results
from dembark.validation.case.deck import require_capable, require_measure, require_steps, sources
from dembark.validation.case.folders import discover, find, require_known
from dembark.validation.case.model import Case, Study
from dembark.validation.case.resolve import for_replica, portable, resolve
from dembark.validation.engines import Engine
from dembark.validation.judge.result import COMPARISON, METRICS

from .fitted import FittedParameters

# How often a run that was ended from outside is started again.
RETRIES = 3
# Of a campaign.
MOST_RUNS = 20000
# For each grain and frame a line of grains.dump, and two to three of contacts.dump.
_BYTES_PER_GRAIN_AND_FRAME = {"grains": 200, "contacts": 600}


@dataclass(frozen=True)
class Run:
    """One simulation; `values` are the resolved parameters in SI units with this replica's own seed. `fitted`: of a run at a draw of a
    posterior what that is known by, see `fitted.FittedParameters`."""

    case: Case
    variant: str
    profile: str
    engine: Engine
    replica: int
    values: Mapping[str, Value]
    fitted: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Short name for people: case, variant, engine and replica."""
        return results.run_name(Path(self.case.name, self.variant, self.engine.name, self.folder_name))

    @property
    def folder_name(self) -> str:
        """Name of the folder with its results."""
        return f"replica-{self.replica}"

    @property
    def particles(self) -> int | None:
        """Number of grains or logs; None when the case does not say."""
        return self.case.particle_count(self.values)

    @property
    def output_size(self) -> int | None:
        """About how many bytes the run writes; None when the case does not say how many particles or frames there are."""
        frames = self.values.get("frames")
        line = sum(_BYTES_PER_GRAIN_AND_FRAME.get(output, 0) for output in self.case.outputs)
        return self.particles * frames * line if self.particles and isinstance(frames, int) else None

    @cached_property
    def inputs(self) -> str:
        """Hash of what decides the outcome: parameters, deck and engine, but not the host, the cores, or the number of replicas."""
        parameters = {key: value for key, value in self.values.items() if key != "replicas"}
        facts = {"parameters": parameters, "deck": sources(self.case, self.engine.name),
                 "engine": [self.engine.name, self.engine.version, self.engine.identity, self.engine.switches()],
                 **({"fitted": self.fitted["sha256"]} if self.fitted else {})}
        return hashlib.sha256(json.dumps(facts, sort_keys=True, allow_nan=False).encode()).hexdigest()


@dataclass(frozen=True)
class Series:
    """The replicas of one case, variant and engine; they are measured together."""

    runs: tuple[Run, ...]

    @property
    def place(self) -> Path:
        """Folder below results/<profile>: <case>/<variant>/<engine>."""
        run = self.runs[0]
        return Path(run.case.name, run.variant, run.engine.name)

    @property
    def cost(self) -> float:
        """Relative cost of one replica, to start the longest first."""
        return (self.runs[0].particles or 1) * self.runs[0].engine.facts.relative_cost


@dataclass(frozen=True)
class Resources:
    """What a run may use: MPI ranks and threads; memory (bytes), time of an attempt (s) and about how long it computes between restart
    files (s, 0: none), where None leaves the choice to the system."""

    ranks: int = 1
    threads: int = 1
    memory: float | None = None
    time: float | None = None
    restart_interval: float | None = None

    @property
    def cores(self) -> int:
        """Cores of one run."""
        return self.ranks * self.threads


@dataclass(frozen=True)
class Plan:
    """All that belongs into one results folder: a profile, or a campaign, and its series with the longest first.

    `facts` say for people and the report what was asked for; `resources` are those of a series' runs by its place, `measure` those of the
    job that measures on a cluster; `tables` are the files that targets were read from.
    """

    label: str
    series: tuple[Series, ...]
    facts: Mapping[str, Any]
    resources: Mapping[Path, Resources] = field(default_factory=dict)
    retries: int = RETRIES
    measure: Resources = Resources()
    tables: tuple[Path, ...] = ()

    @property
    def folders(self) -> dict[str, Run]:
        """The runs by their folders below that of the results."""
        return {str(one.place / run.folder_name): run for one in self.series for run in one.runs}

    def as_json(self, estimates: Mapping[Path, float | None] | None = None) -> dict[str, Any]:
        """The content of plan.json; `estimates`: expected wall times (s) of a run by places of series. `results`: the files of series,
        studies and comparisons that a report counts."""
        places = [one.place for one in self.series]
        measured = dict.fromkeys([*places, *(place for _, place, _ in studies(places))])
        compared = dict.fromkeys(place.parent for place in measured)
        return {**self.facts, "results": [*(str(place / METRICS) for place in measured), *(str(place / COMPARISON) for place in compared)],
                "runs": [{"folder": str(one.place / run.folder_name), "inputs": run.inputs,
                                        **({"estimate": estimates.get(one.place)} if estimates else {})}
                                       for one in self.series for run in one.runs]}


def series(case: Case, variant: str, profile: str | None, engine: Engine, changes: Mapping[str, Value] | None = None,
           name: str | None = None) -> Series:
    """The runs of one case, variant and engine; as many as the parameter `replicas` says (1 when the case has none).

    With `changes` to the variant, `name` is the name of the changed variant; it has no part in the hash of the inputs.
    """
    require_measure(case)
    values = portable(resolve(case, profile, variant, changes))
    require_capable(case, engine.name, values)
    require_steps(case, values)
    count = values.get("replicas")
    numbers = range(1, (count if isinstance(count, int) else 1) + 1)
    return Series(tuple(Run(case, name or variant, profile or "default", engine, k, for_replica(values, k)) for k in numbers))


def predicted(case: Case, variant: str, profile: str, engine: Engine, fitted: FittedParameters, count: int,
              changes: Mapping[str, Value] | None = None) -> Series:
    """`count` runs, each with a draw of the posterior of `fitted` and, where the case has packings, a packing of its own."""
    if "replicas" in (changes or {}):
        raise DembarkError("replicas is set", "each member has a packing of its own", "set their number with --members")
    packings = {"replicas": count} if "replicas" in case.parameters else {}
    drawn = [series(case, variant, profile, engine, {**one, **packings}) for one in fitted.members(case, count, changes or {})]
    return Series(tuple(replace(one.runs[0], replica=k, values=for_replica(one.runs[0].values, k), fitted=fitted.facts)
                        for k, one in enumerate(drawn, start=1)))


def of_profile(profile: str, only_cases: Sequence[str] = (), only_engines: Sequence[str] = ()) -> list[Series]:
    """All series that the cases list for `profile`, longest first; only the engines that are needed have to be there, and of the optional
    ones only those that are named in `only_engines`."""
    cases = discover()
    for name in only_cases:
        require_known(name, cases, "in --case")
    for name in only_engines:
        pick(name, engines.names(), "engine", "in --engine")
    pick(profile, {name for case in cases.values() for name in case.profiles}, "profile", "in the cases")
    gone = left_out(profile, only_cases, only_engines)
    result = [series(case, planned.variant, profile, engines.find(engine), planned.changes(engine))
              for case in _chosen(only_cases) for planned in case.runs.get(profile, ())
              for engine in planned.engines if engine not in gone and (not only_engines or engine in only_engines)]
    if not result:
        raise DembarkError(f"profile {profile} has no runs", "for the chosen cases and engines", "see 'dembark cases'")
    return sorted(result, key=lambda one: -one.cost)


def _chosen(only_cases: Sequence[str]) -> list[Case]:
    return [case for case in discover().values() if not only_cases or case.name in only_cases]


def left_out(profile: str, only_cases: Sequence[str] = (), only_engines: Sequence[str] = ()) -> dict[str, str]:
    """The optional engines of a profile's runs that are not on this machine, and why; none where engines are named: those have to be."""
    planned = [run for case in _chosen(only_cases) for run in case.runs.get(profile, ())]
    return {} if only_engines else engines.absent(engine for run in planned for engine in run.engines)


def studies(planned: Iterable[Path]) -> list[tuple[Study, Path, tuple[Path, ...]]]:
    """The studies of which all variants are among the places `planned` (<case>/<variant>/<engine>), engine by engine: the study, its place,
    and the places of its variants in its order."""
    planned = list(planned)
    found = []
    for case in (find(name) for name in dict.fromkeys(place.parts[0] for place in planned)):
        for study in case.studies.values():
            for engine in case.engines:
                points = tuple(Path(case.name, variant, engine) for variant in study.variants)
                if all(point in planned for point in points):
                    found.append((study, Path(case.name, study.folder_name, engine), points))
    return found


def is_finished(folder: Path, run: Run) -> bool:
    """Whether `folder` holds the finished result of exactly this run."""
    return results.record(folder, run.inputs) is not None
