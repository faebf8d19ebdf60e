"""Exact motion of colliding logs, solved without any of the engines' code: one pair in the plane, and a row of logs on a line.

A contact is a spring: N = k d with k = s_a s_b / (s_a + s_b) and d the overlap of the undeformed boundaries.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PairMotion:
    """The impact of a pair: `times` (s) of which the motion is wanted, from touch to release in [`begin`, `end`].

    `positions`, `velocities` are (times, 2 bodies, 2 axes) in m, m/s; a wall is a body at rest. `force` (times,) in N, `peak` its largest
    value, `normal` (2,) the line of centres from body 1 to body 2 at touch.
    """

    times: Array
    begin: float
    end: float
    positions: Array
    velocities: Array
    force: Array
    peak: float
    normal: Array


def pair_motion(parameters: Mapping[str, Any], times: Array) -> PairMotion:
    """Exact motion of the set-up of case `log_pair` at `times` (s).

    Free flight until the touch; then m a = +-N n - lambda v with N = k d + c d', integrated with a relative error of 1e-12 until N is 0;
    free flight after it (one impact). n turns with the line of centres.
    """
    p = parameters
    on_wall = p["target"] == "wall"
    k = 1.0 / (1.0 / p["stiffness_1"] + 1.0 / p["stiffness_2"])
    mass = np.array([p["mass_1"], math.inf if on_wall else p["mass_2"]])
    touch = p["radius_1"] if on_wall else p["radius_1"] + p["radius_2"]
    offset = 0.0 if on_wall else p["offset"]
    speed = np.array([[p["velocity_1"], 0.0], [0.0 if on_wall else p["velocity_2"], 0.0]])
    begin = p["lead_time"]
    at_touch = np.array([[-math.sqrt(touch**2 - offset**2), offset], [0.0, 0.0]]) + begin * np.array(
        [[speed[1, 0], 0.0], [speed[1, 0], 0.0]]
    )
    free = np.array([0.0 if math.isinf(m) else p["damping"] / m for m in mass])

    def contact(state: Array) -> tuple[float, Array]:
        """Force and normal, from body 1 to body 2."""
        apart = state[2:4] - state[0:2]
        distance = math.hypot(*apart)
        normal = apart / distance
        closing = float((state[4:6] - state[6:8]) @ normal)
        return k * (touch - distance) + p["contact_damping"] * closing, normal

    def rate(time: float, state: Array) -> Array:
        del time
        force, normal = contact(state)
        push = force / mass
        return np.concatenate([state[4:], -push[0] * normal - free[0] * state[4:6], push[1] * normal - free[1] * state[6:8]])

    def release(time: float, state: Array) -> float:
        # At the touch itself the force is zero too, to round-off.
        return 1.0 if time <= begin + 1e-9 * duration else contact(state)[0]

    reduced = 1.0 / float(np.sum(1.0 / mass))
    duration = math.pi * math.sqrt(reduced / k)
    release.terminal, release.direction = True, -1.0  # type: ignore[attr-defined]
    start = np.concatenate([at_touch.ravel(), speed.ravel()])
    solved = solve_ivp(rate, (begin, begin + 20.0 * duration), start, "DOP853", rtol=1e-12, atol=1e-13, events=release, dense_output=True)
    end = float(solved.t_events[0][0]) if len(solved.t_events[0]) else float(solved.t[-1])
    inside = np.clip(times, begin, end)
    states = solved.sol(inside)
    states[:4] += states[4:] * (times - inside)
    during = (times >= begin) & (times <= end)
    force = np.array([contact(state)[0] for state in states.T]) * during
    fine = np.linspace(begin, end, 4001)
    peak = max(contact(state)[0] for state in solved.sol(fine).T)
    shape = (len(times), 2, 2)
    return PairMotion(
        times, begin, end, states[:4].T.reshape(shape), states[4:].T.reshape(shape), np.maximum(force, 0.0), peak, contact(start)[1]
    )


@dataclass(frozen=True)
class ChainMotion:
    """A row of logs at `times` (s): `positions`, `velocities` (times, n) in m, m/s, `forces` (times, n - 1) in N, number of `events`."""

    times: Array
    positions: Array
    velocities: Array
    forces: Array
    events: int


def chain_motion(mass: Array, stiffness: Array, gaps: Array, velocity: Array, times: Array) -> ChainMotion:
    """Exact motion of logs on a line: masses (n,) kg, stiffnesses of the contacts (n - 1,) N/m, gaps (n - 1,) m and velocities (n,) at 0.

    Between two events (a contact closes or opens) the motion is linear and is taken from its modes in closed form; the time of each
    event is the root of that contact's gap. Positions count from where each log begins.
    """
    mass, stiffness, gaps = (np.asarray(values, float) for values in (mass, stiffness, gaps))
    contacts = len(gaps)
    difference = np.zeros((contacts, contacts + 1))
    for c in range(contacts):
        difference[c, c : c + 2] = -1.0, 1.0
    fastest = math.sqrt(4.0 * stiffness.max() / mass.min())
    probe = 0.02 / fastest
    now, place, speed = 0.0, np.zeros(contacts + 1), np.asarray(velocity, float).copy()
    closed = gaps <= 0.0
    positions, velocities, forces = (np.empty((len(times), size)) for size in (contacts + 1, contacts + 1, contacts))
    done, events = 0, 0
    while done < len(times):
        piece = _Piece(mass, np.where(closed, stiffness, 0.0), difference, gaps, place, speed)
        later = times[-1] - now
        at, which = _next_event(piece, closed, probe, later)
        while done < len(times) and times[done] - now <= at:
            positions[done], velocities[done] = piece(times[done] - now)
            gap = gaps + difference @ positions[done]
            forces[done] = np.where(closed, -stiffness * gap, 0.0)
            done += 1
        if which is None:
            break
        place, speed = piece(at)
        now += at
        closed = closed.copy()
        closed[which] = not closed[which]
        events += 1
    return ChainMotion(times, positions, velocities, forces, events)


def chain_with_loss(mass: Array, stiffness: Array, gaps: Array, velocity: Array, duration: float, lag: float) -> Array:
    """Velocities (n,) in m/s after `duration` (s) of the same row with N = k max(0, d + lag d').

    With lag = (2 theta - 1) tau this is the equation that the scheme with the step tau solves to second order: its force of step n is
    that of the overlap one step later, d(t + tau) = d + tau d'.
    """
    mass, stiffness, gaps = (np.asarray(values, float) for values in (mass, stiffness, gaps))
    n = len(mass)

    def rate(time: float, state: Array) -> Array:
        del time
        overlap, closing = -gaps - np.diff(state[:n]), -np.diff(state[n:])
        force = stiffness * np.maximum(0.0, overlap + lag * closing)
        push = np.zeros(n)
        push[:-1] -= force
        push[1:] += force
        return np.concatenate([state[n:], push / mass])

    start = np.concatenate([np.zeros(n), velocity])
    # The force has kinks, which the error control finds; steps must not jump over an impact.
    longest = 0.25 * math.sqrt(mass.min() / stiffness.max())
    return solve_ivp(rate, (0.0, duration), start, "DOP853", rtol=1e-10, atol=1e-13, max_step=longest).y[n:, -1]


class _Piece:
    """Motion between two events: M x'' = -D^T K (g + D x), from `place` and `speed`, by its modes."""

    def __init__(self, mass: Array, stiffness: Array, difference: Array, gaps: Array, place: Array, speed: Array) -> None:
        root = np.sqrt(mass)
        matrix = difference.T @ (stiffness[:, None] * difference) / np.outer(root, root)
        squares, self.modes = np.linalg.eigh(matrix)
        # Motion without deformation has frequency 0 up to round-off.
        self.still = squares < 1e-9 * max(squares.max(), 1e-300)
        self.omega = np.sqrt(np.where(self.still, 1.0, squares))
        push = self.modes.T @ (-(difference.T @ (stiffness * gaps)) / root)
        self.middle = np.where(self.still, 0.0, push / self.omega**2)
        self.start = self.modes.T @ (root * place) - self.middle
        self.rate = self.modes.T @ (root * speed)
        self.root, self.difference, self.gaps = root, difference, gaps

    def __call__(self, time: float) -> tuple[Array, Array]:
        """Positions and velocities after `time` (s)."""
        c, s = np.cos(self.omega * time), np.sin(self.omega * time)
        q = np.where(self.still, self.start + self.rate * time, self.start * c + self.rate / self.omega * s) + self.middle
        r = np.where(self.still, self.rate, self.rate * c - self.start * self.omega * s)
        return self.modes @ q / self.root, self.modes @ r / self.root

    def gap(self, time: float, contact: int) -> float:
        """Gap of `contact` (m); negative is overlap."""
        return float(self.gaps[contact] + self.difference[contact] @ self(time)[0])


def _next_event(piece: _Piece, closed: NDArray[np.bool_], probe: float, later: float) -> tuple[float, int | None]:
    """Time of the first change of a contact and which it is, looked for in steps of `probe`; (later, None) when there is none."""
    begin = 0.0
    # A contact that has just changed has a gap of round-off: it may change again only after a step.
    while begin < later:
        end = min(begin + probe, later)
        gaps = piece.gaps + piece.difference @ piece(end)[0]
        changed = np.flatnonzero((gaps < 0.0) != closed)
        found = []
        for contact in changed:
            low, high = piece.gap(begin, contact), float(gaps[contact])
            found.append((brentq(piece.gap, begin, end, (contact,), xtol=1e-18, rtol=1e-14) if low * high < 0.0 else begin, int(contact)))
        if found:
            return min(found)
        begin = end
    return later, None
