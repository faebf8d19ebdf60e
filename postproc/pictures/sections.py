"""Logs and layers of grains in cross-section: the last frame as a figure, and frames as an animation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from dembark.common.files import read_json

from .. import DumpError, GrainFrame, GrainsDump
from ..dumps import TextDump
from ..dumps.frames import less_edges
from ..history import read_times
from ..render import pixels, write_film
from ..style import GREY, SEQUENTIAL, STYLE
from ..walls.mesh import cut, read_stl
from . import saved

HEIGHT = 3.3  # inches
_DOTS = 100  # an inch of an animation
_CHAIN = "#d55e00"
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Section:
    """Frames of logs or grains in a plane, in m and s: `places` (frames, n, 2), `radii` (n,), `speeds` (frames, n) over `rim_speed`,
    `times` (frames,).

    `links` (m, 2, 2) are contacts of the last frame with `forces` (m,) in N. `drum_radius` 0: there is no drum. The drum turns by
    `drum_speed` (rad/s) about the axis across the plane, clockwise when positive. `walls` (frames, k, 2, 2): lines where meshes cross the
    plane. The longer side of an animation has so many `pixels`.
    """

    places: Array
    radii: Array
    speeds: Array
    times: Array
    drum_radius: float
    drum_speed: float
    label: str
    links: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))
    forces: Array = field(default_factory=lambda: np.zeros(0))
    walls: Array = field(default_factory=lambda: np.zeros((0, 0, 2, 2)))
    pixels: int = 300

    @property
    def view(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top edge of what is shown, m."""
        if self.drum_radius > 0.0:
            half = 1.04 * self.drum_radius
            return -half, half, -half, half
        return self._around(self.places)

    @property
    def last_view(self) -> tuple[float, float, float, float]:
        """The same of the last frame alone: logs that have fallen need no room above them."""
        return self.view if self.drum_radius > 0.0 else self._around(self.places[-1:])

    def _around(self, places: Array) -> tuple[float, float, float, float]:
        low, high = (places - self.radii[:, None]).min(axis=(0, 1)), (places + self.radii[:, None]).max(axis=(0, 1))
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def scene(folder: Path, cross_section: str, drum_radius: float = 0.0, drum_speed: float = 0.0, speed: float = 0.0, frames: int = 0,
          chains: bool = False, last: int = 0, pixels: int = 300) -> Section:
    """The frames of the run in `folder`, seen along the axis that `cross_section` ("xz" or "xy") leaves out.

    Speeds are over `speed` (m/s), or else over that of the drum's rim. `frames` > 1: only so many of them, evenly spaced, the last
    included; or the `last` ones alone, which show a vibration. `chains`: the contact forces of the last one, from contacts.dump. `pixels`
    of the longer side of an animation. Meshes that move without turning are drawn where they are. DumpError when a file cannot be read.
    """
    axes = ["xyz".index(letter) for letter in cross_section]
    dump = GrainsDump(folder / "grains.dump")
    first = max(0, len(dump) - last) if last else 0
    count = len(dump) - first
    shown = np.unique(np.linspace(first, len(dump) - 1, frames if 1 < frames < count else count).round().astype(int))
    frames_shown = [dump[int(number)] for number in shown]
    if changed := [frame for frame in frames_shown if not np.array_equal(frame.ids, frames_shown[0].ids)]:
        raise DumpError(f"{changed[0].where}: its grains are not those of step {frames_shown[0].step}, as a section needs")
    record = read_json(folder / "run.json") or {}
    scale = speed or abs(drum_speed) * drum_radius or 1.0
    label = "speed / speed of the rim" if not speed and drum_radius else "speed / (m/s)" if scale == 1.0 else f"speed / ({scale:g} m/s)"
    links, forces = _chains(folder, frames_shown[-1], axes) if chains else (np.zeros((0, 2, 2)), np.zeros(0))
    return Section(
        np.array([frame.wrapped[:, axes] for frame in frames_shown]), frames_shown[0].radii,
        np.array([np.linalg.norm(frame.velocities, axis=1) / scale for frame in frames_shown]),
        np.array([frame.time_by(float(record.get("time_step", 1.0))) for frame in frames_shown]), drum_radius, drum_speed, label, links,
        forces, _walls(folder, [frame.step for frame in frames_shown]) if axes == [0, 2] else np.zeros((0, 0, 2, 2)), pixels)


def _walls(folder: Path, steps: list[int]) -> Array:
    """Lines (frames, k, 2, 2) in m of x and z in which the meshes of a run cross the plane in the middle of them, at these `steps`, by the
    columns motion_x, motion_z of its history, or at rest without them; none where they turn."""
    none = np.zeros((0, 0, 2, 2))
    meshes = sorted(folder.glob("*.stl"))
    if not meshes or not (folder / "time.csv").is_file():
        return none
    rows = read_times(folder / "time.csv")
    moves = "motion_x" in rows
    if moves and np.abs(rows["motion_angle"]).max() > 0.0:
        return none
    triangles = np.concatenate([np.asarray(read_stl(path).triangles) for path in meshes])
    lines = cut(triangles, 0.5 * float(triangles[..., 1].min() + triangles[..., 1].max()))
    way = np.column_stack([np.interp(steps, rows["step"], rows[f"motion_{axis}"] if moves else 0.0 * rows["step"]) for axis in "xz"])
    return np.asarray(lines[None] + way[:, None, None, :])


def _chains(folder: Path, frame: GrainFrame, axes: list[int]) -> tuple[Array, Array]:
    """Ends (m, 2, 2) in m and normal forces (m,) in N of the contacts in the last frame of contacts.dump: from log to log, or to the
    wall, or to the contact where the other log is drawn at the other side of a periodic box."""
    dump = TextDump(folder / "contacts.dump")
    values = dump.frame(len(dump) - 1).values
    place = dict(zip(frame.ids.tolist(), frame.wrapped, strict=True))
    first = np.array([place[int(one)] for one in values[:, 0]]).reshape(-1, 3)
    contact = first + less_edges(values[:, 10:13] - first, frame)
    way = np.array([place.get(int(one), end) for one, end in zip(values[:, 1], contact, strict=True)]).reshape(-1, 3) - first
    across = (less_edges(way, frame) != way).any(axis=1)
    return np.stack([first, np.where(across[:, None], contact, first + way)], axis=1)[..., axes], values[:, 6]


def picture(section: Section) -> bytes:
    """The last frame as a PNG, with a colour scale."""
    top = limit(section)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(HEIGHT + 1.1, HEIGHT), layout="constrained")
        axes = figure.subplots()
        draw(axes, section, top)
        _last(axes, section)
        bar = figure.colorbar(ScalarMappable(Normalize(0.0, top), SEQUENTIAL), ax=axes, shrink=0.75, aspect=22, pad=0.02, extend="max")
        bar.set_label(section.label)
        bar.outline.set_linewidth(0.4)
    return saved(figure)


def draw(axes: Axes, section: Section, top: float, frame: int = -1) -> None:
    """A frame in `axes`, the last one by default, speeds up to `top` on the colour scale."""
    if section.drum_radius > 0.0:
        axes.add_patch(Circle((0.0, 0.0), section.drum_radius, fill=False, edgecolor=GREY, linewidth=1.6))
    if len(section.walls):
        axes.add_collection(LineCollection(list(section.walls[frame]), colors=GREY, linewidths=1.2))
    size = 2.0 * section.radii
    axes.add_collection(EllipseCollection(
        size, size, np.zeros_like(size), units="x", offsets=section.places[frame], offset_transform=axes.transData,
        array=section.speeds[frame], cmap=SEQUENTIAL, norm=Normalize(0.0, top), edgecolor="white", linewidth=0.3))
    axes.axis("off")


def limit(section: Section) -> float:
    """Upper end of the colour scale: what 2 % of the speeds exceed."""
    return float(np.percentile(section.speeds, 98.0)) or 1.0


def _last(axes: Axes, section: Section) -> None:
    """The view of the last frame, with the contact forces in it and an arrow along which the drum turns."""
    if len(section.forces):
        widths = 4.0 * np.sqrt(section.forces / section.forces.max())
        axes.add_collection(LineCollection(list(section.links), linewidths=widths, colors=_CHAIN, alpha=0.85, capstyle="round"))
    if section.drum_radius > 0.0 and section.drum_speed != 0.0:
        radius, turn = 0.93 * section.drum_radius, math.copysign(1.0, section.drum_speed)
        ends = [(radius * math.cos(angle), radius * math.sin(angle)) for angle in (math.pi / 2 + 0.28 * turn, math.pi / 2 - 0.28 * turn)]
        axes.annotate("", ends[1], ends[0], arrowprops={"arrowstyle": "->", "color": GREY,
                                                        "connectionstyle": f"arc3,rad={-0.28 * turn}", "linewidth": 1.0})
    left, right, bottom, upper = section.last_view
    axes.set(xlim=(left, right), ylim=(bottom, upper), aspect="equal")


def animate(section: Section, path: Path, *, duration: int = 60) -> Path:
    """All frames as a GIF at `path`, each for `duration` ms; marks on the shell turn with the drum. Returns `path`."""
    return write_film(path, _pictures(section), duration, colours=32)


def _pictures(section: Section) -> Iterator[tuple[float, NDArray[np.uint8]]]:
    """Time (s) and picture of each frame."""
    left, right, bottom, upper = section.view
    scale, top = section.pixels / max(right - left, upper - bottom) / _DOTS, limit(section)
    for number, time in enumerate(section.times):
        figure = Figure(figsize=((right - left) * scale, (upper - bottom) * scale), dpi=_DOTS)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        draw(axes, section, top, number)
        if section.drum_radius > 0.0:
            angles = np.arange(12) * np.pi / 6.0 - section.drum_speed * time
            marks = section.drum_radius * np.column_stack([np.cos(angles), np.sin(angles)])
            axes.add_collection(LineCollection(list(np.stack([marks, 1.035 * marks], axis=1)), colors=GREY, linewidths=1.2))
        axes.set(xlim=(left, right), ylim=(bottom, upper))
        yield time, pixels(figure)
