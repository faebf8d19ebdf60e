"""The scheduler of a site: a TOML file with the lines of a job script and the command that submits it."""

from __future__ import annotations

import math
import re
import shlex
import subprocess
from dataclasses import dataclass
from pathlib import Path

from dembark.common import units
from dembark.common.choices import nearest
from dembark.common.errors import DembarkError
from dembark.validation.campaigns.plan import Resources
from dembark.validation.case.tables import TableReader, Types, load_toml

SHIPPED = Path(__file__).with_name("sites")
_KEYS: dict[str, Types] = {"submit": str, "header": str, "array": str, "index": str, "after": str, "each": str, "join": str, "memory": str,
                           "time": str, "at_a_time": int, "largest_array": int, "preamble": str, "queued": str, "container": str}
_NEEDED = ("submit", "header", "array", "index", "after")
# The words in braces of each key.
_JOB = ("name", "log", "ranks", "threads", "cores", "memory_mb", "minutes", "seconds")
_WORDS = {"header": _JOB, "array": (*_JOB, "last", "count", "at_a_time"), "after": ("jobs",), "each": ("job", "name"),
          "submit": ("script",), "queued": ("name",)}


@dataclass(frozen=True)
class Site:
    """A site's file that was read and checked; memory (bytes) and time (s) are those of runs of which the campaign says nothing."""

    path: Path
    submit: str
    header: str
    array: str
    index: str
    after: str
    each: str = "{job}"
    join: str = ":"
    memory: float = 2e9
    time: float = 1800.0
    at_a_time: int = 100
    largest_array: int = 1000
    preamble: str = ""
    queued: str = ""
    container: str = ""

    def environment(self) -> dict[str, str]:
        """This process's environment after the preamble; DembarkError when that fails. A container starts after the preamble of each job,
        and this process is in one: it has nothing to change here."""
        if self.container:
            return {}
        # What it prints must not get into the list of variables; one of comments alone needs a command.
        script = f"set -e\n{{ :\n{self.preamble}\n}} >&2\nenv -0"
        try:
            done = _by_bash(script, 120)
        except subprocess.TimeoutExpired:
            raise DembarkError(f"the preamble of {self.path} has not ended after two minutes", "", "try it in a shell") from None
        if done.returncode:
            raise DembarkError(f"the preamble of {self.path} fails", last_words(done), "correct it, or try it in a shell")
        return dict(entry.split("=", 1) for entry in done.stdout.split("\0") if "=" in entry)

    def script(self, name: str, log: Path, used: Resources, count: int, after: list[tuple[str, str]], body: str,
               at_a_time: int | None = None) -> str:
        """Text of a job script: an array of `count` elements, each running `body` in bash, when the jobs `after` (number, name) have
        ended in whatever way."""
        seconds = used.time or self.time
        words = {"name": name, "log": log, "ranks": used.ranks, "threads": used.threads, "cores": used.cores, "count": count,
                 "last": count - 1, "at_a_time": at_a_time or self.at_a_time, "minutes": math.ceil(seconds / 60),
                 "seconds": math.ceil(seconds), "memory_mb": math.ceil((used.memory or self.memory) / 1e6)}
        jobs = self.join.join(self.each.format(job=job, name=known) for job, known in after)
        lines = [self.header.strip().format(**words), self.array.format(**words), *([self.after.format(jobs=jobs)] if after else [])]
        return "\n".join(["#!/bin/bash", *lines, self.preamble.strip(), body, ""])

    def send(self, script: Path) -> str:
        """Submit a job script: the job's number, which is the first word of the answer. DembarkError with the scheduler's own words when
        it is refused."""
        command = self.submit.format(script=shlex.quote(str(script)))
        try:
            done = _by_bash(command, 300)
        except subprocess.TimeoutExpired:
            raise DembarkError("the scheduler does not answer", f"to {command}", "try again later with 'dembark resume'") from None
        if done.returncode or not done.stdout.strip():
            raise DembarkError("the scheduler refused a job", last_words(done), f"see {script} and {self.path}")
        return done.stdout.split()[0].partition(";")[0]

    def waiting(self, name: str) -> list[str]:
        """Numbers of the jobs called `name` that wait or run; none where the site's file does not say how to ask."""
        if not self.queued:
            return []
        try:
            done = _by_bash(self.queued.format(name=shlex.quote(name)), 60)
        except subprocess.TimeoutExpired:
            return []
        return list(dict.fromkeys(done.stdout.split()))


def _by_bash(command: str, seconds: float) -> subprocess.CompletedProcess[str]:
    """What `command` said; subprocess.TimeoutExpired after `seconds`."""
    return subprocess.run(["bash", "-c", command], capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL,
                          timeout=seconds, check=False)


def last_words(done: subprocess.CompletedProcess[str]) -> str:
    """Why a command failed, in its own words: at most two lines as one."""
    lines = [line.partition("error: ")[2] or line for line in (done.stderr or done.stdout).strip().splitlines()]
    return "; ".join(lines[-2:]) or f"exit code {done.returncode} without a message"


def find(name: str) -> Site:
    """The site `slurm`, or that of a TOML file; DembarkError for anything else or a mistake in it."""
    path = Path(name) if name.endswith(".toml") else SHIPPED / f"{name}.toml"
    if not path.is_file():
        raise DembarkError(f"--executor {name} is neither local, nor slurm, nor the file of a site", nearest(name, ("local", "slurm")),
                           f"copy and edit one of {SHIPPED}")
    return read(path.resolve())


def read(path: Path) -> Site:
    """Read and check a site's file; DembarkError says in one line what is wrong."""
    data, reader = load_toml(path), TableReader(path)
    reader.table(data, "top level", _KEYS, _NEEDED)
    for key, value in data.items():
        if not isinstance(value, str):
            continue
        if place := re.search(r"<\w+>", value):
            raise reader.fail("top level", f"{place.group()} in {key} is a placeholder", "fill it in, or remove it")
        for word in re.findall(r"\{(\w*)\}", value) if key in _WORDS else ():
            if word not in _WORDS[key]:
                raise reader.fail("top level", f"{{{word}}} in {key} is not known", nearest(word, _WORDS[key]))
    if "\n" in data.get("container", "").strip():
        raise reader.fail("top level", "container has several lines", "it is the beginning of one command", "container")
    for key in ("at_a_time", "largest_array"):
        if data.get(key, 1) < 1:
            raise reader.fail("top level", f"{key} = {data[key]} is out of range", "it must be >= 1")
    try:
        numbers = {key: convert(data[key]) for key, convert in (("memory", units.size), ("time", units.seconds)) if key in data}
    except DembarkError as error:
        raise reader.fail("top level", str(error)) from None
    return Site(path, **data | numbers)
