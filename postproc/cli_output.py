"""What the commands on dumps say and where they write: places checked, provenance, lines and progress."""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from dembark.common.errors import DembarkError


def check_places(out: Path | None, *collections: Path | None, suffixes: Sequence[str] = (".nc",), plot: Path | None = None,
                 read: Iterable[Path | None]) -> None:
    """DembarkError when an output cannot be where it shall be, when `out` has none of the `suffixes` of what is written to it, or when two
    are the same file, or one is a file that is `read`."""
    sources = [file for path in read if path
               for file in (path, *(path.glob("*.dump") if path.is_dir() else path.parent.glob(path.name))) if file.is_file()]
    given = [path for path in (out, *collections) if path is not None]
    for path in given:
        if path.is_dir():
            raise DembarkError(f"{path} is a folder", "", "name a file")
        if not path.parent.is_dir():
            raise DembarkError(f"there is no folder {path.parent}", f"for {path.name}", "make it first")
        if path.is_file() and any(path.samefile(one) for one in sources):
            raise DembarkError(f"{path} is a file that is read", "", "name another place")
        if given.count(path) > 1:
            raise DembarkError(f"{path} is named twice", "", "give each output a file of its own")
    if out is not None and out.suffix not in suffixes:
        raise DembarkError(f"{out.name} does not end in {' or '.join(suffixes)}", "in --out")
    if any(collections):
        from .output.paraview import check_place

        for path in filter(None, collections):
            check_place(path)
    if plot is not None and plot.exists() and not plot.is_dir():
        raise DembarkError(f"{plot} is a file", "in --plot", "name a folder")


def provenance(command: str, source: Path) -> dict[str, str]:
    """Attributes of a file that the `command` writes of `source`."""
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return {"title": f"dembark {command} of {source.resolve().name}", "source": str(source),
            "history": f"{now}: dembark {' '.join(sys.argv[1:])}", "software": f"dembark {version('dembark')}"}


def say(lines: Sequence[str]) -> None:
    """Print lines as they are."""
    console = Console(highlight=False, soft_wrap=True)
    for line in lines:
        console.print(line, markup=False)


@contextmanager
def progress(name: str, total: int, interval: float = 10.0) -> Iterator[Callable[[], None]]:
    """Gives a function to call after each of `total` frames: it moves a bar in a terminal, and else prints a line every `interval` s."""
    console = Console(file=sys.stderr, highlight=False, soft_wrap=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("frames"), TimeRemainingColumn())
    done, spoken = 0, clock.monotonic()
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(name, total=total)

        def advance() -> None:
            nonlocal done, spoken
            done += 1
            bar.advance(task)
            if not console.is_terminal and clock.monotonic() - spoken >= interval:
                spoken = clock.monotonic()
                print(f"dembark: {name}: frame {done} of {total}", file=sys.stderr, flush=True)

        yield advance
