"""The pressure of the fluid at a point of a wall, and what is read from its trace."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.history import reached
from dembark.postproc.measurement import Array

Flags = NDArray[np.bool_]
# Before this time (s) nothing is wet: pressures measured then are the offset of their sensors.
DRY = 0.2


# Points of a lattice along one spacing, where the space around a sensor is summed.
FINE = 4


def kernel(distances: Array, h: float) -> Array:
    """Wendland's kernel C2 over its value at 0, at `distances` (m, n) with the smoothing length `h` (m)."""
    q = distances / h
    return np.asarray(np.where(q < 2.0, (1.0 - 0.5 * q) ** 4 * (2.0 * q + 1.0), 0.0))


def full(point: Sequence[float], h: float, spacing: float, solid: Callable[[Array], Flags]) -> float:
    """The sum of the kernel around the `point` (m) over particles of that `spacing` (m), if water filled all space that is not `solid`, of
    places (n, 3)."""
    fine = spacing / FINE
    axis = fine * (np.arange(-math.ceil(2.0 * h / fine), math.ceil(2.0 * h / fine)) + 0.5)
    # Its layers end on the floor.
    upward = axis + fine * round(point[2] / fine) - point[2]
    around = np.stack([part.ravel() for part in np.meshgrid(axis, axis, upward, indexing="ij")], axis=1)
    weights = kernel(np.linalg.norm(around, axis=1), h)
    return float(weights[~solid(np.asarray(point) + around)].sum()) / FINE**3


def pressure_at(point: Sequence[float], places: Array, pressures: Array, h: float, weight: float, room: float) -> float:
    """Pressure (Pa) of the fluid at the `point` (m) of a wall, of its particles at `places` (n, 3), with their `pressures` (Pa, n), the
    smoothing length `h` (m) and the `weight` ρ g (N/m³): Σ (p + ρ g·(x - x_f)) W / Σ W, as a particle of the wall there would have it
    (Adami, Hu & Adams 2012, eq. 27). Where water is sparser than `room`, the sum of W over space that is full of it, its force on an area
    of the wall is less in proportion: then Σ W is `room`. Not below 0."""
    w = kernel(np.linalg.norm(places - np.asarray(point), axis=1), h)
    if not w.any():
        return 0.0
    return max(0.0, float(w @ (pressures - weight * (point[2] - places[:, 2])) / max(w.sum(), room)))


def baseline(times: Array, trace: Array) -> float:
    """The median of a `trace` (n,) before any water arrives, a quarter of a second at dam break's first."""
    return float(np.median(trace[times < DRY]))


def smoothed(times: Array, trace: Array, length: float) -> Array:
    """The mean (n,) of a `trace` (n,) on straight lines between `times` (n,) over `length` around each time; shorter at both ends."""
    summed = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(times) * (trace[1:] + trace[:-1]))])
    low, high = np.clip(times - 0.5 * length, times[0], times[-1]), np.clip(times + 0.5 * length, times[0], times[-1])
    # The integral of straight lines is a parabola between two times: its ends are not on those of the sum.
    return np.asarray((_integral(times, trace, summed, high) - _integral(times, trace, summed, low)) / (high - low))


def _integral(times: Array, trace: Array, summed: Array, at: Array) -> Array:
    """Of the `trace` up to the times `at` (n,), from its integrals `summed` up to `times`."""
    k = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    part = at - times[k]
    slope = (trace[k + 1] - trace[k]) / (times[k + 1] - times[k])
    return np.asarray(summed[k] + part * (trace[k] + 0.5 * slope * part))


def marks(times: Array, trace: Array, window: tuple[float, float]) -> tuple[float, float, float]:
    """Arrival, peak and impulse of a pressure `trace` (n,) at `times` (n,): when it first gets to a quarter of its peak, its largest value,
    and its integral over the `window`, NaN where the trace ends before it."""
    peak = float(trace.max())
    edges = np.array(window)
    inside = (times > edges[0]) & (times < edges[1])
    t, p = np.concatenate([edges[:1], times[inside], edges[1:]]), np.interp(edges, times, trace)
    impulse = float(np.trapezoid(np.concatenate([p[:1], trace[inside], p[1:]]), t)) if times[-1] >= edges[1] else math.nan
    return reached(times, trace, 0.25 * peak) if peak > 0.0 else math.nan, peak, impulse
