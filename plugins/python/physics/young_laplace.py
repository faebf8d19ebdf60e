"""Independent reference for capillary bridges: shooting on the ordinary differential equation of Young and Laplace.

A liquid bridge without gravity hangs between two spheres of any sizes, or a sphere and a plane. Its surface has one curvature everywhere,
which is the pressure p inside minus outside over the surface tension. With arc length t along the meridian from the contact line on the
smaller sphere, phi the angle of the meridian against the radius,

    dr/dt = cos(phi),   dz/dt = sin(phi),   dphi/dt = p - sin(phi)/r.

It starts at half-filling angle b on the smaller sphere (curvature c), r = sin(b)/c, phi = pi - b - theta, and ends on the other one
(curvature c'), where sin(phi - theta') = c' r. Liquid and free area are further equations of the system. Unknown are b, the pressure and
the length of the meridian; the conditions are the contact angle at its end, the volume and the gap (or a step along a branch of constant
volume).

A bridge is stable up to the first gap at which the determinant of these conditions is zero. Between unequal spheres that is the largest
gap. Between equal ones it can come before: a branch of asymmetric bridges leaves the symmetric one, and the liquid drains to one side.

It shares nothing with the tables of ``capillary/bridge.hpp``, which use the first integral of these equations: here the axial force is a
result, 2 pi r sin(phi) - pi r^2 p, the same at every r. Slow (about a second for a branch) and meant for tests and error maps.

Lengths are in R = 2 R* = 2 R1 R2 / (R1 + R2) (the radius of equal spheres, 2 R1 against a plane), volumes in R^3, forces in gamma R,
pressures in gamma/R, energies in gamma R^2; angles in rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Floats = NDArray[np.float64]

_STEP = 1e-6  # of the unknowns, for the Jacobian
_LONGEST = 0.25  # step along a branch, in the unknowns


@dataclass(frozen=True)
class Bridge:
    """One bridge. ``force`` is positive when attractive; ``half_filling_angle`` is that of the smaller sphere; ``neck_radius`` the least of
    the meridian; ``energy`` is free area minus cos(theta) times wetted area."""

    force: float
    neck_radius: float
    half_filling_angle: float
    pressure: float
    gap: float
    volume: float
    energy: float


class NoBridge(ValueError):
    """There is no stable bridge of this volume, gap and contact angle."""


@dataclass(frozen=True)
class _Bodies:
    """Contact angles and curvatures, the smaller sphere first. The curvatures add up to 2."""

    angles: tuple[float, float]
    curvatures: tuple[float, float]

    @property
    def equal(self) -> bool:
        return self.angles[0] == self.angles[1] and self.curvatures[0] == self.curvatures[1]


def _rhs(_t: float, y: Floats, length: Floats, pressure: Floats) -> Floats:
    r, _, phi, _, _ = s = y.reshape(5, -1)
    out = np.empty_like(s)
    sine = np.sin(phi)
    out[0] = np.cos(phi)
    out[1] = sine
    out[2] = pressure - sine / r
    out[3] = np.pi * r * r * sine
    out[4] = 2.0 * np.pi * r
    return (out * length).ravel()


@dataclass(frozen=True)
class _Point:
    """Unknowns and results of a bridge, determinant of its conditions on angle, volume and gap, and the direction of constant volume."""

    x: Floats
    out: Floats
    determinant: float
    tangent: Floats

    @property
    def gap(self) -> float:
        return float(self.out[2])


def _neck(_t: float, y: Floats, _length: Floats, _pressure: Floats) -> float:
    return float(y[2] - 0.5 * np.pi)


def _cap(rim: Floats, half_angle: Floats) -> tuple[Floats, Floats, Floats]:
    """Height, volume and area of the cap of a sphere or a plane under a rim."""
    height = rim * np.tan(0.5 * half_angle)
    return height, np.pi * height * (3.0 * rim**2 + height**2) / 6.0, np.pi * (rim**2 + height**2)


def _integrate(unknowns: Floats, bodies: _Bodies, **options: Any) -> tuple[Floats, Any]:
    half_angle, length = bodies.curvatures[0] * np.exp(unknowns[0]), np.exp(unknowns[2])
    if not np.all(half_angle < np.pi):
        raise FloatingPointError("the meridian misses the sphere")
    start = np.zeros((5, length.size))
    start[0] = np.sin(half_angle) / bodies.curvatures[0]
    start[2] = np.pi - half_angle - bodies.angles[0]
    # t runs in lengths of the meridian, so that all columns end together and share the steps: their differences are smooth.
    smallest = float(min(length.min(), start[0].min()))
    return start, solve_ivp(_rhs, (0.0, 1.0), start.ravel(), method="DOP853", rtol=1e-11, atol=1e-13 * smallest,
                            args=(length, unknowns[1] / length), **options)


def _shoot(unknowns: Floats, bodies: _Bodies) -> Floats:
    """Contact angle missed (over the half-filling angle), ln(volume), gap, height of both caps, force, energy, round-off of the force; one
    column each column of ``unknowns`` = (ln(half-filling angle over curvature), pressure times length, ln length)."""
    start, solution = _integrate(unknowns, bodies)
    r, z, phi, volume, area = solution.y[:, -1].reshape(5, -1)
    if not solution.success or not np.all((r > 0.0) & (phi - bodies.angles[1] > -0.5 * np.pi)):
        raise FloatingPointError("the meridian meets the axis")
    pressure = unknowns[1] / np.exp(unknowns[2])
    half_angle, far_angle = bodies.curvatures[0] * np.exp(unknowns[0]), phi - bodies.angles[1]
    (height, filled, wetted), (far_height, far_filled, far_wetted) = _cap(start[0], half_angle), _cap(r, far_angle)
    liquid, caps = volume - filled - far_filled, height + far_height
    if not (np.all(liquid > 0.0) and np.all(z > 0.0)):
        raise FloatingPointError("the spheres fill the bridge")
    force, far_force = (2.0 * np.pi * radius * np.sin(slope) - np.pi * radius**2 * pressure
                        for radius, slope in ((start[0], start[2]), (r, phi)))
    energy = area - np.cos(bodies.angles[0]) * wetted - np.cos(bodies.angles[1]) * far_wetted
    miss = (np.sin(far_angle) - bodies.curvatures[1] * r) / half_angle
    return np.array([miss, np.log(liquid), z - caps, caps, force, energy, far_force - force])


def _newton(guess: Floats, bodies: _Bodies, volume: float, *, gap: float | None = None,
            normal: Floats | None = None) -> _Point:
    """The bridge of a volume, of ``gap`` or in the plane through the guess with ``normal``."""
    x = guess.copy()
    shift = np.hstack([np.zeros((3, 1)), _STEP * np.eye(3)])

    def conditions(out: Floats, at_gap: float) -> Floats:
        return np.array([out[0], out[1] - np.log(volume), np.log(np.maximum(out[3] + out[2], 0.0) / np.maximum(out[3] + at_gap, 1e-300))])

    def residuals(x: Floats, out: Floats) -> Floats:
        f = conditions(out, gap if gap is not None else 0.0)
        if normal is not None:
            f[2] = normal @ (x[:, None] + shift - guess[:, None])
        return f

    def slopes(f: Floats) -> Floats:
        return (f[:, 1:] - f[:, :1]) / _STEP

    out = _shoot(x[:, None] + shift, bodies)
    for _ in range(40):
        f = residuals(x, out)
        size = np.abs(f[:, 0]).max()
        if size < 3e-10:
            break
        step = np.linalg.solve(slopes(f), -f[:, 0])
        for damping in 0.5 ** np.arange(8):
            trial = x + damping * step
            try:
                new = _shoot(trial[:, None] + shift, bodies)
            except FloatingPointError:
                continue
            if np.abs(residuals(trial, new)[:, 0]).max() < size:
                break
        else:
            break
        x, out = trial, new
    if np.abs(residuals(x, out)[:, 0]).max() < 1e-8:
        miss, more, longer = slopes(conditions(out, float(out[2, 0])))
        tangent = np.cross(miss, more)
        return _Point(x, out[:, 0], float(tangent @ longer), tangent / np.linalg.norm(tangent))
    raise NoBridge(f"no bridge found near volume {volume:g}, contact angles {bodies.angles}, gap {gap}")


def _touching(volume: float, bodies: _Bodies) -> _Point:
    """The bridge between touching spheres, from the ring of a small volume on by continuation."""
    start = min(volume, 1e-5)
    beta = (2.0 * start / np.pi) ** 0.25
    span = 0.5 * np.pi - 0.5 * sum(bodies.angles) - beta
    half = 0.5 * beta**2 / np.sinc(span / np.pi)
    point = _newton(np.array([np.log(beta), 2.0 * (half / (beta - 0.5 * span * half) - span), np.log(2.0 * half)]), bodies, start, gap=0.0)
    before = None
    steps = max(int(np.ceil(np.log(volume / start) / 0.7)), 1)
    for v in np.geomspace(start, volume, steps + 1)[1:]:
        x = point.x
        guess = x if before is None else 2.0 * x - before
        before = x
        point = _newton(guess, bodies, v, gap=0.0)
    return point


def _bridge(point: _Point, bodies: _Bodies) -> Bridge:
    x, out = point.x, point.out
    _, solution = _integrate(x[:, None], bodies, events=_neck)
    if abs(out[6]) > 1e-7 * max(abs(out[4]), solution.y[0].min()):
        raise FloatingPointError(f"the axial force changes along the meridian by {out[6]:g}")
    crossings = solution.y_events[0]
    neck = min([float(solution.y[0, 0]), float(solution.y[0, -1]), *(float(y[0]) for y in crossings)])
    return Bridge(force=float(out[4]), neck_radius=neck, half_filling_angle=float(bodies.curvatures[0] * np.exp(x[0])),
                  pressure=float(x[1] / np.exp(x[2])), gap=float(out[2]), volume=float(np.exp(out[1])), energy=float(out[5]))


@lru_cache(maxsize=256)
def _branch(volume: float, bodies: _Bodies) -> tuple[_Point, ...]:
    """Stable branch from touching on; the last one is where it ceases to be stable."""
    points = [_touching(volume, bodies)]
    sense = np.sign(points[0].determinant)
    direction = sense * points[0].tangent  # in which the gap grows
    step, stable = _LONGEST, True
    while stable:
        try:
            point = _newton(points[-1].x + step * direction, bodies, volume, normal=direction)
        except (FloatingPointError, NoBridge):
            point = None
        # Almost equal spheres have a second branch close by, where the tangent has the other sense; equal ones cross it.
        along = 0.0 if point is None else sense * float(point.tangent @ direction)
        if point is None or (abs(along) if bodies.equal else along) < 0.96:
            step *= 0.5
            if step < 1e-6:
                raise NoBridge(f"the branch of volume {volume:g} cannot be followed")
            continue
        points.append(point)
        stable = sense * point.determinant > 0.0 and along > 0.0
        direction = sense * point.tangent
        step = min(_LONGEST, 1.5 * step)
    return (*points[:-1], _end(points[-2], points[-1], bodies, volume))


def _end(left: _Point, right: _Point, bodies: _Bodies, volume: float) -> _Point:
    """The first bridge between two others of a branch at which the determinant is zero."""
    length = float(np.linalg.norm(right.x - left.x))
    normal = (right.x - left.x) / length
    centre = 0.5 * length
    # Where branches cross Newton's method is at a loss: the zero is interpolated from bridges around it, and then from closer ones.
    for half in (0.5 * length, 0.2 * length, 0.02 * length):
        distances = centre + half * np.array([-1.0, -0.5, 0.5, 1.0])
        points = [_newton(left.x + d * normal, bodies, volume, normal=normal) for d in distances]
        roots = np.roots(np.polyfit(distances - centre, [p.determinant for p in points], 3))
        # The first one on the way: near 30 degrees equal spheres have two, close together.
        inside = roots.real[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) <= half)]
        root = inside.min() if inside.size else roots[np.argmin(np.abs(roots))].real
        centre += float(root)
    powers = np.vander((distances - centre) / half, 4)
    x = np.linalg.solve(powers, np.array([p.x for p in points]))[-1]
    return _Point(x, _shoot(x[:, None], bodies)[:, 0], 0.0, normal)


def _bodies(volume: float, contact_angle: float | Sequence[float], ratio: float) -> _Bodies:
    if not 1e-8 <= volume <= 1.0:
        raise ValueError(f"volume = {volume:g} R^3: the reference solver covers 1e-8 to 1")
    if not 0.0 <= ratio <= 1.0:
        raise ValueError(f"ratio = {ratio:g} of the radii must be between 0 (a plane) and 1")
    pair = np.broadcast_to(np.asarray(contact_angle, dtype=float), 2)
    if not (np.all(pair >= 0.0) and np.all(pair <= np.radians(70.0))):
        raise ValueError(f"contact_angle = {contact_angle} rad: the reference solver covers 0 to 70 degrees")
    return _Bodies((float(pair[0]), float(pair[1])), (2.0 / (1.0 + ratio), 2.0 * ratio / (1.0 + ratio)))


def rupture(volume: float, contact_angle: float | Sequence[float], ratio: float = 1.0) -> Bridge:
    """The bridge of the largest gap at which it is stable; arguments as in `bridge`."""
    bodies = _bodies(volume, contact_angle, ratio)
    return _bridge(_branch(float(volume), bodies)[-1], bodies)


def rupture_gap(volume: float, contact_angle: float | Sequence[float], ratio: float = 1.0) -> float:
    """Largest gap, in R, of a bridge; see `rupture`."""
    return rupture(volume, contact_angle, ratio).gap


def bridge(volume: float, gap: float, contact_angle: float | Sequence[float], ratio: float = 1.0) -> Bridge:
    """The stable bridge of ``volume`` (R^3, 1e-8 to 1) over ``gap`` (R, >= 0).

    ``contact_angle`` in rad, 0 to 70 degrees: one, or those of the smaller and the larger sphere. ``ratio`` of the smaller radius to the
    larger, 1 for equal spheres, 0 for a plane.

    Raises NoBridge beyond rupture, ValueError for arguments outside the ranges.
    """
    bodies = _bodies(volume, contact_angle, ratio)
    if not gap >= 0.0:
        raise ValueError(f"gap = {gap:g} R must be >= 0")
    points = _branch(float(volume), bodies)
    if gap > points[-1].gap:
        raise NoBridge(f"gap {gap:g} R is beyond rupture at {points[-1].gap:g} R")
    right = next(i for i, p in enumerate(points) if p.gap >= gap or i == len(points) - 1)
    if right == 0:
        return _bridge(points[0], bodies)
    a, b = points[right - 1], points[right]
    part = (gap - a.gap) / (b.gap - a.gap)
    # The gap is quadratic along the branch where it is largest.
    if right == len(points) - 1 and not bodies.equal:
        part = 1.0 - np.sqrt(max(1.0 - part, 0.0))
    try:
        return _bridge(_newton(a.x + part * (b.x - a.x), bodies, float(volume), gap=float(gap)), bodies)
    except np.linalg.LinAlgError:
        return _bridge(points[-1], bodies)
