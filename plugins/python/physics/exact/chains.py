"""Exact motion of bodies in a row that push each other through one-sided springs, N = k max(0, d) with d the overlap of neighbours.

Source: Newton's second law; between two events, where a contact closes or opens, the motion is linear and is taken from its modes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Chain:
    """n bodies on a line: `masses` (n,) in kg, `stiffness` (n - 1,) of the contacts in N/m, `gaps` (n - 1,) in m and `velocities` (n,) in
    m/s at time 0."""

    masses: Array
    stiffness: Array
    gaps: Array
    velocities: Array

    @property
    def highest_frequency(self) -> float:
        """Bound of the angular frequencies of the row in 1/s: sqrt(4 k / m) of the stiffest contact and the lightest body."""
        return 2.0 * math.sqrt(self.stiffness.max() / self.masses.min())

    def motion(self, times: Array) -> ChainMotion:
        """Motion at `times` (increasing, s); the time of each event is the root of that contact's gap."""
        contacts = len(self.gaps)
        now, place, speed = 0.0, np.zeros(contacts + 1), np.asarray(self.velocities, float).copy()
        closed = self.gaps <= 0.0
        positions, velocities, forces = (np.empty((len(times), size)) for size in (contacts + 1, contacts + 1, contacts))
        done, events = 0, 0
        while done < len(times):
            piece = _Piece(self, closed, place, speed)
            at, which = _next_event(piece, closed, 0.02 / self.highest_frequency, times[-1] - now)
            while done < len(times) and times[done] - now <= at:
                positions[done], velocities[done] = piece(times[done] - now)
                forces[done] = np.where(closed, -self.stiffness * (self.gaps + np.diff(positions[done])), 0.0)
                done += 1
            if which is None:
                break
            place, speed = piece(at)
            now += at
            closed = closed.copy()
            closed[which] = not closed[which]
            events += 1
        return ChainMotion(positions, velocities, forces, events)

    def peak_force(self, duration: float) -> float:
        """Largest contact force (N) until `duration` (s): 1000 points in a period of the highest frequency see it to 5e-6."""
        count = math.ceil(duration * 1000.0 * self.highest_frequency / math.tau) + 1
        return float(self.motion(np.linspace(0.0, duration, count)).forces.max())

    def velocities_with_loss(self, duration: float, lag: float) -> Array:
        """Velocities (n,) in m/s after `duration` (s) of the same row with N = k max(0, d + lag d').

        With lag = (2 theta - 1) tau this is the equation that a scheme with the step tau and the weight theta of its end solves to second
        order: its force of step n is that of the overlap one step later, d(t + tau) = d + tau d'.
        """
        n = len(self.masses)

        def rate(_: float, state: Array) -> Array:
            force = self.stiffness * np.maximum(0.0, -self.gaps - np.diff(state[:n]) - lag * np.diff(state[n:]))
            push = np.concatenate([-force, [0.0]]) + np.concatenate([[0.0], force])
            return np.concatenate([state[n:], push / self.masses])

        # The force has kinks, which the error control finds; steps must not jump over an impact.
        start = np.concatenate([np.zeros(n), self.velocities])
        return solve_ivp(rate, (0.0, duration), start, "DOP853", rtol=1e-10, atol=1e-13, max_step=0.5 / self.highest_frequency).y[n:, -1]


@dataclass(frozen=True)
class ChainMotion:
    """`positions`, counted from where each body begins, and `velocities` (times, n) in m, m/s; `forces` (times, n - 1) in N; number of
    `events`: contacts that closed or opened."""

    positions: Array
    velocities: Array
    forces: Array
    events: int


class _Piece:
    """Motion between two events: M x'' = -D^T K (g + D x), from `place` and `speed`, by its modes."""

    def __init__(self, chain: Chain, closed: NDArray[np.bool_], place: Array, speed: Array) -> None:
        self.root, self.gaps = np.sqrt(chain.masses), chain.gaps
        difference, stiffness = np.diff(np.eye(len(place)), axis=0), np.where(closed, chain.stiffness, 0.0)
        squares, self.modes = np.linalg.eigh(difference.T @ (stiffness[:, None] * difference) / np.outer(self.root, self.root))
        # Motion without deformation has frequency 0 up to round-off.
        self.still = squares < 1e-9 * max(squares.max(), 1e-300)
        self.omega = np.sqrt(np.where(self.still, 1.0, squares))
        push = self.modes.T @ (-(difference.T @ (stiffness * self.gaps)) / self.root)
        self.middle = np.where(self.still, 0.0, push / self.omega**2)
        self.start = self.modes.T @ (self.root * place) - self.middle
        self.rate = self.modes.T @ (self.root * speed)

    def __call__(self, time: float) -> tuple[Array, Array]:
        """Positions and velocities after `time` (s)."""
        c, s = np.cos(self.omega * time), np.sin(self.omega * time)
        q = np.where(self.still, self.start + self.rate * time, self.start * c + self.rate / self.omega * s) + self.middle
        r = np.where(self.still, self.rate, self.rate * c - self.start * self.omega * s)
        return self.modes @ q / self.root, self.modes @ r / self.root

    def gap(self, time: float, contact: int) -> float:
        """Gap of `contact` (m); negative is overlap."""
        return float(self.gaps[contact] + np.diff(self(time)[0])[contact])


def _next_event(piece: _Piece, closed: NDArray[np.bool_], probe: float, later: float) -> tuple[float, int | None]:
    """Time of the first change of a contact and which it is, looked for in steps of `probe`; (later, None) when there is none."""
    begin = 0.0
    while begin < later:
        end = min(begin + probe, later)
        gaps = piece.gaps + np.diff(piece(end)[0])
        found = []
        for contact in np.flatnonzero((gaps < 0.0) != closed).tolist():
            low, high = piece.gap(begin, contact), float(gaps[contact])
            # A contact that has just changed has a gap of round-off, of either sign.
            found.append((brentq(piece.gap, begin, end, (contact,), xtol=1e-18, rtol=1e-14) if low * high < 0.0 else begin, contact))
        if found:
            return min(found)
        begin = end
    return later, None
