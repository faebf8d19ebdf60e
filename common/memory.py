"""Memory that is free, and a refusal in one line of what does not fit into it."""

from __future__ import annotations

import math
from pathlib import Path

from .errors import DembarkError
from .units import size_text

_SMALL = 1e8  # bytes that are asked for without a look at what there is
_SHARE = 0.9  # of the free memory that may be asked for


def free_memory() -> float:
    """Bytes that a process can still take: what the system has available, and what is left of the limit of its control group; inf where
    neither is known."""
    found = math.inf
    try:
        lines = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines())
        found = 1024.0 * float(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        pass
    try:
        limit, used = (float(Path("/sys/fs/cgroup", name).read_text(encoding="ascii")) for name in ("memory.max", "memory.current"))
        found = min(found, limit - used)
    except (OSError, ValueError):
        pass
    return found


def check_memory(needed: float, what: str, right: str) -> None:
    """DembarkError when `needed` (bytes), which is what `what` take, are more than can be had; `right` says what to do."""
    if needed > _SMALL and needed > _SHARE * (free := free_memory()):
        raise DembarkError(f"{what} are too many: they take {size_text(needed)} of memory, {size_text(free)} are free", "", right)
