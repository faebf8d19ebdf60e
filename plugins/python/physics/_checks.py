"""Checks of arguments shared by the laws: one clear line for each mistake."""

from __future__ import annotations

from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics

# The numbers of a contact by name, as all engines check them.
# Engines take these in other units, too; in SI no liquid has more.
_MOST = {"surface_tension": 10.0}
CONTACT_PARAMETERS: dict[str, dict[str, Any]] = {str(row["name"]): row for row in _physics.contact_parameters()}


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
        given = np.asarray(value)
        # Of these float64 would make numbers.
        if given.dtype.kind in "bSU" or (given.dtype.kind == "O" and any(one is None for one in given.flat)):
            raise TypeError
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number or an array of numbers ({unit}), not {value!r}") from None
    bad = np.isnan(array) | (array <= low if low_open else array < low) | (array > high)
    if not infinite:
        bad |= np.isinf(array)
    if bad.any():
        first = array[bad].flat[0]
        if low == -np.inf and high == np.inf:
            raise ValueError(f"{name} must be a {'' if infinite else 'finite '}number{f' ({unit})' if unit else ''}, not {first:g}")
        bound = f"> {low:g}" if low_open else f">= {low:g}" if high == np.inf else f"between {low:g} and {high:g}"
        raise ValueError(f"{name} must be {f'{bound} {unit}'.rstrip()}{'' if infinite else ' and finite'}, not {first:g}")
    return array


def together(**arrays: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The arguments of these names, broadcast against each other; ValueError naming them with their shapes where they do not fit."""
    try:
        return list(np.broadcast_arrays(*arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items() if array.shape)
        raise ValueError(f"the shapes of {shapes} do not fit together: they must be equal or broadcast") from None


def vectors(name: str, value: ArrayLike, unit: str, n: int, dimension: int) -> NDArray[np.float64]:
    """A vector of `dimension` components for all, or one for each of `n`, as (n, 3); in the plane the third one is 0."""
    array = numbers(name, value, unit)
    if array.shape not in ((n, dimension), (dimension,)):
        raise ValueError(f"{name} must have the shape ({n}, {dimension}), not {array.shape} ({unit})")
    out = np.zeros((n, 3))
    out[:, :dimension] = array
    return out


def one_each(name: str, value: ArrayLike, unit: str, n: int, thing: str, **limits: Unpack[Limits]) -> NDArray[np.float64]:
    """A number for all of `n` things, or one for each, as (n,)."""
    array = numbers(name, value, unit, **limits)
    if array.shape not in ((), (n,)):
        raise ValueError(f"{name} must be a number or have one value a {thing}, shape ({n},), not {array.shape} ({unit})")
    return np.broadcast_to(array, (n,)).astype(float)


def contact_number(name: str, value: ArrayLike, label: str = "") -> NDArray[np.float64]:
    """`value` of the contact parameter `name` as float64; ValueError, under the name `label` if given, for one out of range."""
    row, label = CONTACT_PARAMETERS[name], label or name
    array = numbers(label, value, row["unit"], infinite=True)
    bad = (array <= row["low"] if row["low_open"] else array < row["low"]) | (array > row["high"])
    if not row["infinite"]:
        bad |= np.isinf(array)
    if name in _MOST and (array[~bad] > _MOST[name]).any():
        raise ValueError(f"{label} ({row['unit']}) must be at most {_MOST[name]:g}, not {array.max():g}; is it in m{row['unit']}?")
    if bad.any():
        unit = "" if row["unit"] == "1" else f" ({row['unit']})"
        raise ValueError(f"{label}{unit} must be {row['range']}, not {array[bad].flat[0]:g}")
    return array
