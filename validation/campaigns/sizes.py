"""Durations and sizes of memory as users write them in a campaign, `2 h 30 min`, `1.5 GB`, and back."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from dembark.common.errors import DembarkError
from dembark.common.units import refuse_comma

_TIMES = {"s": 1.0, "sec": 1.0, "min": 60.0, "h": 3600.0, "hour": 3600.0, "hours": 3600.0, "d": 86400.0, "day": 86400.0, "days": 86400.0}
_SIZES = {"kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12, "KiB": 2.0**10, "MiB": 2.0**20, "GiB": 2.0**30, "TiB": 2.0**40}
_PART = re.compile(r"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*([A-Za-z]+)")


def seconds(text: str) -> float:
    """A positive duration in s, of a text such as `90 s`, `10 min`, `2 h 30 min`, `1 d`; DembarkError when it is none."""
    return _total(text, _TIMES, "duration", '"90 s", "10 min", "2 h 30 min", "1 d"')


def size(text: str) -> float:
    """A positive amount of memory in bytes, of a text such as `800 MB`, `1.5 GB`, `2 GiB`; DembarkError when it is none."""
    return _total(text, _SIZES, "amount of memory", '"800 MB", "1.5 GB", "2 GiB"')


def _total(text: str, units: Mapping[str, float], what: str, examples: str) -> float:
    # A comma between two durations is another mistake.
    if re.search(r"\d,\d", text):
        refuse_comma(text)
    parts = _PART.findall(text)
    total = sum(float(number) * units.get(unit, math.nan) for number, unit in parts)
    if _PART.sub("", text).strip() or not total > 0.0:
        raise DembarkError(f"{text!r} is no {what}", f"wanted is a positive one with its unit: {examples}")
    return total


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
