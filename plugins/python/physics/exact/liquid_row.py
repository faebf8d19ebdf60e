"""Liquid of grains in a row that swing on given paths, by the rule of sharing alone: a loop over the time steps, without an engine and
without the project's headers.

In each step bridges whose gap exceeds their rupture distance give back; then all touching pairs without a bridge are granted what they
ask for, together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rule:
    """How liquid is shared.

    share, factor : what a bridge asks of a grain: "cap", `factor` times the liquid on the cap that faces the other side, or "fraction",
        the part `factor` of all
    back : how the liquid of a broken bridge is split between two grains: "equal", by "radius", or as it was "taken"
    largest : largest volume of a new bridge in m^3
    contact_angle : rad, for the rupture distance of Willett et al., Langmuir 16 (2000) 9396, with R = 2 R*
    """

    share: str
    factor: float
    back: str
    largest: float
    contact_angle: float

    def rupture(self, volume: Array, own: Array, other: Array) -> Array:
        """Gap (m) at which bridges of `volume` (m^3) between the radii `own` and `other` break."""
        root = np.cbrt(volume)
        return (1.0 + 0.5 * self.contact_angle) * (root + 0.05 * root**2 * (1.0 / own + 1.0 / other))


@dataclass(frozen=True)
class Row:
    """n grains between walls at x = 0 and at `end` (m), on the paths x = middle + reach sin(2 pi t / period).

    radii, middles : (n,) in m; periods : (n,) in s; reach : m
    volumes : (n,) in m^3, liquid of the grains at the start
    wall, wall_share, wall_part : liquid (m^3) of the left wall at the start, the part of it that it gives to a bridge, and the part of a
        broken bridge that it keeps; the right wall gives and keeps nothing
    """

    radii: Array
    middles: Array
    periods: Array
    reach: float
    end: float
    volumes: Array
    wall: float
    wall_share: float
    wall_part: float

    def gaps(self, times: Array) -> Array:
        """Gaps (m) between all neighbours from the left wall to the right one, (times, n + 1)."""
        x = self.middles + self.reach * np.sin(2.0 * np.pi * times[:, None] / self.periods)
        walls = np.zeros((len(x), 1)), np.full((len(x), 1), self.end)
        return np.hstack((x - self.radii, walls[1])) - np.hstack((walls[0], x + self.radii))


@dataclass(frozen=True)
class Books:
    """Liquid (m^3) after each of some steps: `grains` (steps, n), `bridges`, `wall` (the left one) and the number of bridges, `count`
    (steps,)."""

    grains: Array
    bridges: Array
    wall: Array
    count: Array

    @property
    def total(self) -> Array:
        """All liquid (m^3)."""
        return self.grains.sum(axis=1) + self.bridges + self.wall


def books(row: Row, rule: Rule, time_step: float, steps: Sequence[int] | Array) -> Books:
    """Books after each of `steps`, counted from 1, of `time_step` (s)."""
    # Contact k is between the bodies k and k + 1; body 0 is the left wall, the last one the right wall.
    sides = np.arange(len(row.radii) + 1)[:, None] + np.array([0, 1])
    radii = np.array([np.inf, *row.radii, np.inf])
    own, other = radii[sides].T
    ask, part = _shares(rule, radii[sides])
    ask[0, 0], ask[-1, 1] = row.wall_share, 0.0
    part[0], part[-1] = (row.wall_part, 1.0 - row.wall_part), (1.0, 0.0)

    def of_bodies(amounts: Array) -> Array:
        return np.asarray(np.bincount(sides.ravel(), amounts.ravel(), len(radii)), float)

    owned, volume, back = np.array([row.wall, *row.volumes, 0.0]), np.zeros(len(sides)), np.zeros(sides.shape)
    rupture, wanted, found = np.zeros(len(sides)), {int(step) for step in steps}, []
    for step, gap in enumerate(row.gaps(time_step * np.arange(1.0, max(wanted) + 1)), start=1):
        broken = (volume > 0.0) & (gap > rupture)
        owned, volume = owned + of_bodies(back * broken[:, None]), np.where(broken, 0.0, volume)
        demand = ask * ((volume == 0.0) & (gap < 0.0))[:, None]
        given = demand * (owned / np.maximum(1.0, of_bodies(demand)))[sides]
        new = given.sum(axis=1) > 0.0
        given[new] *= np.minimum(1.0, rule.largest / given[new].sum(axis=1))[:, None]
        owned = np.maximum(owned - of_bodies(given), 0.0)
        volume[new] = given[new].sum(axis=1)
        back[new] = given[new] if rule.back == "taken" else part[new] * volume[new, None]
        rupture[new] = rule.rupture(volume[new], own[new], other[new])
        if step in wanted:
            found.append((owned[1:-1], volume.sum(), owned[0], np.count_nonzero(volume)))
    return Books(*(np.array(column, float) for column in zip(*found, strict=True)))


def _shares(rule: Rule, radii: Array) -> tuple[Array, Array]:
    """(contacts, 2): the share of its liquid that each side is asked for, and the part of a broken bridge that each side gets, by the
    `radii` of both sides."""
    ratio = radii / radii[:, ::-1]
    # The cap that faces the other side is half of 1 - cos of the angle whose sine is other / (own + other).
    facing = 0.5 * (1.0 - np.sqrt(1.0 - 1.0 / (1.0 + ratio) ** 2)) if rule.share == "cap" else np.ones_like(ratio)
    return rule.factor * facing, 1.0 / (1.0 + ratio[:, ::-1]) if rule.back == "radius" else np.full_like(ratio, 0.5)
