"""What Slurm would refuse, or never start: asked before a campaign is submitted."""

from __future__ import annotations

import re
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

from .site import last_words

# It refuses jobs also for some seconds after its own restart, until the nodes have registered.
_TRIES, _PAUSE = 5, 2.0


def refusal(script: Path) -> str:
    """Why Slurm would not take the job `script`, or would let it wait for ever; empty when it would run it."""
    done = _ask(["sbatch", "--test-only", str(script)])
    for _ in range(_TRIES - 1):
        if done is None or "configuration is not available" not in done.stderr:
            break
        time.sleep(_PAUSE)
        done = _ask(["sbatch", "--test-only", str(script)])
    if done is None:
        return "sbatch does not answer"
    if done.returncode:
        return last_words(done)
    text = script.read_text(encoding="utf-8")
    partition = re.search(r"^#SBATCH +(?:--partition[= ]|-p ?)(\S+)", text, re.MULTILINE)
    minutes = re.search(r"^#SBATCH +--time=(\d+)$", text, re.MULTILINE)
    limit = time_limit(partition.group(1) if partition else "")
    # Most sites accept such a job, and never start it.
    if minutes and limit and int(minutes.group(1)) > limit:
        return f"{minutes.group(1)} min exceed the partition's limit of {limit:g} min"
    return ""


def time_limit(partition: str) -> float | None:
    """Longest job of `partition` (empty: the default one), in min; None when it is unlimited or unknown."""
    done = _ask(["sinfo", "--noheader", "--format=%P|%l"])
    for line in done.stdout.splitlines() if done else ():
        name, _, limit = line.strip().partition("|")
        parts = re.fullmatch(r"(?:(\d+)-)?(?:(\d+):)?(\d+):(\d+)", limit)
        if parts and (name.rstrip("*") == partition if partition else name.endswith("*")):
            days, hours, minutes, seconds = (int(part or 0) for part in parts.groups())
            return days * 1440 + hours * 60 + minutes + seconds / 60
    return None


def _ask(command: Sequence[str]) -> subprocess.CompletedProcess[str] | None:
    try:
        return subprocess.run(command, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL, timeout=60, check=False)
    except (FileNotFoundError, subprocess.TimeoutExpired):
        return None
