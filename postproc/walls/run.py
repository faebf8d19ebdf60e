"""What `dembark walls` does: frames to wall loads to files, with memory for one frame and the loads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from dembark.common.errors import DembarkError
from dembark.postproc.contacts import ContactFrame
from dembark.postproc.dumptext import DumpError
from dembark.postproc.grains import GrainFrame
from dembark.postproc.history import read_times
from dembark.postproc.output.netcdf import write_wall_netcdf
from dembark.postproc.output.vtkhdf import write_vtkhdf_wall
from dembark.postproc.output.whole import WholeFile
from dembark.postproc.sources import Reading, Source, open_source
from dembark.postproc.walls import Inclusion, MeshWall
from dembark.postproc.walls.stress import WallRecorder, WallStress
from dembark.postproc.words import STL_UNITS, WallWord, frame_numbers, length, parse_wall, plain

Attributes = Mapping[str, str | float | int]

# The stresses of a wall's patches are kept for every frame as long as they fit into so many bytes.
_SERIES_LIMIT = 400_000_000
# Distances of the contact points from the grains' centres, over the radius, that raise doubts about the wall's place.
_DOUBTFUL = (0.7, 1.3)
# A mesh is in another unit or place when it is larger than so many boxes of grains (an inch is 25 mm), or half of the grains that feel it
# are farther than so many radii. One that is much larger than the box, and may yet be a long floor, is told.
_ROOMS = 20.0
_LARGE = 5.0
_FAR = 2.0


@dataclass
class WallJob:
    """A load measurement that was planned and can be run: its source, frames, walls, outputs and, once run, its results."""

    source: Source
    numbers: list[int]
    diameter: float
    walls: list[WallWord]
    patch: float
    out: Path | None
    vtkhdf: Path | None
    plot: Path | None
    results: list[WallStress] = field(default_factory=list)
    diameters: list[float] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)

    @classmethod
    def plan(cls, path: Path, contacts: Path | None, walls: Sequence[str], patch: str, frames: str, out: Path | None, vtkhdf: Path | None,
             plot: Path | None, how: Reading) -> WallJob:
        """Check everything the user wrote; DembarkError or DumpError before any work is done."""
        source, numbers, first, diameter = begin(path, contacts, frames, how)
        chosen = choose_walls(walls, source, first, diameter)
        if not chosen:
            known = ", ".join(first.wall_forces) or "none"
            raise DembarkError("no wall is given", f"walls in the dump: {known}", "add --wall, such as side:cylinder:radius=25mm")
        check_inclusions(chosen, source)
        check_meshes(chosen, source, first)
        check_outputs(out, vtkhdf, plot=plot)
        return cls(source, numbers, diameter, chosen, length(patch, diameter, "--patch"), out, vtkhdf, plot)

    def run(self, advance: Callable[[], None], provenance: Attributes) -> None:
        """Measure and write; `advance` is called after each frame."""
        recorders = recorders_of(self.walls, self.source, self.numbers, self.patch)
        for grains, contacts in checked_frames(self.walls, self.source, self.numbers):
            for recorder in recorders:
                recorder.add(grains, contacts, self.source.time(grains))
            self.diameters += mean_diameter(grains)
            advance()
        self.results = [recorder.result() for recorder in recorders]
        if self.out:
            self.written.append(write_wall_netcdf(self.out, self.results, provenance, timed=self.source.timed))
        if self.vtkhdf:
            self.written += write_wall_files(self.vtkhdf, self.results, provenance)
        if self.plot:
            from dembark.postproc.plots import save, wall_figures
            self.written += save(self.plot, {name: figure for one in self.results for name, figure in wall_figures(one).items()})

    def summary(self) -> list[str]:
        """What was measured, checked and written, in lines."""
        lines = source_lines(self.source, self.numbers, self.diameter, self.diameters)
        lines += mesh_notes(self.walls, self.source, self.numbers)
        for one in self.results:
            lines += wall_lines(one, self.source)
        return [*lines, *(f"written: {path}" for path in self.written)]


def begin(path: Path, contacts: Path | None, frames: str, how: Reading) -> tuple[Source, list[int], GrainFrame, float]:
    """The source, the chosen frames' numbers, the first of them that has grains, and its mean diameter (m)."""
    source = open_source(path, contacts, how)
    numbers = frame_numbers(frames, len(source.grains))
    first = first_with_grains(source, numbers)
    return source, numbers, first, mean_diameter(first)[0]


def first_with_grains(source: Source, numbers: Sequence[int]) -> GrainFrame:
    """The first of the frames that has grains, which a run that begins to pour has not; DembarkError when there is none."""
    for number in numbers:
        if len((frame := source.grains[number]).radii):
            return frame
    raise DembarkError(f"there are no grains in frames {numbers[0]} to {numbers[-1]}", "those that are chosen",
                       "choose others with --frames")


def choose_walls(texts: Sequence[str], source: Source, frame: GrainFrame, diameter: float) -> list[WallWord]:
    """The walls the user wrote, or else those of the run's case; DembarkError for one that is given twice or is not in the dump."""
    chosen = [parse_wall(text, diameter) for text in texts] or [plain(wall) for wall in source.walls(list(frame.wall_forces))]
    names = [word.wall.name for word in chosen]
    for word in chosen:
        name = word.wall.name
        if names.count(name) > 1:
            raise DembarkError(f"wall {name} is given twice", "in --wall", "give each a name of its own")
        if isinstance(word.wall, Inclusion):
            word.wall.members(frame)
        elif any(word.wall.motion.velocity) and not source.timed:
            raise DembarkError("the wall moves, but the times of the frames are not known", f"for --wall {name}", "give --time-step")
        elif name not in frame.wall_forces:
            known = ", ".join(frame.wall_forces) or "none"
            raise DembarkError(f"the dump has no columns f_force_{name}[1..3]", f"for --wall {name}", f"walls in it: {known}")
    return chosen


def check_inclusions(words: Iterable[WallWord], source: Source) -> None:
    """DembarkError when an inclusion is among the walls and there are no contacts."""
    for word in words:
        if isinstance(word.wall, Inclusion) and source.contacts is None:
            raise DembarkError(f"the load of {word.wall.name} needs contacts", f"{source.path} has none", "name their dump with --contacts")


def check_meshes(words: Iterable[WallWord], source: Source, frame: GrainFrame) -> list[WallWord]:
    """DembarkError when a mesh cannot be what the grains of `frame` feel: its file was in another unit, or it was elsewhere.

    Returns the meshes that no grain feels yet, of which only the size was looked at.
    """
    if not len(frame.radii):
        return list(words)
    time, unfelt = source.time(frame), []
    for word in words:
        if not isinstance(word.wall, MeshWall):
            continue
        wall = word.wall.at(time)
        doubt = _misfit(wall, frame)
        if not doubt:
            unfelt += [word] * (not frame.wall_forces[wall.name].any())
            continue
        # The mesh as it is, and as it would be in other units: factors between any two of them.
        factors = {name: unit / word.unit for name, unit in STL_UNITS.items()}
        fits = [name for name, factor in factors.items() if not _misfit(replace(wall, triangles=wall.triangles * factor), frame)]
        size = " x ".join(f"{1e3 * extent:.4g}" for extent in np.ptp(wall.triangles.reshape(-1, 3), axis=0))
        right = f"with unit={' or unit='.join(fits)} it fits" if fits else "give the unit of the file, and where the simulation had it"
        raise DembarkError(f"the mesh is {size} mm, and {doubt}", f"in --wall {wall.name}", right)
    return unfelt


def checked_frames(words: Iterable[WallWord], source: Source, numbers: Sequence[int]) -> Iterator[tuple[GrainFrame, ContactFrame | None]]:
    """The frames with their contacts; DembarkError at the first in which grains feel a mesh that cannot be what they feel."""
    unfelt = list(words)
    for grains, contacts in source.frames(numbers):
        unfelt = check_meshes(unfelt, source, grains)
        yield grains, contacts


def mesh_notes(words: Iterable[WallWord], source: Source, numbers: Sequence[int]) -> list[str]:
    """A line for each mesh that is much larger than the box of the grains."""
    frame = first_with_grains(source, numbers)
    sizes = {word.wall.name: float(np.ptp(word.wall.triangles.reshape(-1, 3), axis=0).max())
             for word in words if isinstance(word.wall, MeshWall)}
    return [f"note: the mesh {name} is {1e3 * size:.4g} mm wide, the box of the grains {1e3 * _room(frame):.4g} mm; is unit= its file's?"
            for name, size in sizes.items() if size > _LARGE * _room(frame)]


def _room(frame: GrainFrame) -> float:
    """Width (m) of the box of the grains, or of the grains where they have left it."""
    return float(max(np.ptp(frame.wrapped, axis=0).max(), (frame.high - frame.low).max(), 2.0 * frame.radii.max()))


def _misfit(wall: MeshWall, frame: GrainFrame) -> str:
    """Why the mesh cannot be the wall that grains feel, '' when it can."""
    extent, smallest = np.ptp(wall.triangles.reshape(-1, 3), axis=0).max(), 2.0 * frame.radii.min()
    if extent > _ROOMS * _room(frame):
        return f"the box of the grains only {1e3 * _room(frame):.4g} mm wide"
    if extent < smallest:
        return f"the smallest grain {1e3 * smallest:.4g} mm wide"
    felt = np.linalg.norm(frame.wall_forces[wall.name], axis=1) > 0.0
    if not felt.any():
        return ""
    centres = frame.wrapped[felt]
    away = np.linalg.norm(wall.places(centres).points - centres, axis=1) / frame.radii[felt]
    return f"the grains that feel it are {away.min():.3g} to {away.max():.3g} radii away from it" if np.median(away) > _FAR else ""


def check_outputs(*files: Path | None, plot: Path | None) -> None:
    """DembarkError when an output cannot be where it shall be, or two are the same file."""
    given = [path for path in files if path is not None]
    for path in given:
        WholeFile(path)
        if given.count(path) > 1:
            raise DembarkError(f"{path} is named twice", "", "give each output a file of its own")
    if plot is not None and plot.exists() and not plot.is_dir():
        raise DembarkError(f"{plot} is a file", "in --plot", "name a folder")


def recorders_of(words: Sequence[WallWord], source: Source, numbers: Sequence[int], patch: float) -> list[WallRecorder]:
    """A recorder for each wall, with the patches of the first frame."""
    first, found = first_with_grains(source, numbers), []
    for word in words:
        patches = word.patches(first, patch)
        found.append(WallRecorder(word.wall, patches, keep_series=24 * len(patches) * len(numbers) <= _SERIES_LIMIT))
    return found


def write_wall_files(path: Path, results: Sequence[WallStress], provenance: Attributes) -> list[Path]:
    """VTKHDF files of the walls: `path` itself for one, else with `_<name>` behind its stem."""
    several = len(results) > 1
    return [write_vtkhdf_wall(path.with_name(f"{path.stem}_{one.wall.name}{path.suffix}") if several else path, one, provenance)
            for one in results]


def mean_diameter(frame: GrainFrame) -> list[float]:
    """The mean diameter (m) of the grains of a frame, [] of none."""
    return [2.0 * float(frame.radii.mean())] if len(frame.radii) else []


def source_lines(source: Source, numbers: Sequence[int], diameter: float, diameters: Sequence[float]) -> list[str]:
    """What was read; `diameters` (m) are those of the frames, `diameter` is what d means."""
    first, last = (int(source.grains.steps[number]) for number in (numbers[0], numbers[-1]))
    begin, end = (source.time(source.grains[number]) for number in (numbers[0], numbers[-1]))
    when = f"{begin:.6g} to {end:.6g} s" if source.timed else "times are steps: give --time-step"
    count = f"frame {numbers[0]}" if len(numbers) == 1 else f"{len(numbers)} frames, {numbers[0]} to {numbers[-1]}"
    low, high = 1e3 * min(diameters, default=diameter), 1e3 * max(diameters, default=diameter)
    changes = f"the mean diameter of the frames is {low:.4g} to {high:.4g} mm; d is that of the first with grains"
    return [*(f"note: {one}" for one in (*source.notes, *([changes] if high > 1.01 * low else []))),
            f"{count} of {len(source.grains)}; steps {first} to {last}, {when}; mean diameter d = {1e3 * diameter:.4g} mm"]


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
        lines.append(f"  peaks of the normal force: {len(one.peak_forces)}, mean {one.peak_forces.mean():.4g} N, largest {top:.4g} N"
                     f" ({top / max(one.normal_force.mean(), 1e-300):.3g} times its mean)")
    if one.peak_stress.number:
        lines.append(f"  peaks of a patch's normal stress: {one.peak_stress.number}, mean {_pressure(one.peak_stress.mean)}, 99 % below "
                     f"{_pressure(one.peak_stress.quantile(0.99))}, largest {_pressure(one.peak_stress.largest)}")
    if one.contact_force.number:
        lines.append(f"  contacts: {one.contact_force.number / len(one.steps):.4g} a frame, mean normal force {one.contact_force.mean:.4g} "
                     f"N, largest {one.contact_force.largest:.4g} N")
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
