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
from .dose import Logs
from .outcomes import Load

_NAMES = ("impacts.txt", "impacts.bin")


@dataclass(frozen=True)
class Given:
    """What the user says of a source, in SI units; None: what the record of the run says."""

    grains: Path | None = None
    drum_speed: float | None = None
    begin: float | None = None
    end: float | None = None
    impact_speed: float | None = None
    log_stiffness: float | None = None
    log_length: float | None = None

    def of(self, record: Mapping[str, Any], name: str, default: float) -> float:
        """The number `name`: given, of the run's parameters, or `default`."""
        given = getattr(self, name)
        value = record.get("parameters", {}).get(name) if given is None else given
        return default if value is None else float(value)


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
    record = read_json(file.parent / "run.json") or {}
    speed = given.of(record, "drum_speed", math.nan)
    if math.isnan(speed):
        raise DembarkError(f"the speed of the drum of {file} is not known", "", "give it with --speed, such as '11.5 rpm'")
    impacts, period = read_impacts(file), 2.0 * math.pi / abs(speed)
    if not len(impacts):
        raise DembarkError(f"{file} holds no impact")
    begin = given.begin if given.begin is not None else float(record.get("parameters", {}).get("run_in", 0)) * period
    end = given.end if given.end is not None else _last(impacts, record)
    if end - begin < 0.25 * period:
        raise DembarkError(f"the window of {file} from {begin:g} to {end:g} s is less than a quarter of a revolution ({period:.3g} s)")
    return Load(_counted(impacts, record), _logs(file, given, record), begin, end, period, given.of(record, "impact_speed", 0.0),
                given.of(record, "log_stiffness", math.nan))


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


def _logs(file: Path, given: Given, record: Mapping[str, Any]) -> Logs:
    dump = given.grains or file.parent / "grains.dump"
    if not dump.is_file():
        raise DembarkError(f"there is no {dump}", "", "name a dump with id, radius and mass of the logs with --grains")
    frame = GrainsDump(dump, skip_truncated=True)[0]
    return Logs(frame.ids, frame.radii, frame.masses, given.of(record, "log_length", math.nan))
