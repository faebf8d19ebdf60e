"""Liquid that grains and walls lend to bridges and get back: the rule of carried liquid."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import numbers, together

LIQUID_SHARES: tuple[str, ...] = tuple(_physics.liquid_shares())
LIQUID_RETURNS: tuple[str, ...] = tuple(_physics.liquid_returns())


class LiquidBridge(NamedTuple):
    """Volumes (m^3): of the bridge, what each side gives as it forms, what each gets back when it breaks."""

    volume: NDArray[np.float64] | float
    from_i: NDArray[np.float64] | float
    from_j: NDArray[np.float64] | float
    back_i: NDArray[np.float64] | float
    back_j: NDArray[np.float64] | float


def _columns(**arrays: NDArray[np.float64]) -> tuple[tuple[int, ...], list[NDArray[np.float64]]]:
    columns = together(**arrays)
    return columns[0].shape, [np.ascontiguousarray(c.ravel()) for c in columns]


def _shaped(result: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64] | float:
    return result.reshape(shape) if shape else float(result[0])


def liquid_share(radius: ArrayLike, other: ArrayLike, *, share: str = "cap", factor: float = 1.0) -> NDArray[np.float64] | float:
    """Share (0...1) of its liquid that a grain is asked for by a new bridge to another.

    Parameters broadcast against each other; a scalar comes back for scalars.

    radius, other : m, > 0: of the grain, and of what it touches; ``inf`` is a wall
    share : 'cap': factor/2 (1 - sqrt(1 - other^2/(radius + other)^2)), the film on the facing cap (Shi & McCarthy, Powder Technology 184
        (2008) 64); 'fraction': the factor itself
    factor : 0...2 for 'cap', 0...1 for 'fraction', 0 excluded

    >>> round(liquid_share(1e-3, 1e-3), 6), liquid_share(1e-3, float("inf"))
    (0.066987, 0.5)
    """
    if share not in LIQUID_SHARES:
        raise ValueError(f"share {share!r} is unknown; it can be {', '.join(LIQUID_SHARES)}")
    shape, (own, others) = _columns(radius=numbers("radius", radius, "m", low=0.0, low_open=True),
                                    other=numbers("other", other, "m", low=0.0, low_open=True, infinite=True))
    return _shaped(_physics.liquid_share(own, others, share, float(factor)), shape)


def liquid_grant(liquid: ArrayLike, demand: ArrayLike) -> NDArray[np.float64] | float:
    """Volume (m^3) that a holder of `liquid` (m^3) gives per unit share: liquid / max(1, demand).

    demand : sum, >= 0, of all shares that are asked of it at once. What it gives in all, demand times this, is never more than there is.

    >>> liquid_grant(6e-12, [0.5, 3.0]).tolist()
    [6e-12, 2e-12]
    """
    shape, columns = _columns(liquid=numbers("liquid", liquid, "m^3", low=0.0), demand=numbers("demand", demand, "", low=0.0))
    return _shaped(_physics.liquid_grant(*columns), shape)


def liquid_bridge(given_i: ArrayLike, given_j: ArrayLike, radius_i: ArrayLike, radius_j: ArrayLike, *, split: str = "equal",
                  wall_part: ArrayLike = 0.0, largest: ArrayLike = np.inf) -> LiquidBridge:
    """The bridge of two sides, and how its liquid is split when it breaks.

    Parameters broadcast against each other; scalars come back for scalars.

    given_i, given_j : m^3, >= 0: share times grant of each side
    radius_i, radius_j : m, > 0; ``inf`` for j is a wall
    split : 'equal': halves; 'radius': Ri/(Ri + Rj) to i; 'taken': what each gave
    wall_part : 0...1: part of the bridge that a wall gets back, unless `split` is 'taken'
    largest : m^3, > 0: a bridge holds no more; both sides then give less, in proportion

    The volume is from_i + from_j = back_i + back_j. Raises ValueError or TypeError for arguments out of range.

    >>> liquid_bridge(3e-12, 1e-12, 2e-3, 1e-3, split="taken").back_i
    3e-12
    """
    if split not in LIQUID_RETURNS:
        raise ValueError(f"split {split!r} is unknown; it can be {', '.join(LIQUID_RETURNS)}")
    shape, (volumes_i, volumes_j, radii_i, radii_j, walls, limits) = _columns(
        given_i=numbers("given_i", given_i, "m^3", low=0.0), given_j=numbers("given_j", given_j, "m^3", low=0.0),
        radius_i=numbers("radius_i", radius_i, "m", low=0.0, low_open=True),
        radius_j=numbers("radius_j", radius_j, "m", low=0.0, low_open=True, infinite=True),
        wall_part=numbers("wall_part", wall_part, "", low=0.0, high=1.0),
        largest=numbers("largest", largest, "m^3", low=0.0, low_open=True, infinite=True))
    parts = _physics.liquid_bridge(volumes_i, volumes_j, radii_i, radii_j, walls, limits, LIQUID_RETURNS.index(split))
    return LiquidBridge(*(_shaped(part, shape) for part in parts))
