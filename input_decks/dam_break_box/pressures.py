"""The pressure of the fluid at a point of a wall, and what is read from its trace."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dembark.postproc.history import reached
from dembark.postproc.measurement import Array

# Before this time (s) nothing is wet: pressures measured then are the offset of their sensors.
DRY = 0.2


def pressure_at(point: Sequence[float], places: Array, pressures: Array, h: float, weight: float) -> float:
    """Pressure (Pa) of the fluid at the `point` (m) of a wall, of its particles at `places` (n, 3), with their `pressures` (Pa, n), the
    smoothing length `h` (m) and the `weight` ρ g (N/m³): what a wall's particle there would have (Adami, Hu & Adams 2012, eq. 27),
    Σ (p + ρ g·(x - x_f)) W / Σ W with Wendland's kernel C2. 0 where no particle is nearer than 2 h, and not below."""
    q = np.linalg.norm(places - np.asarray(point), axis=1) / h
    kernel = np.where(q < 2.0, (1.0 - 0.5 * q) ** 4 * (2.0 * q + 1.0), 0.0)
    if not kernel.any():
        return 0.0
    return max(0.0, float(kernel @ (pressures - weight * (point[2] - places[:, 2])) / kernel.sum()))


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
    and its integral over the `window`, which ends with the trace if that is shorter."""
    peak = float(trace.max())
    edges = np.array(window)
    inside = (times > edges[0]) & (times < edges[1])
    t, p = np.concatenate([edges[:1], times[inside], edges[1:]]), np.interp(edges, times, trace)
    impulse = float(np.trapezoid(np.concatenate([p[:1], trace[inside], p[1:]]), t))
    return reached(times, trace, 0.25 * peak) if peak > 0.0 else math.nan, peak, impulse
