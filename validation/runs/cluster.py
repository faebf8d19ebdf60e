"""A campaign as job arrays of a cluster's scheduler: the scripts are written and submitted, and nothing stays behind that watches them.

Runs that may use the same resources form an array, each element of which is one run (`job.py`). The same array is submitted once more for
each retry, to begin when the one before it has ended: elements whose run is finished return at once. The last job measures and writes the
report, when also the arrays of earlier submissions have ended: they may still repeat runs. The locks of the runs see to it that no run is
computed twice at the same time.
"""

from __future__ import annotations

import shlex
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from dembark.common.errors import DembarkError
from dembark.common.files import write_atomic
from dembark.validation import results
from dembark.validation.campaigns.plan import Plan, Resources

from . import slurm
from .folder import environment
from .job import REPORT
from .site import Site

JOBS = ".jobs"


# `sent NAME COMMAND` submits a job, keeps its number and writes it into the scripts of the jobs that wait for it.
_SENT = r"""
exec 9> {stamp}.lock
flock -n 9 || {{ echo "this script is running already" >&2; exit 1; }}
sent() {{
  if [ ! -s "$1.job" ]; then
    answer=$(bash -c "$2" < /dev/null) && read -r number _ <<< "$answer" && [ -n "$number" ] || {{
      echo "the scheduler refused $1: $answer; correct $PWD/$1.sh, and run this script again" >&2; exit 1; }}
    echo "${{number%%;*}}" > "$1.job"
    echo "submitted $1: $answer"
  fi
  sed -i "s/@$1@/$(cat "$1.job")/g" {stamp}-*.sh
}}
# `ended NAME COMMAND` stops when a job of an earlier submission waits or runs.
ended() {{
  waiting=$(bash -c "$2" < /dev/null)
  [ -z "$waiting" ] || {{ echo "$1 of an earlier submission waits or runs: wait for its end, or cancel it: $waiting" >&2; exit 1; }}
}}
"""


class Later:
    """Keeps job scripts for a script that submits them elsewhere, where the scheduler is. A job has a word for its number until then."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._scripts: list[Path] = []

    def send(self, script: Path) -> str:
        """A word for the number of this job."""
        self._scripts.append(script)
        return f"@{script.stem}@"

    def write(self, path: Path, earlier: Iterable[str]) -> None:
        """The script: it submits all jobs in their order, each once, when none of the jobs called `earlier` waits or runs."""
        lines = ["#!/bin/bash", "# Submits the jobs of a campaign. Run it where the commands of the scheduler are.",
                 self._site.preamble.strip(), f"cd {shlex.quote(str(path.parent))} || exit 1", _SENT.format(stamp=path.stem).strip()]
        if self._site.queued:
            lines += [shlex.join(["ended", name, self._site.queued.format(name=shlex.quote(name))]) for name in earlier]
        lines += [shlex.join(["sent", script.stem, self._site.submit.format(script=shlex.quote(str(script)))]) for script in self._scripts]
        write_atomic(path, "\n".join([*lines, ""]).encode())
        path.chmod(0o755)


def submit(plan: Plan, folder: Path, site: Site, at_a_time: int | None = None, write_only: bool = False) -> list[str]:
    """Submit the runs of `plan` in its results folder that are neither finished nor running, retries of those that run, and the job that
    reports; returns lines for people. With `write_only` a script is written that submits them. DembarkError with the scheduler's own words
    when it refuses a job; it names those submitted before."""
    states = {state.folder: state.state for state in results.states(folder)}
    arrays: dict[tuple[Resources, bool], list[str]] = {}
    for place in plan.folders:
        if states.get(place) != "finished":
            used = replace(plan.resources[Path(place).parent], restart_interval=None)
            arrays.setdefault((used, states.get(place) == "running"), []).append(place)
    stamp, later = _stamp(plan.label, folder / JOBS), Later(site)
    send = later.send if write_only else site.send
    sent: list[tuple[str, str]] = []
    before = [script.stem for script in sorted((folder / JOBS).glob("*.sh"))]
    earlier = [] if write_only else [(job, name) for name in before for job in site.waiting(name)]
    last = list(earlier)
    try:
        for (used, running), places in arrays.items():
            for first in range(0, len(places), site.largest_array):
                # A run that runs may still fail, and its submitter may have died before it submitted the retries.
                chunk, after = places[first:first + site.largest_array], earlier if running else []
                for attempt in range(int(running), 1 + plan.retries):
                    name = f"{stamp}-{len(sent) + 1}"
                    script = _write(folder, site, name, used, chunk, after, attempt > 0, at_a_time)
                    after = [(send(script), name)]
                    sent += after
                last += [one for one in after if one not in last]
        name = f"{stamp}-{REPORT}"
        sent.append((send(_write(folder, site, name, plan.measure, [REPORT], last, False, None)), name))
    except DembarkError as error:
        numbers = ", ".join(job for job, _ in sent)
        raise DembarkError(str(error), f"submitted before: {numbers}" if numbers else "nothing was submitted") from None
    count = sum(len(places) for (_, running), places in arrays.items() if not running)
    if write_only:
        later.write(script := folder / JOBS / f"{stamp}.submit", before)
        done = f"{count} runs in {len(sent)} jobs are ready; to submit them, run: bash {shlex.quote(str(script))}"
    else:
        done = f"submitted {count} runs in {len(sent)} jobs: {' '.join(job for job, _ in sent)}"
    return [done,
            f"{len(plan.folders) - count} of {len(plan.folders)} runs are finished or running"]


def _stamp(label: str, jobs: Path) -> str:
    """The beginning of the names of a submission's jobs, by which the scheduler is asked for them: no other submission has it."""
    while True:
        stamp = f"dembark-{label}-{datetime.now().astimezone():%y%m%d-%H%M%S}"
        if not any(jobs.glob(f"{stamp}-*")):
            return stamp
        time.sleep(0.1)


def check(plan: Plan, site: Site) -> None:
    """DembarkError when the site's scheduler would refuse a job of `plan`, or would never start it. Only Slurm can be asked."""
    if site.submit.split()[0] != "sbatch":
        return
    if not shutil.which("sbatch"):
        raise DembarkError("sbatch not found", "on PATH", "start this on a machine that jobs are submitted from, or add --write-only")
    for used in {replace(used, restart_interval=None): None for used in (*plan.resources.values(), plan.measure)}:
        with tempfile.TemporaryDirectory(prefix="dembark-") as folder:
            script = Path(folder, "job.sh")
            script.write_text(site.script("dembark", Path("/dev/null"), used, 1, [], "true"), encoding="utf-8")
            if reason := slurm.refusal(script):
                raise DembarkError("Slurm would refuse a job, or never start it", reason,
                                   f"see the campaign's resources, and the header and defaults of {site.path}")


def _write(folder: Path, site: Site, name: str, used: Resources, places: list[str], after: list[tuple[str, str]], again: bool,
           at_a_time: int | None) -> Path:
    jobs = folder / JOBS
    jobs.mkdir(exist_ok=True)
    elements, script = jobs / f"{name}.runs", jobs / f"{name}.sh"
    write_atomic(elements, "".join(f"{place}\n" for place in places).encode())
    words = [sys.executable, "-m", "dembark.validation.runs.job", str(folder), str(elements), *(["--again"] if again else [])]
    # Sites may start jobs, and containers programs, without the environment of the submitter.
    settings = shlex.join(["env", *(f"{key}={value}" for key, value in environment().items())])
    body = f'exec {site.container.strip()} {settings} {shlex.join(words)} --cores {used.cores} "{site.index}"'
    write_atomic(script, site.script(name, jobs / f"{name}.log", used, len(places), after, body, at_a_time).encode())
    script.chmod(0o755)
    return script
