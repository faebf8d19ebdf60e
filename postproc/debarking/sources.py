"""Loads of logs from what a run wrote: files of impacts, radii and masses of the logs, speed of the drum."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dembark.common.errors import DembarkError
from dembark.common.files import read_json

from ..grains import GrainsDump
from ..impacts import Impacts, read_impacts
from ..replica import Replica
from .dose import Logs
from .outcomes import Load

_NAMES = ("impacts.txt", "impacts.bin")


@dataclass(frozen=True)
class Given:
    """What the user says of a source, in SI units: angular velocity of the drum (rad/s; text: the parameter of the run that has it), begin
    and end of the window (s; None: the end of the run, or the last impact), approach from which a contact is an impact (m/s), stiffness of
    a log (N/m), length of the logs and radius of the drum (m; NaN: unknown); `grains`, a dump of the logs, None: that next to the impacts.
    """

    speed: float | str
    grains: Path | None = None
    begin: float = 0.0
    end: float | None = None
    least_speed: float = 0.0
    stiffness: float = math.nan
    length: float = math.nan
    radius: float = math.nan


def files_of(path: Path) -> list[Path]:
    """The files of impacts that `path` names: itself, that of a run's folder, or those of the replicas in it; DembarkError for none."""
    if not path.is_dir():
        return [path]
    found = [one for folder in ("", "replica-*/") for name in _NAMES for one in sorted(path.glob(folder + name))]
    if not found:
        raise DembarkError(f"{path} has no {' or '.join(_NAMES)}", "", "name a file of impacts or the folder of a run that wrote one")
    return found


def load_of(file: Path, given: Given) -> Load:
    """The load whose impacts are in `file`; DembarkError or DumpError in one line where something is missing."""
    run = _run(file)
    record, speed = run.record, run.number(given.speed) if isinstance(given.speed, str) else given.speed
    if not speed > 0.0:
        raise DembarkError(f"the speed of the drum of {file} is {speed:g} rad/s", "", "it must be > 0")
    impacts, period = read_impacts(file), 2.0 * math.pi / speed
    if not len(impacts):
        raise DembarkError(f"{file} holds no impact")
    last = _last(impacts, record)
    begin, end = given.begin, last if given.end is None else given.end
    if "steps" in record and end > last * (1.0 + 1e-9):
        raise DembarkError(f"the window of {file} ends at {end:g} s, its run at {last:g} s", "", "give an earlier --end, or leave it out")
    if end - begin < 0.25 * period:
        raise DembarkError(f"the window of {file} from {begin:g} to {end:g} s is less than a quarter of a revolution ({period:.3g} s)")
    return Load(_counted(impacts, record), _logs(file, given), begin, end, period, given.least_speed, given.stiffness,
                given.radius, str(file))


def parameter(file: Path, name: str) -> float:
    """The number that the run of a file of impacts has for a parameter; DembarkError where it has none."""
    return _run(file).number(name)


def _run(file: Path) -> Replica:
    return Replica(file.parent, read_json(file.parent / "run.json") or {})


def _last(impacts: Impacts, record: Mapping[str, Any]) -> float:
    steps = record.get("steps")
    return float(impacts["time"].max()) if steps is None else float(steps) * float(record["time_step"])


def _counted(impacts: Impacts, record: Mapping[str, Any]) -> Impacts:
    """With bodies counted from 1, as in dumps, also of engines that count from 0."""
    offset = int(record.get("impact_id_offset", 0))
    if not offset:
        return impacts
    moved = np.array(impacts)
    for name in ("id_a", "id_b"):
        moved[name] += offset * (moved[name] >= 0.0)
    return moved


def _logs(file: Path, given: Given) -> Logs:
    dump = given.grains or file.parent / "grains.dump"
    if not dump.is_file():
        raise DembarkError(f"there is no {dump}", "", "name a dump with id, radius and mass of the logs with --grains")
    frame = GrainsDump(dump, skip_truncated=True)[0]
    return Logs(frame.ids, frame.radii, frame.masses, given.length)
