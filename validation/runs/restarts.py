"""States of unfinished runs: how often one is written, the newest complete one, and the folder they wait in for the next attempt."""

from __future__ import annotations

import re
import shutil
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from dembark.common.files import read_json, write_json
from dembark.validation import engines
from dembark.validation.campaigns.plan import Run
from dembark.validation.case import deck

# Wall time (s) between states unless another one is asked for.
INTERVAL = 600.0
# What the decks call their states; docs/how-to/restarts.md has the format of the mark next to each.
BASE = "state"
_ATTEMPTS = "attempts.json"


@dataclass(frozen=True)
class Attempts:
    """What is known of earlier attempts of a run: how many there were, at which steps and how they went on, and their time (s).

    `ended`: the harness saw the last one end.
    """

    attempts: int = 0
    resumed_at: tuple[int, ...] = ()
    resume: str | None = None
    wall_time: float = 0.0
    ended: bool = True


def writes_restarts(run: Run) -> bool:
    """Whether the deck, with all that it includes, writes states to resume from."""
    texts = deck.included_sources(run.case, run.engine.name).values()
    return any(word in text for text in texts for word in run.engine.facts.restart_words)


def steps_between(run: Run, interval: float, cores: int) -> int:
    """Steps between states for about `interval` (s, 0: none) of wall time on `cores`; the same on every host."""
    # Lists of neighbours are built anew whenever a state is written: another interval would change the run by round-off.
    return max(1, round(interval * run.engine.facts.restart_rate * cores / max(1, run.particles or 1))) if interval > 0.0 else 0


def _is_complete(path: Path) -> bool:
    try:
        size, check_sum = path.with_name(path.name + ".crc").read_text(encoding="ascii").split()[:2]
        crc = 0
        with path.open("rb") as handle:
            while block := handle.read(1 << 20):
                crc = zlib.crc32(block, crc)
        return path.stat().st_size == int(size) and crc == int(check_sum, 16)
    except (OSError, ValueError):
        return False


def newest(folder: Path, engine: str) -> int | None:
    """Step of the newest state of `engine` in `folder` that is complete; None when there is none."""
    pattern = re.compile(rf"{BASE}\.(\d+)\.{re.escape(engines.facts(engine).restart_suffix)}")
    found = {int(match.group(1)): path for path in folder.glob(f"{BASE}.*") if (match := pattern.fullmatch(path.name))}
    return next((step for step in sorted(found, reverse=True) if _is_complete(found[step])), None)


def work_folder(run: Run, target: Path) -> Path:
    """Hidden folder next to `target` where attempts of exactly this run work, one after the other."""
    return target.with_name(f".{target.name}.work-{run.inputs[:12]}")


def work_folders(target: Path) -> Iterator[Path]:
    """All work folders next to `target`, whatever their inputs."""
    return target.parent.glob(f".{target.name}.work-*")


def begin(run: Run, work: Path) -> int | None:
    """Make `work` ready for an attempt: the step to resume from, or None and an empty folder when there is no complete state."""
    step = newest(work, run.engine.name) if work.is_dir() and writes_restarts(run) else None
    if step is None:
        before = attempts(work)
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir(parents=True)
        remember(work, Attempts(before.attempts, wall_time=before.wall_time))
    return step


def attempts(work: Path) -> Attempts:
    """What is remembered of earlier attempts in `work`."""
    content = read_json(work / _ATTEMPTS)
    try:
        return Attempts(**(content | {"resumed_at": tuple(content["resumed_at"])})) if content else Attempts()
    except (KeyError, TypeError):
        return Attempts()


def remember(work: Path, what: Attempts) -> None:
    """Keep `what` for the next attempt in `work`."""
    write_json(work / _ATTEMPTS, asdict(what))


def clear(run: Run, work: Path) -> None:
    """Take away what only an unfinished run needs, and what was cut off from its files when it was resumed approximately."""
    for pattern in (f"{BASE}.*", "*.after-*", *run.engine.facts.leftovers, _ATTEMPTS):
        for path in work.glob(pattern):
            path.unlink(missing_ok=True)
