"""Independent reference for capillary bridges: shooting on the ordinary differential equation of Young and Laplace.

A liquid bridge without gravity hangs between two equal spheres (radius 1). Its surface has one curvature everywhere, which is the
pressure p inside minus outside over the surface tension. With arc length t from the neck along the meridian, phi the angle of the
meridian against the radius,

    dr/dt = cos(phi),   dz/dt = sin(phi),   dphi/dt = p - sin(phi)/r,

phi = pi/2 at the neck; at the contact line, on the sphere at half-filling angle beta, r = sin(beta) and phi = beta + theta. Half the
liquid, half the free area are further equations of the system. Unknown are the neck radius, the pressure and the arc length up to the
contact line; the conditions are the contact angle, the volume and the gap (or the neck radius, where a branch is followed).

It shares nothing with the tables of ``capillary/bridge.hpp``, which use the first integral of these equations: here the axial force is a
result, 2 pi r sin(phi) - pi r^2 p, the same at every r. Slow (about 0.5 s for a branch) and meant for tests and error maps.

Lengths are in R, volumes in R^3, forces in gamma R, pressures in gamma/R, energies in gamma R^2; angles in rad.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

_STEP = 1e-6  # of the unknowns, for the Jacobian
_NECK_STEP = 0.12  # of ln(neck radius), along a branch


@dataclass(frozen=True)
class Bridge:
    """One bridge. ``force`` is positive when attractive; ``energy`` is free area minus cos(theta) times wetted area."""

    force: float
    neck_radius: float
    half_filling_angle: float
    pressure: float
    gap: float
    volume: float
    energy: float


class NoBridge(ValueError):
    """There is no stable bridge of this volume, gap and contact angle."""


def _rhs(_t: float, y: NDArray, length: NDArray, pressure: NDArray) -> NDArray:
    r, _, phi, _, _ = s = y.reshape(5, -1)
    out = np.empty_like(s)
    sine = np.sin(phi)
    out[0] = np.cos(phi)
    out[1] = sine
    out[2] = pressure - sine / r
    out[3] = np.pi * r * r * sine
    out[4] = 2.0 * np.pi * r
    return (out * length).ravel()


def _shoot(unknowns: NDArray, theta: float) -> NDArray:
    """Contact angle missed (over beta), ln(volume), gap, beta, force, energy, round-off of the force; one column each column of
    ``unknowns`` = (ln neck radius, pressure times length, ln length)."""
    neck, length = np.exp(unknowns[0]), np.exp(unknowns[2])
    pressure = unknowns[1] / length
    start = np.zeros((5, neck.size))
    start[0] = neck
    start[2] = 0.5 * np.pi
    # t runs in lengths of the meridian, so that all columns end together and share the steps: their differences are smooth.
    solution = solve_ivp(_rhs, (0.0, 1.0), start.ravel(), method="DOP853", rtol=1e-11, atol=1e-13 * float(min(length.min(), neck.min())),
                         args=(length, pressure))
    r, z, phi, volume, area = solution.y[:, -1].reshape(5, -1)
    if not solution.success or not np.all((r > 0.0) & (r < 1.0)):
        raise FloatingPointError("the meridian misses the sphere")
    beta = np.arcsin(r)
    cap = 2.0 * np.sin(0.5 * beta) ** 2
    liquid = 2.0 * (volume - np.pi * cap**2 * (3.0 - cap) / 3.0)
    if not np.all(liquid > 0.0):
        raise FloatingPointError("the spheres fill the bridge")
    force = 2.0 * np.pi * neck - np.pi * neck**2 * pressure
    at_contact = 2.0 * np.pi * r * np.sin(phi) - np.pi * r**2 * pressure
    energy = 2.0 * area - 4.0 * np.pi * np.cos(theta) * cap
    return np.array([(phi - theta) / beta - 1.0, np.log(liquid), 2.0 * (z - cap), beta, force, energy, at_contact - force])


def _newton(guess: NDArray, theta: float, volume: float, *, gap: float | None = None) -> tuple[NDArray, NDArray]:
    """Unknowns and results for the contact angle, the volume and either the gap or the neck radius of the guess."""
    x = guess.copy()
    columns = 4 if gap is not None else 3
    shift = np.zeros((3, columns))
    for column, row in enumerate((1, 2, 0)[: columns - 1], start=1):
        shift[row, column] = _STEP
    free = [1, 2, 0][: columns - 1]

    def residuals(out: NDArray) -> NDArray:
        height = 2.0 * (1.0 - np.cos(out[3]))
        rows = [out[0], out[1] - np.log(volume)]
        if gap is not None:
            rows.append(np.log((height + out[2]) / (height + gap)))
        return np.array(rows)

    out = _shoot(x[:, None] + shift, theta)
    for _ in range(40):
        f = residuals(out)
        size = np.abs(f[:, 0]).max()
        if size < 3e-10:
            return x, out[:, 0]
        step = np.linalg.solve((f[:, 1:] - f[:, :1]) / _STEP, -f[:, 0])
        for damping in 0.5 ** np.arange(8):
            trial = x.copy()
            trial[free] += damping * step
            try:
                new = _shoot(trial[:, None] + shift, theta)
            except FloatingPointError:
                continue
            if np.abs(residuals(new)[:, 0]).max() < size:
                break
        else:
            break
        x, out = trial, new
    if np.abs(residuals(out)[:, 0]).max() < 1e-8:
        return x, out[:, 0]
    raise NoBridge(f"no bridge found near volume {volume:g}, contact angle {theta:g}, gap {gap}")


def _touching(volume: float, theta: float) -> tuple[NDArray, NDArray]:
    """The bridge between touching spheres, from the ring of a small volume on by continuation."""
    start = min(volume, 1e-5)
    beta = (2.0 * start / np.pi) ** 0.25
    span = 0.5 * np.pi - theta - beta
    length = 0.5 * beta**2 / np.sinc(span / np.pi)
    neck = beta - 0.5 * span * length
    x, out = _newton(np.array([np.log(neck), length / neck - span, np.log(length)]), theta, start, gap=0.0)
    before = None
    steps = max(int(np.ceil(np.log(volume / start) / 0.7)), 1)
    for v in np.geomspace(start, volume, steps + 1)[1:]:
        guess = x if before is None else 2.0 * x - before
        before = x
        x, out = _newton(guess, theta, v, gap=0.0)
    return x, out


def _bridge(x: NDArray, out: NDArray) -> Bridge:
    if abs(out[6]) > 1e-7 * max(abs(out[4]), np.exp(x[0])):
        raise FloatingPointError(f"the axial force changes along the meridian by {out[6]:g}")
    return Bridge(force=float(out[4]), neck_radius=float(np.exp(x[0])), half_filling_angle=float(out[3]),
                  pressure=float(x[1] / np.exp(x[2])), gap=float(out[2]), volume=float(np.exp(out[1])), energy=float(out[5]))


@lru_cache(maxsize=256)
def _branch(volume: float, theta: float) -> tuple[tuple[NDArray, NDArray], ...]:
    """Stable branch from touching to rupture, neck by neck; the last one is at rupture."""
    points = [_touching(volume, theta)]
    while True:
        last = points[-1][0]
        guess = 2.0 * last - points[-2][0] if len(points) > 1 else last.copy()
        guess[0] = last[0] - _NECK_STEP
        points.append(_newton(guess, theta, volume))
        if points[-1][1][2] < points[-2][1][2]:
            break

    left, middle, right = points[-3:] if len(points) > 2 else (points[0], points[0], points[1])

    def at(log_neck: float) -> tuple[NDArray, NDArray]:
        part = (log_neck - middle[0][0]) / (right[0][0] - middle[0][0])
        guess = middle[0] + part * (right[0] - middle[0])
        guess[0] = log_neck
        return _newton(guess, theta, volume)

    def slope(log_neck: float) -> float:
        return at(log_neck + 1e-4)[1][2] - at(log_neck - 1e-4)[1][2]

    fold = at(brentq(slope, right[0][0], left[0][0], xtol=1e-8))
    return (*(p for p in points if p[0][0] > fold[0][0]), fold)


def _check(volume: float, contact_angle: float) -> None:
    if not 1e-8 <= volume <= 1.0:
        raise ValueError(f"volume = {volume:g} R^3: the reference solver covers 1e-8 to 1")
    if not 0.0 <= contact_angle <= np.radians(70.0):
        raise ValueError(f"contact_angle = {contact_angle:g} rad: the reference solver covers 0 to 70 degrees")


def rupture(volume: float, contact_angle: float) -> Bridge:
    """The bridge of the largest gap: there the stable and the unstable branch meet. ``volume`` in R^3, 1e-8 to 1."""
    _check(volume, contact_angle)
    return _bridge(*_branch(float(volume), float(contact_angle))[-1])


def rupture_gap(volume: float, contact_angle: float) -> float:
    """Largest gap, in R, of a bridge of ``volume`` (R^3); see `rupture`."""
    return rupture(volume, contact_angle).gap


def bridge(volume: float, gap: float, contact_angle: float) -> Bridge:
    """The stable bridge of ``volume`` (R^3, 1e-8 to 1), ``gap`` (R, >= 0) and ``contact_angle`` (rad, 0 to 70 degrees).

    Raises NoBridge beyond rupture, ValueError for arguments outside the ranges.
    """
    _check(volume, contact_angle)
    if not gap >= 0.0:
        raise ValueError(f"gap = {gap:g} R must be >= 0")
    points = _branch(float(volume), float(contact_angle))
    if gap > points[-1][1][2]:
        raise NoBridge(f"gap {gap:g} R is beyond rupture at {points[-1][1][2]:g} R")
    right = next(i for i, p in enumerate(points) if p[1][2] >= gap or i == len(points) - 1)
    if right == 0:
        return _bridge(*points[0])
    (xa, oa), (xb, ob) = points[right - 1], points[right]
    # The gap is quadratic in the neck radius at rupture.
    part = (gap - oa[2]) / (ob[2] - oa[2])
    if right == len(points) - 1:
        part = 1.0 - np.sqrt(max(1.0 - part, 0.0))
    try:
        return _bridge(*_newton(xa + part * (xb - xa), float(contact_angle), float(volume), gap=float(gap)))
    except np.linalg.LinAlgError:
        return _bridge(*points[-1])
