"""What went wrong while results were analysed, for people: its line, and what of the run is too small to be measured."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from dembark.postproc import DumpError, DumpWarning, GrainsDump
from dembark.validation.case.deck import failed
from dembark.validation.case.model import Case

# Below these numbers most checks have nothing to average over.
_FEW_GRAINS = 100
_FEW_FRAMES = 4
_MISTAKES = (NameError, AttributeError, ImportError, TypeError, KeyError, OSError)


@contextmanager
def collected_warnings() -> Iterator[list[str]]:
    """A list that takes the numerical warnings of the block, as remarks with file and line, instead of the screen."""
    found: list[str] = []
    # The filters stay as they are: where a warning is to be an error, it is one.
    with warnings.catch_warnings(record=True) as caught:
        yield found
    for one in caught:
        if issubclass(one.category, RuntimeWarning):
            found.append(f"numerical warning: {one.message} ({Path(one.filename).name}, line {one.lineno})")
        else:
            warnings.showwarning(one.message, one.category, one.filename, one.lineno)


def reasons(folder: Path, error: Exception, case: Case) -> tuple[str, ...]:
    """Parts of one line about `error`, which the measure.py of `case` raised for the runs in `folder`: the error, file and line, and what
    of the run is too small, unless the error is one of the program itself."""
    reason = str(failed(case.folder / "measure.py", error))
    small = () if isinstance(error, _MISTAKES) else (too_small(path) for path in sorted(folder.glob("replica-*")))
    worst = next(filter(None, small), "")
    return (reason, f"the run may be too small or too short to be measured: {worst}") if worst else (reason,)


def departed(replica: Path) -> str:
    """How many grains of a finished run are no longer in its last frame; '' when none has left, or there are no frames."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DumpWarning)  # the measurement says them
            counts = GrainsDump(replica / "grains.dump").counts
    except DumpError:
        return ""
    most = int(counts.max(initial=0))
    gone = most - int(counts[-1]) if len(counts) else 0
    return f"{replica.name}: {gone} of {most} grains are no longer in the last frame" if gone else ""


def too_small(replica: Path) -> str:
    """What a finished run has too little of: grains, frames, walls that carry something; '' when nothing is striking."""
    try:
        grains = GrainsDump(replica / "grains.dump")
        last = grains[len(grains) - 1]
    except (DumpError, IndexError):
        return ""
    count, frames = len(last.radii), len(grains)
    found = [f"{count} grain{'s' * (count != 1)}"] if count < _FEW_GRAINS else []
    found += [f"{frames} frame{'s' * (frames != 1)}"] if frames < _FEW_FRAMES else []
    found += ["nothing presses on a wall in the last frame"] if last.wall_forces and not any(map(np.any, last.wall_forces.values())) else []
    return ", ".join(found)
