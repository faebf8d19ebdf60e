"""Submitting a campaign, here or to a cluster, going on with one, and saying beforehand what it costs."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path

from dembark.common.errors import DembarkError
from dembark.common.lock import lock
from dembark.common.units import size_text
from dembark.validation.campaigns import estimate, expand, folder
from dembark.validation.campaigns.folder import Options
from dembark.validation.runs import schema, site
from dembark.validation.runs.executor import Local
from dembark.validation.runs.perform import LOCK, Outcome, Place, perform
from dembark.validation.runs.plan import Plan
from dembark.validation.runs.queue import Queue
from dembark.validation.runs.steps import CAMPAIGN_FILE

Say = Callable[[str], None]


def prepare(chosen: Options) -> None:
    """Take over the environment that the preamble of the chosen site makes: with it the engines are found, here and in the jobs."""
    if chosen.executor != "local":
        os.environ.update(site.find(chosen.executor).environment())


def cores_here(chosen: Options) -> int:
    """Cores of this machine to use: on a cluster one, for the steps after the runs."""
    return chosen.cores or (os.cpu_count() or 1 if chosen.executor == "local" else 1)


def check(chosen: Options, plan: Plan) -> None:
    """DembarkError for runs with more cores or memory than there are, here; for jobs of a cluster see `site.check`."""
    if chosen.executor != "local":
        site.find(chosen.executor)
        return
    if chosen.jobs is not None:
        raise DembarkError("--jobs is for a cluster", "with --executor local", "use --cores for the runs of this machine")
    cores, memory = cores_here(chosen), _memory()
    for place, used in plan.resources.items():
        if used.cores > cores:
            raise DembarkError(f"{place} is to run on {used.cores} cores", f"{cores} are there", "lower ranks or threads, or raise --cores")
        if used.memory and used.memory > memory:
            raise DembarkError(f"{place} is to have {size_text(used.memory)} of memory", f"this machine has {size_text(memory)}",
                               "lower memory")


def _memory() -> float:
    return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))


def _place(chosen: Options, results: Path, plan: Plan, cancel: threading.Event, say: Say) -> Place:
    if chosen.executor == "local":
        return lambda _: Local(cores_here(chosen), _memory(), cancel)
    there = site.find(chosen.executor)
    return lambda table: Queue(there, results, plan, say, chosen.jobs, lambda name: table.state(name).job)


def forecast(plan: Plan, results: Path) -> list[estimate.Estimate]:
    """What each series costs, with the rates of the campaign's own store when it has measured some."""
    return estimate.estimates(plan, estimate.Rates(results / schema.FILE))


def submit(plan: Plan, file: Path, results: Path, chosen: Options, cancel: threading.Event, say: Say) -> Outcome:
    """Run `plan`, that of the campaign `file`, in the folder `results` until all its runs are finished, measured and reported.

    `say` gets lines for people. A second submission of the same campaign waits for nothing: it is refused while the first one lives.
    DembarkError for mistakes, before anything has been started; Interrupted when `cancel` is set.
    """
    folder.refuse_foreign(results, plan.label)
    check(chosen, plan)
    with lock(results / LOCK, f"the campaign in {results} is being run by another process"):
        if chosen.executor != "local":
            site.check(site.find(chosen.executor), filter(None, [*plan.resources.values(), plan.measure]))
        folder.enter(results, file, plan, chosen)
        # Its own copy counts from here on, whatever becomes of the file.
        plan = expand.plan(file=results / CAMPAIGN_FILE)
        place, expected = _place(chosen, results, plan, cancel, say), {one.series.place: one.wall_time for one in forecast(plan, results)}
        return perform(plan, results, place, cancel, cores_here(chosen), results / folder.LOG, expected)
