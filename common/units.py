"""Numbers as users write them: `0.02`, `20 mm`, `30 deg`, `5e6 Pa`; returned in the SI unit that a parameter declares."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

from dembark.common.errors import DembarkError

if TYPE_CHECKING:
    import pint

@cache
def _registry() -> pint.UnitRegistry:
    # Loaded on first use: plain numbers, the common case, shall not wait for it.
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def _angle_power(quantity: pint.Quantity) -> float:
    return dict(quantity.to_root_units().unit_items()).get("radian", 0)


def known_unit(unit: str) -> bool:
    """Whether `unit` is `1` or a unit that can be converted to."""
    if unit == "1":
        return True
    try:
        _registry().Unit(unit)
    except Exception:  # the parser of unit texts raises many kinds, none of which means anything else here
        return False
    return True


def to_si(text: str, unit: str) -> float:
    """Value of `text` in `unit` (`1` = dimensionless); a plain number is already in that unit.

    Angles count as a dimension of their own: `30 deg` is refused where a plain ratio is wanted.
    Raises DembarkError when the text is no number, has an unknown unit or one of another dimension.
    """
    try:
        return float(text)
    except ValueError:
        pass
    wanted = "a plain number" if unit == "1" else f"a number in {unit} or with a unit that converts to {unit}"
    try:
        quantity = _registry().Quantity(text)
        target = _registry().Unit("" if unit == "1" else unit)
        # 15 digits: 72 mN/m shall be the same input as 0.072 N/m.
        magnitude = float(f"{quantity.to(target).magnitude:.15g}")
        same_angle = quantity.unitless or _angle_power(quantity) == _angle_power(1 * target)
    except Exception as error:  # pint raises its own kinds and those of Python's tokeniser
        reason = " ".join(str(error).split()) or type(error).__name__
        raise DembarkError(f"{text!r} is no value here ({reason})", f"wanted is {wanted}") from None
    if not same_angle:
        raise DembarkError(f"{text!r} mixes up angles and plain ratios", f"wanted is {wanted}")
    if math.isnan(magnitude):
        raise DembarkError(f"{text!r} is not a number", f"wanted is {wanted}")
    return magnitude
