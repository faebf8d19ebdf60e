"""Two campaigns side by side: which quantities changed by more than their intervals, between commits, engine versions or machines."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from dembark.postproc.statistics import joint_half
from dembark.validation.judge.result import QuantityRecord, Result

# Deterministic quantities have no interval: anything beyond round-off is a change.
ROUND_OFF = 1e-12
STATES = ("changed", "same", "unknown", "new", "gone")

Key = tuple[str, str, str, str]


@dataclass(frozen=True)
class Difference:
    """A quantity `before` and `after`: "changed" beyond the joint 95 % interval, "same" within it, "unknown" where an interval is missing,
    "new" or "gone". `change` is relative; `significance` is the change over the joint half-width; None where there is none."""

    case: str
    variant: str
    engine: str
    name: str
    before: QuantityRecord | None
    after: QuantityRecord | None
    state: str
    change: float | None = None
    significance: float | None = None


def differences(before: Iterable[Result], after: Iterable[Result]) -> list[Difference]:
    """One for each quantity of either campaign, by case, variant, engine and name; what changed comes first, the largest change first."""
    old, new = _by_key(before), _by_key(after)
    found = [_difference(key, old.get(key), new.get(key)) for key in dict.fromkeys([*new, *old])]
    return sorted(found, key=lambda one: (STATES.index(one.state), -abs(one.significance or 0.0)))


def _by_key(campaign: Iterable[Result]) -> dict[Key, QuantityRecord]:
    return {(one.case, one.variant, one.engine, quantity.name): quantity for one in campaign for quantity in one.quantities}


def _difference(key: Key, old: QuantityRecord | None, new: QuantityRecord | None) -> Difference:
    if old is None or new is None:
        return Difference(*key, old, new, "new" if old is None else "gone")
    if old.value is None or new.value is None:
        return Difference(*key, old, new, "same" if old.value is new.value else "changed")
    difference = new.value - old.value
    change = difference / abs(old.value) if old.value else None
    if abs(difference) <= ROUND_OFF * max(abs(old.value), abs(new.value)):
        return Difference(*key, old, new, "same", change, 0.0)
    bounds = [one.agreement for one in (old, new) if one.agreement is not None]
    if not bounds and (old.half is None or new.half is None):
        return Difference(*key, old, new, "unknown", change)
    half = max(bounds) if bounds else joint_half(old.half or 0.0, new.half or 0.0)
    significance = difference / half if half else math.copysign(math.inf, difference)
    return Difference(*key, old, new, "changed" if abs(significance) > 1.0 else "same", change, significance)


def facts(before: Sequence[Result], after: Sequence[Result]) -> list[tuple[str, str, str]]:
    """What identifies the code and the engines of two campaigns: commit and versions, all that occur, of either."""
    one, two = _facts(before), _facts(after)
    return [(name, one.get(name, "–"), two.get(name, "–")) for name in dict.fromkeys([*one, *two])]


def _facts(campaign: Iterable[Result]) -> dict[str, str]:
    found: dict[str, dict[str, None]] = {}
    for one in campaign:
        if one.provenance.get("commit"):
            changed = " (changed)" if one.provenance.get("dirty") else ""
            found.setdefault("commit", {})[str(one.provenance["commit"])[:12] + changed] = None
        for name, version in one.provenance.get("versions", {}).items():
            found.setdefault(name, {})[str(version)] = None
    return {name: ", ".join(values) for name, values in found.items()}
