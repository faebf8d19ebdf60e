"""Numbers for people."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dembark.validation.judge.result import QuantityRecord

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Relative deviations beyond this say that the reference is near zero, not how large the deviation is.
_PERCENT = 1.0


def plain(value: float | None, digits: int = 3) -> str:
    """`value` with `digits` significant ones; `–` for none."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    power = int(f"{value:.{digits - 1}e}".partition("e")[2])  # once it is rounded
    if -3 <= power < 5:
        return f"{value:.{max(0, digits - 1 - power)}f}".replace("-", "−")
    return f"{value / 10**power:.{digits - 1}f}·10{str(power).translate(_SUPERSCRIPTS)}".replace("-", "−")


def with_interval(value: float | None, interval: Sequence[float] | None) -> str:
    """`value ± half`, both to two digits of the half-width."""
    if value is None:
        return "–"
    half = 0.5 * (interval[1] - interval[0]) if interval else math.nan
    if not math.isfinite(half) or half <= 1e-12 * max(1.0, abs(value)):
        return plain(value if abs(value) > 1e-12 else 0.0)
    if half < 1e-6 * abs(value):
        return f"{plain(value)} ± {plain(half, 2)}"
    power = math.floor(math.log10(max(abs(value), half)))
    scale = 10.0**power if not -3 <= power < 5 else 1.0
    places = max(0, 1 - math.floor(math.log10(half / scale)))
    text = f"{value / scale:.{places}f} ± {half / scale:.{places}f}".replace("-", "−")
    return text if scale == 1.0 else f"({text})·10{str(power).translate(_SUPERSCRIPTS)}"


def with_unit(text: str, unit: str) -> str:
    """A number with its unit, which is left out when it is 1."""
    return text if unit == "1" or text == "–" else f"{text} {unit}"


def deviation(one: QuantityRecord) -> str:
    """The deviation from the reference: in per cent, or as a difference where it is absolute or the reference is near zero."""
    if one.deviation is None:
        return "–"
    if one.deviation_kind == "relative" and abs(one.deviation) <= _PERCENT:
        per_cent = 100.0 * one.deviation
        text = f"{per_cent:+.{1 if abs(one.deviation) >= 0.001 else 2}f}" if abs(one.deviation) >= 1e-4 else plain(per_cent, 2)
        return f"{text} %".replace("-", "−")
    absolute = one.deviation_kind == "absolute" or one.value is None or one.reference is None
    difference = one.deviation if absolute else one.value - one.reference  # type: ignore[operator]
    return with_unit(plain(difference, 2), one.unit)


def tolerance_text(one: QuantityRecord) -> str:
    """The tolerance, in per cent where it is relative; empty where there is none."""
    if one.tolerance is None:
        return ""
    if one.tolerance == 0.0:
        return "exact"
    if one.deviation_kind == "relative":
        return f"±{plain(100.0 * one.tolerance, 2)} %"
    return f"±{with_unit(plain(one.tolerance, 2), one.unit)}"


def compact(value: float | str | None) -> str:
    """A parameter without needless zeros; words as they are."""
    if value is None or isinstance(value, str):
        return value or "not set"
    text = f"{value:.6g}"
    if "e" in text:
        mantissa, power = text.split("e")
        text = f"{mantissa}·10{str(int(power)).translate(_SUPERSCRIPTS)}"
    return text.replace("-", "−")
