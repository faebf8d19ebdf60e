"""Durations and sizes of memory as users write them in a campaign, `2 h 30 min`, `1.5 GB`, and back."""

from __future__ import annotations

import re
from collections.abc import Mapping

from dembark.common.errors import DembarkError
from dembark.common.units import refuse_comma

_TIMES = {"s": 1.0, "sec": 1.0, "min": 60.0, "h": 3600.0, "hour": 3600.0, "hours": 3600.0, "d": 86400.0, "day": 86400.0, "days": 86400.0}
_SIZES = {"kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12, "KiB": 2.0**10, "MiB": 2.0**20, "GiB": 2.0**30, "TiB": 2.0**40}
_PART = re.compile(r"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*([A-Za-z]+)")


def _total(text: str, units: Mapping[str, float]) -> float:
    position, total = 0, 0.0
    while position < len(text.rstrip()):
        part = _PART.match(text, position)
        if not part or part.group(2) not in units:
            raise ValueError(text)
        total, position = total + float(part.group(1)) * units[part.group(2)], part.end()
    if total <= 0.0:
        raise ValueError(text)
    return total


def _refuse_decimal_comma(text: str) -> None:
    # A comma between two durations is another mistake.
    if re.search(r"\d,\d", text):
        refuse_comma(text)


def seconds(text: str) -> float:
    """A positive duration in s, of a text such as `90 s`, `10 min`, `2 h 30 min`, `1 d`; DembarkError when it is none."""
    _refuse_decimal_comma(text)
    try:
        return _total(text, _TIMES)
    except ValueError:
        right = 'wanted is a positive one with its unit: "90 s", "10 min", "2 h 30 min", "1 d"'
        raise DembarkError(f"{text!r} is no duration", right) from None


def size(text: str) -> float:
    """A positive amount of memory in bytes, of a text such as `800 MB`, `1.5 GB`, `2 GiB`; DembarkError when it is none."""
    _refuse_decimal_comma(text)
    try:
        return _total(text, _SIZES)
    except ValueError:
        right = 'wanted is a positive one with its unit: "800 MB", "1.5 GB", "2 GiB"'
        raise DembarkError(f"{text!r} is no amount of memory", right) from None


def size_text(count: float) -> str:
    """Bytes for people: `12 MB`, `3.4 GB`."""
    for unit in ("GB", "MB", "kB"):
        if count >= _SIZES[unit]:
            return f"{count / _SIZES[unit]:.3g} {unit}"
    return f"{count:.0f} B"


def core_hours(core_seconds: float) -> str:
    """Core-hours for people, from core-seconds: `0.02`, `1.3`, `120`."""
    hours = core_seconds / 3600.0
    return f"{hours:.0f}" if hours >= 99.5 else f"{hours:.2g}"
