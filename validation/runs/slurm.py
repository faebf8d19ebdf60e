"""What Slurm would refuse is told before anything is submitted."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

from dembark.common.errors import DembarkError
from dembark.validation.runs.plan import Resources
from dembark.validation.runs.queue import asked
from dembark.validation.runs.site import Site, word

_TRIES, _PAUSE = 4, 10.0


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
        distinct = {tuple(asked(site, one).items()) for one in (*used, Resources())}
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
