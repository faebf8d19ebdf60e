"""One impact of a sphere, solved without any of the engines' code: Hertz in closed form, the contact law by an integration that resolves
touch and release, the law in the engines' scheme at their step, and the contact of Mindlin and Deresiewicz with partial slip.

The law: F = 4/3 E* sqrt(R* d) d - gamma_n v_n, T = -k_t xi - gamma_t v_t while it sticks and |T| = mu max(F, 0) once k_t |xi| reaches
that, k_t = 8 G* sqrt(R* d), gamma = -2 sqrt(5/6) beta sqrt(S m*) with S = 2 E* sqrt(R* d) or k_t, lever arms r - d/2. The motion lies in
the plane y, z; spins are about x.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import gamma

Array = NDArray[np.float64]

# t_c v / d_max of an elastic impact after Hertz.
HERTZ_TIME = 4.0 * math.sqrt(math.pi) * gamma(0.4) / (5.0 * gamma(0.9))
# Factor from one part of an integration to the next where the impact begins and ends, and the share of the first.
_GROWTH, _FIRST = 1.25, 1e-10


@dataclass(frozen=True)
class Impacts:
    """n impacts, all attributes (n,) in SI units: `value` of the sweep; `angle` (rad); material constants `e_star`, `g_star`,
    `restitution`, `friction`; of sphere and partner `radius`, `mass` (inf for a plane), velocities along y and z (`slide`, `normal`) and
    `spin` before the impact; `second` is 1 for material B."""

    value: Array
    angle: Array
    second: Array
    e_star: Array
    g_star: Array
    restitution: Array
    friction: Array
    radius: Array
    mass: Array
    slide: Array
    normal: Array
    spin: Array
    radius_2: Array
    mass_2: Array
    slide_2: Array
    normal_2: Array
    spin_2: Array

    def __len__(self) -> int:
        return len(self.value)

    def pick(self, which: Any) -> Impacts:
        """Some of the impacts, or each of them several times."""
        return replace(self, **{one.name: getattr(self, one.name)[which] for one in fields(self)})

    @property
    def reduced_radius(self) -> Array:
        return 1.0 / (1.0 / self.radius + 1.0 / self.radius_2)

    @property
    def reduced_mass(self) -> Array:
        return 1.0 / (1.0 / self.mass + 1.0 / self.mass_2)

    @property
    def closing(self) -> Array:
        """Speed of approach (m/s)."""
        return self.normal_2 - self.normal

    @property
    def sliding(self) -> Array:
        """Tangential velocity of the sphere's point of contact relative to the partner's (m/s)."""
        return self.slide - self.slide_2 + self.radius * self.spin + np.where(np.isinf(self.radius_2), 0.0, self.radius_2) * self.spin_2

    @property
    def peak_overlap(self) -> Array:
        """Hertz, elastic (m)."""
        return (15.0 * self.reduced_mass * self.closing**2 / (16.0 * self.e_star * np.sqrt(self.reduced_radius))) ** 0.4

    @property
    def peak_force(self) -> Array:
        """Hertz, elastic (N)."""
        return hertz_force(self, self.peak_overlap)

    @property
    def duration(self) -> Array:
        """Hertz, elastic (s)."""
        return HERTZ_TIME * self.peak_overlap / self.closing


def hertz_force(one: Impacts, overlap: Array) -> Array:
    """Elastic force (N) at `overlap` (m)."""
    return 4.0 / 3.0 * one.e_star * np.sqrt(one.reduced_radius) * np.maximum(overlap, 0.0) ** 1.5


def impacts(p: Mapping[str, Any]) -> Impacts:
    """The impacts of case `single_contact` with parameters `p`: those of material A, then those of B."""
    n = p["points"]
    second = np.repeat([0.0, 1.0], n)
    steps = np.tile(np.arange(n), 2) / max(n - 1, 1)
    value = p["sweep_from"] + (p["sweep_to"] - p["sweep_from"]) * steps
    sweep = p["sweep"]
    angle = np.radians(value) if sweep in ("direction", "slide", "spin") else np.zeros(2 * n)

    def of(name: str) -> Array:
        return np.where(second > 0.0, p[f"{name}_b"], p[f"{name}_a"])

    youngs, poisson, density = of("youngs_modulus"), of("poisson_ratio"), of("density")
    softness = (1.0 - poisson**2) / youngs * (1.0 + 1.0 / p["stiffness_ratio"])
    shear = 2.0 * (2.0 - poisson) * (1.0 + poisson) / youngs * (1.0 + 1.0 / p["stiffness_ratio"])
    full = np.ones(2 * n)
    radius, speed = p["radius"] * full, p["speed"]
    mass = 4.0 / 3.0 * math.pi * radius**3 * density
    normal = -speed * (np.cos(angle) if sweep == "direction" else full)
    slide = speed * {"direction": np.sin(angle), "slide": np.tan(angle)}.get(sweep, 0.0 * full)
    spin = speed * np.tan(angle) / radius if sweep == "spin" else 0.0 * full
    mirror, rest = p["partner"] == "mirror", p["partner"] == "rest"
    larger, denser = (p["size_ratio"], p["density_ratio"]) if rest else (1.0, 1.0)
    plane = p["partner"] == "plane"
    return Impacts(
        value, angle, second, 1.0 / softness, 1.0 / shear,
        value if sweep == "restitution" else p["restitution"] * full, p["friction"] * full,
        radius, mass, slide, normal, spin,
        math.inf * full if plane else larger * radius, math.inf * full if plane else larger**3 * denser * mass,
        -slide if mirror else 0.0 * full, -normal if mirror else 0.0 * full, -spin if mirror else 0.0 * full,
    )  # fmt: skip


@dataclass(frozen=True)
class Rebounds:
    """After the impacts, (n,) each: velocities of sphere and partner along y and z (m/s), spins (rad/s), largest overlap (m),
    largest normal force (N) and duration (s)."""

    slide: Array
    normal: Array
    spin: Array
    slide_2: Array
    normal_2: Array
    spin_2: Array
    overlap: Array
    force: Array
    duration: Array


class _Law:
    """The contact law of n impacts; a state is (11, n): y, z of the sphere and of its partner, their velocities, both spins, xi."""

    def __init__(self, one: Impacts) -> None:
        beta = np.log(one.restitution) / np.hypot(np.log(one.restitution), math.pi)
        self.damping = -2.0 * math.sqrt(5.0 / 6.0) * beta * np.sqrt(one.reduced_mass)
        self.one, self.root = one, np.sqrt(one.reduced_radius)
        self.plane = np.isinf(one.radius_2)
        self.far = np.where(self.plane, 0.0, one.radius_2)
        self.push, self.push_2 = 1.0 / one.mass, 1.0 / one.mass_2
        self.turn = 2.5 / (one.mass * one.radius**2)
        self.turn_2 = np.where(self.plane, 0.0, 2.5 / (one.mass_2 * one.radius_2**2))

    def start(self, gap: Array) -> Array:
        """The state with `gap` (m) between sphere and partner."""
        one, rest = self.one, np.zeros(len(self.one))
        place_2 = np.where(self.plane, 0.0, -self.far)
        places, velocities = (rest, one.radius + gap, rest, place_2), (one.slide, one.normal, one.slide_2, one.normal_2)
        return np.array([*places, *velocities, one.spin, one.spin_2, rest])

    def overlap(self, state: Array) -> tuple[Array, Array, Array]:
        """Overlap (m), and the two components of the normal."""
        y, z = np.where(self.plane, 0.0, state[0] - state[2]), state[1] - state[3]
        distance = np.hypot(y, z)
        return self.one.radius + self.far - distance, y / distance, z / distance

    def forces(self, state: Array, step: Array | float = 0.0) -> tuple[Array, Array, Array]:
        """Rate of change of the state; xi after `step` (s) more of sliding and the return to the limit; normal force (N)."""
        one = self.one
        overlap, ny, nz = self.overlap(state)
        inside = np.maximum(overlap, 0.0)
        root = self.root * np.sqrt(inside)
        vy, vz = state[4] - state[6], state[5] - state[7]
        arm, arm_2 = one.radius - 0.5 * overlap, np.where(self.plane, 0.0, self.far - 0.5 * overlap)
        vn, vt = vy * ny + vz * nz, vy * nz - vz * ny + arm * state[8] + arm_2 * state[9]
        stiffness, k_t = 2.0 * one.e_star * root, 8.0 * one.g_star * root
        force = 4.0 / 3.0 * one.e_star * root * inside - self.damping * np.sqrt(stiffness) * vn
        limit, trial = one.friction * np.maximum(force, 0.0), state[10] + vt * step
        # Without a pressing force there is no friction, and no damping either.
        slips = (k_t * np.abs(trial) > limit * (1.0 - 1e-12)) | (limit <= 0.0)
        friction = np.where(slips, -np.copysign(limit, trial), -k_t * trial - self.damping * np.sqrt(k_t) * vt)
        touching = overlap > 0.0
        xi = np.where(touching, np.where(slips, np.copysign(limit / np.where(touching, k_t, 1.0), trial), trial), 0.0)
        fy, fz = force * ny + friction * nz, force * nz - friction * ny
        rate = np.array([
            state[4], state[5], state[6], state[7], self.push * fy, self.push * fz, -self.push_2 * fy, -self.push_2 * fz,
            self.turn * arm * friction, self.turn_2 * arm_2 * friction, vt * touching,
        ])  # fmt: skip
        return rate, xi, force

    def parting(self, state: Array) -> Array:
        """Speed along the normal (m/s), > 0 when they part."""
        _, ny, nz = self.overlap(state)
        return (state[4] - state[6]) * ny + (state[5] - state[7]) * nz


def _rebounds(state: Array, overlap: Array, force: Array, duration: Array) -> Rebounds:
    return Rebounds(state[4], state[5], state[8], state[6], state[7], state[9], overlap, force, duration)


def exact(one: Impacts, parts: int = 1000) -> Rebounds:
    """The law by Runge-Kutta's method of fourth order in `parts` of t_c, finer towards touch and release, where the damping grows like
    the fourth root of the overlap. What is left is of second order in a part, from where stick and slip change within it."""
    law = _Law(one)
    state = law.start(np.zeros(len(one)))
    part, elapsed = one.duration / parts, np.zeros(len(one))
    deepest, strongest, going = np.zeros(len(one)), np.zeros(len(one)), np.ones(len(one), bool)
    begun = part * _FIRST
    while going.any():
        overlap, parting = law.overlap(state)[0], law.parting(state)
        to_end = np.where(parting > 0.0, overlap / np.where(parting > 0.0, parting, 1.0), np.inf)
        step = np.minimum(part, (_GROWTH - 1.0) * np.minimum(elapsed + 4.0 * begun, to_end)) * going
        k1 = law.forces(state)[0]
        k2 = law.forces(state + 0.5 * step * k1)[0]
        k3 = law.forces(state + 0.5 * step * k2)[0]
        k4 = law.forces(state + step * k3)[0]
        state = state + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        elapsed = elapsed + step
        _, state[10], force = law.forces(state)
        overlap = law.overlap(state)[0]
        deepest, strongest = np.maximum(deepest, overlap), np.maximum(strongest, force)
        going &= (overlap > _FIRST * deepest) | (elapsed < part)
    return _rebounds(state, deepest, strongest, elapsed)


def stepped(one: Impacts, time_step: float, phase: Array | float, length: float) -> Rebounds:
    """The law in the engines' scheme over `length` (s): leapfrog, forces from positions and from velocities half a step older.

    `phase` (1 or (n,), 0 ... 1) is the part of a step that passes before the touch.
    """
    law = _Law(one)
    state = law.start(one.closing * time_step * phase)
    deepest, strongest = np.zeros(len(one)), np.zeros(len(one))
    steps = math.ceil(length / time_step)
    for _ in range(steps):
        rate, state[10], force = law.forces(state, time_step)
        overlap = law.overlap(state)[0]
        deepest, strongest = np.maximum(deepest, overlap), np.maximum(strongest, force * (overlap > 0.0))
        state[4:10] += time_step * rate[4:10]
        state[:4] += time_step * state[4:8]
    # The flights before the touch and after the release are straight.
    release = steps * time_step + law.overlap(state)[0] / law.parting(state)
    return _rebounds(state, deepest, strongest, release - phase * time_step)


def partial_slip(one: Impacts, springs: int = 400, parts: int = 2000) -> Rebounds:
    """Elastic impact on a plane with the contact of Cattaneo, Mindlin and Deresiewicz, in which slip spreads from the edge.

    The method of dimensionality reduction maps that contact exactly on a row of independent springs under the profile x^2 / R, each with
    Coulomb's law of its own (I. A. Lyashenko, V. L. Popov, Sci. Rep. 5 (2015) 8479, for contacts that stick). Normal and tangential
    problem are uncoupled.
    """
    reach = np.sqrt(one.reduced_radius * one.peak_overlap)[:, None]
    place = (np.arange(springs) + 0.5) / springs * reach
    width = 2.0 * reach / springs
    profile = place**2 / one.reduced_radius[:, None]
    step = 1.02 * one.duration / parts
    turn = 2.5 / (one.mass * one.radius**2)
    overlap, normal, slide, spin = np.zeros(len(one)), one.normal.copy(), one.slide.copy(), one.spin.copy()
    load = np.zeros_like(place)
    for _ in range(parts):
        overlap = overlap - 0.5 * step * normal
        arm = one.radius - 0.5 * overlap
        pressed = np.maximum(overlap[:, None] - profile, 0.0) * width * one.e_star[:, None]
        limit = one.friction[:, None] * pressed
        load = np.clip(load - 4.0 * one.g_star[:, None] * width * ((slide + arm * spin) * step)[:, None], -limit, limit)
        force, friction = hertz_force(one, overlap), load.sum(axis=1)
        normal = normal + step * force / one.mass
        slide, spin = slide + step * friction / one.mass, spin + step * turn * arm * friction
        overlap = overlap - 0.5 * step * normal
    still = np.zeros(len(one))
    return Rebounds(slide, normal, spin, still, still, still, one.peak_overlap, one.peak_force, one.duration)


def sliding_throughout(one: Impacts) -> Rebounds:
    """Rigid bodies that slide from touch to release: the tangential impulse is mu (1 + e) m* v_n."""
    impulse = (1.0 + one.restitution) * one.reduced_mass * one.closing
    friction = -np.sign(one.sliding) * one.friction * impulse
    turn_2 = np.where(np.isinf(one.radius_2), 0.0, 2.5 * friction / (one.mass_2 * np.where(np.isinf(one.radius_2), 1.0, one.radius_2)))
    return Rebounds(
        one.slide + friction / one.mass, one.normal + impulse / one.mass, one.spin + 2.5 * friction / (one.mass * one.radius),
        one.slide_2 - friction / one.mass_2, one.normal_2 - impulse / one.mass_2, one.spin_2 + turn_2,
        one.peak_overlap, one.peak_force, one.duration,
    )  # fmt: skip
