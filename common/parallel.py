"""Work in other processes of this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from typing import TypeVar

from .errors import RunError

Item = TypeVar("Item")
Found = TypeVar("Found")

_FEW = 16


def prepare_worker() -> None:
    """First call in a process that works for another one: it ends with that one, which alone gets the signals of interruptions."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


def cores_here() -> int:
    """Cores that this process may use, which a scheduler may have made fewer than the machine has."""
    return len(os.sched_getaffinity(0))


def parallel_map(function: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
    """`function` of each of `items`, in their order; by as many processes as there are cores when they are many, for which
    `function`, items and what comes of them must be picklable. What `function` raises is raised here; RunError when a process was
    killed."""
    cores = cores_here()
    if cores == 1 or len(items) <= _FEW:
        return [function(item) for item in items]
    # A process with threads of Python must not be copied; one that is begun anew imports all again.
    method = "fork" if threading.active_count() == 1 else "spawn"
    try:
        with ProcessPoolExecutor(cores, multiprocessing.get_context(method), prepare_worker) as pool:
            return list(pool.map(function, items))
    except BrokenProcessPool:
        raise RunError("a worker process was killed", "most often because memory ran out") from None
