"""Single impacts of a sphere on a plane or another sphere by theories of the literature: Hertz, rigid bodies that slide throughout, and
the contact of Mindlin and Deresiewicz with partial slip.

The motion lies in the plane y, z; spins are about x; the bodies approach each other along z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, gamma

Array = NDArray[np.float64]

# t_c v / d_max of an elastic impact after Hertz.
HERTZ_TIME = 4.0 * math.sqrt(math.pi) * gamma(0.4) / (5.0 * gamma(0.9))


@dataclass(frozen=True)
class Impacts:
    """n impacts, in SI units. (n,): material constants `e_star`, `g_star`, `restitution`, `friction`. (2, n), of the sphere and of its
    partner: `radius` and `mass`, inf for a plane; before the impact the velocities along y and z (`slide`, `normal`) and `spin`.
    `friction_limit`: "total" or "elastic", see FinnieRabinowicz."""

    e_star: Array
    g_star: Array
    restitution: Array
    friction: Array
    radius: Array
    mass: Array
    slide: Array
    normal: Array
    spin: Array
    friction_limit: str = "total"

    def __len__(self) -> int:
        return len(self.e_star)

    @property
    def arm(self) -> Array:
        """Radii (m), 0 in the place of a plane's."""
        return np.where(np.isinf(self.radius), 0.0, self.radius)

    @property
    def inertia(self) -> Array:
        """Moments of inertia of solid spheres (kg m^2), inf for a plane."""
        return 0.4 * self.mass * self.radius**2

    @property
    def reduced_radius(self) -> Array:
        """R* (m)."""
        return 1.0 / (1.0 / self.radius).sum(axis=0)

    @property
    def reduced_mass(self) -> Array:
        """m* (kg)."""
        return 1.0 / (1.0 / self.mass).sum(axis=0)

    @property
    def closing(self) -> Array:
        """Speed of approach (m/s)."""
        return self.normal[1] - self.normal[0]

    @property
    def sliding(self) -> Array:
        """Tangential velocity of the sphere's point of contact relative to the partner's (m/s)."""
        return self.slide[0] - self.slide[1] + (self.arm * self.spin).sum(axis=0)

    @property
    def slides(self) -> bool:
        """Whether friction acts in any of the impacts."""
        return bool((self.sliding != 0.0).any() and (self.friction > 0.0).any())

    def force(self, overlap: Array) -> Array:
        """Hertz, elastic (N) at `overlap` (m)."""
        return 4.0 / 3.0 * self.e_star * np.sqrt(self.reduced_radius) * np.maximum(overlap, 0.0) ** 1.5

    @property
    def peak_overlap(self) -> Array:
        """Hertz, elastic (m)."""
        return (15.0 * self.reduced_mass * self.closing**2 / (16.0 * self.e_star * np.sqrt(self.reduced_radius))) ** 0.4

    @property
    def peak_force(self) -> Array:
        """Hertz, elastic (N)."""
        return self.force(self.peak_overlap)

    @property
    def duration(self) -> Array:
        """Hertz, elastic (s)."""
        return HERTZ_TIME * self.peak_overlap / self.closing

    def pulse(self, times: Array) -> Array:
        """Force (times, n) in N at `times` (times, n) in s since the touch: t = ∫ dδ / (v √(1 − (δ/δ_max)^(5/2))) after Hertz, elastic."""
        # In (δ/δ_max)^(5/2) this is an incomplete beta function.
        from_end = np.maximum(0.0, 1.0 - np.abs(2.0 * times / self.duration - 1.0))
        return self.force(self.peak_overlap * betaincinv(0.4, 0.5, from_end) ** 0.4)


@dataclass(frozen=True)
class Rebounds:
    """After impacts. (2, n), of sphere and partner: velocities along y and z (`slide`, `normal`) in m/s and `spin` in rad/s; (n,): largest
    overlap (m), largest normal force (N) and duration (s)."""

    slide: Array
    normal: Array
    spin: Array
    overlap: Array
    force: Array
    duration: Array

    def numbers(self, one: Impacts) -> dict[str, Array]:
        """By name, (n,) each: `overlap`, `force`, `duration`, and velocities after over the speed of approach: of parting (`restitution`),
        of the sphere along the plane (`slide`), of its surface by its `spin`, and of its point of contact (`patch`)."""
        slide, spin = self.slide[0] / one.closing, one.radius[0] * self.spin[0] / one.closing
        return {"restitution": (self.normal[0] - self.normal[1]) / one.closing, "slide": slide, "spin": spin, "patch": slide + spin,
                "overlap": self.overlap, "force": self.force, "duration": self.duration}


def sliding_throughout(one: Impacts) -> Rebounds:
    """Rigid bodies that slide from touch to release: the tangential impulse is mu (1 + e) m* v_n."""
    apart = np.array([[1.0], [-1.0]])
    impulse = (1.0 + one.restitution) * one.reduced_mass * one.closing
    friction = -np.sign(one.sliding) * one.friction * impulse
    return Rebounds(one.slide + apart * friction / one.mass, one.normal + apart * impulse / one.mass,
                    one.spin + one.arm * friction / one.inertia, one.peak_overlap, one.peak_force, one.duration)


def partial_slip(one: Impacts, springs: int = 400, parts: int = 2000) -> Rebounds:
    """Elastic impact on a plane with the contact of Cattaneo, Mindlin and Deresiewicz, in which slip spreads from the edge.

    The method of dimensionality reduction maps that contact exactly on a row of independent springs under the profile x^2 / R, each with
    Coulomb's law of its own (I. A. Lyashenko, V. L. Popov, Sci. Rep. 5 (2015) 8479, for contacts that stick). Normal and tangential
    problem are uncoupled.
    """
    reach = np.sqrt(one.reduced_radius * one.peak_overlap)[:, None]
    profile = ((np.arange(springs) + 0.5) / springs * reach) ** 2 / one.reduced_radius[:, None]
    width, step = 2.0 * reach / springs, 1.02 * one.duration / parts
    overlap, (normal, slide, spin) = np.zeros(len(one)), (before[0] for before in (one.normal, one.slide, one.spin))
    load = np.zeros_like(profile)
    for _ in range(parts):
        overlap = overlap - 0.5 * step * normal
        arm = one.radius[0] - 0.5 * overlap
        limit = (one.friction * one.e_star)[:, None] * np.maximum(overlap[:, None] - profile, 0.0) * width
        load = np.clip(load - 4.0 * one.g_star[:, None] * width * ((slide + arm * spin) * step)[:, None], -limit, limit)
        friction = load.sum(axis=1)
        normal = normal + step * one.force(overlap) / one.mass[0]
        slide, spin = slide + step * friction / one.mass[0], spin + step * arm * friction / one.inertia[0]
        overlap = overlap - 0.5 * step * normal
    slide, normal, spin = (np.array([after, np.zeros(len(one))]) for after in (slide, normal, spin))
    return Rebounds(slide, normal, spin, one.peak_overlap, one.peak_force, one.duration)
