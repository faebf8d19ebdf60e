"""The contact law in single impacts, written down again without the project's headers: solved by an integration that resolves touch and
release, and in the engines' scheme at their step.

The law: F = 4/3 E* sqrt(R* d) d - gamma_n v_n, T = -k_t xi - gamma_t v_t while it sticks and |T| = mu max(N, 0) once k_t |xi| reaches
that, k_t = 8 G* sqrt(R* d), gamma = -2 sqrt(5/6) beta sqrt(S m*) with S = 2 E* sqrt(R* d) or k_t, lever arms r - d/2. N is F or, where
the elastic force limits friction, F without its damping.
"""

from __future__ import annotations

import math

import numpy as np

from dembark.physics.exact.impacts import Array, Impacts, Rebounds

# Factor from one part of an integration to the next where the impact begins and ends, and the share of the first.
_GROWTH, _FIRST = 1.25, 1e-10
_APART = np.array([[1.0], [-1.0]])


class _Law:
    """The law for n impacts; a state is (11, n): y, z, their rates and the spins, each of sphere and partner; xi."""

    def __init__(self, one: Impacts) -> None:
        beta = np.log(one.restitution) / np.hypot(np.log(one.restitution), math.pi)
        self.damping = -2.0 * math.sqrt(5.0 / 6.0) * beta * np.sqrt(one.reduced_mass)
        self.one, self.root, self.arm = one, np.sqrt(one.reduced_radius), one.arm
        self.plane, self.push, self.turn = self.arm[1] == 0.0, _APART / one.mass, 1.0 / one.inertia

    def start(self, gap: Array | float) -> Array:
        """The state with `gap` (m) between sphere and partner."""
        rest = np.zeros((2, len(self.one)))
        return np.concatenate([rest, [self.arm[0] + gap, -self.arm[1]], self.one.slide, self.one.normal, self.one.spin, rest[:1]])

    def overlap(self, state: Array) -> tuple[Array, Array, Array]:
        """Overlap (m), and the two components of the normal."""
        y, z = np.where(self.plane, 0.0, state[0] - state[1]), state[2] - state[3]
        distance = np.hypot(y, z)
        return self.arm.sum(axis=0) - distance, y / distance, z / distance

    def forces(self, state: Array, step: Array | float = 0.0) -> tuple[Array, Array, Array]:
        """Rate of change of the state; xi after `step` (s) more of sliding and the return to the limit; normal force (N)."""
        one, (overlap, ny, nz) = self.one, self.overlap(state)
        inside, touching = np.maximum(overlap, 0.0), overlap > 0.0
        root = self.root * np.sqrt(inside)
        vy, vz = state[4] - state[5], state[6] - state[7]
        arm = np.where(self.arm > 0.0, self.arm - 0.5 * overlap, 0.0)
        vn, vt = vy * ny + vz * nz, vy * nz - vz * ny + (arm * state[8:10]).sum(axis=0)
        stiffness, k_t = 2.0 * one.e_star * root, 8.0 * one.g_star * root
        spring = 4.0 / 3.0 * one.e_star * root * inside
        force = spring - self.damping * np.sqrt(stiffness) * vn
        load = spring if one.friction_limit == "elastic" else np.maximum(force, 0.0)
        limit, trial = one.friction * load, state[10] + vt * step
        # Without a pressing force there is no friction, and no damping either.
        slips = (k_t * np.abs(trial) > limit * (1.0 - 1e-12)) | (limit <= 0.0)
        friction = np.where(slips, -np.copysign(limit, trial), -k_t * trial - self.damping * np.sqrt(k_t) * vt)
        xi = np.where(touching, np.where(slips, np.copysign(limit / np.where(touching, k_t, 1.0), trial), trial), 0.0)
        pushed = self.push * (force * ny + friction * nz), self.push * (force * nz - friction * ny)
        return np.concatenate([state[4:8], *pushed, self.turn * arm * friction, [vt * touching]]), xi, force

    def parting(self, state: Array) -> Array:
        """Speed along the normal (m/s), > 0 when they part."""
        _, ny, nz = self.overlap(state)
        return (state[4] - state[5]) * ny + (state[6] - state[7]) * nz


def solved(one: Impacts, parts: int = 1000) -> Rebounds:
    """The law by Runge-Kutta's method of fourth order in `parts` of t_c, finer towards touch and release, where the damping grows like
    the fourth root of the overlap. What is left is of second order in a part, from where stick and slip change within it."""
    law = _Law(one)
    state, part, elapsed = law.start(0.0), one.duration / parts, np.zeros(len(one))
    deepest, strongest, going = np.zeros(len(one)), np.zeros(len(one)), np.ones(len(one), bool)
    # An overlap is a difference of distances, and means nothing below their round-off.
    nothing = 4.0 * np.finfo(float).eps * one.arm.sum(axis=0)
    while going.any():
        overlap, parting = law.overlap(state)[0], law.parting(state)
        to_end = np.where(parting > 0.0, overlap / np.where(parting > 0.0, parting, 1.0), np.inf)
        step = np.minimum(part, (_GROWTH - 1.0) * np.minimum(elapsed + 4.0 * part * _FIRST, to_end)) * going
        k1 = law.forces(state)[0]
        k2 = law.forces(state + 0.5 * step * k1)[0]
        k3 = law.forces(state + 0.5 * step * k2)[0]
        k4 = law.forces(state + step * k3)[0]
        state = state + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        elapsed = elapsed + step
        _, state[10], force = law.forces(state)
        overlap = law.overlap(state)[0]
        deepest, strongest = np.maximum(deepest, overlap), np.maximum(strongest, force)
        going &= (overlap > np.maximum(_FIRST * deepest, nothing)) | (elapsed < part)
    return Rebounds(state[4:6], state[6:8], state[8:10], deepest, strongest, elapsed)


def stepped(one: Impacts, time_step: float, phase: Array | float, length: float) -> Rebounds:
    """The law in the engines' scheme over `length` (s): leapfrog, forces from positions and from velocities half a step older.

    `phase` (1 or (n,), 0 ... 1) is the part of a step that passes before the touch.
    """
    law = _Law(one)
    state = law.start(one.closing * time_step * phase)
    deepest, strongest, steps = np.zeros(len(one)), np.zeros(len(one)), math.ceil(length / time_step)
    for _ in range(steps):
        rate, state[10], force = law.forces(state, time_step)
        overlap = law.overlap(state)[0]
        deepest, strongest = np.maximum(deepest, overlap), np.maximum(strongest, force * (overlap > 0.0))
        state[4:10] += time_step * rate[4:10]
        state[:4] += time_step * state[4:8]
    # The flights before the touch and after the release are straight.
    release = steps * time_step + law.overlap(state)[0] / law.parting(state)
    return Rebounds(state[4:6], state[6:8], state[8:10], deepest, strongest, release - phase * time_step)
