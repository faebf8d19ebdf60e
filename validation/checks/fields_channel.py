"""Fields of the plug flow over the channel's width and height, coarse-grained in the cells that rest in the laboratory, steady part.

The mean velocity of a cell is Eulerian: the momentum that was found in it over all frames, over the mass. Beside it stands the Lagrangian
one, displacements of single grains over the same time. The flow is uniform along the walls, so the two must agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import islice
from operator import add
from typing import Any

import numpy as np
from dembark.postproc import ContactFrame, GrainFrame
from dembark.postproc.fields.coarse_graining import WallContacts, coarse_grain, rows_of
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import CUTOFF
from dembark.postproc.fields.sums import Fields, FieldSums
from dembark.postproc.walls import PlaneWall, wall_contacts
from dembark.validation.checks import channel as channels
from dembark.validation.checks.channel import Channel
from dembark.validation.checks.fields_result import FieldResult, labelled, variable
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Array, Replica, TimeBlocks, pooled, resampled, time_blocks
from dembark.postproc.statistics import Estimate, block_mean, combined, student
from scipy.special import ndtr

WIDTH = 0.5  # of the kernel, in grain diameters: the layers at the walls stay apart
# Both are velocities of the same grains; what is allowed is what core_flatness allows for a plug that is flat.
TOLERANCE = 0.02
_FIELDS = {
    "velocity": ("1", "downward velocity over that of the plate"),
    "shear_rate": ("1", "rise of the downward velocity along x, times d over the plate's velocity"),
    "temperature": ("1", "granular temperature over the plate's velocity squared"),
    "solid_fraction": ("1", "volume of grains per volume"),
    "stress_xx": ("Pa", "normal stress across the channel, compression positive"),
    "stress_zx": ("Pa", "shear stress, flow of vertical momentum along x, compression positive"),
}


@dataclass(frozen=True)
class Flow:
    """One replica: `sums` of each time block on the grid, and `channel`, what the case's own check read."""

    channel: Channel
    sums: list[FieldSums]
    single: bool

    @property
    def across(self) -> Array:
        """Places (m) of the cells between the walls."""
        return self.sums[0].grid.centres(0)[self.inside]

    @property
    def inside(self) -> Any:
        """Which cells across lie between the walls."""
        place = self.sums[0].grid.centres(0)
        return (place > 0.0) & (place < self.channel.width)

    def estimate(self, measure: Any) -> Estimate:
        """`measure(sums)` of the sums of all blocks, with the interval of what varies among them."""
        blocks = TimeBlocks(np.arange(len(self.sums)), self.single)
        return resampled(lambda keep, _: measure(reduce(add, (one for one, kept in zip(self.sums, keep, strict=True) if kept))), blocks)

    def profiles(self, sums: FieldSums) -> dict[str, Array]:
        """Profiles (cells between the walls,) in units of d, v0 and Pa, of `sums` over the whole height of the window."""
        fields = _whole_height(sums).fields(shear_corrected=True)
        return {name: values[self.inside, 0, 0] for name, values in self._scaled(fields).items()}

    def maps(self) -> dict[str, Array]:
        """The same fields (cells across, cells up) of all blocks."""
        fields = reduce(add, self.sums).fields(shear_corrected=True)
        return {name: values[self.inside, 0, :] for name, values in self._scaled(fields).items()}

    def _scaled(self, fields: Fields) -> dict[str, Array]:
        one, place, width = self.channel, fields.grid.centres(0), WIDTH * self.channel.diameter
        assert fields.stress is not None
        # The kernel reaches through the walls, where nothing is.
        cover = (ndtr(place / width) - ndtr((place - one.width) / width))[:, None, None]
        return {
            "velocity": -fields.velocity[..., 2] / one.base_speed,
            "shear_rate": -fields.velocity_gradient[..., 2, 0] * one.diameter / one.base_speed,
            "temperature": fields.temperature / one.base_speed**2,
            "solid_fraction": fields.solid_fraction / cover,
            "stress_xx": fields.stress[..., 0, 0] / cover,
            "stress_zx": fields.stress[..., 2, 0] / cover,
        }

    def lagrangian(self) -> Array:
        """Mean velocity of the grains by their displacements (cells between the walls,) over v0, smoothed by the same kernel."""
        one, width = self.channel, WIDTH * self.channel.diameter
        weight = np.exp(-0.5 * np.minimum(((self.across[:, None] - one.grain_place) / width) ** 2, 1e3))
        total = weight.sum(axis=1)
        return np.divide(weight @ one.grain_speed, total, out=np.full(len(total), np.nan), where=total > 1e-12) / one.base_speed


def _whole_height(sums: FieldSums) -> FieldSums:
    """The sums of each column of cells, as of a grid with one cell along z."""
    grid = sums.grid
    flat = Grid(grid.low, grid.high, (grid.shape[0], grid.shape[1], 1), grid.periodic)
    grains, contacts, boundary = (values.sum(axis=2, keepdims=True) for values in (sums.grains, sums.contacts, sums.boundary))
    return FieldSums(flat, sums.kernel, sums.frames, grains, contacts, boundary, sums.peculiar, sums.liquid, sums.power)


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
    wall = WallContacts(centre + reach * branch, centre, sign * contacts.forces[mixed])
    free = ~fixed.any(axis=1)
    kept = (getattr(contacts, name)[free] for name in ("first", "branch", "forces", "ids"))
    return grains.select(~glued), ContactFrame(contacts.step, *kept), [wall]


def read(replica: Replica) -> Flow:
    """Measure one run folder."""
    channel = channels.read(replica)
    d, depth, width = channel.diameter, channel.depth, channel.width
    margin = CUTOFF * WIDTH * d
    across = round((width + 2.0 * margin) / (0.25 * d))
    grid = Grid([-margin, 0.0, channel.levels[0]], [width + margin, depth, channel.levels[-1]], (across, 1, 2 * (len(channel.levels) - 1)),
                (False, True, False))
    planes = (PlaneWall("left", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), PlaneWall("right", (width, 0.0, 0.0), (-1.0, 0.0, 0.0)))
    blocks = time_blocks(channel.shear.sum(axis=(1, 2)))
    sums: dict[int, FieldSums] = {}
    # The steady part is the last one of the window.
    used = islice(replica.paired_frames(), len(replica.grains()) - len(channel.solid), None)
    for block, (grains, contacts) in zip(blocks.groups.tolist(), used, strict=True):
        grains, contacts, glued = free_grains(grains, contacts)
        walls = [*glued, *(wall_contacts(grains, plane) for plane in planes)]
        found = coarse_grain(grains, contacts, grid, width=WIDTH * d, walls=walls, threads=1)
        sums[block] = sums[block] + found if block in sums else found
    return Flow(channel, list(sums.values()), blocks.single)


def measure(replicas: Sequence[Replica], unsteady: str) -> FieldResult:
    """Fields and quantities of all replicas of a series; `unsteady`: why none of it may be judged, or ''."""
    flows = [read(replica) for replica in replicas]
    scalars = [_scalars(one) for one in flows]
    agree = pooled(scalars, "difference")
    quantities = [
        Quantity("eulerian_lagrangian_difference", "core: Eulerian − Lagrangian velocity, over v₀", "1", agree, reference=Estimate(0.0, 0.0),
                 absolute=True, tolerance=TOLERANCE, reason=unsteady, source="uniform flow", compared=False,
                 detail="coarse-grained momentum over mass − displacements of grains"),
        Quantity("shear_rate_max", "largest shear rate, times d / v₀", "1", pooled(scalars, "shear"), reason=unsteady, compared=not unsteady,
                 detail=f"of the profile across the channel, Gaussian kernel of width {WIDTH:g} d, mean of both walls"),
        Quantity("temperature_core", "granular temperature of the core, over v₀²", "1", pooled(scalars, "core"), reason=unsteady,
                 compared=not unsteady, detail="⟨v′²⟩/3 about the affine mean flow of the cell"),
        Quantity("temperature_wall", "granular temperature at the walls, over v₀²", "1", pooled(scalars, "wall"), reason=unsteady,
                 compared=not unsteady, detail="within one diameter of the walls"),
    ]
    return FieldResult(_dataset(flows), quantities)


def _scalars(flow: Flow) -> dict[str, Estimate]:
    one, place = flow.channel, flow.across
    from_wall = np.minimum(place, one.width - place)
    core, near, left = np.abs(place - 0.5 * one.width) < 0.25 * one.width, from_wall < one.diameter, place < 0.5 * one.width

    def steepest(sums: FieldSums) -> float:
        rate = np.abs(flow.profiles(sums)["shear_rate"])
        return 0.5 * float(np.nanmax(rate[left]) + np.nanmax(rate[~left]))

    euler = flow.estimate(lambda sums: _core_speed(flow, sums, core))
    lagrange = block_mean(one.core_motion / one.base_speed)
    return {
        "difference": Estimate(euler.value - lagrange.value, combined([euler.half, lagrange.half]), f"{euler.basis}; {lagrange.basis}"),
        "shear": flow.estimate(steepest),
        "core": flow.estimate(lambda sums: float(np.nanmean(flow.profiles(sums)["temperature"][core]))),
        "wall": flow.estimate(lambda sums: float(np.nanmean(flow.profiles(sums)["temperature"][near]))),
    }


def _core_speed(flow: Flow, sums: FieldSums, core: Array) -> float:
    fields = _whole_height(sums).fields()
    momentum, mass = (values[flow.inside, 0, 0][core].sum() for values in (fields.momentum[..., 2], fields.density))
    return float(-momentum / mass / flow.channel.base_speed)


def _dataset(flows: Sequence[Flow]) -> Any:
    first = flows[0]
    channel, grid = first.channel, first.sums[0].grid
    # Windows of different replicas differ a little in height: their maps are brought to the first one's by their place in the window.
    heights = grid.centres(2) - grid.low[2]
    maps = [one.maps() for one in flows]
    spread = np.linspace(0.0, 1.0, len(heights))

    def mean(name: str) -> Array:
        rows = [[np.interp(spread, np.linspace(0.0, 1.0, column.shape[0]), column) for column in one[name]] for one in maps]
        return np.mean(rows, axis=0)

    variables = {name: variable(("x", "z"), mean(name), *texts) for name, texts in _FIELDS.items()}
    profiles = [_profiles(one) for one in flows]
    for name, (units, text) in _FIELDS.items():
        pooled_cells = [pooled([{"value": one} for one in cells], "value") for cells in zip(*(one[name] for one in profiles), strict=True)]
        variables[f"{name}_profile"] = variable(["x"], np.array([one.value for one in pooled_cells]), units, f"{text}, mean over the height")
        variables[f"{name}_profile_half"] = variable(["x"], np.array([one.half for one in pooled_cells]), units, "half-width of its 95 % interval")
    variables["velocity_lagrangian"] = variable(["x"], np.mean([one.lagrangian() for one in flows], axis=0), "1",
                                                "the same from displacements of single grains, smoothed by the same kernel")
    coordinates = {"x": variable(["x"], first.across, "m", "distance from the left wall"),
                   "z": variable(["z"], heights, "m", "height in the window that rests in the laboratory")}
    return labelled(variables, coordinates, kind="channel", kernel="gaussian", width=WIDTH * channel.diameter, channel_width=channel.width,
                    averaged="along y and over the frames of the steady part", frames=sum(len(one.channel.solid) for one in flows),
                    replicas=len(flows), grain_diameter=channel.diameter, base_speed=channel.base_speed)


def _profiles(flow: Flow) -> dict[str, list[Estimate]]:
    """An estimate for each cell across the channel, for every field: jackknife over the time blocks of all cells at once."""
    count, every = len(flow.sums), flow.profiles(reduce(add, flow.sums))
    if count < 4:
        return {name: [Estimate(value, np.inf) for value in values] for name, values in every.items()}
    left_out = [flow.profiles(reduce(add, flow.sums[:number] + flow.sums[number + 1 :])) for number in range(count)]
    basis, factor = f"jackknife over {count} time blocks", student(count - 1) * (np.sqrt(count) if flow.single else 1.0)
    found = {}
    for name, values in every.items():
        # As statistics.jackknife does for one number.
        table = np.array([one[name] for one in left_out])
        error = np.sqrt((count - 1) / count * ((table - table.mean(axis=0)) ** 2).sum(axis=0))
        found[name] = [Estimate(value, factor * half, basis) for value, half in zip(values, error, strict=True)]
    return found
