"""Submitting a campaign, here or to a cluster, going on with one, and saying beforehand what it costs."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

from dembark.common.errors import DembarkError
from dembark.common.files import lock, read_json, write_json
from dembark.validation.campaigns import folder, profiles, slurm, store
from dembark.validation.campaigns.estimate import Estimate, estimates
from dembark.validation.campaigns.expand import Plan
from dembark.validation.campaigns.folder import Options
from dembark.validation.campaigns.rates import Rates
from dembark.validation.campaigns.sizes import size_text
from dembark.validation.campaigns.source import Source
from dembark.validation.workflow import Outcome, Way, here, perform

ESTIMATES = ".estimates.json"


def prepare(chosen: Options) -> None:
    """Take over the environment that the preamble of the chosen profile makes: with it the engines are found, here and in the jobs."""
    os.environ.update(profiles.find(chosen.executor).environment())


def way(chosen: Options, plan: Plan) -> Way:
    """How Snakemake is called for `chosen`; DembarkError for an executor that there is not, or runs with more cores than there are."""
    if chosen.executor == "local":
        if chosen.jobs is not None:
            raise DembarkError("--jobs is for a cluster", "with --executor local", "use --cores for the runs of this machine")
        return _local(chosen, plan)
    profile = profiles.find(chosen.executor)
    words = ["--profile", str(profile.folder)]
    words += ["--jobs", str(chosen.jobs)] if chosen.jobs else []
    words += ["--local-cores", str(chosen.cores)] if chosen.cores else []
    return Way(tuple(words), cluster=profile.executor != "local")


def _local(chosen: Options, plan: Plan) -> Way:
    cores = chosen.cores or os.cpu_count() or 1
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    for place, used in plan.resources.items():
        if used.cores > cores:
            raise DembarkError(f"{place} is to run on {used.cores} cores", f"{cores} are there", "lower ranks or threads, or raise --cores")
        if used.memory and used.memory > memory:
            raise DembarkError(f"{place} is to have {size_text(used.memory)} of memory", f"this machine has {size_text(memory)}",
                               "lower memory")
    return replace(here(cores), words=(*here(cores).words, "--resources", f"mem_mb={int(memory / 1e6)}"))


def forecast(plan: Plan, results: Path, cancel: threading.Event, told: Callable[[int, int], None]) -> list[Estimate]:
    """What each series costs, with the rates of the campaign's own store when it has measured some."""
    return estimates(plan, Rates(store.path_of(results)), cancel, told)


def submit(file: Path, results: Path, chosen: Options, cancel: threading.Event, say: Callable[[str], None],
           told: Callable[[int, int], None]) -> Outcome:
    """Run the campaign `file` in the folder `results` until all its runs are finished, measured and reported.

    `say` gets lines for people. A second submission of the same campaign waits for nothing: it is refused while the first one lives.
    DembarkError for mistakes, before anything has been started; Interrupted when `cancel` is set.
    """
    plan = Source(file=file).plan()
    assert plan is not None
    folder.refuse_foreign(results, plan.spec.name)
    called = way(chosen, plan)
    with lock(results / folder.LOCK, f"the campaign in {results} is being run by another process"):
        slurm.check(profiles.find(chosen.executor), filter(None, [*plan.resources.values(), plan.spec.measure]))
        folder.enter(results, file, plan, chosen)
        with slurm.guarded(profiles.find(chosen.executor), results, cancel, say) as (words, stalled):
            return _go_on(results, replace(called, words=(*called.words, *words), stalled=stalled), cancel, told)


def resume(results: Path, chosen: Options, cancel: threading.Event, say: Callable[[str], None],
           told: Callable[[int, int], None]) -> Outcome:
    """Go on with the campaign of the folder `results`, from its own copy of the file."""
    return submit(folder.own_file(results), results, chosen, cancel, say, told)


def _go_on(results: Path, called: Way, cancel: threading.Event, told: Callable[[int, int], None]) -> Outcome:
    source = Source(file=results / folder.FILE)
    plan = source.plan()
    assert plan is not None
    remember(results, forecast(plan, results, cancel, told))
    return perform(source, results, cancel, called, log=results / folder.LOG)


def remember(results: Path, found: list[Estimate]) -> None:
    """Keep the estimates for `dembark status`: wall time (s) of a run by its place."""
    write_json(results / ESTIMATES, {str(one.series.place): {"wall_time": one.wall_time, "steps": one.steps, "time_step": one.time_step,
                                                              "cores": one.cores, "rate": asdict(one.rate)} for one in found})


def remembered(results: Path) -> dict[str, dict[str, float]]:
    """What `remember` wrote; empty when there is nothing."""
    return read_json(results / ESTIMATES) or {}
