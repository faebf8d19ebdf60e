"""Checks of arguments shared by the laws: one clear line for each mistake."""

from __future__ import annotations

from typing import TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Limits(TypedDict, total=False):
    """What `numbers` allows."""

    low: float
    high: float
    low_open: bool
    infinite: bool


def numbers(name: str, value: ArrayLike, unit: str, *, low: float = -np.inf, high: float = np.inf, low_open: bool = False,
            infinite: bool = False) -> NDArray[np.float64]:
    """`value` as float64, or ValueError naming the argument, its unit and what would be right."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number or an array of numbers ({unit}), not {value!r}") from None
    bad = np.isnan(array) | (array <= low if low_open else array < low) | (array > high)
    if not infinite:
        bad |= np.isinf(array)
    if bad.any():
        first = array[bad].flat[0]
        if low == -np.inf and high == np.inf:
            raise ValueError(f"{name} must be a {'' if infinite else 'finite '}number ({unit}), not {first:g}")
        bound = f"> {low:g}" if low_open else f">= {low:g}" if high == np.inf else f"between {low:g} and {high:g}"
        raise ValueError(f"{name} must be {bound} {unit}{'' if infinite else ' and finite'}, not {first:g}")
    return array
