"""A flow in a channel between two walls: velocities and stresses over cells across it and bands of height, steady part. x runs from wall to
wall, 0 to W; y is periodic or ends at two more walls, gravity points along -z, velocities are counted downward. Grains glued to a rough
wall stand on its plane. Eulerian means weigh each grain by its exact volume in the cell, Lagrangian ones are displacements of single
grains."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from dembark.common.errors import RunError
from dembark.postproc import ContactFrame, GrainFrame, profiles, stress
from dembark.postproc.fields.coarse_graining import WallContacts, rows_of
from dembark.postproc.history import reached
from dembark.postproc.replica import Array, Replica, cached_per_replica
from dembark.postproc.resampling import profile, resampled
from dembark.postproc.spheres import slice_volumes, volume
from dembark.postproc.statistics import Estimate, block_mean, steady_start, time_blocks

Mask = NDArray[np.bool_]
Bands = Mask | slice
ALL = slice(None)
# A mean velocity below this share of sqrt(g W) is creep: falling grains are jammed between the walls.
LEAST_SPEED = 0.01


def _ratio(above: Array, below: Array) -> Array:
    """above / below, NaN where a cell never held a grain."""
    return np.divide(above, below, out=np.full(len(above), np.nan), where=below > 0.0)


@dataclass(frozen=True)
class Course:
    """`series` (rows,) at the steps `when`, and the steps of the frames in the measuring window."""

    series: Array
    when: Array
    frames: NDArray[np.int64]

    def steady_part(self) -> tuple[int, str]:
        """First step of the steady part of the measuring window; and '' or the reason why there is none (then the window's second half is
        used)."""
        # Rows are far closer in time than the memory of what they show: with about 200 of them MSER's batches are long against it.
        thin = max(1, len(self.series) // 200)
        thinned = self.series[: len(self.series) // thin * thin].reshape(-1, thin).mean(axis=1)
        start, middle = steady_start(thinned), int(self.frames[len(self.frames) // 2])
        if start >= len(thinned) or self.when[start * thin] > middle:
            return middle, "no steady part was found in the measuring window; its second half was used"
        return int(self.when[start * thin]), ""


@dataclass(frozen=True)
class Channel:
    """One replica, steady part: arrays over frames, cells across (x) and bands of height (z), in SI units. `speed` (m/s): the scale of
    velocities. `solid` (m3), `flow` = sum V v (m4/s), `flow2` = sum V v^2 are (frames, cells, bands); `pressure` (frames, cells);
    `track` (frames, grains, 3): places (m) of all moving grains at the times `clock` (s); `grain_place`, `grain_speed`: mean x (m) and
    Lagrangian velocity (m/s) of those that stay; `core_motion`: that of the core from frame to frame; `normal`, `shear` (frames, bands, 2):
    stresses (Pa) of the left and right wall; `course`: what shows the steady part, over the time in which it is looked for. `remark`: why
    nothing is said of its flow, or ''."""

    edges: Array
    levels: Array
    width: float
    depth: float
    diameter: float
    density: float
    speed: float
    solid: Array
    flow: Array
    flow2: Array
    pressure: Array
    normal: Array
    shear: Array
    track: Array
    clock: Array
    grain_place: Array
    grain_speed: Array
    core_motion: Array
    force_error: Estimate
    height: float
    steady_share: float
    course: Course
    remark: str = ""

    @property
    def middle(self) -> Array:
        """Centres of the cells."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])

    @property
    def from_wall(self) -> Array:
        """Distance (cells,) from the nearer wall."""
        return np.minimum(self.middle, self.width - self.middle)

    @property
    def core(self) -> Mask:
        """Cells of the middle half of the channel."""
        return np.abs(self.middle - 0.5 * self.width) < 0.25 * self.width

    @property
    def frames(self) -> Mask:
        """The mask of all frames."""
        return np.ones(len(self.solid), bool)

    def sums(self, frames: Mask, bands: Bands = ALL, cells: int = 1) -> tuple[Array, Array]:
        """Flow and solid volume of the kept frames and bands, of each group of `cells` cells."""
        groups = np.arange(0, len(self.middle), cells)
        flow, solid = (np.add.reduceat(values[frames][:, :, bands].sum(axis=(0, 2)), groups) for values in (self.flow, self.solid))
        return flow, solid

    def velocity(self, frames: Mask, bands: Bands = ALL, cells: int = 1) -> Array:
        """Mean downward velocity (cells,)."""
        return _ratio(*self.sums(frames, bands, cells))

    def _mean(self, where: Mask, frames: Mask, bands: Bands) -> float:
        flow, solid = self.sums(frames, bands)
        return float(flow[where].sum() / solid[where].sum())

    def core_velocity(self, frames: Mask, bands: Bands = ALL) -> float:
        """Mean over the core."""
        return self._mean(self.core, frames, bands)

    def wall_velocity(self, frames: Mask, bands: Bands = ALL) -> float:
        """Velocity of the layer within one diameter of the walls, over the core's."""
        return self._mean(self.from_wall < self.diameter, frames, bands) / self.core_velocity(frames, bands)

    def flatness(self, frames: Mask, bands: Bands = ALL) -> float:
        """Largest |v / v_core - 1| over the core, in cells of about one diameter."""
        core = np.logical_and.reduceat(self.core, np.arange(0, len(self.core), 2))
        return float(np.abs(self.velocity(frames, bands, 2)[core] / self.core_velocity(frames, bands) - 1.0).max())

    def deficit(self, frames: Mask, bands: Bands = ALL, cells: int = 1) -> tuple[Array, Array]:
        """Distance from the nearer wall (m) and 1 - v / v_core there, both walls averaged; without cells that hold hardly a grain. With two
        `cells` taken together they are one diameter wide: smaller ones show the same grain's velocity at several places."""
        flow, solid = self.sums(frames, bands, cells)
        half, edges = len(flow) // 2, self.edges[::cells]
        flow, solid = flow[:half] + flow[::-1][:half], solid[:half] + solid[::-1][:half]
        filled = solid > 0.1 * solid.max()
        place = 0.5 * (edges[1:] + edges[:-1])[:half]
        return place[filled], 1.0 - (flow[filled] / solid[filled]) / self.core_velocity(frames, bands)

    def decay_length(self, frames: Mask, bands: Bands = ALL, cells: int = 1, start: float = 2.0) -> float:
        """Length in d of the exponential that fits the deficit; `start` in d."""
        place, deficit = self.deficit(frames, bands, cells)
        begin = [max(deficit[0], 1e-3), np.log(start * self.diameter)]
        fit = least_squares(lambda p: p[0] * np.exp(-place / np.exp(p[1])) - deficit, begin)
        return min(float(np.exp(min(fit.x[1], 300.0))), self.width) / self.diameter

    def scaled_deficit(self, length: float) -> tuple[Array, Array]:
        """Distance from the layer at the nearer wall over `length` (d), and (v_core - v) / (v_core - v_wall) there; 1 at 0. The layer's
        centres are half a diameter off the wall, and its velocity is that of the wall."""
        place, deficit = self.deficit(self.frames, cells=2)
        return (place - place[0]) / (length * self.diameter), deficit / (1.0 - self.wall_velocity(self.frames))

    def lagrangian(self) -> Array:
        """Mean Lagrangian velocity (cells,) of the grains whose mean place is in each cell; NaN where there is none."""
        cell = np.clip(np.searchsorted(self.edges, self.grain_place) - 1, 0, len(self.middle) - 1)
        count, speeds = np.bincount(cell, minlength=len(self.middle)), np.bincount(cell, self.grain_speed, len(self.middle))
        return _ratio(speeds.astype(np.float64), count.astype(np.float64))

    def ninety_width(self, frames: Mask, bands: Bands = ALL) -> float:
        """Distance from the wall in d at which the deficit has fallen to a tenth of its greatest value."""
        place, deficit = self.deficit(frames, bands)
        top = int(np.argmax(deficit))
        found = reached(place[top:], -deficit[top:], -0.1 * deficit[top])
        return (0.5 * self.width if math.isnan(found) else found) / self.diameter

    def inertial(self, frames: Mask, bands: Bands = ALL) -> float:
        """Inertial number of the core: the steeper of the mean slopes of v in its two halves, the mean pressure in the core."""
        speed, left = self.velocity(frames, bands), self.middle < 0.5 * self.width
        slopes = [np.polyfit(self.middle[one], speed[one], 1)[0] for one in (self.core & left, self.core & ~left)]
        pressure = self.pressure[frames][:, self.core].mean()
        return float(profiles.inertial_number(max(slopes, key=abs), pressure, self.diameter, self.density))

    def inertial_numbers(self, frames: Mask) -> Array:
        """Inertial number across the channel (cells - 1,), between the middles of neighbouring cells."""
        pressure, slope = self.pressure[frames].mean(axis=0), np.diff(self.velocity(frames)) / np.diff(self.middle)
        return np.asarray(profiles.inertial_number(slope, 0.5 * (pressure[1:] + pressure[:-1]), self.diameter, self.density))

    def shear_inertial(self, frames: Mask) -> float:
        """The largest of these further than one diameter from the walls, where cells are not split by the layers."""
        place = 0.5 * (self.middle[1:] + self.middle[:-1])
        return float(self.inertial_numbers(frames)[np.minimum(place, self.width - place) > self.diameter].max())

    def fluctuation(self, frames: Mask, bands: Bands = ALL, apart: bool = False) -> Array:
        """Standard deviation (cells,) of the vertical velocities about the cell's mean, over the scale of velocities. `apart`: without what
        all grains do together from frame to frame, which is no agitation."""
        solid, flow, flow2 = (values[frames][:, :, bands].sum(axis=2) for values in (self.solid, self.flow, self.flow2))
        common = (flow.sum(axis=1) / solid.sum(axis=1))[:, None] if apart else 0.0
        mean = _ratio((flow - common * solid).sum(axis=0), solid.sum(axis=0))
        square = _ratio((flow2 - 2.0 * common * flow + common**2 * solid).sum(axis=0), solid.sum(axis=0))
        return np.sqrt(np.maximum(0.0, square - mean**2)) / self.speed

    def fraction(self, frames: Mask, bands: Bands = ALL) -> Array:
        """Solid fraction (cells,)."""
        return self.sums(frames, bands)[1] / (frames.sum() * self.depth * np.diff(self.edges) * np.diff(self.levels)[bands].sum())

    def mobilisation(self, frames: Mask, bands: Bands = ALL) -> float:
        """Shear over normal stress of both walls."""
        return float(self.shear[frames][:, bands].sum() / self.normal[frames][:, bands].sum())

    def flux_errors(self) -> Array:
        """Flux through each height over the scale of velocities times the bulk density, minus 1; (frames, bands)."""
        slab = np.diff(self.levels) * self.width * self.depth
        bulk = self.solid.sum(axis=(0, 1, 2)) / (len(self.solid) * slab.sum())
        return self.flow.sum(axis=1) / slab / (self.speed * bulk) - 1.0


def cells_across(width: float, diameter: float) -> Array:
    """Edges of an even number of pairs of cells across, each cell about half a diameter wide."""
    return np.linspace(0.0, width, 4 * round(width / (2.0 * diameter)) + 1)


def joined(given: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], track: Array, stays: Mask, clock: Array, **more: Any) -> Channel:
    """The Channel from the frames' `rows` and the `track` (frames, n, 3) of the grains at the times `clock` (s); those that `stays` marks
    are in the channel all along."""
    width, diameter = float(given["channel_width"]), float(given["grain_diameter"])
    inner = stays & (np.abs(track[:, :, 0].mean(axis=0) - 0.5 * width) < 0.25 * width)
    over_frames: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return Channel(
        edges=cells_across(width, diameter), width=width, depth=float(given["channel_depth"]), diameter=diameter,
        density=float(given["grain_density"]), track=track, clock=clock,
        core_motion=-np.diff(track[:, inner, 2].mean(axis=1)) / np.diff(clock),
        grain_place=track[:, stays, 0].mean(axis=0), grain_speed=-profiles.lagrangian_velocities(track[:, stays], clock)[:, 2],
        **over_frames, **more)


@cached_per_replica
def read(replica: Replica) -> Channel:
    """Measure a run whose grains sink with a plate, in cells that rest in the laboratory and stay filled for all frames used; the scale of
    velocities is the plate's. RunError when they stay filled over less than four diameters."""
    given, times = replica.parameters, replica.times()
    width, depth, diameter = (float(given[name]) for name in ("channel_width", "channel_depth", "grain_diameter"))
    outline = np.array([_outline(grains, width * depth) for grains in replica.grains()])
    steps, weight = outline[:, 0].astype(np.int64), outline[0, 3] * float(given["gravity"])
    moving = times["time"] > float(given["settle_time"])
    course = Course((times["left_fz"] + times["right_fz"])[moving], times["step"][moving], steps)
    start, _ = course.steady_part()
    used = steps >= start
    bottom, top = outline[used, 1], outline[used, 2]
    low, high = bottom.max() + 2.0 * diameter, top.min() - 2.0 * diameter
    if high - low < 4.0 * diameter:
        raise RunError(f"{replica.folder} is too short to be measured", f"{max(0.0, (high - low) / diameter):.1f} d of its height stay "
                       "filled while the plate sinks", "use more grains or less travel")
    levels, edges = np.linspace(low, high, max(4, round((high - low) / diameter)) + 1), cells_across(width, diameter)
    rows, paths = [], []
    for grains, contacts in _chosen(replica, used):
        paths.append(grains.select(grains.types == 1).positions)
        rows.append(frame_rows(grains, contacts, edges, levels, depth))
    track = np.array(paths)
    stays = (track[0, :, 2] > bottom[0] + 2.0 * diameter) & (track[-1, :, 2] < top[-1] - 2.0 * diameter)
    walls = sum(times[f"{wall}_fz"] for wall in ("left", "right", "front", "rear", "base") if f"{wall}_fz" in times)
    return joined(given, rows, track, stays, steps[used].astype(float) * replica.time_step, levels=levels, speed=float(given["base_speed"]),
                  force_error=block_mean((walls / weight - 1.0)[times["step"] >= start]), height=float(np.mean(top - bottom)),
                  steady_share=float(used.mean()), course=course)


@cached_per_replica
def read_periodic(replica: Replica) -> Channel:
    """Measure a run whose grains fall between the walls, periodic along the flow; the scale of velocities is sqrt(g W). The walls' friction
    swings by as much as its mean, so the steady part is that of the kinetic energy, which sums up what the balance of forces lacks. The
    balance is that of friction, weight and the mean acceleration from frame to frame."""
    given, times, steps = replica.parameters, replica.times(), np.array([frame.step for frame in replica.grains()])
    gravity, width, depth = (float(given[name]) for name in ("gravity", "channel_width", "channel_depth"))
    window = times["step"] > 2 * steps[0] - steps[1]
    course = Course(times["kinetic_energy"][window], times["step"][window], steps)
    start, _ = course.steady_part()
    used, edges, speed = steps >= start, cells_across(width, float(given["grain_diameter"])), float(np.sqrt(gravity * width))
    rows, paths, levels, weight = [], [], np.zeros(2), 0.0
    for grains, contacts in _chosen(replica, used):
        levels, weight = np.array([grains.low[2], grains.high[2]]), float(grains.masses.sum()) * gravity
        paths.append(grains.positions)
        # All grains in the box, where the walls' forces are to be sorted by height.
        rows.append(frame_rows(replace(grains, positions=grains.wrapped), contacts, edges, levels, depth, periodic=True))
    fall, track = np.array([row["flow"].sum() / row["solid"].sum() for row in rows]), np.array(paths)
    remark = ""
    if fall.mean() < LEAST_SPEED * speed:
        remark = f"the grains are jammed between the walls: they creep at {fall.mean():.2g} m/s"
    friction, when, clock = times["left_fz"] + times["right_fz"], times["step"], steps[used] * replica.time_step
    held = [friction[(when > low) & (when <= high)].mean() / weight for low, high in pairwise(steps[used])]
    return joined(given, rows, track, np.full(track.shape[1], True), clock, levels=levels, speed=speed,
                  force_error=block_mean(np.array(held) - 1.0 + np.diff(fall) / np.diff(clock) / gravity),
                  height=float(levels[1] - levels[0]), steady_share=float(used.mean()), course=course, remark=remark)


Measure = Callable[[Mask, Bands], float]


def estimates(one: Channel, series: Array, more: Mapping[str, Measure], apart: bool = False) -> dict[str, Estimate]:
    """What is measured of any channel, by name, and `more`; intervals are from time blocks of `series` (frames,), and from the bands.
    `apart`: fluctuations without what all grains do together, see `Channel.fluctuation`."""
    near, bands = one.from_wall < one.diameter, one.solid.shape[2]
    measures: dict[str, Measure] = {
        "core_flatness": one.flatness,
        "inertial_number": one.inertial,
        "wall_mobilisation": one.mobilisation,
        "core_fluctuation": lambda f, b: float(one.fluctuation(f, b, apart)[one.core].mean()),
        "wall_fluctuation": lambda f, b: float(np.nanmean(one.fluctuation(f, b, apart)[near])),
        "solid_fraction": lambda f, b: float(one.fraction(f, b)[one.core].mean()),
        **more,
    }

    def estimate(get: Measure) -> Estimate:
        return resampled(lambda f, b: get(f, ALL if places is None else b), frames, places)

    frames, places = time_blocks(series), np.arange(bands) * max(4, bands // 2) // bands if bands > 1 else None
    return {
        **{name: estimate(get) for name, get in measures.items()},
        "wall_normal_stress": block_mean(one.normal.mean(axis=(1, 2))),
        "force_balance_error": one.force_error,
    }


def across(channels: Sequence[Channel], name: str, title: str, label: str, get: Callable[[Channel], Array], **more: Any) -> dict[str, Any]:
    """A curve from wall to wall, the same in all `channels`: `get` gives it for each cell, or between the middles of neighbours."""
    rows, place = [get(one) for one in channels], channels[0].middle / channels[0].diameter
    return profile(name, title, "distance from the left wall x / d", label,
                   place if len(rows[0]) == len(place) else 0.5 * (place[1:] + place[:-1]), rows, **more)


def upward(channels: Sequence[Channel], name: str, title: str, label: str, get: Callable[[Channel], Array]) -> dict[str, Any]:
    """A curve over the height in the window, of values (frames, bands, ...) that `get` gives; windows of replicas differ a little."""
    first, curves = channels[0], [get(one).mean(axis=(0, 2)) for one in channels]
    levels = (0.5 * (first.levels[1:] + first.levels[:-1]) - first.levels[0]) / first.diameter
    rows = [np.interp(np.linspace(0, 1, len(levels)), np.linspace(0, 1, len(curve)), curve) for curve in curves]
    return profile(name, title, "height in the window z / d", label, levels, rows, vertical=True)


def _chosen(replica: Replica, used: Mask) -> Iterator[tuple[GrainFrame, ContactFrame]]:
    """The frames that `used` marks."""
    return (pair for pair, keep in zip(replica.paired_frames(), used, strict=True) if keep)


def _outline(grains: GrainFrame, area: float) -> tuple[int, float, float, float]:
    """(step, lowest point, surface, mass) of the moving grains."""
    free = grains.select(grains.types == 1)
    top = profiles.surface_height(free.positions[:, 2], free.radii, area)
    return grains.step, float((free.positions[:, 2] - free.radii).min()), top, float(free.masses.sum())


def unsteady(courses: Sequence[Course]) -> str:
    """'' when the mean over the packings is steady, or the reason why nothing is said of their flow. A single packing hides a slow drift in
    its scatter, and one of several fails the test by chance more often than the test allows."""
    rows = min(len(one.series) for one in courses)
    mean = np.mean([one.series[:rows] for one in courses], axis=0)
    return replace(courses[0], series=mean, when=courses[0].when[:rows]).steady_part()[1]


def free_grains(grains: GrainFrame, contacts: ContactFrame) -> tuple[GrainFrame, ContactFrame, list[WallContacts]]:
    """The moving grains, the contacts among them, and those with grains glued to a wall as contacts with that wall."""
    glued = grains.types == 2
    if not glued.any():
        return grains, contacts, []
    rows = rows_of(grains.ids, contacts.ids, contacts.step)
    fixed = glued[rows]
    mixed, first = fixed[:, 0] != fixed[:, 1], ~fixed[:, 0]
    own = np.where(first, rows[:, 0], rows[:, 1])[mixed]
    sign = np.where(first, 1.0, -1.0)[mixed, None]
    branch = sign * contacts.branch[mixed]
    centre = np.where(first[:, None], contacts.first, contacts.first + contacts.branch)[mixed]
    reach = grains.radii[own, None] / np.maximum(np.linalg.norm(branch, axis=1), 1e-300)[:, None]
    free = ~fixed.any(axis=1)
    kept = (getattr(contacts, name)[free] for name in ("first", "branch", "forces", "ids"))
    wall = WallContacts(centre + reach * branch, centre, sign * contacts.forces[mixed])
    return grains.select(~glued), ContactFrame(contacts.step, *kept), [wall]


def frame_rows(grains: GrainFrame, contacts: ContactFrame, edges: Array, levels: Array, depth: float,
               periodic: bool = False) -> dict[str, Any]:
    """One frame's rows of the arrays of Channel; `periodic`: `levels` are the two ends of a period, which hold every grain whole."""
    free, _, glued = free_grains(grains, contacts)
    heights, speed = free.positions[:, 2], -free.velocities[:, 2]
    shares = np.ones((len(heights), 1)) if periodic else slice_volumes(heights, free.radii, levels) / volume(free.radii)[:, None]
    parts = slice_volumes(free.positions[:, 0], free.radii, edges)
    # Only contacts centred in the window: with its full height as cross-section they make the mean stress of each cell.
    centre = contacts.first[:, 2] + 0.5 * contacts.branch[:, 2]
    inside = np.full(len(centre), True) if periodic else (centre >= levels[0]) & (centre < levels[-1])
    lines = (contacts.first[inside], contacts.branch[inside], contacts.forces[inside])
    tensor = stress.pair_stress(*lines, 0, edges, depth * (levels[-1] - levels[0]))
    walls = []
    for name, side in (("left", 1), ("right", -1)):
        # The wall itself and the grains glued to it.
        place, forces = grains.positions[:, 2], grains.wall_forces[name]
        for one in glued:
            near = (0.5 * edges[-1] - one.positions[:, 0]) * side > 0.0
            place, forces = np.concatenate([place, one.positions[near, 2]]), np.concatenate([forces, one.forces[near]])
        walls.append(stress.plane_wall_stress(place, forces, 0, side, levels, depth))
    return {
        "solid": parts.T @ shares,
        "flow": parts.T @ (shares * speed[:, None]),
        "flow2": parts.T @ (shares * speed[:, None] ** 2),
        "pressure": np.trace(tensor, axis1=1, axis2=2) / 3.0,
        "normal": np.stack([normal for normal, _ in walls], axis=1),
        "shear": np.stack([shear for _, shear in walls], axis=1),
    }
