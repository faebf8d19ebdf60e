"""Exact motion of two elastic bodies that meet in the plane.

The contact is a linear spring with a damper: N = k d + c d', d the overlap of the undeformed boundaries. Source: Newton's second law for
both bodies; head on and without damping its solution is half a period of a harmonic oscillator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pair:
    """Two bodies that move along x towards each other; the second one is a wall at rest when its mass is inf. SI units.

    masses : of both bodies (kg)
    stiffness : k of the contact (N/m)
    distance : of the centres at touch (m); of the centre from a wall
    velocities : along x before the impact (m/s), the first greater than the second
    offset : distance of the lines on which the centres move (m), less than `distance`; 0: head on
    damping : lambda of the drag -lambda v on each body while they touch (N s/m)
    contact_damping : c of the contact (N s/m)
    """

    masses: tuple[float, float]
    stiffness: float
    distance: float
    velocities: tuple[float, float]
    offset: float = 0.0
    damping: float = 0.0
    contact_damping: float = 0.0

    @property
    def reduced_mass(self) -> float:
        """1 / (1 / m_1 + 1 / m_2) in kg."""
        return 1.0 / (1.0 / self.masses[0] + 1.0 / self.masses[1])

    @property
    def omega(self) -> float:
        """sqrt(k / m*) in 1/s: a head-on impact without damping lasts pi / omega."""
        return math.sqrt(self.stiffness / self.reduced_mass)

    @property
    def speed(self) -> float:
        """Speed of approach along the line of centres at touch (m/s)."""
        return (self.velocities[0] - self.velocities[1]) * math.sqrt(1.0 - (self.offset / self.distance) ** 2)

    def motion(self, times: Array, begin: float) -> PairMotion:
        """Motion at `times` (n,) in s: free flight until the touch at `begin`, one impact, free flight after it.

        Integrated with a relative error of 1e-12 until N is 0; the normal turns with the line of centres.
        """
        mass, k, touch = np.array(self.masses), self.stiffness, self.distance
        speed = np.array([[self.velocities[0], 0.0], [self.velocities[1], 0.0]])
        drag = self.damping / mass
        place = np.array([[-math.sqrt(touch**2 - self.offset**2) + begin * speed[1, 0], self.offset], [begin * speed[1, 0], 0.0]])

        def contact(state: Array) -> tuple[float, Array]:
            """Force and normal, from body 1 to body 2."""
            apart = state[2:4] - state[0:2]
            distance = math.hypot(*apart)
            normal = apart / distance
            closing = float((state[4:6] - state[6:8]) @ normal)
            return k * (touch - distance) + self.contact_damping * closing, normal

        def rate(_: float, state: Array) -> Array:
            force, normal = contact(state)
            push = force / mass
            return np.concatenate([state[4:], -push[0] * normal - drag[0] * state[4:6], push[1] * normal - drag[1] * state[6:8]])

        duration = math.pi / self.omega

        def release(time: float, state: Array) -> float:
            # At the touch itself the force is zero too, to round-off.
            return 1.0 if time <= begin + 1e-9 * duration else contact(state)[0]

        release.terminal, release.direction = True, -1.0  # type: ignore[attr-defined]
        start = np.concatenate([place.ravel(), speed.ravel()])
        span = (begin, begin + 20.0 * duration)
        solved = solve_ivp(rate, span, start, "DOP853", rtol=1e-12, atol=1e-13, events=release, dense_output=True)
        end = float(solved.t_events[0][0]) if len(solved.t_events[0]) else float(solved.t[-1])
        inside = np.clip(times, begin, end)
        states = solved.sol(inside)
        states[:4] += states[4:] * (times - inside)
        force = np.array([contact(state)[0] for state in states.T]) * ((times >= begin) & (times <= end))
        peak = max(contact(state)[0] for state in solved.sol(np.linspace(begin, end, 4001)).T)
        shape = (len(times), 2, 2)
        positions, velocities = states[:4].T.reshape(shape), states[4:].T.reshape(shape)
        return PairMotion(begin, end, positions, velocities, np.maximum(force, 0.0), peak, contact(start)[1])


@dataclass(frozen=True)
class PairMotion:
    """The impact of a pair, from touch to release in [`begin`, `end`] (s).

    `positions`, `velocities` (times, 2 bodies, 2 axes) in m, m/s; `force` (times,) in N, `peak` its largest value; `normal` (2,): the line
    of centres from body 1 to body 2 at touch.
    """

    begin: float
    end: float
    positions: Array
    velocities: Array
    force: Array
    peak: float
    normal: Array
