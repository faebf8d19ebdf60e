"""A block on a plate that shakes obliquely: it sticks, slides, flies and lands, from event to event.

Phases are those of the drive, lengths in g / w^2, speeds in g / w. The plate is at x = G c sin(phase), z = G sin(phase): G, the throw
number, is its largest vertical acceleration over g, c the cotangent of the angle between its path and the horizontal. Friction is
Coulomb's. A landing with the speed u throws the block up with e u and takes mu (1 + e) u off its slip, at most all of it. Between two
events the motion is in closed form; an event is the first root of a function of the phase.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

from scipy.optimize import brentq

from dembark.common.errors import DembarkError

TURN = 2.0 * math.pi
PIECE = TURN / 500.0  # in which functions are searched for roots
REST = 1e-9  # speed relative to the plate that is none
WINDOW = 20  # periods of a mean
MOST = 100_000  # events in a period


@dataclass(frozen=True)
class Conveyed:
    """Mean `speed` in g / w; `flight`, the share of the time without contact; `spread`, the largest difference (g / w) of its means over
    WINDOW periods, 0 of a motion that repeats."""

    speed: float
    flight: float
    spread: float


def first_root(function: Callable[[float], float], start: float, end: float, piece: float = PIECE) -> float:
    """Where a function that is not negative after `start` becomes so, or `end`."""
    before = start
    while before < end:
        after = min(before + piece, end)
        if function(after) < 0.0:
            return float(brentq(function, before, after, xtol=1e-15)) if function(before) > 0.0 else before
        before = after
    return end


@dataclass
class Block:
    """On the plate, or `flying` at the height `z` with the vertical speed `w`; `x`, `v` are its place and speed along the conveyor."""

    throw: float
    cotangent: float
    friction: float
    restitution: float
    phase: float = 0.0
    x: float = 0.0
    v: float = 0.0
    flying: bool = False
    z: float = 0.0
    w: float = 0.0
    flown: float = 0.0

    def plate_speed(self, phase: float) -> float:
        """Along the conveyor."""
        return self.throw * self.cotangent * math.cos(phase)

    def load(self, phase: float) -> float:
        """Force of the plate on a block that goes with it, over the weight."""
        return 1.0 - self.throw * math.sin(phase)

    def leave(self, rise: float) -> None:
        """Fly, with the speed `rise` over that of the plate."""
        self.flying, self.z, self.w = True, self.throw * math.sin(self.phase), self.throw * math.cos(self.phase) + rise

    def fly(self, end: float) -> None:
        """Until the block lands, or to `end`."""
        start, rise = self.phase, self.w - self.throw * math.cos(self.phase)

        def gap(phase: float) -> float:
            t = phase - start
            return self.z + self.w * t - 0.5 * t * t - self.throw * math.sin(phase)

        touching = gap(start) < 1e-12
        self.phase = first_root(gap, start, end, min(PIECE, 0.1 * rise) if touching and rise > REST else PIECE)
        t = self.phase - start
        self.z, self.w = self.z + self.w * t - 0.5 * t * t, self.w - t
        self.x, self.flown = self.x + self.v * t, self.flown + t
        if self.phase < end:
            self.land()

    def land(self) -> None:
        """Hit the plate: leap again, or stay."""
        hits = max(self.throw * math.cos(self.phase) - self.w, 0.0)
        slip = self.v - self.plate_speed(self.phase)
        self.v -= math.copysign(min(abs(slip), self.friction * (1.0 + self.restitution) * hits), slip)
        self.flying = False
        if self.restitution * hits > REST:
            self.leave(self.restitution * hits)

    def stay(self, end: float) -> None:
        """On the plate until it lets go, slip begins or ends, or to `end`."""
        start, mu, pull = self.phase, self.friction, self.throw * self.cotangent
        slip = self.v - self.plate_speed(start)
        slides = abs(slip) > REST
        if not slides and mu * self.load(start) >= pull * abs(math.sin(start)) - 1e-12:
            self.phase = first_root(lambda at: mu * self.load(at) - pull * abs(math.sin(at)), start, end)
            self.x += pull * (math.sin(self.phase) - math.sin(start))
            self.v = self.plate_speed(self.phase)
            if self.phase == start:  # slip begins here
                self.phase = min(start + 1e-9, end)
            return
        # Without friction the block would be left behind by the plate's acceleration.
        sign, begun = math.copysign(1.0, slip if slides else math.sin(start)), self.v

        def speed(at: float) -> float:
            return begun - sign * mu * (at - start + self.throw * (math.cos(at) - math.cos(start)))

        if self.throw > 1.0:
            lift = math.asin(1.0 / self.throw)
            end_of_load = start + (lift - start) % TURN
            if self.load(start) > 0.0 or end_of_load > start + 1e-6:
                end = min(end, end_of_load)
        self.phase = first_root(lambda at: sign * (speed(at) - self.plate_speed(at)), start, end)
        t = self.phase - start
        self.x += begun * t - sign * mu * (0.5 * t * t + self.throw * (math.sin(self.phase) - math.sin(start) - t * math.cos(start)))
        self.v = speed(self.phase)
        if self.phase < end:
            self.v = self.plate_speed(self.phase)
            self.phase += 1e-12

    def advance(self, end: float) -> None:
        """To `end`, through all events before it."""
        for _ in range(MOST):
            if self.phase >= end:
                return
            if not self.flying and self.load(self.phase + 1e-9) < 0.0:
                self.leave(0.0)
            if self.flying:
                self.fly(end)
            else:
                self.stay(end)
        raise DembarkError("the block collides without end", f"at throw number {self.throw:g}")


def conveyed(throw: float, angle: float, friction: float, restitution: float = 0.0, skip: int = 60, periods: int = 60) -> Conveyed:
    """The motion of a block that starts with the plate, in `periods` after `skip` more; `angle` (rad) between path and horizontal."""
    cotangent = 1.0 / math.tan(angle)
    block = Block(throw, cotangent, friction, restitution, v=throw * cotangent)
    for period in range(skip):
        block.advance(TURN * (period + 1))
    x, flown, places = block.x, block.flown, [block.x]
    for period in range(skip, skip + periods):
        block.advance(TURN * (period + 1))
        if (period + 1 - skip) % WINDOW == 0:
            places.append(block.x)
    means = [(after - before) / (TURN * WINDOW) for before, after in pairwise(places)]
    spread = max(means) - min(means) if means else 0.0
    return Conveyed((block.x - x) / (TURN * periods), (block.flown - flown) / (TURN * periods), spread)
