"""Loads of walls over frames: which walls, checks that they are where the grains feel them, recorders, and the summary in lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from dembark.common.errors import DembarkError

from ..cli_options import STL_UNITS, PatchedWall, parse_wall, patched
from ..contacts import ContactFrame
from ..dumps import DumpError
from ..grains import GrainFrame
from ..history import read_times
from ..sources import Selection, Source
from . import Inclusion, MeshWall
from .stress import WallRecorder, WallStress

# The stresses of a wall's patches are kept for every frame as long as they fit into so many bytes.
_SERIES_LIMIT = 400_000_000
# Distances of the contact points from the grains' centres, over the radius, that raise doubts about the wall's place.
_DOUBTFUL = (0.7, 1.3)
# A mesh is in another unit or place when it is larger than so many boxes of grains (an inch is 25 mm), or half of the grains that feel it
# are farther than so many radii. One that is much larger than the box, and may yet be a long floor, gets a note.
_ROOMS = 20.0
_LARGE = 5.0
_FAR = 2.0


class WallLoads:
    """The walls of `chosen` frames, by the user's `texts` or else those of the run; `add` takes the frames, `results` are the loads.

    `walls` are what was chosen, `notes` lines about them. DembarkError for a wall that is given twice, that the dump does not have, or
    that cannot be where the grains feel it: all before any frame but the first is read.
    """

    def __init__(self, texts: Sequence[str], chosen: Selection) -> None:
        self._chosen, source, frame = chosen, chosen.source, chosen.first
        self.walls = [parse_wall(text, chosen.diameter) for text in texts]
        self.notes: list[str] = []
        if not texts:
            found, self.notes = source.walls(list(frame.wall_forces))
            self.walls = [patched(wall) for wall in found]
        _check(self.walls, source, frame)
        self._unfelt = _check_meshes(self.walls, source, frame)
        self._recorders: list[WallRecorder] = []

    @property
    def names(self) -> list[str]:
        """Names of the walls."""
        return [one.wall.name for one in self.walls]

    def record(self, patch: float) -> None:
        """Begin to record, on patches of about the size `patch` (m) on what lies in the box of the first frame."""
        for one in self.walls:
            patches = one.patches(self._chosen.first, patch)
            keep = 24 * len(patches) * len(self._chosen.numbers) <= _SERIES_LIMIT
            self._recorders.append(WallRecorder(one.wall, patches, keep_series=keep))

    def check(self, frame: GrainFrame) -> None:
        """DembarkError when this is the first frame in which grains feel a mesh, and that cannot be what they feel."""
        self._unfelt = _check_meshes(self._unfelt, self._chosen.source, frame)

    def add(self, frame: GrainFrame, contacts: ContactFrame | None, time: float) -> None:
        """Take the next frame at `time` (s)."""
        for recorder in self._recorders:
            recorder.add(frame, contacts, time)

    def results(self) -> list[WallStress]:
        """The load of each wall."""
        return [recorder.result() for recorder in self._recorders]

    def mesh_notes(self) -> list[str]:
        """A line for each mesh that is much larger than the box of the grains."""
        room = _room(self._chosen.first)
        sizes = {one.wall.name: float(np.ptp(one.wall.triangles.reshape(-1, 3), axis=0).max())
                 for one in self.walls if isinstance(one.wall, MeshWall)}
        return [f"note: the mesh {name} is {1e3 * size:.4g} mm wide, the box of the grains {1e3 * room:.4g} mm; is unit= that of its file?"
                for name, size in sizes.items() if size > _LARGE * room]


def _check(walls: Sequence[PatchedWall], source: Source, frame: GrainFrame) -> None:
    names = [one.wall.name for one in walls]
    for name, wall in zip(names, (one.wall for one in walls), strict=True):
        if names.count(name) > 1:
            raise DembarkError(f"wall {name} is given twice", "in --wall", "give each a name of its own")
        if isinstance(wall, Inclusion):
            wall.members(frame)
            if source.contacts is None:
                raise DembarkError(f"the load of {name} needs contacts", f"{source.path} has none", "name their dump with --contacts")
        elif any(wall.motion.velocity) and not source.timed:
            raise DembarkError("the wall moves, but the times of the frames are not known", f"for --wall {name}", "give --time-step")
        elif name not in frame.wall_forces:
            known = ", ".join(frame.wall_forces) or "none"
            raise DembarkError(f"the dump has no columns f_force_{name}[1..3]", f"for --wall {name}", f"walls in it: {known}")


def _check_meshes(walls: Iterable[PatchedWall], source: Source, frame: GrainFrame) -> list[PatchedWall]:
    """DembarkError when a mesh cannot be what the grains of `frame` feel: its file was in another unit, or it was elsewhere.

    Returns the meshes that no grain feels yet, of which only the size was looked at.
    """
    meshes = [one for one in walls if isinstance(one.wall, MeshWall)]
    if not len(frame.radii):
        return meshes
    time, unfelt = source.time(frame), []
    for one in meshes:
        assert isinstance(one.wall, MeshWall)
        wall = one.wall.at(time)
        if doubt := _misfit(wall, frame):
            # The mesh as it is, and as it would be in other units: factors between any two of them.
            factors = {name: unit / one.unit for name, unit in STL_UNITS.items()}
            fits = [name for name, factor in factors.items() if not _misfit(replace(wall, triangles=wall.triangles * factor), frame)]
            size = " x ".join(f"{1e3 * extent:.4g}" for extent in np.ptp(wall.triangles.reshape(-1, 3), axis=0))
            right = f"with unit={' or unit='.join(fits)} it fits" if fits else "give the file's unit and its place in the simulation"
            raise DembarkError(f"the mesh is {size} mm, and {doubt}", f"in --wall {wall.name}", right)
        if not frame.wall_forces[wall.name].any():
            unfelt.append(one)
    return unfelt


def _room(frame: GrainFrame) -> float:
    """Width (m) of the box of the grains, or of the grains where they have left it."""
    return float(max(np.ptp(frame.wrapped, axis=0).max(), (frame.high - frame.low).max(), 2.0 * frame.radii.max()))


def _misfit(wall: MeshWall, frame: GrainFrame) -> str:
    """Why the mesh cannot be the wall that grains feel, '' when it can."""
    extent, smallest = np.ptp(wall.triangles.reshape(-1, 3), axis=0).max(), 2.0 * frame.radii.min()
    if extent > _ROOMS * _room(frame):
        return f"the box of the grains is only {1e3 * _room(frame):.4g} mm wide"
    if extent < smallest:
        return f"the smallest grain is {1e3 * smallest:.4g} mm wide"
    felt = np.linalg.norm(frame.wall_forces[wall.name], axis=1) > 0.0
    if not felt.any():
        return ""
    centres = frame.wrapped[felt]
    away = np.linalg.norm(wall.places(centres).points - centres, axis=1) / frame.radii[felt]
    return f"the grains that feel it are {away.min():.3g} to {away.max():.3g} radii away from it" if np.median(away) > _FAR else ""


def wall_lines(one: WallStress, source: Source) -> list[str]:
    """A wall's load in lines, with what was checked."""
    x, y, z = one.force.mean(axis=0)
    largest = int(np.argmax(one.mean[:, 0]))
    lines = [(f"{one.wall.name}: mean force on the grains ({x:.4g}, {y:.4g}, {z:.4g}) N on {len(one.patches)} patches of "
              f"{1e6 * one.patches.areas.mean():.4g} mm2; the patches' sum differs from it by {one.imbalance():.1e}"),
             (f"  normal stress: largest mean {_pressure(one.mean[largest, 0])} ± {_pressure(one.half[largest, 0])} at "
              f"({', '.join(f'{1e3 * place:.4g}' for place in one.patches.centres[largest])}) mm")]
    if not one.contacts.any() and not one.outside.any():
        lines.append("  note: no grain feels this wall in these frames")
    if one.outside.any():
        share = np.abs(one.outside).sum() / max(np.abs(one.force).sum(), 1e-300)
        lines.append(f"  note: {100.0 * share:.2g} % of the force acts outside the patches")
    if len(one.peak_forces):
        top = one.peak_forces.max()
        mean = float(one.normal_force.mean())
        lines.append(f"  peaks of the normal force: {len(one.peak_forces)}, mean {one.peak_forces.mean():.4g} N, largest {top:.4g} N"
                     + (f" ({top / mean:.3g} times its mean)" if mean > 0.0 else ""))
    if one.peak_stress.number:
        lines.append(f"  peaks of a patch's normal stress: {one.peak_stress.number}, mean {_pressure(one.peak_stress.mean)}, 99 % below "
                     f"{_pressure(one.peak_stress.quantile(0.99))}, largest {_pressure(one.peak_stress.largest)}")
    if one.contact_force.number:
        lines.append(f"  contacts: {one.contact_force.number / len(one.steps):.4g} a frame, mean normal force {one.contact_force.mean:.4g} "
                     f"N, largest {one.contact_force.largest:.4g} N")
        if one.contact_force.mean < 0.0:
            lines.append("  note: the grains pull at this wall; does its normal point to them?")
    if one.series is None:
        lines.append("  note: too many patches and frames to keep each frame's stresses; means and peaks are of all frames")
    low, high = one.reach
    if high > 0.0 and not (_DOUBTFUL[0] <= low and high <= _DOUBTFUL[1]):
        lines.append(f"  note: grains that feel this wall are {low:.3g} to {high:.3g} radii away from it; "
                     "is it where the simulation had it?")
    return [*lines, *_own_force(one, source)]


def _own_force(one: WallStress, source: Source) -> list[str]:
    """How far the force is from the one that the engine itself wrote into time.csv at the same steps."""
    path = source.grains.path.with_name("time.csv")
    try:
        history = read_times(path)
    except DumpError:
        return []
    names = [f"{one.wall.name}_f{axis}" for axis in "xyz"]
    common, ours, theirs = np.intersect1d(one.steps, history["step"], return_indices=True)
    if not len(common) or any(name not in history for name in names):
        return []
    own = np.column_stack([history[name][theirs] for name in names])
    difference = np.abs(one.force[ours] - own).max() / max(np.abs(own).max(), 1e-300)
    return [f"  the engine's own force in {path.name} at {len(common)} of these steps differs by at most {difference:.1e}"]


def _pressure(value: float) -> str:
    if not np.isfinite(value):
        return "(too few frames)"
    return f"{value / 1e3:.4g} kPa" if abs(value) >= 1e4 else f"{value:.4g} Pa"
