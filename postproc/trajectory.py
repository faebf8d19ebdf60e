"""Grains in MDAnalysis: any dump of grains as a Universe, in double precision underneath."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

import MDAnalysis
import numpy as np
from MDAnalysis.coordinates.base import ReaderBase
from MDAnalysis.core import topologyattrs
from MDAnalysis.core.topology import Topology
from MDAnalysis.lib.mdamath import triclinic_box
from MDAnalysis.lib.util import store_init_arguments
from MDAnalysis.topology.base import TopologyReaderBase
from numpy.typing import NDArray

from .dumps.frames import Array, DumpError, DumpWarning, cell
from .dumps.series import listed
from .grains import GrainFrame, GrainsDump

_KEPT = ("columns", "density", "skip_truncated", "units", "varying")


class _Grains:
    """A dump with the grains that ever occur in it, and the frame that was read last: topology and trajectory need the same."""

    def __init__(self, filename: str | Path, options: dict[str, Any]) -> None:
        self.dump = GrainsDump(filename, **{name: value for name, value in options.items() if name in _KEPT and name != "varying"})
        if len(self.dump) == 0:
            raise DumpError(f"{filename} has no complete frame")
        self._held: tuple[int, GrainFrame] = (0, self.dump[0])
        self.roster = _roster(self.dump, self._held[1], options.get("varying"))

    def frame(self, number: int) -> GrainFrame:
        if self._held[0] != number:
            self._held = (number, self.dump[number])
        return self._held[1]


@lru_cache(maxsize=1)
def _opened(filename: str, _stamp: object, options: tuple[tuple[str, Any], ...]) -> _Grains:
    """The dump; the reader of a file comes right after the parser of its topology. `_stamp` changes when the file does."""
    return _Grains(filename, dict(options))


def _grains(filename: str | Path, options: dict[str, Any]) -> _Grains:
    stats = [file.stat() for file in listed(filename) if file.is_file()]
    kept = tuple((name, tuple(value) if isinstance(value := options[name], list) else value) for name in _KEPT if name in options)
    return _opened(str(filename), tuple((stat.st_size, stat.st_mtime_ns) for stat in stats), kept)


def _roster(dump: GrainsDump, first: GrainFrame, varying: bool | None) -> dict[str, NDArray[Any]]:
    """Ids, types, radii and masses of all grains that ever occur, as they are when they first do."""
    if varying is None:
        counts = dump.counts
        varying = bool((counts != counts[0]).any())
    parts, known = [_static(first)], first.ids
    for number in range(1, len(dump) if varying else 1):
        new = np.setdiff1d(dump.raw(number, ("id",)).values.astype(np.int64), known)
        if len(new):
            frame = dump[number]
            parts.append(_static(frame.select(np.isin(frame.ids, new))))
            known = np.union1d(known, new)
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    order = np.argsort(joined["ids"], kind="stable")
    return {name: values[order] for name, values in joined.items()}


def _static(frame: GrainFrame) -> dict[str, NDArray[Any]]:
    types = frame.types if frame.has("types") else np.ones(len(frame.ids), np.int64)
    return {"ids": frame.ids, "types": types, "radii": frame.radii, "masses": frame.masses}


class GrainsParser(TopologyReaderBase):
    """MDAnalysis topology of a dump of grains: ids, types, radii and masses of all grains that ever occur in it."""

    format = "DEMGRAINS"

    def parse(self, **kwargs: Any) -> Topology:
        """Topology with one residue and one segment."""
        grains = _grains(self.filename, kwargs).roster
        attributes = [topologyattrs.Atomids(grains["ids"]), topologyattrs.Atomtypes(grains["types"].astype(str).astype(object)),
                      topologyattrs.Radii(grains["radii"]), topologyattrs.Masses(grains["masses"]), topologyattrs.Resids(np.array([1])),
                      topologyattrs.Resnums(np.array([1])), topologyattrs.Segids(np.array(["DEM"], dtype=object))]
        return Topology(len(grains["ids"]), 1, 1, attrs=attributes)


class GrainsReader(ReaderBase):
    """MDAnalysis trajectory of a dump of grains, in the file's own SI units and coordinates (MDAnalysis's own reader of text dumps
    moves the box to the origin and keeps single precision, too little for overlaps).

    `ts.positions`, `ts.velocities`, `ts.forces` are what MDAnalysis works with; the double-precision originals and everything else
    (`omegas`, `wall_forces`, `radii`, `extra`, ...) are in `ts.data["frame"]`, a GrainFrame. Where grains come and go, the atoms are all
    that ever occur; `ts.data["present"]` (n,) marks those that are there, the others have NaN for positions, velocities and forces.
    """

    format = "DEMGRAINS"
    units: ClassVar = {"time": None, "length": None, "velocity": None, "force": None}

    @store_init_arguments
    def __init__(self, filename: str | Path, time_step: float = 1.0, wrapped: bool = False, **kwargs: Any) -> None:
        """`time_step` (s) of the simulation turns steps into `ts.time` where the dump has no times; with `wrapped`, positions are
        inside the box.

        Further: `columns`, `density`, `skip_truncated`, `units` of GrainsDump; `varying` says that grains come and go though their number
        stays.
        """
        self._grains = _grains(filename, kwargs)
        steps, times = self._grains.dump.steps, self._grains.dump.times
        self._times = times if np.isfinite(times).all() else steps * time_step
        kwargs.setdefault("dt", float(self._times[1] - self._times[0]) if len(steps) > 1 else time_step)
        super().__init__(filename, **{name: value for name, value in kwargs.items() if name not in _KEPT})
        self._wrapped = wrapped
        self._ids = self._grains.roster["ids"]
        self.n_atoms = len(self._ids)
        self.n_frames = len(steps)
        self.ts = self._Timestep(self.n_atoms, **self._ts_kwargs)
        self._read_frame(0)
        self._warn_of_walls()

    def _warn_of_walls(self) -> None:
        frame = self.ts.data["frame"]
        walled = [axis for axis, periodic in zip("xyz", frame.periodic, strict=True) if not periodic]
        if 0 < len(walled) < 3:
            warnings.warn(f"{self._grains.dump.path}: the box is not periodic along {' and '.join(walled)}, but MDAnalysis takes it for "
                          "periodic there: neighbours across these faces are none", DumpWarning, stacklevel=2)

    def _read_frame(self, frame: int) -> Any:
        if not 0 <= frame < self.n_frames:
            raise OSError(f"there is no frame {frame}")
        grains = self._grains.frame(frame)
        same = np.array_equal(self._ids, grains.ids)
        present = np.ones(self.n_atoms, bool) if same else np.isin(self._ids, grains.ids)
        if present.sum() != len(grains.ids):
            raise DumpError(f"{grains.where}: holds grains that the first frame does not; open it with varying=True")
        ts = self.ts
        ts.frame = frame
        ts.positions = self._spread(grains.wrapped if self._wrapped else grains.positions, present)
        if grains.has("velocities"):
            ts.velocities = self._spread(grains.velocities, present)
        if grains.has("forces"):
            ts.forces = self._spread(grains.forces, present)
        ts.dimensions = _dimensions(grains)
        ts.data["step"] = grains.step
        ts.data["time"] = float(self._times[frame])
        ts.data["frame"] = grains
        ts.data["present"] = present
        return ts

    def _spread(self, values: Array, present: NDArray[np.bool_]) -> Array:
        if present.all():
            return values
        spread = np.full((self.n_atoms, 3), np.nan)
        spread[present] = values
        return spread

    def _read_next_timestep(self, ts: Any = None) -> Any:
        if self.ts.frame + 1 >= self.n_frames:
            raise EOFError
        return self._read_frame(self.ts.frame + 1)

    def _reopen(self) -> None:
        self.ts.frame = -1

    def close(self) -> None:
        """Nothing stays open between frames."""


def _dimensions(grains: GrainFrame) -> Sequence[float] | Array | None:
    """The box as MDAnalysis has it, which takes every axis for periodic: without a periodic one there is none."""
    if not grains.periodic.any():
        return None
    edges = cell(grains.low, grains.high, grains.tilt)
    return triclinic_box(*edges) if grains.tilt.any() else [*np.diag(edges), 90.0, 90.0, 90.0]


def universe(path: str | Path, time_step: float = 1.0, **kwargs: Any) -> MDAnalysis.Universe:
    """MDAnalysis Universe of a dump of grains, for its selections and analysis classes; keywords are those of GrainsReader.

    For example `universe(path).select_atoms("type 1 and prop z > 0.05")`. The same as
    `MDAnalysis.Universe(path, format="DEMGRAINS", time_step=time_step)`, once this function is imported.

    MDAnalysis takes every axis of `dimensions` for periodic. So these are None for a box without a periodic axis, and a warning names the
    axes of another box that are not: there, MDAnalysis finds neighbours across walls. `ts.data["frame"]` has the box of the dump.
    """
    name = str(path)
    return MDAnalysis.Universe(name, name, topology_format="DEMGRAINS", format="DEMGRAINS", time_step=time_step, **kwargs)
