"""Grains of a run: one schema for the dumps of every engine, as a stream of frames (MDAnalysis's view of them: trajectory.py)."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Generic, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from .dumps.frames import NO_FLAGS, Array, DensityError, DumpError, RawFrame, cell, check_periods, folded, integers, numbered, take
from .dumps.opening import Trajectory, open_dump
from .dumps.typed import TypedDump
from .dumps.units import KEPT_UNITS, in_si
from .spheres import volume

Column = TypeVar("Column")

_VECTORS = ("vx", "vy", "vz"), ("omegax", "omegay", "omegaz"), ("fx", "fy", "fz")
_WRAPPED, _UNWRAPPED, _IMAGES = ("x", "y", "z"), ("xu", "yu", "zu"), ("ix", "iy", "iz")
_SCALED, _SCALED_UNWRAPPED = ("xs", "ys", "zs"), ("xsu", "ysu", "zsu")
_WALL = re.compile(r"f_force_(\w+)\[([123])\]")
# Columns of a frame without grains whose file names none.
_EVERY = ("id", "type", *_WRAPPED, *(name for names in _VECTORS for name in names), "radius", "mass")
_SHAPE = ("shape", "blockiness", "c_shape")  # columns of superquadrics and ellipsoids


class AbsentColumnError(DumpError, AttributeError):
    """The dump does not hold a quantity that is needed."""


class _Held(Generic[Column]):
    """A field of GrainFrame that may be None, which asking for it refuses (AbsentColumnError): the dump has no columns of these names."""

    def __init__(self, columns: str) -> None:
        self._columns = columns

    def __set_name__(self, owner: type[GrainFrame], name: str) -> None:
        self._name = name

    def __get__(self, frame: GrainFrame | None, owner: type[GrainFrame]) -> Column:
        if frame is None:
            # The field has no default.
            raise AttributeError(self._name)
        found = frame.__dict__[self._name]
        if found is None:
            where = frame.where or f"step {frame.step}"
            raise AbsentColumnError(f"{where}: {self._name} are not known, the dump has no {self._columns}")
        return cast("Column", found)

    def __set__(self, frame: GrainFrame, value: Column | None) -> None:
        frame.__dict__[self._name] = value


@dataclass(frozen=True, repr=False, kw_only=True)
class GrainFrame:
    """All n grains at one step, sorted by id; SI units.

    `time` (s) is what the dump says by `ITEM: TIME`, or None. `positions` (m) go on through periodic faces where `unwrapped` says so: the
    dump has image flags or such positions; `wrapped` are those inside the box; `velocities` (m/s), `omegas` (rad/s), `forces` (N, all
    contacts and gravity)
    are (n, 3); `radii` (m), `masses` (kg), `ids`, `types` are (n,);
    `wall_forces[name]` (n, 3) is the force of that wall on each grain (N). `low`, `high` (m) and `periodic` describe the box, which
    `tilt` = (xy, xz, yz) (m) shears: its edges are (Lx, 0, 0), (xy, Ly, 0), (xz, yz, Lz). `extra` holds every other column (n,) by
    its name in the dump. What the dump does not hold of velocities, omegas, forces and types is given as None, and asking for it
    raises DumpError. `where` names file and step in messages.
    """

    step: int
    low: Array
    high: Array
    periodic: NDArray[np.bool_]
    ids: NDArray[np.int64]
    positions: Array
    wrapped: Array
    radii: Array
    masses: Array
    wall_forces: Mapping[str, Array]
    types: _Held[NDArray[np.int64]] = _Held("type")
    velocities: _Held[Array] = _Held("vx vy vz")
    omegas: _Held[Array] = _Held("omegax omegay omegaz")
    forces: _Held[Array] = _Held("fx fy fz")
    tilt: Array = field(default_factory=lambda: np.zeros(3))
    extra: Mapping[str, Array] = field(default_factory=dict)
    where: str = ""
    time: float | None = None
    unwrapped: bool = False

    def __repr__(self) -> str:
        return f"GrainFrame(step={self.step}, {len(self.ids)} grains)"

    def time_by(self, time_step: float) -> float:
        """The time (s) of the frame, by its step and `time_step` (s) where the dump has none."""
        return self.step * time_step if self.time is None else self.time

    def has(self, name: str) -> bool:
        """Whether the dump held `name`: velocities, omegas, forces or types."""
        return self.__dict__[name] is not None

    def select(self, mask: NDArray[np.bool_]) -> GrainFrame:
        """The same frame with only the grains where `mask` (n,) is true."""
        names = ("ids", "positions", "wrapped", "radii", "masses", "types", "velocities", "omegas", "forces")
        arrays: dict[str, Any] = {name: self.__dict__[name][mask] if self.has(name) else None for name in names}
        return replace(self, **arrays, wall_forces={name: force[mask] for name, force in self.wall_forces.items()},
                       extra={name: values[mask] for name, values in self.extra.items()})


class _Table:
    """Columns of a raw frame by name, rows in the order of the ids; it remembers which were taken."""

    def __init__(self, raw: RawFrame, where: str) -> None:
        self.raw, self.where = raw, where
        self.index = {name: number for number, name in enumerate(raw.columns)}
        self._order: NDArray[np.intp] | None = None
        self.taken: set[str] = set()
        self.ids = self.integers("id")
        if len(self.ids) > 1 and not (self.ids[1:] > self.ids[:-1]).all():
            self._order = np.argsort(self.ids, kind="stable")
            self.ids = self.ids[self._order]
            twice = np.flatnonzero(self.ids[1:] == self.ids[:-1])
            if len(twice):
                raise DumpError(f"{where}: grain {self.ids[twice[0]]} appears twice")

    def has(self, names: Sequence[str]) -> bool:
        return self.index.keys() >= set(names)

    def __call__(self, *names: str) -> Array:
        """A copy of columns: (n,) of one, (n, k) of several."""
        columns = numbered(self.raw.columns, names, self.where)
        self.taken.update(names)
        values = take(self.raw.values, columns)
        return values if self._order is None else values[self._order]

    def integers(self, name: str) -> NDArray[np.int64]:
        return integers(self(name), f"{self.where}: column {name}")


Say = Callable[[str], object]


def _positions(table: _Table, say: Say) -> tuple[Array, Array, bool]:
    """Unwrapped positions, those inside the box, and whether the dump has what unwraps them."""
    raw = table.raw
    edges = cell(raw.low, raw.high, raw.tilt)
    wrapped: Array | None = None
    unwrapped: Array | None = None
    if table.has(_WRAPPED):
        wrapped = table(*_WRAPPED)
    elif table.has(_SCALED):
        wrapped = raw.low + table(*_SCALED) @ edges
    if table.has(_UNWRAPPED):
        unwrapped = table(*_UNWRAPPED)
    elif table.has(_SCALED_UNWRAPPED):
        unwrapped = raw.low + table(*_SCALED_UNWRAPPED) @ edges
    known = unwrapped is not None or table.has(_IMAGES)
    if wrapped is None:
        if unwrapped is None:
            raise DumpError(f"{table.where}: column x, y, z is missing, and so are xu, xs and xsu; there are {' '.join(raw.columns)}")
        wrapped = folded(unwrapped, raw.low, raw.high, raw.tilt, raw.periodic)
    elif unwrapped is None:
        unwrapped = wrapped + _images(table, say) @ edges if table.has(_IMAGES) else wrapped.copy()
    table.taken.update(_IMAGES)
    return unwrapped, wrapped, known


def _images(table: _Table, say: Say) -> Array:
    """How many periods each grain has gone along each axis. Where the file does not say which axes are periodic, those with such numbers
    are taken as periodic."""
    images, raw = table(*_IMAGES), table.raw
    unused = [axis for axis in range(3) if raw.flagged and not raw.periodic[axis] and images[:, axis].any()]
    if unused:
        say(f"image flags along {', '.join('xyz'[axis] for axis in unused)}, not periodic, are not used")
        images[:, unused] = 0.0
    return images


def _masses(table: _Table, radii: Array, density: float | None, say: Say) -> Array:
    held = [name for name in ("mass", "density") if table.has([name])]
    if held and density is not None:
        say(f"the given density is not used, for the dump has a column {held[0]}")
    if held:
        return table("mass") if held[0] == "mass" else table("density") * volume(radii)
    if density is None:
        raise DensityError(f"{table.where}: column mass is missing; give density= (kg/m^3), or dump mass")
    if table.has(["type"]) and len(kinds := np.unique(table("type"))) > 1:
        say(f"all grains have the given density, though there are {len(kinds)} types")
    return density * volume(radii)


def grain_frame(raw: RawFrame, where: str, density: float | None = None, say: Say = str) -> GrainFrame:
    """The grains of a raw frame; `density` (kg/m^3) makes the masses of solid spheres where there are none. `where` begins the messages of
    DumpError; `say` takes lines about what is odd."""
    check_periods(raw, where)
    units = raw.units
    if not raw.flagged:
        say(NO_FLAGS)
    raw, kept = in_si(raw, where)
    if kept:
        say(KEPT_UNITS.format(", ".join(kept), units))
    if twice := sorted({name for name in raw.columns if raw.columns.count(name) > 1}):
        say(f"columns {', '.join(twice)} appear more than once; the first of each is used")
    if any(name.startswith(_SHAPE) for name in raw.columns):
        say("grains are taken as spheres of their radius, though the dump has columns of a shape")
    if not raw.columns and not len(raw.values):
        raw = replace(raw, columns=_EVERY, values=np.empty((0, len(_EVERY))))
    table = _Table(raw, where)
    if not table.has(["radius"]) and table.has(["diameter"]):
        radii = 0.5 * table("diameter")
    else:
        radii = table("radius")
    walls = dict.fromkeys(match.group(1) for name in raw.columns if (match := _WALL.fullmatch(name)) and table.has(_wall(match.group(1))))
    positions, wrapped, unwrapped = _positions(table, say)
    masses, wall_forces = _masses(table, radii, density, say), {wall: table(*_wall(wall)) for wall in walls}
    for name, values in (("radius", radii), ("mass", masses)):
        if values.min(initial=0.0) < 0.0:
            raise DumpError(f"{where}: grain {table.ids[values.argmin()]} has a {name} of {values.min():.9g}, which cannot be negative")
    types = table.integers("type") if table.has(["type"]) else None
    velocities, omegas, forces = (table(*names) if table.has(names) else None for names in _VECTORS)
    # Last: what none of the others has taken.
    extra = {name: table(name) for name in raw.columns if name not in table.taken}
    return GrainFrame(step=raw.step, low=raw.low, high=raw.high, periodic=raw.periodic, tilt=raw.tilt, ids=table.ids, types=types,
                      positions=positions, wrapped=wrapped, velocities=velocities, omegas=omegas, forces=forces, radii=radii, masses=masses,
                      wall_forces=wall_forces, extra=extra, where=where, time=raw.time, unwrapped=unwrapped)


def _wall(name: str) -> tuple[str, ...]:
    return tuple(f"f_force_{name}[{axis}]" for axis in (1, 2, 3))


class GrainsDump(TypedDump[GrainFrame]):
    """Grains as a sequence of GrainFrame, read one at a time: any file that open_dump reads."""

    def __init__(self, path: Trajectory, *, skip_truncated: bool = False, stream: bool = False, columns: Sequence[str] | None = None,
                 density: float | None = None, units: str = "") -> None:
        """Open; DumpError for a missing, foreign or truncated file (see open_dump).

        `density` (kg/m^3) is that of solid grains where the dump has no masses, `columns` are those of a binary dump, `units` is the unit
        style of a dump that does not name it.
        """
        super().__init__(open_dump(path, skip_truncated, stream=stream, columns=columns, units=units))
        self._density = density

    def raw(self, number: int, columns: Sequence[str]) -> RawFrame:
        """Only some columns of a frame, as they stand in the file."""
        return self._dump.frame(number, columns)

    def _frame(self, raw: RawFrame) -> GrainFrame:
        return grain_frame(raw, f"{self.path}, step {raw.step}", self._density, partial(self._say, raw.step))
