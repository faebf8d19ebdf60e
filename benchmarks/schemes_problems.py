"""What `benchmarks.schemes` integrates: oscillators, one fast and slow by turns, an impact, a block that slides, a bed of 50 grains.

The state of a problem is y = (x, v, s): coordinates, their velocities, and the history of contacts. A problem gives the accelerations, the
rates of the history, for schemes that take them as differential equations, and the step of the history that the engines make: all moves on
with one velocity, then what is beyond the friction limit slips. Units SI, but for the oscillators, which have none.

The laws of contact are those of `dembark.physics.Contact`, in arrays; benchmarks/tests compare the two.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from dembark.physics import FinnieRabinowicz, effective_shear_modulus, effective_youngs_modulus

Array = NDArray[np.float64]
NONE: Array = np.zeros(0)


def no_history(_x: Array, _v: Array, _s: Array) -> Array:
    """The rate of a history that is none."""
    return NONE


def no_step(_x: Array, _v: Array, _s: Array, _h: float) -> Array:
    """The step of a history that is none."""
    return NONE


@dataclass
class Problem:
    """`start`, y at t = 0, of which the first `n` numbers are x; `end`; `fast`: the shortest period, or the duration of an impact.

    `measure` gives the numbers of a final state that are compared, each over the scale that it has. Evaluations are counted.
    """

    n: int
    start: Array
    end: float
    fast: float
    acceleration: Callable[[Array, Array, Array], Array]
    history: Callable[[Array, Array, Array], Array] = no_history
    advance: Callable[[Array, Array, Array, float], Array] = no_step
    measure: Callable[[Array], Array] = lambda y: y
    energy: Callable[[Array], float] | None = None
    evaluations: int = field(default=0, repr=False)

    def parts(self, y: Array) -> tuple[Array, Array, Array]:
        """x, v, s."""
        return y[: self.n], y[self.n : 2 * self.n], y[2 * self.n :]

    def forces(self, x: Array, v: Array, s: Array) -> Array:
        """The accelerations; one evaluation."""
        self.evaluations += 1
        return self.acceleration(x, v, s)

    def rate(self, _time: float, y: Array) -> Array:
        """dy/dt; one evaluation."""
        x, v, s = self.parts(y)
        return np.concatenate([v, self.forces(x, v, s), self.history(x, v, s)])


def oracle(problem: Problem, tolerance: float = 1e-13, method: str = "DOP853") -> Array:
    """The final state by a scheme of eighth order with error control."""
    found = solve_ivp(problem.rate, (0.0, problem.end), problem.start, method=method, rtol=max(tolerance, 3e-14), atol=1e-3 * tolerance)
    return np.asarray(found.y[:, -1])


def ending(event: Any, direction: float) -> Any:
    """The function `event`, at whose zero in this direction `solve_ivp` ends."""
    event.terminal, event.direction = True, direction
    return event


def oscillator(damping: float = 0.0, periods: float = 5.0) -> Problem:
    """x'' = -x - 2 zeta x'."""
    return Problem(1, np.array([1.0, 0.0]), 2.0 * math.pi * periods, 2.0 * math.pi, lambda x, v, _: -x - 2.0 * damping * v,
                   energy=lambda y: 0.5 * float(y @ y))


def alternating(fastest: float = 50.0, end: float = 4.0 * math.pi) -> Problem:
    """A nonlinear system of fourth order that is fast and slow by turns: q'' = -q, Q'' = -(1 - s) g - s (W^2 Q + 2 zeta W Q').

    s = 1 / (1 + exp(20 q)), g = 1, zeta = 0.02: while q < 0, Q rings on a spring of the frequency W, as a grain that has landed; while
    q > 0 it flies. Measured: q and q', and Q and Q' over 1 and 1.
    """
    def acceleration(x: Array, v: Array, _s: Array) -> Array:
        share = 1.0 / (1.0 + math.exp(20.0 * x[0]))
        return np.array([-x[0], -(1.0 - share) - share * (fastest**2 * x[1] + 0.04 * fastest * v[1])])

    return Problem(2, np.array([1.0, 1.0, 0.0, 0.0]), end, 2.0 * math.pi / fastest, acceleration)


def coupled(fastest: float = 50.0, end: float = 4.0 * math.pi) -> Problem:
    """Two oscillators that exchange energy, which stays: H = (p^2 + q^2 + P^2 + W^2 Q^2 + W q^2 Q) / 2."""
    def acceleration(x: Array, _v: Array, _s: Array) -> Array:
        q, fast = x
        return np.array([-q - fastest * q * fast, -(fastest**2) * fast - 0.5 * fastest * q * q])

    def energy(y: Array) -> float:
        q, fast, p, speed = y
        return 0.5 * float(p * p + q * q + speed * speed + fastest**2 * fast * fast + fastest * q * q * fast)

    return Problem(2, np.array([0.8, 0.01, 0.0, 0.0]), end, 2.0 * math.pi / fastest, acceleration, energy=energy)


# Grains: d = 5 mm, 2500 kg/m^3, E = 10 MPa, nu = 0.3.
RADIUS, DENSITY, YOUNG, POISSON = 2.5e-3, 2500.0, 1e7, 0.3
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
E_STAR = effective_youngs_modulus(YOUNG, POISSON, YOUNG, POISSON)
G_STAR = effective_shear_modulus(YOUNG, POISSON, YOUNG, POISSON)


def damping_of(restitution: float) -> float:
    """-2 sqrt(5/6) beta."""
    log = math.log(restitution)
    return -2.0 * math.sqrt(5.0 / 6.0) * log / math.hypot(log, math.pi)


def duration(speed: float, mass: float = MASS, radius: float = RADIUS) -> float:
    """T_c (s) of an impact without damping (Hertz) of bodies of these reduced mass and radius."""
    return 2.9433 * (15.0 * mass * speed**2 / (16.0 * E_STAR * math.sqrt(radius))) ** 0.4 / speed


def impact(restitution: float, gap: float = 0.0, speed: float = 1.0) -> Problem:
    """A grain hits a plane; `gap` (m) at the start. Measured: the velocity after the impact over `speed` (m/s)."""
    damping, lasts = damping_of(restitution) * math.sqrt(MASS), duration(speed)

    def acceleration(x: Array, v: Array, _s: Array) -> Array:
        overlap = -x[0]
        if overlap <= 0.0:
            return np.zeros(1)
        root = 2.0 * E_STAR * math.sqrt(RADIUS * overlap)
        return np.array([(2.0 / 3.0 * root * overlap - damping * math.sqrt(root) * v[0]) / MASS])

    return Problem(1, np.array([gap, -speed]), 1.6 * lasts + gap / speed, lasts, acceleration, measure=lambda y: y[1:2] / speed)


def impact_oracle(restitution: float, tolerance: float = 1e-13, speed: float = 1.0) -> float:
    """The velocity after the impact over `speed`: from touch to release, the release located."""
    problem = impact(restitution, 0.0, speed)

    def parts(t: float, y: Array) -> float:
        return float(y[0]) if t > 0.1 * problem.fast else -1.0

    found = solve_ivp(problem.rate, (0.0, 3.0 * problem.fast), problem.start, method="DOP853", rtol=max(tolerance, 3e-14),
                      atol=tolerance * np.array([speed * problem.fast, speed]), events=ending(parts, 1.0), first_step=1e-9 * problem.fast)
    return float(found.y_events[0][0][1]) / speed


# The block: 1 kg with k_t = 1e5 N/m under N = 10 N; friction falls from 0.6 to 0.4 over 0.5 mm.
LAW = FinnieRabinowicz(static_friction=0.6, kinetic_friction=0.4, critical_slip_distance=5e-4)
BLOCK_STIFFNESS, BLOCK_LOAD, BLOCK_DAMPING = 1e5, 10.0, 30.0


def limit(slip: float) -> tuple[float, float]:
    """Displacement (m) of the spring at which the block slides, and how it changes with the slip."""
    falling = (LAW.static_friction - LAW.kinetic_friction) * math.exp(-slip / LAW.critical_slip_distance)
    return (LAW.kinetic_friction + falling) * BLOCK_LOAD / BLOCK_STIFFNESS, -falling / LAW.critical_slip_distance * (
        BLOCK_LOAD / BLOCK_STIFFNESS)


def slides(v: Array, s: Array) -> bool:
    """Whether the spring is at its limit and would go on."""
    return abs(s[0]) >= limit(s[1])[0] * (1.0 - 1e-12) and s[0] * v[0] > 0.0


def block(speed: float = 0.1) -> Problem:
    """A block is pushed, slides on a spring with Finnie-Rabinowicz friction, stops and rings; s = (displacement, slip).

    Measured: position over the way that it slides, velocity over `speed` (m/s).
    """
    def acceleration(_x: Array, v: Array, s: Array) -> Array:
        if slides(v, s):
            return np.array([-BLOCK_STIFFNESS * math.copysign(limit(s[1])[0], s[0])])
        return np.array([-BLOCK_STIFFNESS * s[0] - BLOCK_DAMPING * v[0]])

    def history(_x: Array, v: Array, s: Array) -> Array:
        if not slides(v, s):
            return np.array([v[0], 0.0])
        slope = limit(s[1])[1]
        slip = abs(v[0]) / (1.0 + slope)
        return np.array([math.copysign(1.0, s[0]) * slope * slip, slip])

    def advance(_x: Array, v: Array, s: Array, h: float) -> Array:
        trial = s[0] + h * v[0]
        if abs(trial) <= limit(s[1])[0]:
            return np.array([trial, s[1]])
        more = max(abs(trial) - limit(s[1])[0], 0.0)
        for _ in range(50):  # Newton: |trial| - more = limit(slip + more)
            reach, slope = limit(s[1] + more)
            change = (abs(trial) - more - reach) / (1.0 + slope)
            more += change
            if abs(change) < 1e-17:
                break
        return np.array([math.copysign(abs(trial) - more, trial), s[1] + more])

    way = 0.5 * speed**2 / (LAW.kinetic_friction * BLOCK_LOAD)
    period = 2.0 * math.pi / math.sqrt(BLOCK_STIFFNESS)
    return Problem(1, np.array([0.0, speed, 0.0, 0.0]), 0.05, period, acceleration, history, advance,
                   measure=lambda y: np.array([y[0] / way, y[1] / speed]))


def block_oracle(tolerance: float = 1e-13, speed: float = 0.1) -> Array:
    """What `block` measures, its parts integrated one by one: stick, slide to rest, stick."""
    problem = block(speed)
    y, now = problem.start, 0.0

    def stick(_time: float, y: Array) -> list[float]:
        return [y[1], -BLOCK_STIFFNESS * y[2] - BLOCK_DAMPING * y[1], y[1], 0.0]

    def slide(_time: float, y: Array) -> list[float]:
        reach, slope = limit(y[3])
        slip = y[1] / (1.0 + slope)
        return [y[1], -BLOCK_STIFFNESS * reach, slope * slip, slip]

    for rate, ends in ((stick, lambda _, y: limit(y[3])[0] - y[2]), (slide, lambda _, y: y[1]), (stick, None)):
        found = solve_ivp(rate, (now, problem.end), y, method="DOP853", rtol=max(tolerance, 3e-14), first_step=1e-6,
                          atol=tolerance * np.array([1e-3, speed, 1e-4, 1e-3]), events=ends and ending(ends, -1.0))
        y, now = found.y[:, -1], float(found.t[-1])
    return problem.measure(y)


class Bed:
    """50 grains in a vertical plane between two walls and a floor: x = (x, z, angle) of each; s: the tangential spring of each contact.

    Hertz with damping, a spring of k_t with damping up to mu N, as in the engines, lever arms r - overlap / 2.
    """

    def __init__(self, restitution: float, friction: float, count: int = 50, columns: int = 10, gravity: float = 9.81) -> None:
        self.count, self.friction, self.gravity = count, friction, gravity
        self.damping = damping_of(restitution)
        self.width = columns * 2.02 * RADIUS
        self.take(*np.triu_indices(count, 1))

    def take(self, one: NDArray[np.int64], two: NDArray[np.int64]) -> None:
        """The contacts: these pairs, and each grain with the walls: left, right, floor."""
        self.one, self.two, self.pairs = one, two, len(one)
        self.body = np.concatenate([one, np.tile(np.arange(self.count), 3)])
        ones, zeros = np.ones(self.count), np.zeros(self.count)
        self.facing = np.array([[*ones, *-ones, *zeros], [*zeros, *zeros, *ones]])
        walled = np.arange(len(self.body)) >= self.pairs
        self.mass = np.where(walled, MASS, 0.5 * MASS)
        self.root = np.sqrt(np.where(walled, RADIUS, 0.5 * RADIUS))

    def keep_near(self, x: Array, reach: float) -> None:
        """Forget pairs that are further apart than `reach` (d)."""
        place = x.reshape(-1, 3)[:, :2]
        near = np.linalg.norm(place[self.one] - place[self.two], axis=1) < reach * 2.0 * RADIUS
        self.take(self.one[near], self.two[near])

    def geometry(self, x: Array, v: Array) -> tuple[Array, ...]:
        """Overlap (m), normal (2, contacts), and relative velocities along the normal and along the tangent (n_z, -n_x) (m/s)."""
        place, speed = x.reshape(-1, 3), v.reshape(-1, 3)
        apart = place[self.one, :2] - place[self.two, :2]
        distance = np.hypot(apart[:, 0], apart[:, 1])
        normal = np.concatenate([apart.T / distance, self.facing], axis=1)
        overlap = np.concatenate([2.0 * RADIUS - distance, RADIUS - place[:, 0], RADIUS - (self.width - place[:, 0]),
                                  RADIUS - place[:, 1]])
        moving = speed[self.body, :2]
        moving[: self.pairs] -= speed[self.two, :2]
        arm = RADIUS - 0.5 * overlap
        turning = speed[self.body, 2]
        turning[: self.pairs] += speed[self.two, 2]
        along = moving[:, 0] * normal[0] + moving[:, 1] * normal[1]
        across = moving[:, 0] * normal[1] - moving[:, 1] * normal[0] + arm * turning
        return overlap, normal, along, across

    def springs(self, overlap: Array, along: Array) -> tuple[Array, Array, Array]:
        """Normal force (N), k_t (N/m), and the displacement (m) of a tangential spring at the friction limit; 0 where a contact is open."""
        root = self.root * np.sqrt(np.maximum(overlap, 0.0))
        stiffness, k_t = 2.0 * E_STAR * root, 8.0 * G_STAR * root
        force = 2.0 / 3.0 * stiffness * overlap - self.damping * np.sqrt(stiffness * self.mass) * along
        reach = np.divide(self.friction * np.maximum(force, 0.0), k_t, out=np.zeros_like(k_t), where=k_t > 0.0)
        return force, k_t, reach

    def acceleration(self, x: Array, v: Array, s: Array) -> Array:
        """m/s^2, rad/s^2. A bed without friction has no history."""
        overlap, normal, along, across = self.geometry(x, v)
        force, k_t, reach = self.springs(overlap, along)
        friction = np.zeros_like(force)
        if self.friction:
            sticks = np.abs(s) < reach * (1.0 - 1e-12)
            friction = -k_t * s - np.where(sticks, self.damping * np.sqrt(k_t * self.mass) * across, 0.0)
        push = np.stack([force * normal[0] + friction * normal[1], force * normal[1] - friction * normal[0],
                         2.5 / RADIUS**2 * (RADIUS - 0.5 * overlap) * friction], axis=1) / MASS
        out = np.zeros((self.count, 3))
        for column in range(3):
            other = push[: self.pairs, column] * (1.0 if column == 2 else -1.0)
            out[:, column] = (np.bincount(self.body, push[:, column], self.count) + np.bincount(self.two, other, self.count))
        out[:, 1] -= self.gravity
        return out.ravel()

    def advance(self, x: Array, v: Array, s: Array, h: float) -> Array:
        """The springs after a step of the engines."""
        if not self.friction:
            return s
        overlap, _, along, across = self.geometry(x, v)
        reach = self.springs(overlap, along)[2]
        return np.where(overlap > 0.0, np.clip(s + h * across, -reach, reach), 0.0)

    def problem(self, x: Array, v: Array, s: Array, end: float, speed: float = 1.0) -> Problem:
        """From this state on; measured: positions over d, velocities over `speed` (m/s)."""
        def measure(y: Array) -> Array:
            place, velocity = y[: 3 * self.count].reshape(-1, 3)[:, :2], y[3 * self.count : 6 * self.count].reshape(-1, 3)[:, :2]
            return np.concatenate([place.ravel() / (2.0 * RADIUS), velocity.ravel() / speed])

        return Problem(3 * self.count, np.concatenate([x, v, s]), end, duration(speed, 0.5 * MASS, 0.5 * RADIUS), self.acceleration,
                       advance=self.advance, measure=measure, energy=self.energy)

    def energy(self, y: Array) -> float:
        """Kinetic energy, weight and normal springs (J)."""
        n = 3 * self.count
        x, v = y[:n], y[n : 2 * n].reshape(-1, 3)
        overlap = np.maximum(self.geometry(x, y[n : 2 * n])[0], 0.0)
        springs = 8.0 / 15.0 * E_STAR * self.root * overlap**2.5
        return float(0.5 * MASS * (v[:, :2] ** 2).sum() + 0.2 * MASS * RADIUS**2 * (v[:, 2] ** 2).sum()
                     + MASS * self.gravity * x.reshape(-1, 3)[:, 1].sum() + springs.sum())

    def lattice(self, seed: int = 1) -> Array:
        """Rows of grains a few hundredths of d apart, every second one shifted, each grain moved a little."""
        columns = round(self.width / (2.02 * RADIUS)) - 1
        k = np.arange(self.count)
        row = k // columns
        x = (k % columns + 0.5 + 0.5 * (row % 2)) * 2.04 * RADIUS + 0.02 * RADIUS
        place = np.stack([x, RADIUS * (1.02 + 1.78 * row), 0.0 * k], axis=1)
        place[:, :2] += np.random.default_rng(seed).uniform(-0.01, 0.01, (self.count, 2)) * RADIUS
        return place.ravel()

    def stiffest(self, x: Array, s: Array) -> float:
        """The highest frequency (rad/s) of small motions about a bed at rest, without damping or slip."""
        n, tiny = 3 * self.count, 1e-6
        scale = np.tile([RADIUS, RADIUS, 1.0], self.count) * 1e-3
        at_rest, matrix = np.zeros(n), np.empty((n, n))
        for j in range(n):
            move = np.zeros(n)
            move[j] = tiny * scale[j]
            ends = []
            for sign in (1.0, -1.0):
                place = x + sign * move
                spring = s + self.geometry(x, sign * move)[3] * (self.geometry(x, at_rest)[0] > 0.0)
                ends.append(self.acceleration(place, at_rest, spring))
            matrix[:, j] = (ends[0] - ends[1]) / (2.0 * move[j])
        return math.sqrt(float(np.max(-np.linalg.eigvals(matrix).real)))
