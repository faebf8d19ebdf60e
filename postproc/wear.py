"""Wear of a ductile surface by single impacts: I. Finnie, Erosion of surfaces by solid particles, Wear 3 (1960) 87.

A grain of mass m that arrives with the speed v at the angle a from the surface cuts it like a tool. The surface presses against it with
the flow pressure p; the ratio of the normal to the tangential force, K, and that of the height of the contact to the depth of the cut, psi,
are constant. The grain has no spin before, and turns freely about its centre, with the inertia m r^2 / 2 and the edge at the distance r. It
ends cutting when its edge leaves the surface (flat angles) or stops (steep ones), and has then removed the volume

    m v^2 / (psi K p) (sin 2a - 6 / K sin^2 a) for tan a <= K / 6,   m v^2 / (psi K p) K / 6 cos^2 a for steeper ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

# As Finnie took them: K, and psi.
FORCE_RATIO, CONTACT_RATIO = 2.0, 2.0


def angle_function(angle: ArrayLike, force_ratio: float = FORCE_RATIO) -> NDArray[np.float64]:
    """Volume removed over m v^2 / (psi K p) at the `angle` (rad, 0 to pi/2) between path and surface; K is the `force_ratio`."""
    a = np.asarray(angle, float)
    if not ((a >= 0.0) & (a <= 0.5 * np.pi)).all():
        raise ValueError("angle must be from 0 to pi/2 rad")
    sine, cosine = np.sin(a), np.cos(a)
    flat = 6.0 * sine <= force_ratio * cosine
    return np.where(flat, 2.0 * sine * cosine - 6.0 / force_ratio * sine**2, force_ratio / 6.0 * cosine**2)


def removed_volume(mass: ArrayLike, speed: ArrayLike, angle: ArrayLike, flow_pressure: float, *, force_ratio: float = FORCE_RATIO,
                   contact_ratio: float = CONTACT_RATIO) -> NDArray[np.float64]:
    """Volume (m^3) that impacts of grains with `mass` (kg) and `speed` (m/s) at the `angle` (rad) from the surface remove from a material
    with the `flow_pressure` (Pa); arrays broadcast. ValueError for an angle out of range or a pressure that is not positive."""
    if not flow_pressure > 0.0:
        raise ValueError(f"flow_pressure must be > 0 Pa, not {flow_pressure:g}")
    scale = np.asarray(mass, float) * np.asarray(speed, float) ** 2 / (contact_ratio * force_ratio * flow_pressure)
    return np.asarray(scale * angle_function(angle, force_ratio))
