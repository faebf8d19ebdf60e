"""Checks of case `liquid_exchange`: what every grain, the wall and the bridges own, against the rule on the given paths.

The reference is worked out here, without engine and without the project's headers: a loop over the time steps with the positions of the
paths. In each step bridges whose gap exceeds their rupture distance give back; then all touching pairs without a bridge are granted
what they ask for, together. Round-off is all that may differ.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dembark.validation.checks.logs import exact
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica, profile
from numpy.typing import NDArray

Array = NDArray[np.float64]
REFERENCES = ()
SIZES = (1.0, 0.7, 1.2, 0.8, 1.0)
PERIODS = (1.0, 1.37, 0.83, 1.61, 1.13)
WET = (0, 3)
GRAINS = len(SIZES)
LEFT, RIGHT = GRAINS, GRAINS + 1


@dataclass(frozen=True)
class Books:
    """Liquid (m^3) after each of some steps: `grains` (rows, 5), `bridges`, `wall` and `count` (rows,)."""

    grains: Array
    bridges: Array
    wall: Array
    count: Array

    @property
    def total(self) -> Array:
        return self.grains.sum(axis=1) + self.bridges + self.wall


@dataclass
class _Bridge:
    volume: float
    back: tuple[float, float]
    rupture: float


def _asked(p: Mapping[str, Any], own: float, other: float) -> float:
    """Share of its liquid that a grain is asked for: of the cap that faces the other side, or a part of all."""
    if p["liquid_share"] == "fraction":
        return float(p["liquid_share_factor"])
    facing = 0.5 if math.isinf(other) else 0.5 * (1.0 - math.sqrt(1.0 - (other / (own + other)) ** 2))
    return float(p["liquid_share_factor"]) * facing


def _split(p: Mapping[str, Any], pair: tuple[int, int], radii: Sequence[float], given: tuple[float, float]) -> tuple[float, float]:
    """What each side gets back of a bridge that was `given` by both."""
    volume = sum(given)
    if p["liquid_return"] == "taken":
        return given
    if pair[1] >= GRAINS:
        part = p["wall_part"] if pair[1] == LEFT else 0.0
        return (volume * (1.0 - part), volume * part)
    if p["liquid_return"] == "radius":
        part = radii[pair[0]] / (radii[pair[0]] + radii[pair[1]])
        return (volume * part, volume * (1.0 - part))
    return (0.5 * volume, 0.5 * volume)


def _rupture(p: Mapping[str, Any], volume: float, own: float, other: float) -> float:
    """Rupture distance of Willett et al. (2000), R = 2 R*."""
    radius = 2.0 / (1.0 / own + 1.0 / other)
    root = math.cbrt(volume)
    return (1.0 + 0.5 * p["contact_angle"]) * (root + 0.1 * root * root / radius)


def expected(p: Mapping[str, Any], steps: Sequence[int], first: int) -> Books:
    """Books after each of `steps`, for parameters `p`; `first`: the first step in which an engine looks for contacts."""
    radii = [0.5 * p["grain_diameter"] * size for size in SIZES] + [math.inf, math.inf]
    gap, amplitude = p["gap"] * p["grain_diameter"], p["amplitude"] * p["grain_diameter"]
    middles, end = [], gap
    for radius in radii[:GRAINS]:
        middles.append(end + radius)
        end += 2.0 * radius + gap
    pairs = [(0, LEFT), *((k, k + 1) for k in range(GRAINS - 1)), (GRAINS - 1, RIGHT)]
    owned = [p["liquid_content"] * 4.0 / 3.0 * math.pi * radii[k] ** 3 if k in WET else 0.0 for k in range(GRAINS)]
    owned += [p["wall_liquid"], 0.0]
    largest = p["max_bridge"] or math.inf
    bridges: dict[tuple[int, int], _Bridge] = {}
    wanted, rows = set(steps), []
    for step in range(first, max(steps) + 1):
        time = step * p["time_step"]
        x = [m + amplitude * math.sin(2.0 * math.pi * time / (p["period"] * part)) for m, part in zip(middles, PERIODS, strict=True)]

        def apart(pair: tuple[int, int], x: Sequence[float] = x) -> float:
            one, other = pair
            if other == LEFT:
                return x[one] - radii[one]
            return (end if other == RIGHT else x[other] - radii[other]) - x[one] - radii[one]

        for pair, bridge in list(bridges.items()):
            if apart(pair) > bridge.rupture:
                for side, back in zip(pair, bridge.back, strict=True):
                    owned[side] += back
                del bridges[pair]
        asking = [pair for pair in pairs if pair not in bridges and apart(pair) < 0.0]
        shares = {}
        for one, other in asking:
            share = p["wall_share"] if other == LEFT else 0.0 if other == RIGHT else _asked(p, radii[other], radii[one])
            shares[one, other] = (_asked(p, radii[one], radii[other]), share)
        demand = [sum(s for pair in asking for side, s in zip(pair, shares[pair], strict=True) if side == k) for k in range(GRAINS + 2)]
        granted = [owned[k] / max(1.0, demand[k]) for k in range(GRAINS + 2)]
        for pair in asking:
            given = (shares[pair][0] * granted[pair[0]], shares[pair][1] * granted[pair[1]])
            volume = sum(given)
            if not volume > 0.0:
                continue
            if volume > largest:
                given = (given[0] * largest / volume, given[1] * largest / volume)
            bridges[pair] = _Bridge(sum(given), _split(p, pair, radii, given), _rupture(p, sum(given), radii[pair[0]], radii[pair[1]]))
            for side, amount in zip(pair, given, strict=True):
                owned[side] = max(owned[side] - amount, 0.0)
        if step in wanted:
            rows.append([*owned[:GRAINS], sum(b.volume for b in bridges.values()), owned[LEFT], float(len(bridges))])
    table = np.array(rows)
    return Books(table[:, :GRAINS], table[:, GRAINS], table[:, GRAINS + 1], table[:, GRAINS + 2])


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, curves and remarks of the run (there is one)."""
    replica = replicas[0]
    p, times = replica.parameters, replica.times()
    # Nothing touches in the first step, so it does not matter which engine looks at it.
    books = expected(p, [int(step) for step in times["step"]], 1)
    total = books.total[0]
    grains = np.stack([times[f"liquid_{k}"] for k in range(1, GRAINS + 1)], axis=1)
    all_of_it = times["liquid_grains"] + times["liquid_bridges"] + times["liquid_walls"] + times["liquid_lost"]
    found = [
        _zero("total_liquid_error", "largest change of all liquid, over all liquid", np.abs(all_of_it / total - 1.0).max(), 1e-13),
        _zero("sum_error", "liquid on grains less the sum over the grains, over all liquid",
              np.abs(times["liquid_grains"] - grains.sum(axis=1)).max() / total, 1e-13),
        _zero("lost", "liquid lost, over all liquid", np.abs(times["liquid_lost"]).max() / total, 0.0),
    ]
    for k in range(GRAINS):
        found.append(_zero(f"liquid_{k + 1}_error", f"largest error of the liquid of grain {k + 1}, over all liquid",
                           np.abs(grains[:, k] - books.grains[:, k]).max() / total, 1e-12))
    found += [
        _zero("wall_liquid_error", "largest error of the liquid of the left wall, over all liquid",
              np.abs(times["liquid_walls"] - books.wall).max() / total, 1e-12),
        _zero("bridge_volume_error", "largest error of the liquid in bridges, over all liquid",
              np.abs(times["liquid_bridges"] - books.bridges).max() / total, 1e-12),
        _zero("bridge_count_error", "largest error of the number of bridges", np.abs(times["bridge_count"] - books.count).max(), 0.0),
    ]
    for k in range(GRAINS):
        due = exact(books.grains[-1, k])
        found.append(Quantity(f"liquid_{k + 1}", f"liquid of grain {k + 1} at the end", "m^3", exact(grains[-1, k]), reference=due,
                              tolerance=1e-12 * total, absolute=True, agreement=1e-12 * total, source="the rule on the given paths"))
    changes = int(np.abs(np.diff(books.count)).sum())
    found.append(Quantity("changes", "changes of the number of bridges from row to row", "1",
                          exact(np.abs(np.diff(times["bridge_count"])).sum()),
                          reference=exact(changes), tolerance=0.0, agreement=0.0, source="the rule on the given paths"))
    return found, _curves(times, grains, books), [f"All liquid: {total:.6g} m³. Paths are given; forces move nothing."]


def _zero(name: str, label: str, value: float, tolerance: float) -> Quantity:
    return Quantity(name, label, "1", exact(value), reference=exact(0.0), tolerance=tolerance, absolute=True,
                    agreement=tolerance, source="the rule on the given paths", detail="over all rows of time.csv")


def _curves(times: Mapping[str, Array], grains: Array, books: Books) -> list[dict[str, Any]]:
    curves = [profile(f"liquid_{k + 1}", f"Liquid of grain {k + 1}", "time (s)", "V (mm³)", times["time"], [grains[:, k] * 1e9],
                      reference=books.grains[:, k] * 1e9, reference_label="rule") for k in range(GRAINS)]
    curves.append(profile("bridges", "Liquid in bridges", "time (s)", "V (mm³)", times["time"], [times["liquid_bridges"] * 1e9],
                          reference=books.bridges * 1e9, reference_label="rule"))
    return curves


def picture(parameters: Mapping[str, Any]) -> dict[str, Any] | None:
    """Five grains are no picture."""
    del parameters
    return None
