"""Grains on a plate whose motion is known: forces of Hertz's contact, where the plate must be, and when a grain that bounces lands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dembark.postproc.measurement import Array


@dataclass(frozen=True)
class Contact:
    """A sphere of `radius` (m) and `mass` (kg) on a plane; `modulus` is the effective one E* (Pa), `restitution` the coefficient of
    restitution."""

    radius: float
    mass: float
    modulus: float
    restitution: float

    def force(self, overlap: Array, approach: Array) -> Array:
        """N, (n,): 4/3 E* sqrt(R) overlap^(3/2) and the damping for the speed `approach` (m/s, > 0 when it grows), after Tsuji et al.,
        Powder Technology 71 (1992) 239, with S = 2 E* sqrt(R overlap); 0 without overlap."""
        inside = np.maximum(overlap, 0.0)
        log_e = math.log(self.restitution)
        beta = -log_e / math.hypot(log_e, math.pi)
        stiffness = 2.0 * self.modulus * np.sqrt(self.radius * inside)
        return np.asarray(2.0 / 3.0 * stiffness * inside + 2.0 * math.sqrt(5.0 / 6.0) * beta * np.sqrt(stiffness * self.mass) * approach)

    def overlap(self, force: Array) -> Array:
        """m, (n,): of an elastic contact with this `force` (N)."""
        return np.asarray((np.maximum(force, 0.0) / (4.0 / 3.0 * self.modulus * math.sqrt(self.radius))) ** (2.0 / 3.0))

    def duration(self, speed: float) -> float:
        """s, of an elastic impact at `speed` (m/s): 2.87 (m² / (R E*² v))^(1/5), K. L. Johnson, Contact Mechanics (1985) section 11.4."""
        return float(2.87 * (self.mass**2 / (self.radius * self.modulus**2 * speed)) ** 0.2)


def turned(places: Array, times: Array, rate: float, along: Array) -> tuple[Array, Array]:
    """Heights (times, n) in m of `places` (n, 3) over a plate, the plane z = 0 at the time 0, which turns about y with `rate` (rad/s) while
    the point of the axis that was the origin moves with the velocity `along` (3,) in m/s; and the speeds (times, n) in m/s with which the
    plate comes up to these places along its normal: n · (v + ω × r)."""
    angle = rate * times
    normal = np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    arm = places[None] - times[:, None, None] * along
    height = np.einsum("ta,tna->tn", normal, arm)
    # (0, w, 0) x r = w (r_z, 0, -r_x)
    speed = along + rate * np.stack([arm[..., 2], 0.0 * arm[..., 0], -arm[..., 0]], axis=-1)
    return height, np.einsum("ta,tna->tn", normal, speed)


def landings(count: int, place: Callable[[float], float], velocity: Callable[[float], float], gap: float, gravity: float,
             contact: Contact) -> list[tuple[float, float]]:
    """Times (s) at which a point that falls from rest, `gap` (m) above a plate at `place(t)` (m) with `velocity(t)` (m/s), meets it, and
    the speeds (m/s) with which. It goes with the plate for as long as an elastic contact lasts, and leaves it with the restitution."""
    found: list[tuple[float, float]] = []
    since, height, speed = 0.0, place(0.0) + gap, 0.0

    def above(t: float) -> float:
        return height + speed * (t - since) - 0.5 * gravity * (t - since) ** 2 - place(t)

    for _ in range(count):
        high = since + 1e-5
        while above(high) > 0.0:
            high += 1e-5
        low = high - 1e-5
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if above(middle) > 0.0 else (low, middle)
        hits = velocity(high) - speed + gravity * (high - since)
        found.append((high, hits))
        since = high + contact.duration(hits)
        height, speed = place(since), velocity(since) + contact.restitution * hits
    return found


def touched(times: Array, force: Array) -> Array:
    """s: times at which `force` (n,) becomes positive."""
    begins = (force[1:] > 0.0) & ~(force[:-1] > 0.0)
    return times[1:][begins]
