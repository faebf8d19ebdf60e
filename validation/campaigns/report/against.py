"""Two campaigns side by side: which quantities changed by more than their intervals, between commits, engine versions or machines."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from dembark.postproc.statistics import joint_half

# Deterministic quantities have no interval: anything beyond round-off is a change.
ROUND_OFF = 1e-12
STATES = ("changed", "same", "unknown", "new", "gone")


def differences(before: Iterable[Mapping[str, Any]], after: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One row for each quantity of either campaign, by case, variant, engine and name; what changed comes first, the largest change first.

    `state`: "changed" beyond the joint 95 % interval, "same" within it, "unknown" where an interval is missing, "new" or "gone".
    `significance`: change over the joint half-width, None without one. Inputs are metrics.json contents.
    """
    old, new = _by_key(before), _by_key(after)
    rows = [_row(key, old.get(key), new.get(key)) for key in dict.fromkeys([*new, *old])]
    return sorted(rows, key=lambda row: (STATES.index(row["state"]), -abs(row["significance"] or 0.0)))


def _by_key(campaign: Iterable[Mapping[str, Any]]) -> dict[tuple[str, str, str, str], Mapping[str, Any]]:
    return {(one["case"], one["variant"], one["engine"], quantity["name"]): quantity for one in campaign for quantity in one["quantities"]}


def _row(key: Sequence[str], old: Mapping[str, Any] | None, new: Mapping[str, Any] | None) -> dict[str, Any]:
    known = new or old or {}
    row = {"case": key[0], "variant": key[1], "engine": key[2], "name": key[3], "label": known["label"], "unit": known["unit"],
           "before": old, "after": new, "change": None, "significance": None}
    if old is None or new is None:
        return row | {"state": "new" if old is None else "gone"}
    if old["value"] is None or new["value"] is None:
        return row | {"state": "same" if old["value"] is new["value"] else "changed"}
    difference = new["value"] - old["value"]
    row["change"] = difference / abs(old["value"]) if old["value"] else None
    if abs(difference) <= ROUND_OFF * max(abs(old["value"]), abs(new["value"])):
        return row | {"state": "same", "significance": 0.0}
    if new.get("agreement") is not None or old.get("agreement") is not None:
        bound = max(one["agreement"] for one in (old, new) if one.get("agreement") is not None)
        return row | _significant(difference, bound)
    if old["interval"] is None or new["interval"] is None:
        return row | {"state": "unknown"}
    return row | _significant(difference, joint_half(*(0.5 * (one["interval"][1] - one["interval"][0]) for one in (old, new))))


def _significant(difference: float, half: float) -> dict[str, Any]:
    if half == 0.0:
        return {"state": "changed", "significance": math.copysign(math.inf, difference)}
    return {"state": "changed" if abs(difference) > half else "same", "significance": difference / half}


def facts(campaign: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """What identifies a campaign's code and engines: commit and versions, all that occur."""
    found: dict[str, dict[str, None]] = {}
    for one in campaign:
        told = one.get("provenance", {})
        if told.get("commit"):
            found.setdefault("commit", {})[str(told["commit"])[:12] + (" (changed)" if told.get("dirty") else "")] = None
        for name, version in told.get("versions", {}).items():
            found.setdefault(name, {})[str(version)] = None
    return {name: ", ".join(values) for name, values in found.items()}
