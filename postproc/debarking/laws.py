"""Forces that remove bark and damage wood, how forces follow from impulses, and how bark goes under effective impacts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.common.choices import nearest
from dembark.common.errors import DembarkError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bond:
    """Measured shear `strength` (Pa) of the bond of bark and wood of a `species` in a `condition`."""

    species: str
    condition: str
    strength: float
    source: str


_VILKOVSKY = "Vilkovský et al., Forests 13 (2022) 637: means, along the grain, green wood"
_BELLI = "Belli, Forest Prod. J. 46 (1996) 75: means, after 80 days of storage"
# No number was found for pine and birch, nor for any frozen wood.
BONDS = (
    Bond("spruce", "dormant", 0.36e6, _VILKOVSKY), Bond("spruce", "growing", 0.26e6, _VILKOVSKY),
    Bond("beech", "dormant", 0.48e6, _VILKOVSKY), Bond("beech", "growing", 0.46e6, _VILKOVSKY),
    Bond("oak", "dormant", 0.49e6, _VILKOVSKY), Bond("oak", "growing", 0.39e6, _VILKOVSKY),
    Bond("hickory", "stored wet", 0.93e6, _BELLI), Bond("hickory", "stored dry", 3.2e6, _BELLI),
)


def bond(species: str, condition: str) -> Bond:
    """The measured bond of a species in a condition; DembarkError where no number is known."""
    conditions = {one.condition: one for one in BONDS if one.species == species}
    if not conditions:
        raise DembarkError(f"no measured strength of the bond of bark and wood is known for {species!r}",
                           nearest(species, {one.species for one in BONDS}), "give the force or the strength itself")
    if condition not in conditions:
        raise DembarkError(f"no measured strength of the bond of bark and wood is known for {species} in the condition {condition!r}",
                           nearest(condition, conditions), "give the force or the strength itself")
    return conditions[condition]


def bark_force(strength: float, area: float, friction: float) -> float:
    """Normal force (N) at which the friction of a sliding contact of the `area` (m2) shears a bond of the `strength` (Pa): strength area /
    friction."""
    return strength * area / friction


def peak_of_speed(speed: float, stiffness: float, mass: float) -> float:
    """Peak force (N) of the impact of a body of the reduced `mass` (kg) at `speed` (m/s) on a spring (N/m) without damping: v sqrt(k m).

    It is an upper bound with contact damping of a damping ratio up to 1/2, too.
    """
    return speed * math.sqrt(stiffness * mass)


def force_bound(speed: float, radius: float, stiffness: float, mass: float, gravity: float = 9.81) -> float:
    """N; that no impact of one or two logs exceeds in a drum of the `radius` R (m): v sqrt(s m) with v^2 = (speed R)^2 + 4 g R, rad/s.

    Two of the heaviest logs (`mass`, kg; `stiffness`, N/m) meet head on, each with the speed of the shell and of a fall through the drum.
    """
    return peak_of_speed(math.sqrt((speed * radius) ** 2 + 4.0 * gravity * radius), stiffness, mass)


def peak_of_impulse(impulse: Array, stiffness: float, mass: float, restitution: float) -> Array:
    """Peak force (N) of an `impulse` (N s) that is known without its duration: J = m v (1 + e), so F = J sqrt(k / m) / (1 + e)."""
    return np.asarray(impulse * (math.sqrt(stiffness / mass) / (1.0 + restitution)))


def peak_of_duration(impulse: Array, duration: Array) -> Array:
    """Peak force (N) of a half sine of the `impulse` (N s) and `duration` (s): pi J / (2 T). Every pulse has at least J / T."""
    return np.asarray(0.5 * math.pi * impulse / duration)


@dataclass(frozen=True)
class ForceRange:
    """Peak forces (N) from `bark`, which removes bark, to `wood`, above which wood is damaged; DembarkError where they are no range."""

    bark: float
    wood: float

    def __post_init__(self) -> None:
        if not self.bark > 0.0:
            raise DembarkError(f"the force that removes bark is {self.bark:g} N", "", "it must be > 0 N")
        if not self.wood > self.bark:
            raise DembarkError(f"the force that removes bark, {self.bark:g} N, is not below the one that damages wood, {self.wood:g} N", "",
                               "no impact can remove bark and spare the wood")


@dataclass(frozen=True)
class RemovalLaw:
    """How bark goes; one of the two numbers.

    width : m of the circumference that an effective impact clears, over the length of the log. In a sector of the arc a, n impacts at
        random places leave (1 - width/a)^n of the bark: the chance that an impact removes a piece of bark is width/a
    energy : J/m2 of friction that the removal of bark takes. What falls on bare wood is lost: E on the area A leaves exp(-E / (energy A))
    """

    width: float | None = None
    energy: float | None = None

    def __post_init__(self) -> None:
        given = [value for value in (self.width, self.energy) if value is not None]
        if len(given) != 1 or not given[0] > 0.0:
            raise DembarkError("the law of debarking has one positive number", "", "give the width that an effective impact clears (m), or "
                               "the energy of friction that takes bark off (J/m^2)")

    def left(self, impacts: Array, friction: Array, arcs: Array, length: float) -> Array:
        """Share of bark (..., n, m) that `impacts` and `friction` (J), both (..., n, m), leave in the m sectors of n logs with the arcs
        (n,) in m and the `length` in m (NaN: unknown)."""
        if self.width is not None:
            if self.width >= arcs.min():
                raise DembarkError(f"an effective impact clears {1e3 * self.width:g} mm, a sector of the thinnest log has "
                                   f"{1e3 * arcs.min():.3g} mm", "", "take fewer sectors")
            return np.asarray((1.0 - self.width / arcs[:, None]) ** impacts)
        assert self.energy is not None
        if math.isnan(length):
            raise DembarkError("the length of the logs is not known", "", "give it; the energy of friction counts per area")
        return np.asarray(np.exp(-friction / (self.energy * length * arcs[:, None])))

    def even(self, impacts: Array, friction: Array, circumferences: Array, length: float, times: Sequence[float]) -> Array:
        """Degree of debarking (t,) after `times` (s) of logs that are hit evenly around, with the rates of `impacts` (1/s) and of
        `friction` (W) of each log (n,)."""
        exponent = impacts * self.width if self.width is not None else friction / (self.energy * length)  # type: ignore[operator]
        left = np.exp(-np.outer(times, exponent / circumferences))
        return np.asarray(1.0 - left @ circumferences / circumferences.sum())
