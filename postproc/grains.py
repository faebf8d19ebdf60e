"""Grains of a run: one schema for the dumps of every engine, as a stream of frames or as an MDAnalysis Universe."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import MDAnalysis
import numpy as np
from dembark.postproc.dumptext import DumpError, RawFrame, TextDump
from MDAnalysis.coordinates.base import ReaderBase
from MDAnalysis.core import topologyattrs
from MDAnalysis.core.topology import Topology
from MDAnalysis.topology.base import TopologyReaderBase
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SCALARS = ("id", "type", "radius", "mass")
_VECTORS = {
    "positions": ("x", "y", "z"),
    "velocities": ("vx", "vy", "vz"),
    "omegas": ("omegax", "omegay", "omegaz"),
    "forces": ("fx", "fy", "fz"),
}
_WALL = re.compile(r"f_force_(\w+)\[1\]")


@dataclass(frozen=True)
class GrainFrame:
    """All n grains at one step, sorted by id; SI units.

    `positions` (m) are unwrapped where the dump has image flags, `wrapped` are those inside the box; `velocities` (m/s),
    `omegas` (rad/s), `forces` (N, all contacts and gravity) are (n, 3); `radii` (m), `masses` (kg), `ids`, `types` are (n,);
    `wall_forces[name]` (n, 3) is the force of that wall on each grain (N). `low`, `high` (m) and `periodic` describe the box.
    """

    step: int
    low: Array
    high: Array
    periodic: NDArray[np.bool_]
    ids: NDArray[np.int64]
    types: NDArray[np.int64]
    positions: Array
    wrapped: Array
    velocities: Array
    omegas: Array
    forces: Array
    radii: Array
    masses: Array
    wall_forces: Mapping[str, Array]

    def select(self, mask: NDArray[np.bool_]) -> GrainFrame:
        """The same frame with only the grains where `mask` (n,) is true."""
        names = ("ids", "types", "positions", "wrapped", "velocities", "omegas", "forces", "radii", "masses")
        return GrainFrame(
            step=self.step,
            low=self.low,
            high=self.high,
            periodic=self.periodic,
            wall_forces={name: force[mask] for name, force in self.wall_forces.items()},
            **{name: getattr(self, name)[mask] for name in names},
        )


def _frame(raw: RawFrame, path: Path) -> GrainFrame:
    column = {name: index for index, name in enumerate(raw.columns)}
    wanted = [*_SCALARS, *(name for names in _VECTORS.values() for name in names)]
    missing = [name for name in wanted if name not in column]
    if missing:
        raise DumpError(f"{path}: column {', '.join(missing)} is missing; there are {' '.join(raw.columns)}")
    values = raw.values[np.argsort(raw.values[:, column["id"]], kind="stable")]

    def vector(names: tuple[str, ...]) -> Array:
        return values[:, [column[name] for name in names]]

    walls = [match.group(1) for name in raw.columns if (match := _WALL.fullmatch(name))]
    wrapped = vector(_VECTORS["positions"])
    images = vector(("ix", "iy", "iz")) if {"ix", "iy", "iz"} <= column.keys() else np.zeros_like(wrapped)
    return GrainFrame(
        step=raw.step,
        low=raw.low,
        high=raw.high,
        periodic=raw.periodic,
        ids=values[:, column["id"]].astype(np.int64),
        types=values[:, column["type"]].astype(np.int64),
        positions=wrapped + images * np.where(raw.periodic, raw.high - raw.low, 0.0),
        wrapped=wrapped,
        velocities=vector(_VECTORS["velocities"]),
        omegas=vector(_VECTORS["omegas"]),
        forces=vector(_VECTORS["forces"]),
        radii=values[:, column["radius"]],
        masses=values[:, column["mass"]],
        wall_forces={wall: vector(tuple(f"f_force_{wall}[{axis}]" for axis in (1, 2, 3))) for wall in walls},
    )


class GrainsDump:
    """`grains.dump` of either engine as a sequence of GrainFrame, read one at a time."""

    def __init__(self, path: str | Path, *, skip_truncated: bool = False) -> None:
        """Open; DumpError for a missing, foreign or truncated file (see TextDump for `skip_truncated`)."""
        self._dump = TextDump(path, skip_truncated=skip_truncated)

    @property
    def path(self) -> Path:
        """The file."""
        return self._dump.path

    @property
    def truncated(self) -> str:
        """One line about a cut-off last frame that was left out, or ''."""
        return self._dump.truncated

    def __len__(self) -> int:
        return len(self._dump)

    def __iter__(self) -> Iterator[GrainFrame]:
        return (self[number] for number in range(len(self)))

    def __getitem__(self, number: int) -> GrainFrame:
        if number < 0:
            number += len(self)
        if not 0 <= number < len(self):
            raise IndexError(number)
        return _frame(self._dump.frame(number), self.path)


class GrainsParser(TopologyReaderBase):
    """MDAnalysis topology of a `grains.dump`: ids, types, radii and masses of its first frame."""

    format = "DEMGRAINS"

    def parse(self, **kwargs: Any) -> Topology:
        """Topology with one residue and one segment."""
        frame = GrainsDump(self.filename)[0]
        attributes = [
            topologyattrs.Atomids(frame.ids),
            topologyattrs.Atomtypes(frame.types.astype(str).astype(object)),
            topologyattrs.Radii(frame.radii),
            topologyattrs.Masses(frame.masses),
            topologyattrs.Resids(np.array([1])),
            topologyattrs.Resnums(np.array([1])),
            topologyattrs.Segids(np.array(["DEM"], dtype=object)),
        ]
        return Topology(len(frame.ids), 1, 1, attrs=attributes)


class GrainsReader(ReaderBase):
    """MDAnalysis trajectory of a `grains.dump`, in the file's own SI units and coordinates (MDAnalysis's LAMMPSDUMP moves the box to
    the origin and keeps single precision, too little for overlaps).

    `ts.positions`, `ts.velocities`, `ts.forces` are what MDAnalysis works with; the double-precision originals and everything else
    (`omegas`, `wall_forces`, `radii`, ...) are in `ts.data["frame"]`, a GrainFrame.
    """

    format = "DEMGRAINS"
    units: ClassVar = {"time": None, "length": None, "velocity": None, "force": None}

    def __init__(self, filename: str | Path, time_step: float = 1.0, **kwargs: Any) -> None:
        """`time_step` (s) of the simulation turns steps into `ts.time`."""
        super().__init__(filename, **kwargs)
        self._grains = GrainsDump(filename)
        self._time_step = time_step
        self.n_atoms = len(self._grains[0].ids)
        self.n_frames = len(self._grains)
        self.ts = self._Timestep(self.n_atoms, **self._ts_kwargs)
        self._read_frame(0)

    def _read_frame(self, frame: int) -> Any:
        if not 0 <= frame < self.n_frames:
            raise OSError(f"there is no frame {frame}")
        grains = self._grains[frame]
        if len(grains.ids) != self.n_atoms:
            raise DumpError(f"{self._grains.path}, frame {frame + 1}: has {len(grains.ids)} grains, the first had {self.n_atoms}")
        ts = self.ts
        ts.frame = frame
        ts.positions, ts.velocities, ts.forces = grains.positions, grains.velocities, grains.forces
        ts.dimensions = [*(grains.high - grains.low), 90.0, 90.0, 90.0]
        ts.data["step"] = grains.step
        ts.data["time"] = grains.step * self._time_step
        ts.data["frame"] = grains
        return ts

    def _read_next_timestep(self, ts: Any = None) -> Any:
        if self.ts.frame + 1 >= self.n_frames:
            raise EOFError
        return self._read_frame(self.ts.frame + 1)

    def _reopen(self) -> None:
        self.ts.frame = -1

    def close(self) -> None:
        """Nothing stays open between frames."""


def universe(path: str | Path, time_step: float = 1.0) -> MDAnalysis.Universe:
    """MDAnalysis Universe of a `grains.dump`, for its selections and analysis classes.

    For example `universe(path).select_atoms("type 1 and prop z > 0.05")`.
    """
    name = str(path)
    return MDAnalysis.Universe(name, name, topology_format="DEMGRAINS", format="DEMGRAINS", time_step=time_step)
