"""Coarse-grained fields of a vessel about the z axis, averaged around it: functions of radius and height only.

The fields are those of Gaussian coarse graining in three dimensions (Goldhirsch, Granular Matter 12 (2010) 239, with the lines of wall
contacts of Weinhart et al., Granular Matter 14 (2012) 289), and the average around the axis is taken in closed form: a point at the radius
s carries to the radius r the mean of the Gaussian around the axis, and of its products with the cosine of the angle between the two for
vectors that turn with the angle,

    K_n(r; s) = exp(-(r^2 + s^2) / 2 w^2) I_n(r s / w^2) / (2 pi w^2),    n = 0, 1, 2,

I_n being the modified Bessel functions. Cells are rings; what they hold are integrals of K_n, so mass is conserved to round-off, and the
momentum that flows through the faces of a ring is balanced by its weight and the force of the walls (RingSums.unbalanced).

The integrals are taken from tables, one over the radius and one over the height of a point, that cubic splines go through, to 1e-6. A
spline is a sum of B-splines (de Boor, A Practical Guide to Splines, 1978), of which four do not vanish at a place. So points are summed
first, each on 4 x 4 nodes of both tables, and only these sums are multiplied by the tables.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.sparse import csr_array
from scipy.special import ive, ndtr

from .. import ContactFrame, GrainFrame, spheres
from .coarse_graining import WallContacts

Array = NDArray[np.float64]

REACH = 4.0  # widths beyond the vessel that the rings go on
_POINTS = 3  # of Gauss's rule on a line as long as the width, at least, and within a ring
_BEYOND = 6.0  # widths beyond the layers that sources may lie
_TABLE = 12  # places for each width in the tables of the kernel


@dataclass(frozen=True, eq=False)
class Rings:
    """Rings between the radii `radial` (k + 1,), from 0, and the heights `vertical` (l + 1,), in m, for a kernel of `width` (m) in a vessel
    of `radius` (m) with its base at z = 0.

    The last ring also takes what the kernel carries beyond it, and so do the lowest and the highest.
    """

    radial: Array
    vertical: Array
    width: float
    radius: float

    @classmethod
    def around(cls, radius: float, height: float, width: float, spacing: float) -> Rings:
        """Rings of about `spacing` (m) in a vessel of `radius` with a filling of `height`, both borders of rings; REACH widths around."""
        step, rise = radius / max(1, round(radius / spacing)), height / max(1, round(height / spacing))
        more, further = int(np.ceil(REACH * width / step)), int(np.ceil(REACH * width / rise))
        radial, vertical = np.arange(round(radius / step) + more + 1.0), np.arange(-further, round(height / rise) + further + 1.0)
        return cls(step * radial, rise * vertical, width, radius)

    @property
    def radii(self) -> Array:
        """Middle radii (k,)."""
        return 0.5 * (self.radial[1:] + self.radial[:-1])

    @property
    def heights(self) -> Array:
        """Middle heights (l,)."""
        return 0.5 * (self.vertical[1:] + self.vertical[:-1])

    @cached_property
    def areas(self) -> Array:
        """Areas (k,) in m2 of the rings seen from above."""
        return np.pi * np.diff(self.radial**2)

    @cached_property
    def volumes(self) -> Array:
        """Volumes (k, l) in m3."""
        return self.areas[:, None] * np.diff(self.vertical)

    @cached_property
    def radially(self) -> _Table:
        """Shares (k,) of K_0, K_1 and K_2 in the rings and, at their k + 1 borders, the values of K_1, over the radius of the source."""
        places = self._places(0.0, self.radial[-1])
        node, weight = np.polynomial.legendre.leggauss(_POINTS)
        half = 0.5 * np.diff(self.radial)[:, None]
        points, weights = self.radii[:, None] + half * node, half * weight
        shares = [(self._kernel(order, points, places[:, None, None]) * 2.0 * np.pi * points * weights).sum(axis=2) for order in (0, 1, 2)]
        shares[0][:, -1] += 1.0 - shares[0].sum(axis=1)
        borders = self._kernel(1, self.radial, places[:, None])
        # Beyond the last ring is nothing that it could flow into.
        borders[:, -1] = 0.0
        return _Table(places, np.hstack([*shares, borders]))

    @cached_property
    def upward(self) -> _Table:
        """Values of `along`, side by side, over the height of the source. Beyond the table nothing flows any more."""
        places = self._places(self.vertical[0] - _BEYOND * self.width, self.vertical[-1] + _BEYOND * self.width)
        return _Table(places, np.hstack(self.along(places)))

    def _places(self, low: float, high: float) -> Array:
        return np.linspace(low, high, 4 + int(np.ceil(_TABLE * (high - low) / self.width)))

    def _kernel(self, order: int, radius: Array, source: Array) -> Array:
        scaled = ive(order, radius * source / self.width**2) * np.exp(-0.5 * ((radius - source) / self.width) ** 2)
        return np.asarray(scaled / (2.0 * np.pi * self.width**2))

    @cached_property
    def radial_table(self) -> tuple[Array, Array, Array, Array]:
        """Values of `across` at a source, for each B-spline of the table: (nr, k) three times and (nr, k + 1)."""
        return self._parted(self.radially.coefficients)

    @cached_property
    def vertical_table(self) -> tuple[Array, Array]:
        """The same of `along`: (nz, l) and (nz, l + 1)."""
        count = len(self.heights)
        return self.upward.coefficients[:, :count], self.upward.coefficients[:, count:]

    def across(self, source: Array) -> tuple[Array, Array, Array, Array]:
        """For sources at the radii (m,): shares (m, k) of K_0, K_1, K_2, and values (m, k + 1) of K_1 at the borders in 1/m2."""
        return self._parted(self.radially(source))

    def _parted(self, columns: Array) -> tuple[Array, Array, Array, Array]:
        count = len(self.radii)
        return columns[:, :count], columns[:, count : 2 * count], columns[:, 2 * count : 3 * count], columns[:, 3 * count :]

    def along(self, source: Array) -> tuple[Array, Array]:
        """For sources at the heights (m,): shares (m, l) in the layers, and values (m, l + 1) at their borders in 1/m."""
        distance = (self.vertical - source[:, None]) / self.width
        below, density = ndtr(distance), np.exp(-0.5 * distance**2) / (np.sqrt(2.0 * np.pi) * self.width)
        # The outermost layers hold what lies beyond them, so nothing flows through their outer borders.
        below[:, 0], below[:, -1] = 0.0, 1.0
        density[:, [0, -1]] = 0.0
        return np.diff(below, axis=1), density

    @cached_property
    def above(self) -> Array:
        """Part (l,) of the kernel that lies above the base: 1 far from it, ½ at it."""
        return np.asarray(ndtr(self.heights / self.width))

    @cached_property
    def coverage(self) -> Array:
        """Part (k, l) of the kernel that lies inside the vessel. A field over this is a mean over what the kernel sees inside, free of the
        dimming where it reaches through a wall."""
        node, weight = np.polynomial.legendre.leggauss(200)
        source = 0.5 * self.radius * (node + 1.0)
        inside = (np.pi * self.radius * weight * source) @ self.across(source)[0] / self.areas
        return np.asarray(inside[:, None] * self.above)


class _Table:
    """Functions of a place, c of them, as the cubic splines through their `values` (n, c) at the even `places` (n,) say; beyond these they
    stay what they are at the first and the last."""

    def __init__(self, places: Array, values: Array) -> None:
        spline = make_interp_spline(places, values)
        self._knots, self.coefficients = spline.t, spline.c

    def basis(self, place: Array) -> csr_array:
        """Values of the B-splines at the places (m,), (m, n), four in each row."""
        if not len(place):
            return csr_array((0, len(self.coefficients)))
        return BSpline.design_matrix(np.clip(place, self._knots[0], self._knots[-1]), self._knots, 3)

    def __call__(self, place: Array) -> Array:
        """The functions at the places, (m, c)."""
        return np.asarray(self.basis(place) @ self.coefficients)


@dataclass
class RingSums:
    """Sums over `frames` frames, compression positive; (k, l) unless said otherwise.

    `mass` (kg) and `volume` (m3) of grains; upward forces (N): `net`, of contacts and gravity on grains, and `wall`, of walls; stress
    times volume (J): `zz`, `rr`, `tt`, `zr` (flow of vertical momentum outward), `rz` (flow of radial momentum upward). Flow (N) of
    vertical momentum by contacts: `through_rings` (k + 1, l) outward and `through_layers` (k, l + 1) upward.
    """

    frames: int
    mass: Array
    volume: Array
    net: Array
    wall: Array
    zz: Array
    rr: Array
    tt: Array
    zr: Array
    rz: Array
    through_rings: Array
    through_layers: Array

    def __add__(self, other: RingSums) -> RingSums:
        return RingSums(**{one.name: getattr(self, one.name) + getattr(other, one.name) for one in fields(self)})

    def padded(self, more: tuple[tuple[int, int], tuple[int, int]]) -> RingSums:
        """The same with empty rings and layers before and after, `more` as in numpy.pad."""
        sums: dict[str, Any] = {one.name: np.pad(getattr(self, one.name), more) for one in fields(self) if one.name != "frames"}
        return replace(self, **sums)

    def mean(self, name: str, rings: Rings) -> Array:
        """Mean over frames and volume of the rings (k, l): kg/m3, 1, N/m3 or Pa."""
        return np.asarray(getattr(self, name) / (self.frames * rings.volumes))

    def unbalanced(self, rings: Rings, gravity: float) -> Array:
        """Force density (k, l) in N/m3 of walls less weight and less the flow out through the faces of the rings: 0 at rest."""
        out = np.diff(self.through_rings, axis=0) + np.diff(self.through_layers, axis=1)
        return np.asarray((self.wall - self.mass * gravity - out) / (self.frames * rings.volumes))


@dataclass(frozen=True)
class Zones:
    """Stress zz and rr times volume (zones, sectors, k, 2) in J of one frame, and zz of all rings together (l,)."""

    stress: Array
    column: Array


def coarse_grain(grains: GrainFrame, contacts: ContactFrame, walls: Sequence[WallContacts], rings: Rings, layers: Array,
                 sector_shares: Callable[[Array], Array]) -> tuple[RingSums, Zones]:
    """Fields of one frame.

    `layers` (l, zones): which layers belong to the zones; `sector_shares(places)`: shares (m, sectors) of places (m, 3) in the sectors.
    """
    lines = [(contacts.first, contacts.branch, contacts.forces),
             *((one.positions, one.points - one.positions, one.forces) for one in walls)]
    first, branch, forces = (np.concatenate(parts) for parts in zip(*lines, strict=True))
    place, tensor = _points(first, branch, forces, rings.width)
    # The streaming part is a line of no length: the momentum m v is carried with v.
    streaming = np.einsum("n,na,nb->nab", grains.masses, grains.velocities, grains.velocities)
    lined = _Sources(rings, place, tensor)
    carried = _Sources(rings, grains.positions, streaming)
    touched, pull = np.concatenate([wall.points for wall in walls]), np.concatenate([wall.forces[:, 2] for wall in walls])
    contact, flow = lined.summed(lined.stress), carried.summed(carried.stress)
    mass, volume, net = carried.summed(np.column_stack([grains.masses, spheres.volume(grains.radii), grains.forces[:, 2]]))
    wall, = _Sources(rings, touched).summed(pull[:, None])
    (zero, one, two, border), (layer, level) = rings.radial_table, rings.vertical_table

    def ringed(across: Array, sums: Array, along: Array = layer) -> Array:
        return np.asarray(across.T @ (sums @ along))

    vertical, even, odd, outward, upward = contact + flow
    even_sum, odd_sum = ringed(zero, even), ringed(two, odd)
    found = RingSums(frames=1, mass=ringed(zero, mass), volume=ringed(zero, volume), net=ringed(zero, net), wall=ringed(zero, wall),
                   zz=ringed(zero, vertical), rr=even_sum + odd_sum, tt=even_sum - odd_sum, zr=ringed(one, outward), rz=ringed(one, upward),
                   through_rings=2.0 * np.pi * rings.radial[:, None] * ringed(border, contact[3]),
                   through_layers=ringed(zero, contact[0], level))
    parts = layer @ layers
    return found, Zones(lined.zoned(parts, sector_shares) + carried.zoned(parts, sector_shares), found.zz.sum(axis=0))


class _Sources:
    """Points at `place` (m, 3) that carry stress times volume `tensor` (m, 3, 3) in J."""

    def __init__(self, rings: Rings, place: Array, tensor: Array | None = None) -> None:
        self._rings, self._place = rings, place
        self._across = rings.radially.basis(np.hypot(place[:, 0], place[:, 1]))
        self._along = rings.upward.basis(place[:, 2])
        if tensor is not None:
            self.stress = _around(tensor, place)

    def summed(self, values: Array) -> Array:
        """Sums (q, nr, nz) of `values` (m, q) over the nodes of both tables."""
        (count, nr), nz = self._across.shape, self._along.shape[1]
        share = self._across.data.reshape(count, 4, 1) * self._along.data.reshape(count, 1, 4)
        node = nz * self._across.indices.reshape(count, 4, 1) + self._along.indices.reshape(count, 1, 4)
        spread = csr_array((share.ravel(), node.ravel(), np.arange(0, 16 * count + 1, 16)), shape=(count, nr * nz))
        return np.asarray(spread.T @ values).T.reshape(-1, nr, nz)

    def zoned(self, layers: Array, sector_shares: Callable[[Array], Array]) -> Array:
        """Stress zz and rr times volume (zones, sectors, k, 2) in J; `layers` (nz, zones) as of the table of heights."""
        zones, sectors = self._along @ layers, sector_shares(self._place)
        weights = (zones[:, :, None] * sectors[:, None, :]).reshape(-1, zones.shape[1] * sectors.shape[1])
        zero, _, two, _ = self._rings.radial_table
        zz, even, odd = ((self._across.T @ (weights * one[:, None])).T @ table
                         for one, table in zip(self.stress.T[:3], (zero, zero, two), strict=True))
        return np.stack([zz, even + odd], axis=-1).reshape(zones.shape[1], sectors.shape[1], -1, 2)


def _points(first: Array, branch: Array, forces: Array, width: float) -> tuple[Array, Array]:
    """Places (m, 3) of Gauss's rule on all lines, and there the lines' -f l (m, 3, 3) in J by the weights of the rule."""
    # Each line as finely as its own length requires: one long line must not make many points of all.
    counts = np.maximum(_POINTS, np.rint(_POINTS * np.sqrt((branch**2).sum(axis=1)) / width).astype(int))
    places, tensors = [np.empty((0, 3))], [np.empty((0, 3, 3))]
    for count in np.unique(counts):
        here = counts == count
        node, weight = np.polynomial.legendre.leggauss(count)
        along = first[here, None, :] + 0.5 * (node + 1.0)[:, None] * branch[here, None, :]
        lines = -forces[here, :, None] * branch[here, None, :]
        places.append(along.reshape(-1, 3))
        tensors.append((0.5 * weight[:, None, None] * lines[:, None]).reshape(-1, 3, 3))
    return np.concatenate(places), np.concatenate(tensors)


def _around(tensor: Array, place: Array) -> Array:
    """Of tensors (m, 3, 3), components (m, 5) along the directions outward, around and up at each place: zz, half the sum and half the
    difference of rr and tt, zr and rz."""
    radius = np.hypot(place[:, 0], place[:, 1])
    safe = np.where(radius > 0.0, radius, 1.0)
    cosine, sine = np.where(radius > 0.0, place[:, 0] / safe, 1.0), place[:, 1] / safe
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = tensor.transpose(1, 2, 0)
    difference = 0.5 * (xx - yy) * (cosine**2 - sine**2) + (xy + yx) * cosine * sine
    return np.column_stack([zz, 0.5 * (xx + yy), difference, cosine * zx + sine * zy, cosine * xz + sine * yz])
