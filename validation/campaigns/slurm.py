"""Guards around Snakemake's Slurm executor: what would be refused is told before the start, and no job is left behind or doubled."""

from __future__ import annotations

import getpass
import hashlib
import math
import re
import shlex
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from dembark.common.errors import DembarkError, Interrupted
from dembark.validation.campaigns.profiles import ExecutorProfile
from dembark.validation.campaigns.spec import RunResources
from dembark.validation.engines import mpi_launcher

_COMMANDS = ("sbatch", "squeue", "scancel", "scontrol")
_ATTEMPTS, _TRIES, _PAUSE = 12, 4, 10.0
# The executor asks after its jobs ever more rarely while none ends, at last every so many seconds.
_LONGEST_INTERVAL = 180
_QUIET = 2 * _LONGEST_INTERVAL + 60.0
_NUMBERS = ("runtime", "mem_mb", "mem_mb_per_cpu", "nodes", "tasks", "cpus_per_task")
_WAITING = ("PENDING", "REQUEUED", "REQUEUE_HOLD", "SPECIAL_EXIT")
# Reasons for which a job waits until somebody changes something: more patience does not help.
_HOPELESS = re.compile(r"Partition(Time|Node)Limit|BadConstraints|(Assoc|QOS)Max\w*PerJob\w*|Invalid\w+|\w*NeverSatisfied|JobHeld\w+|"
                       r"launch failed.*")


@dataclass(frozen=True)
class Job:
    """A job in the queue: `name` is that of its workflow, `what` the step it does, `reason` why it waits."""

    number: str
    name: str
    state: str
    reason: str
    what: str

    @property
    def waits(self) -> bool:
        """Whether it has not begun."""
        return self.state in _WAITING

    @property
    def hopeless(self) -> bool:
        """Whether it waits for something that will not come by itself."""
        return self.waits and bool(_HOPELESS.fullmatch(self.reason))


def job_prefix(results: Path) -> str:
    """What the names of all jobs of the campaign in `results` begin with; the same after every restart, at most 45 characters."""
    folder = results.resolve()
    readable = re.sub(r"[^A-Za-z0-9]+", "-", folder.name)[:20].strip("-")
    return f"dembark_{readable}_{hashlib.sha256(str(folder).encode()).hexdigest()[:12]}"


def request(used: RunResources) -> dict[str, int | str]:
    """What Snakemake and its executor are told about a job beside its cores: memory, time of an attempt, MPI ranks."""
    asked: dict[str, int | str] = {}
    if used.memory:
        asked["mem_mb"] = math.ceil(used.memory / 1e6)
    if used.time:
        asked["runtime"] = math.ceil(used.time / 60)
    if used.ranks > 1:
        # With the key `mpi` the executor starts the run in the allocation itself, not as its first step: so srun finds room for the ranks.
        asked |= {"mpi": Path(mpi_launcher(used.ranks)[0]).name, "tasks": used.ranks}
    if used.ranks > 1 or used.threads > 1:
        asked["cpus_per_task"] = used.threads
    return asked


def _ask(words: list[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(words, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL, timeout=60, check=False)
    except FileNotFoundError:
        raise DembarkError(f"{words[0]} not found", "on PATH", "start this on a machine that Slurm jobs are submitted from") from None
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(words, 1, "", "no answer within a minute")


def _word(done: subprocess.CompletedProcess[str]) -> str:
    # Of several lines, the one that says what is wrong with the job, not that its submission failed in general.
    lines = [line.partition("error: ")[2] or line for line in done.stderr.strip().splitlines()]
    return "; ".join(lines[-2:]) or f"exit code {done.returncode} without a word"


def check(profile: ExecutorProfile, used: Iterable[RunResources]) -> None:
    """Ask Slurm, before anything is submitted, whether it answers and would take jobs with these resources (those of the profile added).

    DembarkError tells in one line what Slurm refuses; without a Slurm profile nothing is asked.
    """
    if profile.executor != "slurm":
        return
    absent = [name for name in _COMMANDS if not shutil.which(name)]
    if absent:
        raise DembarkError(f"{', '.join(absent)} not found", "on PATH", "start this on a machine that Slurm jobs are submitted from")
    _check_status_command(profile)
    distinct = {tuple(sorted((profile.defaults | request(one)).items())) for one in (*used, RunResources())}
    for resources in sorted(distinct, key=repr):
        _check_request(profile, dict(resources))


def _check_status_command(profile: ExecutorProfile) -> None:
    first = int(profile.settings.get("slurm-init-seconds-before-status-checks", 40))
    place = f"slurm-status-command in {profile.folder / 'config.yaml'}"
    if profile.settings.get("slurm-status-command", "sacct") == "sacct":
        done = _ask(["sacct", "--noheader", "--allocations", "--starttime=now-2days", "--format=JobIDRaw"])
        if done.returncode:
            raise DembarkError("sacct does not answer", _word(done), f"set {place} to squeue")
        return
    done = _ask(["scontrol", "show", "config"])
    if done.returncode:
        raise DembarkError("Slurm does not answer", _word(done), "try again when 'scontrol ping' says UP")
    age = re.search(r"^MinJobAge\s*=\s*(\d+)", done.stdout, re.M)
    # Below three first intervals the executor would ask sacct, whether that works or not; a job that is forgotten between two of its
    # questions would be waited for without end.
    needed = max(3 * first, _LONGEST_INTERVAL + 20)
    if age and int(age.group(1)) < needed:
        raise DembarkError(f"Slurm forgets jobs {age.group(1)} s after their end (MinJobAge)", f"squeue needs {needed} s",
                           f"set {place} to sacct")


def _check_request(profile: ExecutorProfile, resources: Mapping[str, Any]) -> None:
    from snakemake_executor_plugin_slurm.submit_string import get_submit_command

    class Named(dict[str, Any]):
        __getattr__ = dict.__getitem__

    # The executor's own words, so that what is asked here is what will be asked then.
    # A value that Snakemake works out for itself ("2h", an expression) is left out.
    known = {key: value for key, value in resources.items() if isinstance(value, int) or key not in _NUMBERS}
    job = SimpleNamespace(resources=Named(known), threads=resources.get("cpus_per_task", 1))
    given = {option: f" {flag} {shlex.quote(str(resources[key]))}" if resources.get(key) else ""
             for option, flag, key in (("account", "-A", "slurm_account"), ("partition", "-p", "slurm_partition"))}
    call = get_submit_command(job, {"run_uuid": "dembark", "slurm_logfile": "/dev/null", "comment_str": "", "workdir": "", **given})
    for _ in range(_TRIES):
        done = _ask([*shlex.split(call), "--test-only", "--wrap=true"])
        if not done.returncode or "configuration is not available" not in done.stderr:
            break
        # It says so also for a while after its own restart, until the nodes have told it what they are.
        time.sleep(_PAUSE)
    words = " ".join(f"{key}={value}" for key, value in resources.items())
    asked = f"asked with {words}, see the campaign's resources and {profile.folder}"
    if done.returncode:
        raise DembarkError("Slurm would refuse a job", _word(done), asked)
    # Most sites let jobs wait for ever that ask for more time than their partition gives.
    limit = time_limit(str(resources.get("slurm_partition") or ""))
    wanted = known.get("runtime", 0)
    if limit and wanted > limit:
        raise DembarkError("Slurm would never start a job", f"{wanted} min exceed the partition's limit of {limit:g} min", asked)


def time_limit(partition: str) -> float | None:
    """Longest job of `partition` (empty: the default one), in min; None when it is unlimited or unknown."""
    for line in _ask(["sinfo", "--noheader", "--format=%P|%l"]).stdout.splitlines():
        name, _, limit = line.strip().partition("|")
        parts = re.fullmatch(r"(?:(\d+)-)?(?:(\d+):)?(\d+):(\d+)", limit)
        if parts and (name.rstrip("*") == partition if partition else name.endswith("*")):
            days, hours, minutes, seconds = (int(part or 0) for part in parts.groups())
            return days * 1440 + hours * 60 + minutes + seconds / 60
    return None


def jobs(results: Path, attempts: int = _ATTEMPTS) -> list[Job]:
    """The campaign's jobs that have not ended, of this user; DembarkError when Slurm does not answer `attempts` times (two minutes)."""
    prefix = job_prefix(results)
    words = ["squeue", f"--user={getpass.getuser()}", "--noheader", "--array", "--format=%i|%j|%T|%r|%k"]
    for attempt in range(attempts):
        done = _ask(words)
        if done.returncode == 0:
            found = [Job(*line.split("|", 4)) for line in done.stdout.splitlines() if line.count("|") >= 4]
            return [job for job in found if job.name.startswith(prefix + "_")]
        if attempt + 1 < attempts:
            time.sleep(_PAUSE)
    raise DembarkError("Slurm does not answer", _word(done), "try again when 'scontrol ping' says UP")


def cancel_all(results: Path) -> list[Job]:
    """Cancel every job of the campaign that is still in the queue; returns those."""
    return _cancel(jobs(results))


def _cancel(found: list[Job]) -> list[Job]:
    for first in range(0, len(found), 500):
        numbers = [job.number for job in found[first:first + 500]]
        done = _ask(["scancel", *numbers])
        # One that ended in the meantime is no failure.
        if done.returncode and "Invalid job id" not in done.stderr and "already completing" not in done.stderr:
            raise DembarkError(f"scancel {' '.join(numbers[:5])}", _word(done), "cancel them by hand before starting again")
    return found


def adopt_or_cancel(results: Path, cancel: threading.Event, tell: Callable[[str], None],
                    interval: float = 10.0) -> tuple[int, int]:
    """Deal with jobs that a process which died has left: those that wait are cancelled, for those that run this waits.

    Nobody watches such jobs, so the next workflow would submit their runs a second time. A waiting one has nothing to lose but its
    place in the queue; a running one goes on with its work, and its result is found when it has ended. Returns the numbers of jobs
    waited for and cancelled. Interrupted when `cancel` is set.
    """
    adopted: set[str] = set()
    cancelled: set[str] = set()
    while True:
        left = jobs(results)
        waiting = [job for job in left if job.waits and job.number not in cancelled]
        if _cancel(waiting):
            tell(f"{len(waiting)} waiting jobs of an earlier start cancelled")
            cancelled |= {job.number for job in waiting}
        going = {job.number for job in left if not job.waits}
        if going - adopted:
            tell(f"waiting for {len(going)} jobs of an earlier start: {', '.join(sorted(going)[:10])}")
            adopted |= going
        if not left:
            return len(adopted), len(cancelled)
        if cancel.wait(interval if going else min(1.0, interval)):
            raise Interrupted("interrupted", f"{len(going)} jobs of an earlier start go on")


@contextmanager
def guarded(profile: ExecutorProfile, results: Path, cancel: threading.Event, tell: Callable[[str], None],
            ) -> Iterator[tuple[list[str], Callable[[int], bool] | None]]:
    """Deal with the jobs of an earlier start, and at the end, however it comes, leave none in the queue.

    Gives words for Snakemake beside `--profile`, and what to ask now and then while it runs (`Watch`); both empty without Slurm.
    """
    if profile.executor != "slurm":
        yield [], None
        return
    adopt_or_cancel(results, cancel, tell)
    try:
        yield ["--slurm-jobname-prefix", job_prefix(results)], Watch(results, results / "workflow.log", tell)
    finally:
        # A submission that failed, or an interruption, may leave jobs behind that nobody would look after.
        try:
            left = cancel_all(results)
        except DembarkError as error:
            tell(f"jobs may be left in the queue: {error}")
        else:
            if left:
                tell(f"{len(left)} jobs were still in the queue and are cancelled")


class Watch:
    """Looks after a running workflow: tells once of each job that will never start, and notices when it waits for forgotten ones."""

    def __init__(self, results: Path, log: Path, tell: Callable[[str], None]) -> None:
        self._results, self._log, self._tell = results, log, tell
        self._told: set[str] = set()

    def __call__(self, process: int) -> bool:
        """Look once; True when the Snakemake with this process id has to be started again, see `stalled`."""
        try:
            left = jobs(self._results, attempts=1)
        except DembarkError:
            # A scheduler that is away for a while is no reason to give up a workflow that waits for it.
            return False
        for job in left:
            if job.hopeless and job.number not in self._told:
                self._told.add(job.number)
                self._tell(f"job {job.number} ({job.what}) will not start: {job.reason}; cancel it with 'scancel {job.number}', "
                           "or change what keeps it")
        if left or not stalled(process, self._log):
            return False
        self._tell("Slurm has forgotten jobs that the workflow waits for; it is started again")
        return True


def stalled(process: int, log: Path, quiet: float = _QUIET) -> bool:
    """Whether a Snakemake of which no job is in the queue waits for some nevertheless, which it would do without end.

    That happens when slurmctld lost its state, or was away while jobs ended. It is so when `log`, its output, has said nothing for
    `quiet` seconds and it has no process of its own at work.
    """
    try:
        silent = time.time() - log.stat().st_mtime
        works = any(path.read_text().strip() for path in Path(f"/proc/{process}/task").glob("*/children"))
    except OSError:
        return False
    return silent > quiet and not works
