"""A channel as measured: velocities and stresses over cells across it and bands of height, in the steady part of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dembark.postproc import ContactFrame, GrainFrame, profiles, stress
from dembark.postproc.spheres import slice_volumes, volume
from dembark.validation.checks.run import Replica, once, wall_friction
from dembark.postproc.statistics import Estimate, block_mean, steady_start
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def _ratio(above: Array, below: Array) -> Array:
    """above / below, NaN where a cell never held a grain."""
    return np.divide(above, below, out=np.full(len(above), np.nan), where=below > 0.0)


def fitted_decay(place: Array, deficit: Array, start: float) -> float:
    """Length of the exponential that fits `deficit` at the distances `place` best, in their unit; `start`: a guess."""
    fit = least_squares(lambda p: p[0] * np.exp(-place / np.exp(p[1])) - deficit, [max(deficit[0], 1e-3), np.log(start)])
    return float(np.exp(min(fit.x[1], 300.0)))


@dataclass(frozen=True)
class Channel:
    """One replica, steady part: arrays over frames, cells across (x) and bands of height (z), in SI units.

    `solid` (m3), `flow` = sum V v (m4/s), `flow2` = sum V v^2 are (frames, cells, bands), v downward; `pressure`
    (frames, cells); `grain_place`, `grain_speed` (grains,): mean x (m) and Lagrangian velocity (m/s); `core_motion`: that of the core from
    frame to frame; `normal`, `shear` (frames, bands, 2): stresses (Pa) of the left and right wall.
    """

    edges: Array
    levels: Array
    width: float
    depth: float
    diameter: float
    density: float
    base_speed: float
    solid: Array
    flow: Array
    flow2: Array
    pressure: Array
    normal: Array
    shear: Array
    grain_place: Array
    grain_speed: Array
    core_motion: Array
    force_error: Estimate
    wall_friction: float
    height: float
    steady_share: float
    remark: str

    @property
    def middle(self) -> Array:
        """Centres of the cells."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])

    @property
    def core(self) -> Mask:
        """Cells of the middle half of the channel."""
        return np.abs(self.middle - 0.5 * self.width) < 0.25 * self.width

    def velocity(self, frames: Mask, bands: Mask) -> Array:
        """Mean downward velocity (cells,)."""
        return _ratio(self._sum(self.flow, frames, bands), self._sum(self.solid, frames, bands))

    def _sum(self, values: Array, frames: Mask, bands: Mask) -> Array:
        return values[frames][:, :, bands].sum(axis=(0, 2))

    def core_velocity(self, frames: Mask, bands: Mask) -> float:
        """Mean over the core."""
        return float(self._sum(self.flow, frames, bands)[self.core].sum() / self._sum(self.solid, frames, bands)[self.core].sum())

    def flatness(self, frames: Mask, bands: Mask) -> float:
        """Largest |v / v_core - 1| over the core, in cells of about one diameter."""
        flow, solid = (self._sum(values, frames, bands) for values in (self.flow, self.solid))
        pairs = np.arange(0, len(flow), 2)
        speed = _ratio(np.add.reduceat(flow, pairs), np.add.reduceat(solid, pairs))[np.logical_and.reduceat(self.core, pairs)]
        return float(np.abs(speed / self.core_velocity(frames, bands) - 1.0).max())

    def deficit(self, frames: Mask, bands: Mask) -> tuple[Array, Array]:
        """Distance from the nearer wall (m) and 1 - v / v_core there, both walls averaged; without cells that hold hardly a grain."""
        flow, solid = (self._sum(values, frames, bands) for values in (self.flow, self.solid))
        half = len(flow) // 2
        flow, solid = flow[:half] + flow[::-1][:half], solid[:half] + solid[::-1][:half]
        filled = solid > 0.1 * solid.max()
        return self.middle[:half][filled], 1.0 - (flow[filled] / solid[filled]) / self.core_velocity(frames, bands)

    def wall_velocity(self, frames: Mask, bands: Mask) -> float:
        """Velocity of the layer within one diameter of the walls, over the core's."""
        near = np.minimum(self.middle, self.width - self.middle) < self.diameter
        return float(
            self._sum(self.flow, frames, bands)[near].sum() / self._sum(self.solid, frames, bands)[near].sum()
        ) / self.core_velocity(frames, bands)

    def decay_length(self, frames: Mask, bands: Mask) -> float:
        """Length in d of the exponential that fits the deficit."""
        return min(fitted_decay(*self.deficit(frames, bands), 2.0 * self.diameter), self.width) / self.diameter

    def ninety_width(self, frames: Mask, bands: Mask) -> float:
        """Distance from the wall in d at which the deficit has fallen to a tenth of its greatest value."""
        place, deficit = self.deficit(frames, bands)
        top = int(np.argmax(deficit))
        below = np.nonzero(deficit[top:] <= 0.1 * deficit[top])[0]
        if not len(below):
            return 0.5 * self.width / self.diameter
        last = top + int(below[0])
        share = (deficit[last - 1] - 0.1 * deficit[top]) / (deficit[last - 1] - deficit[last])
        return float(place[last - 1] + share * (place[last] - place[last - 1])) / self.diameter

    def inertial(self, frames: Mask, bands: Mask) -> float:
        """Inertial number of the core: the steeper of the mean slopes of v in its two halves, the mean pressure in the core."""
        speed, half = self.velocity(frames, bands), self.middle < 0.5 * self.width
        slopes = [np.polyfit(self.middle[one], speed[one], 1)[0] for one in (self.core & half, self.core & ~half)]
        return float(
            profiles.inertial_number(max(slopes, key=abs), self.pressure[frames][:, self.core].mean(), self.diameter, self.density)
        )

    def fluctuation(self, frames: Mask, bands: Mask) -> Array:
        """Standard deviation (cells,) of the vertical velocities about the cell's mean, over v0."""
        mean = self.velocity(frames, bands)
        return (
            np.sqrt(np.maximum(0.0, _ratio(self._sum(self.flow2, frames, bands), self._sum(self.solid, frames, bands)) - mean**2))
            / self.base_speed
        )

    def fraction(self, frames: Mask, bands: Mask) -> Array:
        """Solid fraction (cells,)."""
        height = np.diff(self.levels)[bands].sum()
        return self._sum(self.solid, frames, bands) / (frames.sum() * self.depth * np.diff(self.edges) * height)

    def mobilisation(self, frames: Mask, bands: Mask) -> float:
        """Shear over normal stress of both walls."""
        return float(self.shear[frames][:, bands].sum() / self.normal[frames][:, bands].sum())

    def flux_errors(self) -> Array:
        """Flux through each height over v0 times the bulk density, minus 1; (frames, bands)."""
        slab = np.diff(self.levels) * self.width * self.depth
        bulk = self.solid.sum(axis=(0, 1, 2)) / (len(self.solid) * slab.sum())
        return self.flow.sum(axis=1) / slab / (self.base_speed * bulk) - 1.0


@once
def read(replica: Replica) -> Channel:
    """Measure one run folder."""
    values = replica.parameters
    width, depth, diameter, speed = (float(values[name]) for name in ("channel_width", "channel_depth", "grain_diameter", "base_speed"))
    outline = [_outline(grains, width * depth) for grains in replica.grains()]
    steps = np.array([step for step, *_ in outline])
    times = replica.times()
    weight = outline[0][3] * float(values["gravity"])
    start, remark = _steady(times, steps, float(values["settle_time"]))
    used = steps >= start
    bottom, top = np.array([row[1] for row in outline])[used], np.array([row[2] for row in outline])[used]
    low, high = bottom.max() + 2.0 * diameter, top.min() - 2.0 * diameter
    if high - low < 4.0 * diameter:
        raise ValueError(
            f"only {(high - low) / diameter:.1f} d of height stay filled while the plate sinks: fewer travel or more grains are needed"
        )
    levels = np.linspace(low, high, max(4, round((high - low) / diameter)) + 1)
    edges = np.linspace(0.0, width, 4 * round(width / (2.0 * diameter)) + 1)
    rows: dict[str, list[Any]] = {}
    paths = []
    for (grains, contacts), keep in zip(replica.paired_frames(), used, strict=True):
        if keep:
            paths.append(grains.select(grains.types == 1).positions)
            for name, row in frame_rows(grains, contacts, edges, levels, depth).items():
                rows.setdefault(name, []).append(row)
    track = np.array(paths)
    stays = (track[0, :, 2] > bottom[0] + 2.0 * diameter) & (track[-1, :, 2] < top[-1] - 2.0 * diameter)
    clock = steps[used] * replica.time_step
    moved = profiles.lagrangian_velocities(track[:, stays], clock)
    inner = stays & (np.abs(track[:, :, 0].mean(axis=0) - 0.5 * width) < 0.25 * width)
    walls = sum(times[f"{wall}_fz"] for wall in ("left", "right", "base"))
    return Channel(
        edges=edges,
        levels=levels,
        width=width,
        depth=depth,
        diameter=diameter,
        density=float(values["grain_density"]),
        base_speed=speed,
        core_motion=-np.diff(track[:, inner, 2].mean(axis=1)) / np.diff(clock),
        grain_place=track[:, stays, 0].mean(axis=0),
        grain_speed=-moved[:, 2],
        force_error=block_mean((walls / weight - 1.0)[times["step"] >= start]),
        wall_friction=wall_friction(values),
        height=float(np.mean(top - bottom)),
        steady_share=float(used.mean()),
        remark=remark,
        **{name: np.array(row) for name, row in rows.items()},
    )


def _outline(grains: GrainFrame, area: float) -> tuple[int, float, float, float]:
    """(step, lowest point, surface, mass) of the moving grains."""
    free = grains.select(grains.types == 1)
    top = profiles.surface_height(free.positions[:, 2], free.radii, area)
    return grains.step, float((free.positions[:, 2] - free.radii).min()), top, float(free.masses.sum())


def _steady(times: dict[str, Array], steps: NDArray[np.int64], settle_time: float) -> tuple[int, str]:
    """`steady_part` by the friction of the walls, once the plate moves."""
    moving = times["time"] > settle_time
    return steady_part((times["left_fz"] + times["right_fz"])[moving], times["step"][moving], steps)


def steady_part(series: Array, when: Array, steps: NDArray[np.int64]) -> tuple[int, str]:
    """First step of the steady part of the measuring window, whose frames are at `steps`, by a series with values at the steps `when`; and
    '' or the reason why there is none (then the window's second half is used)."""
    # Rows are far closer in time than the memory of what they show: with about 200 of them MSER's batches are long against it.
    thin = max(1, len(series) // 200)
    thinned = series[: len(series) // thin * thin].reshape(-1, thin).mean(axis=1)
    start = steady_start(thinned)
    if start >= len(thinned) or when[start * thin] > steps[len(steps) // 2]:
        return int(steps[len(steps) // 2]), "no steady part was found in the measuring window, its second half was used"
    return int(when[start * thin]), ""


def frame_rows(
    grains: GrainFrame, contacts: ContactFrame, edges: Array, levels: Array, depth: float, periodic: bool = False
) -> dict[str, Any]:
    """One frame's rows of the arrays of `Channel`; `periodic`: `levels` are the two ends of a period, which hold every grain whole."""
    free = grains.select(grains.types == 1)
    heights, speed = free.positions[:, 2], -free.velocities[:, 2]
    shares = np.ones((len(heights), 1)) if periodic else slice_volumes(heights, free.radii, levels) / volume(free.radii)[:, None]
    parts = slice_volumes(free.positions[:, 0], free.radii, edges)
    # Only contacts centred in the window: with its whole height as cross-section they make the mean stress of each cell.
    centre = contacts.first[:, 2] + 0.5 * contacts.branch[:, 2]
    inside = np.full(len(centre), True) if periodic else (centre >= levels[0]) & (centre < levels[-1])
    tensor = stress.pair_stress(
        contacts.first[inside], contacts.branch[inside], contacts.forces[inside], 0, edges, depth * (levels[-1] - levels[0])
    )
    walls = [_wall_rows(grains, contacts, name, levels, depth) for name in ("left", "right")]
    return {
        "solid": parts.T @ shares,
        "flow": parts.T @ (shares * speed[:, None]),
        "flow2": parts.T @ (shares * speed[:, None] ** 2),
        "pressure": np.trace(tensor, axis1=1, axis2=2) / 3.0,
        "normal": np.stack([normal for normal, _ in walls], axis=1),
        "shear": np.stack([shear for _, shear in walls], axis=1),
    }


def _wall_rows(grains: GrainFrame, contacts: ContactFrame, name: str, levels: Array, depth: float) -> tuple[Array, Array]:
    """Normal and shear stress of a wall: the wall itself and the grains glued to it."""
    side = 1 if name == "left" else -1
    heights, forces = grains.positions[:, 2], grains.wall_forces[name]
    glued = grains.types == 2
    if glued.any():
        index = np.searchsorted(grains.ids, contacts.ids)
        mixed = glued[index[:, 0]] != glued[index[:, 1]]
        pair, force = index[mixed], contacts.forces[mixed]
        first_free = ~glued[pair[:, 0]]
        wall, free = np.where(first_free, pair[:, 1], pair[:, 0]), np.where(first_free, pair[:, 0], pair[:, 1])
        middle = 0.5 * (grains.positions[glued, 0].min() + grains.positions[glued, 0].max())
        here = (grains.positions[wall, 0] - middle) * side < 0
        heights = np.concatenate([heights, grains.positions[free[here], 2]])
        forces = np.concatenate([forces, np.where(first_free[:, None], force, -force)[here]])
    return stress.plane_wall_stress(heights, forces, 0, side, levels, depth)
