"""What users write on the command line: lengths in mean diameters or with units, frames, grids, columns and walls."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from dembark.common.choices import pick
from dembark.common.errors import DembarkError
from dembark.common.units import NUMBER, finite, to_si

from .grains import GrainFrame
from .walls import CylinderWall, Inclusion, MeshWall, Motion, PlaneWall, Wall
from .walls.patches import Patches, borders, box_patches, count_of, cylinder_patches, inclusion_patches, mesh_patches, plane_patches

_DIAMETERS = re.compile(rf"\s*({NUMBER})\s*d\s*")
_KINDS: Mapping[str, tuple[str, ...]] = {
    "plane": ("origin", "normal", "velocity", "since", "u", "v", "patch"),
    "cylinder": ("radius", "axis", "origin", "outside", "velocity", "since", "height", "around", "patch"),
    "mesh": ("file", "unit", "velocity", "since", "by"),
    "inclusion": ("ids", "surface", "radius", "axis", "around", "along", "patch"),
}
_MOST_IDS = 10_000_000  # of an inclusion
_MOST_PIXELS = 8000  # along a side of a picture
_ORIGIN, _UPWARD = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
# Units of length that STL files come in, in m.
STL_UNITS = {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}


def length(text: str, diameter: float, what: str) -> float:
    """A positive length (m): `1.5d` is in mean diameters, `7 mm` has a unit, a plain number is in m."""
    value = _place(text, diameter, what)
    if not value > 0.0:
        raise DembarkError(f"{text!r} is not a length", f"in {what}", "give a positive one, such as 1.5d (mean diameters) or '7 mm'")
    return value


def positive(unit: str, option: str) -> Callable[[str], float]:
    """A reader of positive numbers of an `option`, with or without a unit of their own, in `unit` (SI)."""
    def read(text: str) -> float:
        value = to_si(text, unit, option)
        if value <= 0.0:
            raise DembarkError(f"{text!r} is not positive", f"in {option}")
        return value

    return read


def value_or_name(text: str, unit: str, option: str) -> float | str:
    """A positive number in `unit` (SI), or the name of a parameter, which begins with a letter."""
    return text if text.isidentifier() else positive(unit, option)(text)


def removal_force(force: float | None, bond: str | None, area: float | None, friction: float | None) -> float:
    """The peak force (N) that removes bark: given, or that of a `bond`, `species:condition` or a strength, on an `area` (m2)."""
    from .debarking.laws import bark_force
    from .debarking.laws import bond as known_bond

    if (force is None) == (bond is None):
        raise DembarkError("the force that removes bark is not given" if force is None else "--bark-force and --bond are given", "",
                           "give --bark-force, or --bond with --area and --friction; there is no default")
    if force is not None:
        return force
    if area is None or friction is None:
        raise DembarkError(f"{'--area' if area is None else '--friction'} is missing", "with --bond",
                           "the force is strength times area over friction")
    assert bond is not None
    species, colon, condition = bond.partition(":")
    named = colon or not bond[:1].isdigit()
    strength = known_bond(species.strip(), condition.strip()).strength if named else positive("Pa", "--bond")(bond)
    return bark_force(strength, area, friction)


def _place(text: str, diameter: float, what: str) -> float:
    match = _DIAMETERS.fullmatch(text)
    return finite(float(match.group(1)), what, text) * diameter if match else to_si(text, "m", what)


def counts(text: str) -> tuple[int, int, int]:
    """Cells along x, y and z: `64,64,64`, or one number for all three."""
    parts = text.split(",")
    if not all(re.fullmatch(r"\s*\d+\s*", part) for part in parts) or len(parts) not in (1, 3) or not all(int(part) for part in parts):
        raise DembarkError(f"{text!r} is not a grid", "in --grid", "give the numbers of cells, such as 64,64,64")
    cells = [int(part) for part in parts] * (3 // len(parts))
    return cells[0], cells[1], cells[2]


def span(text: str, diameter: float, what: str) -> tuple[float, float]:
    """Two rising places (m), `0,50mm`."""
    ends = [_place(part, diameter, what) for part in text.split(",")]
    if len(ends) != 2 or not ends[0] < ends[1]:
        raise DembarkError(f"{text!r} is not a range", f"in {what}", "give two rising numbers, such as 0,50mm")
    return ends[0], ends[1]


def picture_size(text: str) -> tuple[int, int]:
    """Width and height in pixels: `1200x900`."""
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    size = (int(match.group(1)), int(match.group(2))) if match else (0, 0)
    if not 100 <= min(size) <= max(size) <= _MOST_PIXELS:
        raise DembarkError(f"{text!r} is not the size of a picture", "in --size",
                           f"give width and height, 1200x900, each from 100 to {_MOST_PIXELS}")
    return size


def value_range(text: str) -> tuple[float, float]:
    """Two rising numbers, `0,0.5`."""
    try:
        ends = [finite(float(part), "--range", part) for part in text.split(",")]
    except ValueError:
        ends = []
    if len(ends) != 2 or not ends[0] < ends[1]:
        raise DembarkError(f"{text!r} is not a range", "in --range", "give two rising numbers in the unit of the scale, such as 0,0.5")
    return ends[0], ends[1]


def frame_numbers(text: str, count: int) -> list[int]:
    """Numbers of frames, from 0, as in Python: `10:50`, `::5`, `-10:`, `3`; DembarkError when there is none."""
    parts = text.split(":")
    try:
        words = [int(part) if part.strip() else None for part in parts]
    except ValueError:
        words = []
    if not 1 <= len(words) <= 3 or words == [None] or (len(words) == 3 and words[2] == 0):
        raise DembarkError(f"{text!r} names no frames", "in --frames", "give first:end or first:end:step, counted from 0")
    one = words[0]
    if len(words) == 1 and one is not None:
        found = [one % count] if -count <= one < count else []
    else:
        found = sorted(range(count)[slice(*words)])
    if not found:
        raise DembarkError(f"no frame in {text!r}", "in --frames", f"the dump has {count} frames, 0 to {count - 1}")
    return found


def grain_numbers(text: str, where: str) -> tuple[int, ...]:
    """Numbers of grains, `1,5-9`."""
    found: list[int] = []
    for part in text.split(","):
        match = re.fullmatch(r"(\d+)(?:-(\d+))?", part.strip())
        first, last = (int(match.group(1)), int(match.group(2) or match.group(1))) if match else (0, -1)
        if last < first:
            raise DembarkError(f"{part!r} names no grains", where, "give numbers and ranges, such as 1,5-9")
        if len(found) + last - first >= _MOST_IDS:
            raise DembarkError(f"{part!r} names too many grains", where, f"there are at most {_MOST_IDS}")
        found += range(first, last + 1)
    return tuple(found)


def lags(text: str) -> tuple[float, float]:
    """Two rising times (s), `20ms,0.1`."""
    ends = [positive("s", "--diffusion")(part) for part in text.split(",")]
    if len(ends) != 2 or not ends[0] < ends[1]:
        raise DembarkError(f"{text!r} is not a range", "in --diffusion", "give two rising times, such as 20ms,0.1")
    return ends[0], ends[1]


def contact_columns(text: str) -> dict[str, list[int | str]]:
    """Columns of a foreign dump of contacts by what they are, `first=1,2,3 ids=7,8`; see ContactsDump."""
    found: dict[str, list[int | str]] = {}
    for part in text.split():
        name, _, words = part.partition("=")
        if not words:
            raise DembarkError(f"{part!r} names no columns", "in --contact-columns",
                               "write first=1,2,3 second=4,5,6 ids=7,8 forces=10,11,12")
        if name in found:
            raise DembarkError(f"{name} is given twice", "in --contact-columns", "give each once")
        found[name] = [int(word) if word.isdecimal() else word for word in words.split(",")]
    return found


@dataclass(frozen=True)
class PatchedWall:
    """A wall, how its patches of about a given size (m) are made for a frame, and the unit (m) that the file of a mesh was read in."""

    wall: Wall | Inclusion
    patches: Callable[[GrainFrame, float], Patches]
    unit: float = 1.0


def patched(wall: Wall) -> PatchedWall:
    """A wall with patches all over the box."""
    return PatchedWall(wall, lambda frame, size: box_patches(wall, frame, size))


def parse_wall(text: str, diameter: float) -> PatchedWall:
    """`name:kind:key=value:...`, kind plane, cylinder, mesh or inclusion; `diameter` (m) is the unit d of lengths."""
    name, *rest = text.split(":")
    where = f"--wall {name}"
    if not re.fullmatch(r"\w+", name) or not rest:
        raise DembarkError(f"{text!r} is not a wall", "in --wall", "write name:kind:key=value, such as side:cylinder:radius=25mm")
    kind, options = rest[0], {}
    pick(kind, _KINDS, "kind of wall", f"in {where}")
    for part in rest[1:]:
        key, sign, value = part.partition("=")
        pick(key, _KINDS[kind], f"key of a {kind}", f"in {where}")
        if not sign and key != "outside":
            raise DembarkError(f"{key!r} has no value", f"in {where}", f"write {key}=value")
        if sign and key == "outside":
            raise DembarkError("'outside' takes no value", f"in {where}", "leave it out for a wall that grains are inside of")
        if key in options:
            raise DembarkError(f"{key!r} is given twice", f"in {where}", "give each key once")
        options[key] = value
    return _WallOptions(name, kind, options, diameter, where).patched()


@dataclass(frozen=True)
class _WallOptions:
    """The keys of one --wall; lengths are in m or in `diameter` (m), `where` begins messages."""

    name: str
    kind: str
    options: Mapping[str, str]
    diameter: float
    where: str

    def patched(self) -> PatchedWall:
        """The wall with its patches; mistakes in their sizes are found before any frame is read."""
        wall = self.wall()
        own = self.length("patch")
        spans = {key: span(self.options[key], self.diameter, self.where) for key in ("u", "v", "height") if key in self.options}
        numbers = {key: self.count(key) for key in ("around", "along") if key in self.options}

        def patches(frame: GrainFrame, size: float) -> Patches:
            if isinstance(wall, MeshWall):
                return mesh_patches(wall, self.options.get("by", "triangle"))
            usual, size = box_patches(wall, frame, own or size), own or size
            if isinstance(wall, Inclusion):
                around, along = (numbers.get(key, count) for key, count in zip(("around", "along"), usual.shape, strict=True))
                return inclusion_patches(wall, wall.size(frame), around, along)
            edges = [borders(*spans[name], count_of(spans[name][1] - spans[name][0], size)) if name in spans else usual.edges[axis]
                     for axis, name in enumerate(usual.names)]
            if isinstance(wall, PlaneWall):
                return plane_patches(wall, *edges)
            return cylinder_patches(wall, numbers.get("around", usual.shape[0]), edges[1])

        return PatchedWall(wall, patches, self.unit() if isinstance(wall, MeshWall) else 1.0)

    def wall(self) -> Wall | Inclusion:
        """The wall itself."""
        if self.kind == "inclusion":
            return Inclusion(self.name, self.ids(), self.options.get("surface", "sphere"), self.length("radius"),
                             self.vector("axis", "1", _UPWARD))
        since = to_si(self.options["since"], "s", f"{self.where}, since") if "since" in self.options else 0.0
        motion = Motion(self.vector("velocity", "m/s", _ORIGIN), since)
        if self.kind == "plane":
            return PlaneWall(self.name, self.vector("origin", "m", _ORIGIN), self.vector("normal", "1", _UPWARD), motion)
        if self.kind == "cylinder":
            radius = length(self.needed("radius"), self.diameter, f"{self.where}, radius")
            return CylinderWall(self.name, radius, self.vector("axis", "1", _UPWARD), self.vector("origin", "m", _ORIGIN),
                                "outside" not in self.options, motion)
        if self.options.get("by", "triangle") not in ("triangle", "group"):
            raise DembarkError(f"there are no patches by {self.options['by']!r}", f"in {self.where}", "they are by triangle or by group")
        return MeshWall.from_stl(self.name, Path(self.needed("file")), scale=self.unit(), motion=motion)

    def needed(self, key: str) -> str:
        """The text of a key that must be there."""
        if not self.options.get(key):
            raise DembarkError(f"{key} is missing", f"in {self.where}", f"add :{key}=...")
        return self.options[key]

    def length(self, key: str) -> float | None:
        """A length (m), None where it is not given."""
        return length(self.options[key], self.diameter, f"{self.where}, {key}") if key in self.options else None

    def vector(self, key: str, unit: str, default: tuple[float, float, float]) -> tuple[float, float, float]:
        """Three numbers in `unit`, or one of the axes with its sign."""
        text = self.options.get(key)
        if text is None:
            return default
        if unit == "1" and text in ("x", "y", "z", "-x", "-y", "-z"):
            values = [float(axis == text[-1]) * (-1.0 if text[0] == "-" else 1.0) for axis in "xyz"]
        else:
            values = [to_si(part, unit, f"{self.where}, {key}") for part in text.split(",")]
        if len(values) != 3:
            raise DembarkError(f"{text!r} is not a vector", f"in {self.where}, {key}", "give three numbers, such as 0,0,1")
        return values[0], values[1], values[2]

    def count(self, key: str) -> int:
        """A number of patches."""
        if not re.fullmatch(r"[1-9]\d*", self.options[key]):
            raise DembarkError(f"{self.options[key]!r} is not a number of patches", f"in {self.where}, {key}", "give an integer from 1 on")
        return int(self.options[key])

    def unit(self) -> float:
        """The unit (m) of the file of a mesh."""
        unit = self.options.get("unit", "m")
        if unit not in (*STL_UNITS, "d"):
            raise DembarkError(f"unit={unit} is unknown", f"in {self.where}", f"it must be {', '.join(STL_UNITS)} or d (mean diameters)")
        return STL_UNITS.get(unit, self.diameter)

    def ids(self) -> tuple[int, ...]:
        """Numbers of grains."""
        return grain_numbers(self.needed("ids"), f"in {self.where}, ids")
