"""What the commands read: a dump, or the folder of a run with its time step and walls."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dembark.common.errors import DembarkError
from dembark.common.files import read_json
from dembark.postproc.contacts import ContactFrame, ContactsDump
from dembark.postproc.dumptext import DumpError
from dembark.postproc.grains import GrainFrame, GrainsDump
from dembark.postproc.walls import CylinderWall, Motion, PlaneWall, Wall


@dataclass(frozen=True)
class Source:
    """Frames to be averaged: `grains`, `contacts` (None: there are none), `time_step` (s; NaN: unknown), `record` of the run or {}.

    Times are those of the dump where it has them (`ITEM: TIME`): the step may change during a run.
    """

    path: Path
    grains: GrainsDump
    contacts: ContactsDump | None
    time_step: float
    record: Mapping[str, Any]

    @property
    def notes(self) -> list[str]:
        """Lines about what of the files was left out or put in order, and about what is odd in them."""
        lines = [line for one in (self.grains, self.contacts) if one is not None for line in one.remarks]
        known = np.isfinite(self.grains.times)
        apart = np.abs(self.grains.times - self.grains.steps * self.time_step)[known]
        if (apart > 1e-6 * np.abs(self.grains.times[known]).max(initial=0.0)).any():
            lines.append(f"the times are those of the dump, not its steps times {self.time_step:.6g} s")
        return lines

    @property
    def timed(self) -> bool:
        """Whether the times are known in s."""
        return not math.isnan(self.time_step) or bool(np.isfinite(self.grains.times).all())

    def time(self, frame: GrainFrame) -> float:
        """Simulated time (s) of a frame; its step where no time is known. DumpError where only other frames of the dump have a time."""
        if frame.time is not None:
            return frame.time
        if not math.isnan(self.time_step):
            return frame.step * self.time_step
        if np.isfinite(self.grains.times).any():
            raise DumpError(f"{frame.where}: the frame has no ITEM: TIME, but others have; give the time step")
        return frame.step

    def frames(self, numbers: Sequence[int]) -> Iterator[tuple[GrainFrame, ContactFrame | None]]:
        """Frames by their numbers, one at a time, each with the contacts of its step; DumpError when those are not there."""
        for number in numbers:
            grains = self.grains[number]
            yield grains, self.contacts.at_step(grains.step) if self.contacts is not None else None

    def walls(self, names: Sequence[str]) -> list[Wall]:
        """The walls of a case of dembark that carry one of `names`, told from its parameters; [] for other files."""
        return _walls_of(self.record.get("parameters", {}), self.time_step, names)


@dataclass(frozen=True)
class Reading:
    """How files are to be read that do not say it themselves: `time_step` (s), `density` (kg/m3) of grains without masses, names of the
    `columns` of a binary dump, what the columns of a foreign dump of contacts are (see ContactsDump), and the unit style."""

    time_step: float | None = None
    density: float | None = None
    columns: Sequence[str] | None = None
    contact_columns: Mapping[str, Sequence[int | str]] | None = None
    units: str = ""


def open_source(path: Path, contacts: Path | None = None, reading: Reading | None = None) -> Source:
    """Open a dump of grains, or a run folder with grains.dump; DembarkError or DumpError in one line when it is not there.

    A last frame that was cut off is left out and told in `notes`.
    """
    how = reading or Reading()
    folder = _run_folder(path)
    record = (read_json(folder / "run.json") or {}) if folder else {}
    file = folder / "grains.dump" if folder else path
    if contacts is None and folder and (folder / "contacts.dump").is_file():
        contacts = folder / "contacts.dump"
    time_step = how.time_step if how.time_step is not None else float(record.get("time_step", math.nan))

    def grains_in(units: str) -> GrainsDump:
        return GrainsDump(file, skip_truncated=True, columns=how.columns, density=how.density, units=units)

    grains = grains_in(how.units)
    if not len(grains):
        raise DumpError(f"{file} has no whole frame")
    if contacts is None:
        return Source(path, grains, None, time_step, record)
    # Both are of one run: where only one of them names the units, they hold for the other.
    touching = ContactsDump(contacts, skip_truncated=True, columns=how.contact_columns, units=how.units or grains.units)
    if touching.units and not grains.units:
        grains = grains_in(touching.units)
    return Source(path, grains, touching, time_step, record)


def _run_folder(path: Path) -> Path | None:
    if not path.is_dir():
        return None
    if (path / "grains.dump").is_file():
        return path
    inside = sorted(path.glob("replica-*/grains.dump"))
    if len(inside) == 1:
        return inside[0].parent
    advice = f"name one of its replicas, such as {inside[0].parent}" if inside else "name a dump file or the folder of a run"
    raise DembarkError(f"{path} has no grains.dump", "", advice)


def _walls_of(parameters: Mapping[str, Any], time_step: float, names: Sequence[str]) -> list[Wall]:
    """dembark's cases have their walls where these parameters say: side, left and right stand, base lies at z = 0."""
    found: dict[str, Wall] = {}
    if "cylinder_radius" in parameters:
        found["side"] = CylinderWall("side", float(parameters["cylinder_radius"]))
    width = parameters.get("silo_width", parameters.get("channel_width"))
    if width is not None:
        found["left"] = PlaneWall("left", normal=(1.0, 0.0, 0.0))
        found["right"] = PlaneWall("right", (float(width), 0.0, 0.0), (-1.0, 0.0, 0.0))
    if parameters:
        speed = float(parameters.get("base_speed", 0.0))
        # A base that sinks begins to when the grains have settled.
        since = math.ceil(float(parameters.get("settle_time", 0.0)) / time_step) * time_step if time_step > 0.0 else 0.0
        found["base"] = PlaneWall("base", motion=Motion((0.0, 0.0, -speed), since))
    return [wall for name, wall in found.items() if name in names]
