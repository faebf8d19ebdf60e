"""Memory that is free, and a refusal in one line of what does not fit into it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from .errors import DembarkError
from .units import size_text

_SMALL = 1e8  # bytes that are asked for without a look at what there is
_SHARE = 0.9  # of the free memory that may be asked for


def free_memory() -> float:
    """Bytes that a process can still take: what the system has available, and what is left of the limits of its control group and of those
    around it, of either version (schedulers make one for each job); inf where neither is known."""
    found = math.inf
    try:
        lines = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines())
        found = 1024.0 * float(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        pass
    for limit, used in _limits(Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")):
        try:
            found = min(found, float(limit.read_text(encoding="ascii")) - float(used.read_text(encoding="ascii")))
        except (OSError, ValueError):
            continue
    return found


def _limits(groups: Path, mounted: Path) -> Iterator[tuple[Path, Path]]:
    """Files of the limit and the use of memory of the control groups in `groups`, and of all around them. In a container the names may be
    those of the host; then only the outermost exists, which is the container's own."""
    try:
        lines = [line.split(":", 2) for line in groups.read_text(encoding="utf-8").splitlines()]
    except OSError:
        lines = []
    for _, controllers, name in [["0", "", "/"], *(line for line in lines if len(line) == 3)]:
        if not controllers:
            top, files = mounted, ("memory.max", "memory.current")
        elif "memory" in controllers.split(","):
            top, files = mounted / "memory", ("memory.limit_in_bytes", "memory.usage_in_bytes")
        else:
            continue
        place = top / name.lstrip("/")
        for folder in (place, *place.parents):
            if folder.is_relative_to(top):
                yield folder / files[0], folder / files[1]


def check_memory(needed: float, what: str, right: str) -> None:
    """DembarkError when `needed` (bytes), which is what `what` take, are more than can be had; `right` says what to do."""
    if needed > _SMALL and needed > _SHARE * (free := free_memory()):
        raise DembarkError(f"{what} are too many: they take {size_text(needed)} of memory, {size_text(free)} are free", "", right)
