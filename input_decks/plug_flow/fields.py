"""Fields of the plug flow over width and height of the channel, coarse-grained in cells at rest, steady part. Eulerian velocity: momentum
over mass of a cell. Lagrangian: displacements of grains over the same time. The flow is uniform along the walls, so that both agree."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import islice
from operator import add
from typing import Any

import numpy as np
from scipy.special import ndtr

from dembark.postproc.fields.accumulators import FieldSums
from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.field_set import FieldSet
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import CUTOFF
from dembark.postproc.measurement import Array, Measurement, Replica, Value
from dembark.postproc.output import cf_dataset, variable, with_interval
from dembark.postproc.resampling import resampled
from dembark.postproc.statistics import Estimate, TimeBlocks, block_mean, combined, jackknife_error, over_replicas, student, time_blocks
from dembark.postproc.walls import PlaneWall, wall_contacts

from .channel import Channel, free_grains
from .channel import read as read_channel

WIDTH = 0.5  # of the kernel, in grain diameters: the layers at the walls stay apart
_FIELDS = {
    "velocity": ("1", "downward velocity over that of the plate"),
    "shear_rate": ("1", "gradient of the downward velocity along x, times d over the plate's velocity"),
    "temperature": ("1", "granular temperature over the plate's velocity squared"),
    "solid_fraction": ("1", "volume of grains per volume"),
    "stress_xx": ("Pa", "normal stress across the channel, compression positive"),
    "stress_zx": ("Pa", "shear stress, flow of vertical momentum along x, compression positive"),
}


@dataclass(frozen=True)
class Flow:
    """One replica: `sums` of each of the time `blocks` on the grid, and the `channel`; the groups of `blocks` number its frames."""

    channel: Channel
    sums: list[FieldSums]
    blocks: TimeBlocks

    @property
    def inside(self) -> Any:
        """Which cells across lie between the walls."""
        place = self.sums[0].grid.centres(0)
        return (place > 0.0) & (place < self.channel.width)

    @property
    def across(self) -> Array:
        """Places (m) of the cells between the walls."""
        return self.sums[0].grid.centres(0)[self.inside]

    @property
    def total(self) -> FieldSums:
        """The sums of all blocks."""
        return reduce(add, self.sums)

    def estimate(self, measure: Callable[[FieldSums], float]) -> Estimate:
        """`measure(sums)` of the sums of all blocks, with the interval of what varies among them."""
        blocks = replace(self.blocks, groups=np.arange(len(self.sums)))
        return resampled(lambda keep, _: measure(reduce(add, (one for one, kept in zip(self.sums, keep, strict=True) if kept))), blocks)

    def scaled(self, fields: FieldSet) -> dict[str, Array]:
        """`fields` (cells between the walls, cells up) in units of d, v0 and Pa."""
        one, place, width = self.channel, fields.grid.centres(0), WIDTH * self.channel.diameter
        assert fields.stress is not None
        # The kernel reaches through the walls, where nothing is; so does the grid along y, unless that is periodic.
        within = one.depth / (fields.grid.high[1] - fields.grid.low[1])
        cover = within * (ndtr(place / width) - ndtr((place - one.width) / width))[:, None, None]
        found = {
            "velocity": -fields.velocity[..., 2] / one.speed,
            "shear_rate": -fields.velocity_gradient[..., 2, 0] * one.diameter / one.speed,
            "temperature": fields.temperature / one.speed**2,
            "solid_fraction": fields.solid_fraction / cover,
            "stress_xx": fields.stress[..., 0, 0] / cover,
            "stress_zx": fields.stress[..., 2, 0] / cover,
        }
        return {name: values[self.inside, 0] for name, values in found.items()}

    def curves(self, sums: FieldSums) -> dict[str, Array]:
        """The same (cells between the walls,) of `sums` over the full height of the window."""
        return {name: values[:, 0] for name, values in self.scaled(_whole_height(sums).fields(shear_corrected=True)).items()}

    def lagrangian(self) -> Array:
        """Mean velocity of the grains by their displacements (cells between the walls,) over v0, smoothed by the same kernel."""
        one, width = self.channel, WIDTH * self.channel.diameter
        weight = np.exp(-0.5 * np.minimum(((self.across[:, None] - one.grain_place) / width) ** 2, 1e3))
        total = weight.sum(axis=1)
        return np.divide(weight @ one.grain_speed, total, out=np.full(len(total), np.nan), where=total > 1e-12) / one.speed

    def curve_estimates(self) -> dict[str, list[Estimate]]:
        """An estimate for each cell across the channel, for every field: jackknife over the time blocks of all cells at once."""
        count, every = len(self.sums), self.curves(self.total)
        if count < 4:
            return {name: [Estimate(value, np.inf) for value in values] for name, values in every.items()}
        left_out = [self.curves(reduce(add, self.sums[:number] + self.sums[number + 1 :])) for number in range(count)]
        basis, factor = f"jackknife over {count} time blocks", student(count - 1) * self.blocks.widening
        found = {}
        for name, values in every.items():
            error = jackknife_error(np.array([one[name] for one in left_out]))
            found[name] = [Estimate(value, factor * half, basis) for value, half in zip(values, error, strict=True)]
        return found


def _whole_height(sums: FieldSums) -> FieldSums:
    """The sums of each column of cells, as of a grid with one cell along z."""
    grid = sums.grid
    flat = Grid(grid.low, grid.high, (grid.shape[0], grid.shape[1], 1), grid.periodic)
    grains, boundary = sums.grains.sum(axis=2, keepdims=True), sums.boundary.sum(axis=2, keepdims=True)
    contacts = None if sums.contacts is None else sums.contacts.sum(axis=2, keepdims=True)
    return FieldSums(flat, sums.kernel, sums.frames, grains, contacts, boundary, sums.peculiar, sums.liquid, sums.power)


def read(replica: Replica) -> Flow:
    """Measure one run folder."""
    channel = read_channel(replica)
    d, depth, width = channel.diameter, channel.depth, channel.width
    margin = CUTOFF * WIDTH * d
    across = round((width + 2.0 * margin) / (0.25 * d))
    periodic = bool(replica.grains()[0].periodic[1])
    ends = 0.0 if periodic else margin
    low, high = np.array([-margin, -ends, channel.levels[0]]), np.array([width + margin, depth + ends, channel.levels[-1]])
    grid = Grid(low, high, (across, 1, 2 * (len(channel.levels) - 1)), (False, periodic, False))
    planes = (PlaneWall("left", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), PlaneWall("right", (width, 0.0, 0.0), (-1.0, 0.0, 0.0)))
    blocks = time_blocks(channel.shear.sum(axis=(1, 2)))
    sums: dict[int, FieldSums] = {}
    # The steady part is the last one of the window.
    used = islice(replica.paired_frames(), len(replica.grains()) - len(channel.solid), None)
    for block, (grains, contacts) in zip(blocks.groups.tolist(), used, strict=True):
        free, among, glued = free_grains(grains, contacts)
        walls = [*glued, *(wall_contacts(free, plane) for plane in planes)]
        found = coarse_grain(free, among, grid, width=WIDTH * d, walls=walls, threads=1)
        sums[block] = sums[block] + found if block in sums else found
    return Flow(channel, list(sums.values()), blocks)


def measured(replicas: Sequence[Replica], unsteady: str) -> Measurement:
    """Fields of all replicas of a series and values drawn from them; `unsteady`: why none of it may be judged, or ''."""
    flows = [read(replica) for replica in replicas]
    scalars = [_scalars(one) for one in flows]
    over = {name: over_replicas([one[name] for one in scalars]) for name in scalars[0]}
    values = {name: Value(one, reason=unsteady, compared=not unsteady) for name, one in over.items()}
    values["eulerian_lagrangian_difference"] = Value(over["eulerian_lagrangian_difference"], Estimate(0.0, 0.0), reason=unsteady)
    return Measurement(values, fields=_dataset(flows))


def _scalars(flow: Flow) -> dict[str, Estimate]:
    one, place = flow.channel, flow.across
    core, left = np.abs(place - 0.5 * one.width) < 0.25 * one.width, place < 0.5 * one.width
    near = np.minimum(place, one.width - place) < one.diameter

    def speed(sums: FieldSums) -> float:
        fields = _whole_height(sums).fields()
        momentum, mass = (values[flow.inside, 0, 0][core].sum() for values in (fields.momentum[..., 2], fields.density))
        return float(-momentum / mass / one.speed)

    def steepest(sums: FieldSums) -> float:
        rate = np.abs(flow.curves(sums)["shear_rate"])
        return 0.5 * float(np.nanmax(rate[left]) + np.nanmax(rate[~left]))

    def temperature(where: Any) -> Estimate:
        return flow.estimate(lambda sums: float(np.nanmean(flow.curves(sums)["temperature"][where])))

    euler, lagrange = flow.estimate(speed), block_mean(one.core_motion / one.speed)
    difference = Estimate(euler.value - lagrange.value, combined([euler.half, lagrange.half]), f"{euler.basis}; {lagrange.basis}")
    return {"eulerian_lagrangian_difference": difference, "shear_rate_max": flow.estimate(steepest), "temperature_core": temperature(core),
            "temperature_wall": temperature(near)}


def _dataset(flows: Sequence[Flow]) -> Any:
    first = flows[0]
    channel, grid = first.channel, first.sums[0].grid
    # Windows of different replicas differ a little in height: their maps are brought to the first one's by their place in the window.
    heights = grid.centres(2) - grid.low[2]
    maps, curves = [one.scaled(one.total.fields(shear_corrected=True)) for one in flows], [one.curve_estimates() for one in flows]
    spread = np.linspace(0.0, 1.0, len(heights))
    variables = {}
    for name, (units, text) in _FIELDS.items():
        rows = [[np.interp(spread, np.linspace(0.0, 1.0, len(column)), column) for column in one[name]] for one in maps]
        variables[name] = variable(("x", "z"), np.mean(rows, axis=0), units, text)
        cells = [over_replicas(list(same)) for same in zip(*(one[name] for one in curves), strict=True)]
        variables |= with_interval(f"{name}_profile", ["x"], cells, units, f"{text}, mean over the height")
    variables["velocity_lagrangian"] = variable(["x"], np.mean([one.lagrangian() for one in flows], axis=0), "1",
                                                "the same from displacements of single grains, smoothed with the same kernel")
    coordinates = {"x": variable(["x"], first.across, "m", "distance from the left wall"),
                   "z": variable(["z"], heights, "m", "height in the window, at rest in the laboratory frame")}
    return cf_dataset(variables, coordinates, kernel="gaussian", width=WIDTH * channel.diameter, channel_width=channel.width,
                    averaged="along y and over the frames of the steady part", frames=sum(len(one.channel.solid) for one in flows),
                    replicas=len(flows), grain_diameter=channel.diameter, base_speed=channel.speed)
