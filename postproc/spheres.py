"""Volumes of spheres cut by parallel planes, exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def volume_below(height: Array, radius: Array) -> Array:
    """Volume (m3) of spheres of `radius` (m) below a plane `height` (m) above their centres; broadcasts.

    Spherical cap, V = pi (r + h)^2 (2r - h) / 3 for -r <= h <= r, continued by 0 and the volume of the sphere.
    """
    inside = np.clip(height, -radius, radius)
    return np.pi / 3.0 * (radius + inside) ** 2 * (2.0 * radius - inside)


def slice_volumes(centres: Array, radii: Array, edges: Array) -> Array:
    """Volumes (m3) of n spheres between the k + 1 rising planes `edges` (m); `centres` (m), `radii` (m) are (n,); returns (n, k)."""
    return np.diff(volume_below(edges[None, :] - centres[:, None], radii[:, None]), axis=1)


def volume(radii: Array) -> Array:
    """Volumes (m3) of spheres."""
    return 4.0 / 3.0 * np.pi * radii**3
