"""Fields on a grid from grains and contacts by coarse graining; definitions and sources: docs/theory/fields_theory.md."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark import _fields
from dembark.common.errors import DembarkError
from dembark.common.memory import check_memory
from dembark.common.parallel import cores_here

from ..contacts import ContactFrame
from ..dumps.frames import cell
from ..grains import GrainFrame
from . import accumulators as column
from .accumulators import FieldSums
from .grid import Grid, check_periods
from .kernels import NAMES, Kernel, line_nodes, unit_gauss

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_IMAGE = 200.0  # bytes of a grain or contact, and of each of its periodic images, while it is spread
_MOST_THREADS = 64
_TOUCHING = 1e-6  # gap over the sum of the radii up to which spheres touch
_DIGITS = 6  # of numbers in dumps whose format nobody set


@dataclass(frozen=True, eq=False)
class WallContacts:
    """The k contacts of grains with walls: contact `points` (k, 3) on the wall and `positions` (k, 3) of the grains' centres in m,
    `forces` (k, 3) of the wall on the grain in N."""

    points: Array
    positions: Array
    forces: Array


def coarse_grain(grains: GrainFrame, contacts: ContactFrame | None, grid: Grid, *, kernel: str = "gaussian", width: float,
                 walls: Sequence[WallContacts] = (), mean_velocity: Array | None = None, threads: int | None = None, closed: bool = False,
                 liquid: str = "liquid_volume", power: str = "dissipated_power") -> FieldSums:
    """Sums of one frame over the cells of `grid`, with a `kernel` (gaussian, lucy, heaviside) of `width` (m).

    Frames are added (`+`) and give their mean by `.fields()`. What lies beyond the grid is lost; with `closed`, the kernel of a grain
    inside the grid is scaled so that all of it stays within, as is apt where the grid's faces are walls. Periodic images follow the
    box of `grains`, which may be triclinic.

    `mean_velocity` (nx, ny, nz, 3) in m/s, for example of a first pass over all frames: velocity fluctuations are then those about it,
    interpolated to each grain. `liquid` names the column of grains and contacts with volumes of liquid (m3), `power` that of contacts
    with dissipated powers (W); without it the power is that of the contact forces on the relative velocity at the contact. `threads`:
    all cores by default; the result is the same to the last bit for any number. DembarkError says what of the input is wrong.
    """
    phi = Kernel(kernel, float(width))
    if threads is not None and threads < 1:
        raise DembarkError(f"threads = {threads} is too small", "coarse graining", "give at least 1")
    check_periods(grid, grains)
    check_contacts(contacts, grains)
    _check_room(grid, phi, grains, contacts)
    _check_finite(grains.step, positions=grains.wrapped, velocities=grains.velocities)
    target = _target(grid, phi, grains, closed, threads)
    touching, pairs = _touching(grains, contacts)
    sums = FieldSums(
        grid, phi, 1, _zeros(grid, column.GRAIN_COLUMNS), None if contacts is None else _zeros(grid, column.CONTACT_COLUMNS),
        _zeros(grid, 3), peculiar=mean_velocity is not None,
        liquid=liquid in grains.extra or (contacts is not None and liquid in contacts.extra),
        power=contacts is not None and (power in contacts.extra or grains.has("omegas")))
    # Moments are taken about the middle of the grid, so that the second ones lose few digits.
    target.grains(**_plain(
        places=grains.wrapped, masses=grains.masses, radii=grains.radii, velocities=grains.velocities,
        peculiar=grains.velocities if mean_velocity is None else grains.velocities - interpolate(mean_velocity, grid, grains.wrapped),
        touches=np.bincount(pairs[touching].ravel(), minlength=len(grains.ids)).astype(float), liquid=grains.extra.get(liquid),
        middle=0.5 * (grid.low + grid.high)), out=_rows(sums.grains))
    if contacts is not None and sums.contacts is not None:
        _check_finite(contacts.step, first=contacts.first, branch=contacts.branch, forces=contacts.forces)
        place, weight = line_nodes(phi, _longest(contacts.branch))
        target.contacts(**_plain(
            first=contacts.first, branch=contacts.branch, forces=contacts.forces, pairs=pairs, touching=touching, radii=grains.radii,
            velocities=grains.velocities, omegas=grains.omegas if grains.has("omegas") else None, liquid=contacts.extra.get(liquid),
            power=contacts.extra.get(power), place=place, weight=weight), out=_rows(sums.contacts))
    for wall in walls:
        branch = wall.points - wall.positions
        _check_finite(grains.step, **{"wall points": wall.points, "wall positions": wall.positions, "wall forces": wall.forces})
        if sums.contacts is not None:
            values = np.zeros((len(branch), column.CONTACT_COLUMNS))
            values[:, column.STRESS] = -(wall.forces[:, :, None] * branch[:, None, :]).reshape(-1, 9)
            place, weight = line_nodes(phi, _longest(branch))
            target.lines(**_plain(first=wall.positions, branch=branch, values=values, place=place, weight=weight), out=_rows(sums.contacts))
        place, weight = line_nodes(phi, 0.0)
        target.lines(**_plain(first=wall.points, branch=np.zeros_like(branch), values=wall.forces, place=place, weight=weight),
                     out=_rows(sums.boundary))
    return sums


def _target(grid: Grid, kernel: Kernel, frame: GrainFrame, closed: bool, threads: int | None) -> _fields.Target:
    """What the compiled code spreads onto: all periodic images in the box of `frame` count. With `closed`, the shares of each place inside
    the grid are scaled to sum to 1 within it, and places outside have none; otherwise what lies beyond the grid is lost."""
    places, shares = unit_gauss(kernel.nodes_per_cell(grid))
    cores = cores_here()
    return _fields.Target(
        low=grid.low, high=grid.high, shape=np.array(grid.shape, float), edges=cell(frame.low, frame.high, frame.tilt),
        periodic=np.array(grid.periodic, float), box_periodic=np.array(frame.periodic, float), kind=NAMES.index(kernel.name),
        width=kernel.width, reach=kernel.reach, closed=closed, cell_place=places, cell_weight=shares,
        # More than a few for each core would only wait, and very many cannot be started.
        threads=min(threads or cores, max(_MOST_THREADS, cores)))


def _zeros(grid: Grid, columns: int) -> Array:
    """Zeros (nx, ny, nz, columns), in memory as the compiled code fills them: a row of cells along z for each column."""
    nx, ny, nz = grid.shape
    return np.zeros((nx, ny, columns, nz)).transpose(0, 1, 3, 2)


def _rows(out: Array) -> Array:
    return out.transpose(0, 1, 3, 2)


def _plain(**arrays: NDArray[Any] | None) -> dict[str, Any]:
    """Arrays as the compiled code takes them: contiguous, of 8 bytes or flags."""
    kept = (np.bool_, np.int64)
    return {name: None if one is None else np.ascontiguousarray(one, one.dtype if one.dtype in kept else np.float64)
            for name, one in arrays.items()}


def _longest(branch: Array) -> float:
    return float(np.sqrt(np.einsum("ij,ij->i", branch, branch).max())) if len(branch) else 0.0


def check_contacts(contacts: ContactFrame | None, grains: GrainFrame) -> None:
    """DembarkError when the contacts are of another step, or when the branch of one reaches over half of the box: it is not that of the
    nearest image, for the dump of the contacts does not say that the axis is periodic."""
    if contacts is None or not len(contacts.branch):
        return
    if contacts.step != grains.step:
        raise DembarkError(f"the contacts are of step {contacts.step}, the grains of step {grains.step}", "", "give both of the same step")
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


def _touching(grains: GrainFrame, contacts: ContactFrame | None) -> tuple[NDArray[np.bool_], Index]:
    """Which of m contacts touch (m,), and the rows (m, 2) of their grains."""
    if contacts is None or len(contacts.ids) == 0:
        return np.zeros(0, bool), np.zeros((0, 2), np.int64)
    pairs = rows_of(grains.ids, contacts.ids, contacts.step)
    reach = (grains.radii[pairs[:, 0]] + grains.radii[pairs[:, 1]]) * (1.0 + _TOUCHING) + 2.0 * np.sqrt(3.0) * _rounding(contacts.first)
    return np.einsum("ij,ij->i", contacts.branch, contacts.branch) <= reach**2, pairs


def _rounding(places: Array) -> float:
    """By how much the coordinates of `places` (m, 3) may be rounded, in m, when all have six digits; else 0."""
    sizes = np.abs(places[places != 0.0])
    if not len(sizes):
        return 0.0
    digits = sizes / 10.0 ** (np.floor(np.log10(sizes)) - _DIGITS + 1)
    six = np.abs(digits - np.round(digits)) < 1e-4
    return float(0.5 * 10.0 ** (np.floor(np.log10(sizes.max())) - _DIGITS + 1)) if six.all() else 0.0


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
        raise DembarkError(f"a contact of grain {wanted[~found][0]}", f"step {step}", "no such grain is in the grains of that step")
    return rows


def interpolate(field: Array, grid: Grid, places: Array) -> Array:
    """`field` (nx, ny, nz, k) at `places` (n, 3) in m, linear between cell centres, constant beyond the outermost (periodic axes go on).

    NaN of empty cells counts as 0.
    """
    from scipy.ndimage import map_coordinates
    if field.shape[:3] != grid.shape:
        raise DembarkError(f"the mean velocity is on {field.shape[:3]} cells", f"the grid has {grid.shape}",
                           "give it on the grid of the fields")
    known = np.pad(np.nan_to_num(field), [*((int(flag),) * 2 for flag in grid.periodic), (0, 0)], mode="wrap")
    at = (places - grid.low) / grid.spacing - 0.5
    at = np.where(grid.periodic, at % grid.shape + 1.0, at).T
    return np.stack([map_coordinates(component, at, order=1, mode="nearest") for component in np.moveaxis(known, -1, 0)], axis=-1)


def _check_finite(step: int, **arrays: Array) -> None:
    for name, values in arrays.items():
        if not np.isfinite(values).all():
            raise DembarkError(f"{name} with numbers that are not finite", f"step {step}", "every number must be finite")
