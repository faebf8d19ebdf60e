"""Numbers as users write them: `0.02`, `20 mm`, `30 deg`, `1/2`; returned in the SI unit that a parameter declares. Durations and sizes of
memory, `2 h 30 min`, `1.5 GB`, and back.

What counts as a number is decided here and nowhere else. The unit library alone would take `0,3` for 0, `4.5.6` for 2.7 and `9 81` for 729.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, cast

from .errors import DembarkError

if TYPE_CHECKING:
    import pint

# Of a number as users write it, without groups.
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
# A number or a fraction of two, then a unit, in which a digit can only be part of a power.
_VALUE = re.compile(rf"\s*(?P<number>{NUMBER}(?:\s*/\s*{NUMBER})?)\s*\*?\s*(?P<unit>[^\W\d].*|[%°].*|)\s*")
_IN_UNIT = re.compile(r"(?:[^\W\d]+\d?|[%°]|(?:\^|\*\*)\s*\(?[-+]?\d+(?:\.\d+)?\)?|[*/·()]|\s+)*")
# Products and powers of these are known without the library, which takes a while to load.
_SYMBOL = r"(?:m|s|kg|N|Pa|J|W|rad|K)(?:\^[1-9])?"
_PLAIN = re.compile(rf"1|{_SYMBOL}(?:[*/ ]{_SYMBOL})*")
# What a quantity may be measured in, a grain's diameter or a vessel's radius, is a day and the gas constant to the library.
_SCALES = ("d", "R")
_POWER = re.compile(r"([^\W\d]+)(\d)")
_EXAMPLES = {"m": "4 mm", "m^2": "4 mm^2", "m^3": "0.08 mm^3", "s": "2 ms", "m/s": "2 cm/s", "m/s^2": "9.81 m/s^2", "kg": "2 g",
             "kg/m^3": "2.5 g/cm^3", "Pa": "5 MPa", "Pa*s": "1 mPa*s", "N": "2 mN", "N/m": "72 mN/m", "rad": "20 deg", "rad/s": "14 rpm",
             "1": "0.3"}
_TIMES = {"s": 1.0, "sec": 1.0, "min": 60.0, "h": 3600.0, "hour": 3600.0, "hours": 3600.0, "d": 86400.0, "day": 86400.0, "days": 86400.0}
_SIZES = {"kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12, "KiB": 2.0**10, "MiB": 2.0**20, "GiB": 2.0**30, "TiB": 2.0**40}
_PART = re.compile(r"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*([A-Za-z]+)")


@cache
def _registry() -> pint.UnitRegistry[float]:
    # Loaded on first use: plain numbers, the common case, shall not wait for it.
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def _angle_power(quantity: pint.Quantity[float]) -> float:
    return cast("float", dict(quantity.to_root_units().unit_items()).get("radian", 0))


def known_unit(unit: str) -> bool:
    """Whether `unit` is `1`, a scale (d, R) or a unit that can be converted to."""
    if unit in _SCALES or _PLAIN.fullmatch(unit):
        return True
    try:
        # Another sign is dropped by the tokeniser of some versions of Python, and is an error to that of others.
        return bool(_IN_UNIT.fullmatch(unit.removeprefix("1")) and _registry().Unit(unit))
    except Exception:  # noqa: BLE001 (the parser of unit texts raises many kinds, none of which means anything else here)
        return False


def si_unit(unit: str) -> bool:
    """Whether `unit` is `1` or one of SI without a factor, so that engines may read its numbers: `Pa*s`, not `mm`, nor `d`, which is a
    day."""
    if _PLAIN.fullmatch(unit):
        return True
    return known_unit(unit) and math.isclose(_registry().Quantity(1.0, unit).to_base_units().magnitude, 1.0)


def example(unit: str) -> str:
    """A value in `unit` as a user may write it: `'4 mm'` for m, `0.3` for `1`."""
    return _EXAMPLES["1"] if unit == "1" else repr(_EXAMPLES.get(unit, f"5 {unit}"))


def refuse_comma(text: str, name: str = "") -> None:
    """DembarkError when the number `text` has a comma; `name` is what it was given for."""
    if "," in text:
        right = f"write the decimal point: {text.strip().replace(',', '.')}"
        if text.count(",") > 1 or "." in text:
            right = f"write a decimal point and nothing between thousands: {example('1')} or 1000.5"
        raise DembarkError(f"{name}: {text!r} has a comma; {right}" if name else f"{text!r} has a comma; {right}")


def finite(value: float, name: str = "", text: str = "") -> float:
    """`value`, given for `name` as `text`, when it is finite; DembarkError for nan, inf and what is too large for a number (1e400)."""
    if math.isfinite(value):
        return value
    raise DembarkError(f"{name} = {text or value}: give a finite number" if name else f"{text or str(value)!r}: give a finite number")


def to_si(text: str, unit: str, name: str = "") -> float:
    """Value of `text` in `unit` (`1` = dimensionless); a plain number is already in that unit. `name` is what it was given for.

    Angles count as a dimension of their own: `30 deg` is refused where a plain ratio is wanted. Raises DembarkError when the text is no
    finite number, has a comma, an unknown unit or one of another dimension, or when it is a unit without a number.
    """
    refuse_comma(text, name)
    try:
        return finite(float(text), name, text.strip())
    except ValueError:
        pass
    head = f"{name}: " if name else ""
    shown = repr(text.strip())
    match = _VALUE.fullmatch(text)
    if match is None or not _IN_UNIT.fullmatch(match["unit"]):
        if _IN_UNIT.fullmatch(text.strip()) and text.strip() and known_unit(text.strip()) and unit != "1":
            raise DembarkError(f"{name} = {text.strip()}: give a number with it, e.g. {example(unit)}" if name else
                               f"{shown} is a unit without a number; give e.g. {example(unit)}")
        kind = "plain number" if unit == "1" else "number, with or without a unit"
        raise DembarkError(f"{head}{shown} is not a {kind}; give e.g. {example(unit)}")
    value = _converted(match["number"], match["unit"].strip(), unit, head, shown)
    return finite(value, name, text.strip())


def _converted(number: str, given: str, unit: str, head: str, shown: str) -> float:
    first, _, second = number.partition("/")
    try:
        factor = float(first) / (float(second) if second else 1.0)
    except ZeroDivisionError:
        raise DembarkError(f"{head}{shown} divides by zero; give e.g. {example(unit)}") from None
    import pint

    try:
        quantity = _registry().Quantity(factor, given)
        target = _registry().Unit("" if unit == "1" else unit)
        # 15 digits: 72 mN/m shall be the same input as 0.072 N/m.
        value = float(f"{quantity.to(target).magnitude:.15g}")
    except pint.UndefinedUnitError:
        # People write m3 where the library needs m^3.
        mended = _POWER.sub(r"\1^\2", given)
        right = f"write the power with ^: '{number} {mended}'" if mended != given and known_unit(mended) else f"give e.g. {example(unit)}"
        raise DembarkError(f"{head}unknown unit {given!r} in {shown}; {right}") from None
    except Exception:  # noqa: BLE001 (the library raises its own kinds and those of Python's tokeniser)
        raise DembarkError(f"{head}cannot convert {shown} to {'a plain number' if unit == '1' else unit}; "
                           f"give e.g. {example(unit)}") from None
    if not quantity.unitless and _angle_power(quantity) != _angle_power(1 * target):
        raise DembarkError(f"{head}{shown} mixes up angles and plain ratios; give e.g. {example(unit)}")
    return value


def seconds(text: str) -> float:
    """A positive duration in s, of a text such as `90 s`, `10 min`, `2 h 30 min`, `1 d`; DembarkError when it is none."""
    return _total(text, _TIMES, "a duration", '"90 s", "10 min", "2 h 30 min", "1 d"')


def size(text: str) -> float:
    """A positive amount of memory in bytes, of a text such as `800 MB`, `1.5 GB`, `2 GiB`; DembarkError when it is none."""
    return _total(text, _SIZES, "an amount of memory", '"800 MB", "1.5 GB", "2 GiB"')


def _total(text: str, units: Mapping[str, float], what: str, examples: str) -> float:
    # A comma between two durations is another mistake.
    if re.search(r"\d,\d", text):
        refuse_comma(text)
    parts = _PART.findall(text)
    total = sum(float(number) * units.get(unit, math.nan) for number, unit in parts)
    if _PART.sub("", text).strip() or not total > 0.0:
        raise DembarkError(f"{text!r} is not {what}", f"give a positive one with its unit: {examples}")
    return total


def size_text(count: float) -> str:
    """Bytes for people: `12 MB`, `3.4 GB`."""
    for unit in ("TB", "GB", "MB", "kB"):
        if round(count / _SIZES[unit], 3) >= 1.0:
            return f"{count / _SIZES[unit]:.3g} {unit}"
    return f"{count:.0f} B"


def core_hours(core_seconds: float) -> str:
    """Core-hours for people, from core-seconds: `0.02`, `1.3`, `120`."""
    hours = core_seconds / 3600.0
    return f"{hours:.0f}" if hours >= 99.5 else f"{hours:.2g}"


def duration(seconds: float | None) -> str:
    """A duration for people, from s: `45 s`, `3 min 20 s`, `2 h 5 min`; `–` for none."""
    if seconds is None:
        return "–"
    rounded = round(seconds)
    if rounded < 60:
        return f"{rounded} s"
    if rounded < 3600:
        return f"{rounded // 60} min {rounded % 60} s"
    return f"{rounded // 3600} h {rounded % 3600 // 60} min"
