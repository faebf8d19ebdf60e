"""A U-shaped trough in the plane y = 0, and grains that rain into it."""

import math
from itertools import pairwise
from types import SimpleNamespace as Parameters

import numpy as np
from numpy.typing import NDArray

from . import packing
from .setup import Array, rectangle


def trough(width: float, side: float, strips: int, depth: float) -> Array:
    """Triangles (n, 3, 3) in m: a round bottom about the y axis of `strips` planes, whose edges lie on a circle of `width` (m), and upright
    sides from there to z = `side` (m); -`depth`/2 < y < `depth`/2. Normals point inwards."""
    angles = np.linspace(math.pi, 2.0 * math.pi, strips + 1)
    rim = 0.5 * width * np.column_stack([np.cos(angles), np.sin(angles)])
    line = np.vstack([[-0.5 * width, side], rim, [0.5 * width, side]])
    return np.vstack([rectangle((a[0], -0.5 * depth, a[1]), (0.0, depth, 0.0), (b[0] - a[0], 0.0, b[1] - a[1]))
                      for a, b in pairwise(line)])


def sites(p: Parameters, clear: tuple[float, float, float] | None = None) -> tuple[Array, float]:
    """Sites (n, 3) in m of a dilute bed in the trough, the lowest first, and the height (m) of its top; `clear`: (x, z, radius) in m of a
    disc that stays free."""
    d_max = packing.largest(p)
    spacing, radius = 1.15 * d_max, 0.5 * p.trough_width
    # A strip's middle is nearer to the axis than its edges.
    inner = radius * math.cos(0.5 * math.pi / p.strips) - 0.65 * d_max
    columns = 2 * int(inner / spacing) + 1
    rows = math.ceil(2.0 * p.grain_count / columns) + columns
    x = spacing * (np.arange(columns) - columns // 2)
    z = -inner + spacing * np.arange(rows)
    height, across = (axis.ravel() for axis in np.meshgrid(z, x, indexing="ij"))
    inside = np.hypot(across, np.minimum(height, 0.0)) <= 1.000001 * inner
    if clear is not None:
        inside &= np.hypot(across - clear[0], height - clear[1]) >= clear[2] + 0.65 * d_max
    found = np.column_stack([across[inside], np.zeros(inside.sum()), height[inside]])[: math.ceil(1.15 * p.grain_count)]
    return found, float(found[-1, 2] + spacing)


def sites_within(p: Parameters, lines: Array, clear: tuple[float, float, float]) -> Array:
    """Sites (n, 3) in m, the lowest first, of a dilute bed in a trough of any shape, whose section are `lines` (k, 2, 2) in m: those that
    have a line to the left, to the right and below, and 0.65 d_max of room; `clear`: (x, z, radius) in m of a disc that stays free."""
    d_max = packing.largest(p)
    spacing, room = 1.15 * d_max, 0.65 * d_max
    low, high = lines.min(axis=(0, 1)), lines.max(axis=(0, 1))
    axes = (np.arange(a + room, b, spacing) for a, b in zip(low, high, strict=True))
    x, z = (axis.ravel() for axis in np.meshgrid(*axes, indexing="xy"))
    places = np.column_stack([x, z])
    start, along = lines[:, 0], lines[:, 1] - lines[:, 0]
    share = np.einsum("nka,ka->nk", places[:, None] - start, along) / np.maximum((along**2).sum(axis=1), 1e-300)
    gap = np.linalg.norm(places[:, None] - start - np.clip(share, 0.0, 1.0)[..., None] * along, axis=2).min(axis=1)

    def met(axis: int, sign: int) -> NDArray[np.bool_]:
        """Whether a ray from each place along an axis hits a line; `sign`: its direction."""
        other = 1 - axis
        crossed = (lines[:, 0, other] > places[:, None, other]) != (lines[:, 1, other] > places[:, None, other])
        with np.errstate(divide="ignore", invalid="ignore"):
            at = start[:, axis] + along[:, axis] * (places[:, None, other] - start[:, other]) / along[:, other]
            return np.asarray((crossed & (sign * (at - places[:, None, axis]) > 0.0)).any(axis=1))

    inside = met(0, -1) & met(0, 1) & met(1, -1) & (gap >= room)
    inside &= np.hypot(x - clear[0], z - clear[1]) >= clear[2] + room
    return np.column_stack([x[inside], np.zeros(inside.sum()), z[inside]])[: math.ceil(1.15 * p.grain_count)]


def polygon(diameter: float, corners: int, centre: tuple[float, float]) -> Array:
    """Corners (n, 2) in m of a regular polygon on a circle of `diameter` (m) about the `centre` in the plane of x and z."""
    angles = 2.0 * math.pi * (np.arange(corners) + 0.5) / corners
    return np.asarray(centre) + 0.5 * diameter * np.column_stack([np.cos(angles), np.sin(angles)])


def prism(corners: Array, depth: float) -> Array:
    """Triangles (n, 3, 3) in m of the sides of a prism with the cross-section `corners` (k, 2) in the plane of x and z, -`depth`/2 < y <
    `depth`/2; it is open at both ends, where nothing gets to."""
    return np.vstack([rectangle((a[0], -0.5 * depth, a[1]), (b[0] - a[0], 0.0, b[1] - a[1]), (0.0, depth, 0.0))
                      for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
