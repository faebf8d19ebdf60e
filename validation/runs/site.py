"""How a site's scheduler is spoken to: a TOML file with its commands, how their answers are read, and text for the shell of each job; and
what it would refuse, told before anything is submitted."""

from __future__ import annotations

import getpass
import math
import re
import shlex
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dembark.common import units
from dembark.common.choices import nearest
from dembark.common.errors import DembarkError
from dembark.validation.case.tables import TableReader, load_toml
from dembark.validation.runs.plan import Resources

_TRIES, _PAUSE = 4, 10.0
SHIPPED = Path(__file__).with_name("sites")
_JOBS = {"at_a_time": int, "memory": str, "time": str, "options": str, "poll": str, "latency": str}
_COMMANDS = {"submit": str, "status": str, "cancel": str, "test": str}
_ANSWERS = {"job": str, "line": str, "waiting": list, "running": list, "again": str, "hopeless": str}
_WORDS = ("name", "title", "log", "ranks", "threads", "cores", "memory_mb", "minutes", "seconds", "options", "script", "user", "jobs")
_NEVER = r"(?!)"


@dataclass(frozen=True)
class Row:
    """A job as the status command tells it; a scheduler need not tell its name and why it waits."""

    job: str
    state: str
    name: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Site:
    """A site's file that was read and checked; memory in bytes, times in s."""

    path: Path
    jobs: Mapping[str, Any]
    commands: Mapping[str, str]
    answers: Mapping[str, Any]
    preamble: str = ""

    def environment(self) -> dict[str, str]:
        """This process's environment after the preamble; DembarkError when that fails."""
        # What it prints must not get into the list of variables; one of comments alone needs a command.
        script = f"set -e\n{{ :\n{self.preamble}\n}} >&2\nenv -0"
        done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL,
                              timeout=120, check=False)
        if done.returncode:
            last = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
            raise DembarkError(f"the preamble of {self.path} fails", last[0], "mend it, or try it in a shell")
        return dict(entry.split("=", 1) for entry in done.stdout.split("\0") if "=" in entry)

    def ask(self, command: str, jobs: Iterable[str] = (), /, **words: object) -> subprocess.CompletedProcess[str]:
        """Call one of the commands with these words in it; DembarkError when there is no such program."""
        several = {"options": shlex.split(self.jobs["options"]), "jobs": list(jobs)}
        told = {"user": getpass.getuser(), **words}
        call = [part for word in shlex.split(self.commands[command])
                for part in (several[word[1:-1]] if word[1:-1] in several and word[0] == "{" else [word.format(**told)])]
        try:
            return subprocess.run(call, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL, timeout=60, check=False)
        except FileNotFoundError:
            raise DembarkError(f"{call[0]} not found", "on PATH", "start this on a machine that jobs are submitted from") from None
        except subprocess.TimeoutExpired:
            return subprocess.CompletedProcess(call, 1, "", "timed out: no answer within a minute")

    def rows(self, cut: str = "") -> list[Row] | None:
        """The user's jobs whose names begin with `cut`, where the scheduler tells names; None when it does not answer."""
        done = self.ask("status")
        if done.returncode:
            return None
        found = (re.search(self.answers["line"], line) for line in done.stdout.splitlines())
        rows = [Row(**{key: value.strip() for key, value in match.groupdict().items() if value is not None}) for match in found if match]
        return [row for row in rows if row.name.startswith(cut) or not row.name]

    def asked(self, used: Resources) -> dict[str, int]:
        """What a job asks for, with the site's values where the plan has none."""
        time = used.time or self.jobs["time"]
        return {"ranks": used.ranks, "threads": used.threads, "cores": used.cores, "minutes": math.ceil(time / 60),
                "memory_mb": math.ceil((used.memory or self.jobs["memory"]) / 1e6), "seconds": math.ceil(time)}

    def waits(self, row: Row) -> bool:
        """Whether a job has not begun."""
        return row.state in self.answers["waiting"]

    def lives(self, row: Row) -> bool:
        """Whether a job has not ended."""
        return self.waits(row) or row.state in self.answers["running"]

    def hopeless(self, row: Row) -> bool:
        """Whether a job waits for something that will not come by itself."""
        return self.waits(row) and bool(re.fullmatch(self.answers.get("hopeless", _NEVER), row.reason))

    def number(self, answer: str) -> str | None:
        """Number of the job in the answer to a submission."""
        found = re.search(self.answers["job"], answer, re.MULTILINE)
        return found.group("job") if found else None

    def transient(self, answer: str) -> bool:
        """Whether a refused submission is to be tried again."""
        return bool(re.search(self.answers.get("again", _NEVER), answer))


def word(done: subprocess.CompletedProcess[str]) -> str:
    """What a command said was wrong: of several lines those that say what, not that it failed in general."""
    lines = [line.partition("error: ")[2] or line for line in (done.stderr or done.stdout).strip().splitlines()]
    return "; ".join(lines[-2:]) or f"exit code {done.returncode} without a word"


def find(name: str) -> Site:
    """The site `slurm`, or that of a TOML file; DembarkError for anything else or a mistake in it."""
    known = [path.stem for path in SHIPPED.glob("*.toml") if path.stem != "site"]
    path = SHIPPED / f"{name}.toml" if name in known else Path(name)
    if not path.is_file():
        raise DembarkError(f"--executor {name} is neither local, nor slurm, nor the file of a site", nearest(name, ("local", *known)),
                           f"write one like {SHIPPED / 'site.toml'}")
    return read(path.resolve())


def read(path: Path) -> Site:
    """Read and check a site's file; DembarkError says in one line what is wrong."""
    data, reader = load_toml(path), TableReader(path)
    reader.table(data, "top level", {"base": str, "preamble": str, "jobs": dict, "commands": dict, "answers": dict})
    base = load_toml(SHIPPED / f"{data['base']}.toml") if data.get("base") == "slurm" else {}
    if "base" in data and not base:
        raise reader.fail("top level", f"base = {data['base']!r} is not known", "there is slurm")
    defaults = load_toml(SHIPPED / "slurm.toml")["jobs"] | {"options": ""}
    jobs = defaults | base.get("jobs", {}) | data.get("jobs", {})
    commands, answers = ({**base.get(table, {}), **data.get(table, {})} for table in ("commands", "answers"))
    reader.table(jobs, "jobs", _JOBS)
    reader.table(commands, "commands", _COMMANDS, ("submit", "status", "cancel"))
    reader.table(answers, "answers", _ANSWERS, ("job", "line", "waiting", "running"))
    _check(reader, jobs, commands, answers)
    try:
        jobs = jobs | {"memory": units.size(jobs["memory"])} | {key: units.seconds(jobs[key]) for key in ("time", "poll", "latency")}
    except DembarkError as error:
        raise reader.fail("jobs", str(error)) from None
    return Site(path, jobs, commands, answers, data.get("preamble", ""))


def _check(reader: TableReader, jobs: Mapping[str, Any], commands: Mapping[str, str], answers: Mapping[str, Any]) -> None:
    for table, values in (("jobs", jobs), ("commands", commands)):
        for key, value in values.items():
            if isinstance(value, str) and (place := re.search(r"<\w+>", value)):
                raise reader.fail(table, f"{place.group()} in {key} is a place for your own value", "fill it in, or take it away")
    if jobs["at_a_time"] < 1:
        raise reader.fail("jobs", f"at_a_time = {jobs['at_a_time']} is out of range", "allowed is >= 1")
    for key, text in commands.items():
        for name in re.findall(r"\{(\w*)\}", text):
            if name not in _WORDS:
                raise reader.fail("commands", f"{{{name}}} in {key} is not known", nearest(name, _WORDS))
    for key, group in (("job", "job"), ("line", "job"), ("line", "state")):
        try:
            if group not in re.compile(answers[key]).groupindex:
                raise reader.fail("answers", f"{key} has no group (?P<{group}>...)", "")
        except re.error as error:
            raise reader.fail("answers", f"{key} is no regular expression", str(error)) from None


def check(site: Site, used: Iterable[Resources]) -> None:
    """Ask the scheduler of `site` whether it answers and, if there is a way to ask, whether it would take jobs with these resources.

    DembarkError tells in one line what it refuses.
    """
    absent = [name for name in dict.fromkeys(text.split()[0] for text in site.commands.values()) if not shutil.which(name)]
    if absent:
        raise DembarkError(f"{', '.join(absent)} not found", "on PATH", "start this on a machine that jobs are submitted from")
    if site.rows() is None:
        raise DembarkError("the scheduler does not answer", word(site.ask("status")), f"the question is in {site.path}")
    if "test" in site.commands:
        distinct = {tuple(site.asked(one).items()) for one in (*used, Resources())}
        for resources in sorted(distinct):
            _check_request(site, dict(resources))


def _check_request(site: Site, resources: dict[str, int]) -> None:
    with tempfile.TemporaryDirectory(prefix="dembark-") as folder:
        script = Path(folder, "job.sh")
        script.write_text("#!/bin/sh\n", encoding="utf-8")
        for _ in range(_TRIES):
            done = site.ask("test", name="dembark", title="dembark", log="/dev/null", script=script, **resources)
            if not done.returncode or "configuration is not available" not in done.stderr:
                break
            # It says so also for a while after its own restart, until the nodes have told it what they are.
            time.sleep(_PAUSE)
    words = " ".join(f"{key}={value}" for key, value in resources.items())
    place = f"asked with {words} {site.jobs['options']}, see the campaign's resources and {site.path}"
    if done.returncode:
        raise DembarkError("Slurm would refuse a job", word(done), place)
    # Most sites let jobs wait for ever that ask for more time than their partition gives.
    named = re.search(r"(?:--partition[= ]|-p ?)(\S+)", site.jobs["options"])
    limit = time_limit(named.group(1) if named else "")
    if limit and resources["minutes"] > limit:
        raise DembarkError("Slurm would never start a job",
                           f"{resources['minutes']} min exceed the partition's limit of {limit:g} min", place)


def time_limit(partition: str) -> float | None:
    """Longest job of `partition` (empty: the default one), in min; None when it is unlimited or unknown."""
    try:
        done = subprocess.run(["sinfo", "--noheader", "--format=%P|%l"], capture_output=True, text=True, errors="replace",
                              stdin=subprocess.DEVNULL, timeout=60, check=False)
    except (FileNotFoundError, subprocess.TimeoutExpired):
        return None
    for line in done.stdout.splitlines():
        name, _, limit = line.strip().partition("|")
        parts = re.fullmatch(r"(?:(\d+)-)?(?:(\d+):)?(\d+):(\d+)", limit)
        if parts and (name.rstrip("*") == partition if partition else name.endswith("*")):
            days, hours, minutes, seconds = (int(part or 0) for part in parts.groups())
            return days * 1440 + hours * 60 + minutes + seconds / 60
    return None
