"""Frames of a run as pictures: grains or the surface of water, walls and bodies, in one view and on one colour scale."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dembark.common.choices import nearest
from dembark.common.errors import DembarkError
from dembark.common.units import to_si

from ..contacts import ContactFrame
from ..dumps import DumpError
from ..fields.coarse_graining import WallContacts
from ..grains import GrainFrame
from ..history import read_times
from ..render import Colours, Renderer, Scene, Sheet, Surface, View
from ..sources import Source
from ..style import SEQUENTIAL
from ..walls import CylinderWall, MeshWall, PlaneWall, Wall, wall_contacts
from ..walls.mesh import read_stl
from . import water
from .quantities import OF_CONTACTS, Quantity, quantity, usual

Array = NDArray[np.float64]

_WALL = 0.14  # opacity
_WATER, _BODY = "#2b7bba", "#e6c67d"
_WATER_OPACITY = 0.55
_FACETS = 96  # of a cylinder
_GLUED = 2  # type of glued grains in the dumps of cases
_NEIGHBOURS = 8  # particles whose mean colours a point of the surface
_MOST_KINDS = 12
_STRAY = 0.001  # part of the grains, at each end of each axis, that may be out of the picture
_SPACE = View(np.eye(3))
_PRINTED = 0.028  # height of letters in the report, whose pictures are small
_PREFIXES = ((1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))


@dataclass(frozen=True)
class Look:
    """How a run is drawn: `colour_by` a quantity ("": the usual one), in `unit` or over `scale` (SI), from one end of `span` (in that unit)
    to the other, on the map `colours` of matplotlib; in a `view` of render.VIEWS or "x,y,z" ("": one that suits the run); `cut`: without
    the half that is nearer to the eye; `surface`: particles of a fluid are drawn by its surface; `size` in pixels; height of `letters` over
    that of a picture of 4 by 3."""

    colour_by: str = ""
    unit: str = ""
    span: tuple[float, float] | None = None
    scale: float = 0.0
    colours: str = SEQUENTIAL
    view: str = ""
    cut: bool = False
    surface: bool = False
    walls: bool = True
    size: tuple[int, int] | None = None
    letters: float = 0.02

    def __post_init__(self) -> None:
        """DembarkError for a map that does not exist."""
        import matplotlib as mpl

        if self.colours not in mpl.colormaps:
            raise DembarkError(f"unknown colours {self.colours!r}", "in --colours", nearest(self.colours, mpl.colormaps))


@dataclass
class Album:
    """Pictures of the frames `numbers` of a `source`, all of the same view and scale. Frames are read once for these, and once to draw.

    `walls` are drawn with those of the run.
    """

    source: Source
    numbers: Sequence[int]
    look: Look
    walls: Sequence[Wall] = ()
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """DembarkError where a frame has no such quantity, or none has a grain."""
        first = next((frame for frame in map(self.source.grains.__getitem__, self.numbers) if len(frame.ids)), None)
        if first is None:
            raise DembarkError(f"there are no grains in frames {self.numbers[0]} to {self.numbers[-1]}", "", "choose others with --frames")
        self.view = View.named(self.look.view or _suitable(first))
        self.name = self.look.colour_by or ("" if self.look.surface else usual(first))
        self.folder = self.source.grains.path.parent if self.source.path.is_dir() else None
        record = self.source.record.get("walls", {})
        own, notes = self.source.walls([name for name, wall in record.items() if wall["kind"] != "box"])
        self.notes += notes
        steps = self.source.grains.steps[list(self.numbers)]
        # All walls press on grains, drawn or not; those of the user replace the run's own of the same name.
        given = {wall.name for wall in self.walls}
        self.known: list[Wall] = [*(wall for wall in own if wall.name not in given), *self.walls]
        self.meshes = self._meshes(steps) if self.folder and (self.look.walls or self.name == "pressure") else {}
        meshes = list(self.meshes.values()) if self.look.walls else []
        bodies = water.boxes(self.folder, record, steps) if self.folder else {}
        self.moving = [Surface(np.zeros((0, 3, 3)), opacity=_WALL, edges=True)] * len(meshes) + [
            Surface(np.zeros((0, 3, 3)), _BODY, edges=True)] * len(bodies)
        self.places = [*meshes, *bodies.values()]
        self.unplaced: list[str] = []
        self.sheet = self._sheet()
        if self.unplaced:
            self.notes.append(f"the position of the wall {', '.join(self.unplaced)} is unknown; its part of the pressure is missing, "
                              "add --wall")

    def __iter__(self) -> Iterator[tuple[float, NDArray[np.uint8]]]:
        """Time (s; NaN: unknown) and picture (height, width, 3) of each frame."""
        with Renderer(self.sheet.camera) as renderer:
            for row, number in enumerate(self.numbers):
                scene = self.scene(row, *self._read(number))
                yield scene.time, self.sheet.compose(renderer.draw(scene), scene.time)

    def _read(self, number: int) -> tuple[GrainFrame, ContactFrame | None]:
        if self.name in OF_CONTACTS:
            return next(iter(self.source.frames([number])))
        return self.source.grains[number], None

    def _meshes(self, steps: NDArray[np.int64]) -> dict[str, Array]:
        """Triangles (steps, t, 3, 3) in m of the meshes of the run by name, at each step: at rest, or moved by the columns motion_x, ... of
        its history. Meshes that do no work while another does are at rest. Meshes that turn are left out, for the history does not say
        about which axis."""
        assert self.folder
        files = sorted(self.folder.glob("*.stl"))
        if not files:
            return {}
        try:
            rows = read_times(self.folder / "time.csv") if (self.folder / "time.csv").is_file() else {}
        except DumpError as error:
            self.notes.append(f"walls are drawn at rest: {error}")
            rows = {}
        if np.abs(rows.get("motion_angle", np.zeros(1))).max() > 0.0:
            self.notes.append(f"the walls {', '.join(file.stem for file in files)} turn; they are not drawn")
            return {}
        way = np.column_stack([np.interp(steps, rows["step"], rows[f"motion_{axis}"]) if "motion_x" in rows else np.zeros(len(steps))
                               for axis in "xyz"])
        working = {name.removesuffix("_work") for name, column in rows.items() if name.endswith("_work") and column.any()}
        resting = {file for file in files if working and f"{file.stem}_work" in rows and file.stem not in working}
        return {file.stem: np.asarray(read_stl(file).triangles)[None] + (0.0 if file in resting else 1.0) * way[:, None, None, :]
                for file in files}

    def _sheet(self) -> Sheet:
        """Everything that is in any frame, and the colour scale of all of them."""
        corners = _SPACE.extent(np.zeros((0, 3)))
        flat, sample, ends = self.view.extent(np.zeros((0, 3))), None, []
        kinds: set[int] = set()
        self.middle = np.inf
        for row, number in enumerate(self.numbers):
            frame, contacts = self._read(number)
            frame = frame.select(self._shown(frame))
            near = _together(frame.wrapped)
            places, reach = frame.wrapped[near], frame.radii[near]
            corners = _joined(corners, _SPACE.extent(places, reach))
            flat = _joined(flat, self.view.extent(places, reach))
            if self.name:
                sample = self._quantity(frame, contacts, row)
                values = sample.values[np.isfinite(sample.values)]
                ends += [np.percentile(values, [2.0, 98.0])] if len(values) else []
                kinds |= set(np.unique(values).astype(int).tolist()) if sample.kinds else set()
        for place in self.places:
            corners = _joined(corners, _SPACE.extent(place))
            flat = _joined(flat, self.view.extent(place))
        # Walls reach to where others are.
        for number in self.numbers:
            for wall in self._standing(self._time(self.source.grains.steps[number], number)) if self.look.walls else ():
                if isinstance(wall, PlaneWall) and np.isfinite(corners).all():
                    foot = wall.places(corners.mean(axis=0)[None]).points
                    corners = _joined(corners, np.concatenate([foot, foot]))
        self.corners, self.middle = corners, float(flat[:, 2].mean()) if self.look.cut else np.inf
        for number in self.numbers:
            for surface in self._walls(self._time(self.source.grains.steps[number], number)):
                flat = _joined(flat, self.view.extent(surface.triangles))
        return Sheet(self.view, flat, self._colours(sample, ends, kinds) if sample else None, self.look.size, self.look.letters)

    def _time(self, step: int, number: int) -> float:
        """Time (s) of a frame by its number, NaN where it is unknown."""
        said = float(self.source.grains.times[number])
        return said if np.isfinite(said) else float(step) * self.source.time_step

    def _colours(self, first: Quantity, ends: Sequence[Array], kinds: Collection[int]) -> Colours:
        """The scale of values like the `first`: from the lowest to the highest of the `ends` (2,) of all frames, or as the look says."""
        look = self.look
        if 0 < len(kinds) <= _MOST_KINDS and not look.span:
            self.factor = 1.0
            return Colours(first.label, kinds=tuple(sorted(kinds)))
        low, high = (float(pick([one[side] for one in ends], default=float(side))) for side, pick in enumerate((min, max)))
        if look.scale:
            self.factor, unit = look.scale, f"{look.scale:.3g} {first.unit}"
        elif look.unit:
            if not first.unit:
                raise DembarkError(f"the unit of {self.name} is not known", "in --unit", "leave --unit out")
            self.factor, unit = to_si(f"1 {look.unit}", first.unit, "--unit"), look.unit
        else:
            self.factor, unit = _usual_unit(first.unit, max(abs(low), abs(high)) if not look.span else 1.0)
        low, high = look.span or (low / self.factor, high / self.factor)
        label = first.label if unit in ("", "1") else f"{first.label} / {f'({unit})' if set(unit) & set('/*^ ') else unit}"
        return Colours(label, low, high if high > low else low + 1.0, name=look.colours)

    def _quantity(self, frame: GrainFrame, contacts: ContactFrame | None, row: int) -> Quantity:
        """What the grains of the frame that is `row` among the chosen ones are coloured by; NaN of glued ones."""
        found = quantity(self.name, frame, contacts, self._pressing(frame, row) if self.name == "pressure" else [])
        if found.kinds or not self._cased(frame):
            return found
        return replace(found, values=np.where(frame.types == _GLUED, np.nan, found.values))

    def _pressing(self, frame: GrainFrame, row: int) -> list[WallContacts]:
        """What walls do to grains; those that push but whose place is not known become `unplaced`."""
        standing = {wall.name: wall for wall in self._standing(self._time(frame.step, self.numbers[row]))}
        # A mesh without forces of its own may be a part of a wall that is called like another one.
        if self.meshes.keys() <= frame.wall_forces.keys():
            standing = {name: MeshWall(name, places[row]) for name, places in self.meshes.items()} | standing
        self.unplaced += [name for name, forces in frame.wall_forces.items() if name not in {*standing, *self.unplaced} and forces.any()]
        return [wall_contacts(frame, wall) for name, wall in standing.items() if name in frame.wall_forces]

    def _cased(self, frame: GrainFrame) -> bool:
        """Whether types are those of cases."""
        return "case" in self.source.record and frame.has("types")

    def _shown(self, frame: GrainFrame) -> NDArray[np.bool_]:
        """Which grains (n,) are in the picture; glued ones of a rough wall may reach far beyond the packing."""
        shown = np.ones(len(frame.ids), bool)
        if self._cased(frame) and (frame.types == _GLUED).any() and (frame.types != _GLUED).any():
            free, reach = frame.wrapped[frame.types != _GLUED], 3.0 * frame.radii.max()
            shown = np.all((frame.wrapped >= free.min(axis=0) - reach) & (frame.wrapped <= free.max(axis=0) + reach), axis=1)
        return shown

    def scene(self, row: int, frame: GrainFrame, contacts: ContactFrame | None) -> Scene:
        """The frame that is `row` among the chosen ones."""
        shown = self._shown(frame) & (frame.wrapped @ self.view.axes[2] <= self.middle)
        scale = self.sheet.colours
        time = self._time(frame.step, self.numbers[row])
        values = self._quantity(frame, contacts, row).values / self.factor if scale else None
        surfaces = [*(replace(look, triangles=place[row]) for look, place in zip(self.moving, self.places, strict=True)),
                    *self._walls(time)]
        plain = np.tile(np.asarray(_rgb(_WATER), np.uint8), (len(frame.ids), 1))
        if self.look.surface:
            triangles, drops = water.surface(frame)
            shown &= drops
            of_corners = None
            if scale and values is not None and len(triangles):
                _, near = cKDTree(frame.wrapped).query(triangles.reshape(-1, 3), min(_NEIGHBOURS, len(values)))
                of_corners = scale.rgb(values[near].reshape(len(near), -1).mean(axis=1)).reshape(-1, 3, 3)
            surfaces.append(Surface(triangles, _WATER, _WATER_OPACITY if of_corners is None else 1.0, of_corners, smooth=True))
        colours = plain if scale is None or values is None else scale.rgb(values)
        return Scene(frame.wrapped[shown], frame.radii[shown], colours[shown], tuple(one for one in surfaces if len(one.triangles)), time)

    def _standing(self, time: float) -> list[Wall]:
        """Planes, cylinders and meshes that are no files of the run, where they are at `time` (s)."""
        return [wall if np.isnan(time) else wall.at(time) for wall in self.known]

    def _walls(self, time: float) -> list[Surface]:
        """Planes, cylinders and meshes at `time` (s), as far as what is shown reaches."""
        if not self.look.walls:
            return []
        ends = np.array([[self.corners[a, 0], self.corners[b, 1], self.corners[c, 2]] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
        found = []
        for here in self._standing(time):
            if isinstance(here, MeshWall):
                found.append(here.triangles)
                continue
            along = here.places(ends).coordinates
            if isinstance(here, CylinderWall):
                first, second = np.linspace(0.0, 2.0 * np.pi, _FACETS + 1), np.array([along[:, 1].min(), along[:, 1].max()])
            else:
                assert isinstance(here, PlaneWall)
                first, second = (np.array([one.min(), one.max()]) for one in along.T)
            grid = here.points(*np.meshgrid(first, second, indexing="ij"))
            if isinstance(here, CylinderWall):
                grid[-1] = grid[0]
            squares = np.stack([grid[:-1, 0], grid[1:, 0], grid[1:, 1], grid[:-1, 1]], axis=1)
            found.append(np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]]))
        return [Surface(triangles, opacity=_WALL, edges=True) for triangles in found]


def _together(places: Array) -> NDArray[np.bool_]:
    """Which of `places` (n, 3) are near nearly all others: few that have flown away would make all else small."""
    if not len(places):
        return np.zeros(0, bool)
    low, high = np.quantile(places, [_STRAY, 1.0 - _STRAY], axis=0)
    reach = 0.1 * (high - low).max()
    return np.asarray(((places >= low - reach) & (places <= high + reach)).all(axis=1))


def _joined(one: Array, other: Array) -> Array:
    return np.array([np.minimum(one[0], other[0]), np.maximum(one[1], other[1])])


def _suitable(frame: GrainFrame) -> str:
    """A layer is seen from its face, all else from a corner."""
    span = np.ptp(frame.wrapped, axis=0)
    for axis, name in ((1, "front"), (2, "top"), (0, "side")):
        if span[axis] <= 0.01 * frame.radii.max() < 0.02 * np.delete(span, axis).max():
            return name
    return "iso"


def _usual_unit(unit: str, size: float) -> tuple[float, str]:
    """The unit with a prefix in which `size` (SI) is a number from 1 to 1000, and its value in SI."""
    if unit not in ("m", "m/s", "N", "Pa") or not size > 0.0:
        return 1.0, unit
    factor, prefix = next((one for one in reversed(_PREFIXES) if size >= one[0] * (1.0 - 1e-9)), _PREFIXES[0])
    return factor, prefix + unit


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(colour.removeprefix("#")))


def picture(folder: Path, wanted: Mapping[str, Any]) -> NDArray[np.uint8]:
    """The last frame of the run in `folder` (height, width, 3), as [picture] of its case says."""
    from ..sources import open_source

    source = open_source(folder)
    return next(iter(Album(source, [len(source.grains) - 1], Look(**wanted, letters=_PRINTED))))[1]
