"""Fields on a grid from grains and contacts by coarse graining; definitions and sources: docs/theory/fields_theory.md."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark import _fields
from dembark.common.errors import DembarkError
from dembark.common.memory import check_memory
from dembark.postproc.contacts import ContactFrame
from dembark.postproc.fields import sums as column
from dembark.postproc.fields.carried import Contacts, Grains
from dembark.postproc.fields.deposit import Spreader, zeros
from dembark.postproc.fields.grid import Grid, check_periods
from dembark.postproc.fields.kernels import Kernel
from dembark.postproc.fields.sums import FieldSums
from dembark.postproc.grains import GrainFrame

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_IMAGE = 200.0  # bytes of a grain or contact, and of each of its periodic images, while it is spread
_TOUCHING = 1e-6  # gap over the sum of the radii up to which spheres touch: what six digits of a dump leave


@dataclass(frozen=True, eq=False)
class WallContacts:
    """The k contacts of grains with walls: contact `points` (k, 3) on the wall and `positions` (k, 3) of the grains' centres in m,
    `forces` (k, 3) of the wall on the grain in N."""

    points: Array
    positions: Array
    forces: Array


def coarse_grain(
    grains: GrainFrame,
    contacts: ContactFrame | None,
    grid: Grid,
    *,
    kernel: str = "gaussian",
    width: float,
    walls: Sequence[WallContacts] = (),
    mean_velocity: Array | None = None,
    threads: int | None = None,
    closed: bool = False,
    liquid: str = "liquid_volume",
    power: str = "dissipated_power",
    backend: str = "native",
) -> FieldSums:
    """Sums of one frame over the cells of `grid`, with a `kernel` (gaussian, lucy, heaviside) of `width` (m).

    Frames are added (`+`) and give their mean by `.fields()`. What lies beyond the grid is lost; with `closed`, the kernel of a grain
    inside the grid is scaled so that all of it stays within, as is apt where the grid's faces are walls. Periodic images follow the
    box of `grains`, which may be triclinic.

    `mean_velocity` (nx, ny, nz, 3) in m/s, for example of a first pass over all frames: velocity fluctuations are then those about it,
    interpolated to each grain. `liquid` names the column of grains and contacts with volumes of liquid (m3), `power` that of contacts
    with dissipated powers (W); without it the power is that of the contact forces on the relative velocity at the contact. `threads`:
    all cores by default; the result is the same to the last bit for any number. `backend`: "native" (compiled) or "numpy" (slow, the
    same to round-off). DembarkError says what of the input is wrong.
    """
    phi = Kernel(kernel, float(width))
    check_periods(grid, grains)
    check_contacts(contacts, grains)
    _check_room(grid, phi, grains, contacts)
    spreader = Spreader(grid, phi, grains, closed, threads, backend)
    workers = spreader.workers
    _check_finite(grains.wrapped, "positions", grains.step, workers)
    touching, pairs, touches = _linked(grains, contacts, workers) if backend == "native" else _touching(grains, contacts)
    sums = FieldSums(
        grid,
        phi,
        1,
        zeros(grid, column.GRAIN_COLUMNS),
        None if contacts is None else zeros(grid, column.CONTACT_COLUMNS),
        zeros(grid, 3),
        peculiar=mean_velocity is not None,
        liquid=liquid in grains.extra or (contacts is not None and liquid in contacts.extra),
        power=contacts is not None and (power in contacts.extra or grains.has("omegas")),
    )
    _check_finite(grains.velocities, "velocities", grains.step, workers)
    peculiar = grains.velocities if mean_velocity is None else grains.velocities - interpolate(mean_velocity, grid, grains.wrapped)
    spreader.grains(
        Grains(grains.wrapped, grains.masses, grains.radii, grains.velocities, peculiar, touches, grains.extra.get(liquid)), sums.grains
    )
    if contacts is not None and sums.contacts is not None:
        for name in ("first", "branch", "forces"):
            _check_finite(getattr(contacts, name), name, contacts.step, workers)
        omegas = grains.omegas if grains.has("omegas") else None
        spreader.contacts(
            Contacts(
                contacts.first, contacts.branch, contacts.forces, pairs, touching, grains.radii, grains.velocities, omegas,
                contacts.extra.get(liquid), contacts.extra.get(power),
            ),
            sums.contacts,
        )  # fmt: skip
    for wall in walls:
        _add_wall(wall, sums, spreader)
    return sums


def check_contacts(contacts: ContactFrame | None, grains: GrainFrame) -> None:
    """DembarkError when the contacts are of another step, or when the branch of one reaches over half of the box: it is not that of the
    nearest image, for the dump of the contacts does not say that the axis is periodic."""
    if contacts is None or not len(contacts.branch):
        return
    if contacts.step != grains.step:
        raise DembarkError(f"contacts of step {contacts.step} and grains of step {grains.step}", "", "give both of the same step")
    size = np.asarray(grains.high, float) - grains.low
    # Of the numbers without their axes this is known fast.
    if max(contacts.branch.max(), -contacts.branch.min()) <= 0.5 * size.min():
        return
    for axis in np.flatnonzero((np.abs(contacts.branch).max(axis=0) > 0.5 * size * (1.0 + 1e-9)) & (size > 0.0)):
        row = int(np.abs(contacts.branch[:, axis]).argmax())
        length = float(np.linalg.norm(contacts.branch[row]))
        # A box that is not periodic may be no larger than a few grains.
        if grains.periodic[axis] or length > 4.0 * grains.radii.max(initial=0.0):
            one, two = contacts.ids[row]
            raise DembarkError(f"the contact of grains {one} and {two} is {1e3 * length:.4g} mm long, over half of the box along "
                               f"{'xyz'[axis]}", f"step {contacts.step}",
                               "where that is periodic, the dump of contacts must say so (ITEM: BOX BOUNDS pp)")


def _check_room(grid: Grid, kernel: Kernel, grains: GrainFrame, contacts: ContactFrame | None) -> None:
    """DembarkError when the sums, and the copies of the grid or of the grains beyond periodic borders, take more memory than there is."""
    bytes_of = 8.0 * (column.GRAIN_COLUMNS + column.CONTACT_COLUMNS + 3) * grid.cells
    size = np.where(grains.periodic, grains.high - grains.low, np.inf)
    if kernel.name == "gaussian" and not np.any(grains.tilt):
        beyond = np.where(grid.periodic, np.ceil(kernel.reach / grid.spacing), 0.0)
        bytes_of += 8.0 * column.GRAIN_COLUMNS * float(np.prod(grid.shape + 2.0 * beyond)) * bool(beyond.any())
        size = np.where(grid.periodic, np.inf, size)
    images = np.prod(1.0 + np.floor((grid.high - grid.low + 2.0 * kernel.reach) / size))
    bytes_of += _IMAGE * float(images) * max(len(grains.radii), 0 if contacts is None else len(contacts.ids))
    what = f"{' × '.join(map(str, grid.shape))} cells with a kernel of {1e3 * kernel.width:.4g} mm"
    check_memory(bytes_of, what, "take fewer cells or a narrower kernel")


def _add_wall(wall: WallContacts, sums: FieldSums, spreader: Spreader) -> None:
    for name in ("points", "positions", "forces"):
        _check_finite(getattr(wall, name), f"wall {name}", spreader.frame.step, spreader.workers)
    if sums.contacts is not None:
        branch = wall.points - wall.positions
        values = np.zeros((len(branch), column.CONTACT_COLUMNS))
        values[:, column.STRESS] = -(wall.forces[:, :, None] * branch[:, None, :]).reshape(-1, 9)
        spreader.lines(wall.positions, branch, values, sums.contacts)
    spreader.points(wall.points, wall.forces, sums.boundary)


def _linked(grains: GrainFrame, contacts: ContactFrame | None, threads: int) -> tuple[NDArray[np.bool_], Index, Array]:
    """What `_touching` gives, compiled."""
    count = 0 if contacts is None else len(contacts.ids)
    touching, pairs, touches = np.zeros(count, bool), np.zeros((count, 2), np.int64), np.zeros(len(grains.ids))
    if contacts is not None and count:
        wanted = np.ascontiguousarray(contacts.ids, np.int64)
        ids, radii, branch = np.ascontiguousarray(grains.ids, np.int64), _doubles(grains.radii), _doubles(contacts.branch)
        missing = _fields.link(ids, radii, wanted, branch, 1.0 + _TOUCHING, threads, pairs, touching, touches)
        if missing >= 0:
            raise _no_grain(wanted.ravel()[missing], contacts.step)
    return touching, pairs, touches


def _touching(grains: GrainFrame, contacts: ContactFrame | None) -> tuple[NDArray[np.bool_], Index, Array]:
    """Which of m contacts touch (m,), the rows (m, 2) of their grains, and how many of them each of n grains has (n,)."""
    if contacts is None or len(contacts.ids) == 0:
        return np.zeros(0, bool), np.zeros((0, 2), np.int64), np.zeros(len(grains.ids))
    pairs = rows_of(grains.ids, contacts.ids, contacts.step)
    reach = (grains.radii[pairs[:, 0]] + grains.radii[pairs[:, 1]]) * (1.0 + _TOUCHING)
    touching = np.einsum("ij,ij->i", contacts.branch, contacts.branch) <= reach**2
    return touching, pairs, np.bincount(pairs[touching].ravel(), minlength=len(grains.ids)).astype(float)


def rows_of(ids: Index, wanted: Index, step: int) -> Index:
    """Rows of `ids` (n,), rising, at which `wanted` (any shape) stand; DembarkError when one is not there."""
    if len(ids) == 0:
        found, rows = np.zeros(wanted.shape, bool), np.zeros(wanted.shape, np.int64)
    elif ids[-1] - ids[0] < 8 * len(ids) + 1000:
        table = np.zeros(ids[-1] - ids[0] + 1, np.int64)
        table[ids - ids[0]] = np.arange(len(ids))
        rows = np.take(table, wanted - ids[0], mode="clip")
        found = ids[rows] == wanted
    else:
        rows = np.minimum(np.searchsorted(ids, wanted), len(ids) - 1)
        found = ids[rows] == wanted
    if not found.all():
        raise _no_grain(wanted[~found][0], step)
    return rows


def _no_grain(number: int, step: int) -> DembarkError:
    return DembarkError(f"a contact of grain {number}", f"step {step}", "no such grain is in the grains of that step")


def interpolate(field: Array, grid: Grid, places: Array) -> Array:
    """`field` (nx, ny, nz, k) at `places` (n, 3) in m, linear between cell centres, constant beyond the outermost (periodic axes go on).

    NaN of empty cells counts as 0.
    """
    if field.shape[:3] != grid.shape:
        raise DembarkError(f"a mean velocity on {field.shape[:3]} cells", f"the grid has {grid.shape}", "give it on the grid of the fields")
    known = np.nan_to_num(field)
    lower, upper, share = [], [], []
    for axis in range(3):
        at = (places[:, axis] - grid.low[axis]) / grid.spacing[axis] - 0.5
        count = grid.shape[axis]
        if not grid.periodic[axis]:
            at = np.clip(at, 0.0, count - 1)
        below = np.floor(at).astype(int)
        lower.append(below % count)
        upper.append((below + 1) % count if grid.periodic[axis] else np.minimum(below + 1, count - 1))
        share.append((at - below)[:, None])
    result = np.zeros((len(places), field.shape[3]))
    for corner in range(8):
        sides = [(corner >> axis) & 1 for axis in range(3)]
        cell = tuple((upper if side else lower)[axis] for axis, side in enumerate(sides))
        weight = np.ones((len(places), 1))
        for axis, side in enumerate(sides):
            weight = weight * (share[axis] if side else 1.0 - share[axis])
        result += weight * known[cell]
    return result


def _check_finite(values: Array, name: str, step: int, threads: int) -> None:
    if not _fields.finite(_doubles(values), threads):
        raise DembarkError(f"{name} with numbers that are not finite", f"step {step}", "every number must be finite")


def _doubles(values: Array) -> Array:
    return np.ascontiguousarray(values, np.float64)
