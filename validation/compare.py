"""Whether two engines agree: each compared quantity's difference within the joint interval, and never more than 10 % apart; or, where
nothing is random, within a bound that the quantity brings along.

Packings differ by more than what varies within one, so a comparison of random runs is decided only by intervals over three packings or
more in each engine. A page compares many quantities, of which one in twenty lies beyond its 95 % interval although nothing is wrong:
what fails is beyond the interval that holds all differences of the page together with 99 %.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

from dembark.common.errors import RunError
from dembark.common.files import read_json, write_json
from dembark.postproc.statistics import joint_half, joint_limit

CAP = 0.10
PACKINGS = 3
# Of all comparisons of a page together.
CONFIDENCE = 0.99


def compare(case_variant_folder: Path) -> dict[str, Any]:
    """Compare the engines that have a `metrics.json` below `case_variant_folder`, write its `comparison.json` and return that.

    Of each pair of engines the first in alphabetical order is the reference. RunError when there are fewer than two.
    """
    metrics = {content["engine"]: content for path in sorted(case_variant_folder.glob("*/metrics.json")) if (content := read_json(path))}
    if len(metrics) < 2:
        raise RunError(
            f"nothing to compare in {case_variant_folder}", f"there is a measurement of {', '.join(metrics) or 'no engine'} only"
        )
    names = sorted(metrics)
    content = {
        "case": metrics[names[0]]["case"],
        "variant": metrics[names[0]]["variant"],
        "profile": metrics[names[0]]["profile"],
        "engines": names,
        "cap": CAP,
        "quantities": [
            entry for index, one in enumerate(names) for other in names[index + 1 :] for entry in _pairs(metrics[one], metrics[other])
        ],
    }
    write_json(case_variant_folder / "comparison.json", content)
    return content


def _pairs(first: dict[str, Any], second: dict[str, Any]) -> list[dict[str, Any]]:
    by_name = {quantity["name"]: quantity for quantity in first["quantities"] if quantity.get("compared")}
    both = [(by_name[one["name"]], one) for one in second["quantities"] if one.get("compared") and one["name"] in by_name]
    return [pair(*two, first["engine"], second["engine"], len(both)) for two in both]


def pair(reference: dict[str, Any], value: dict[str, Any], reference_engine: str, engine: str, comparisons: int = 1) -> dict[str, Any]:
    """One quantity of two engines with its verdict; `comparisons`: how many quantities are compared together with it.

    pass: the difference is within the joint 95 % interval, which is at most 10 % wide. fail: it is beyond what chance does to one of
    all `comparisons`. info: between the two; or the joint interval is unknown, too wide to tell 10 %, or from fewer than three
    packings in either engine, which cannot hold what varies from one packing to the next.

    A quantity of a deterministic run has an `agreement` instead, in its own unit: pass within it, fail beyond it.
    """
    entry = {
        "name": value["name"],
        "label": value["label"],
        "unit": value["unit"],
        "engine": engine,
        "reference_engine": reference_engine,
        "value": value["value"],
        "interval": value["interval"],
        "reference": reference["value"],
        "reference_interval": reference["interval"],
        "deviation": None,
        "deviation_kind": "relative",
        "joint_half_width": None,
        "tolerance": CAP,
        "source": reference_engine,
        "detail": "agreement of the engines",
    }
    bounds = [one["agreement"] for one in (value, reference) if one.get("agreement") is not None]
    if bounds and value["value"] is not None and reference["value"] is not None:
        bound, difference = max(bounds), value["value"] - reference["value"]
        entry |= {"deviation": difference, "deviation_kind": "absolute", "tolerance": bound}
        same = abs(difference) <= bound
        return entry | {"verdict": "pass" if same else "fail", "reason": "" if same else "the same numbers are due"}
    if value["value"] is None or not reference["value"]:
        return entry | {"verdict": "fail", "reason": "no number to compare"}
    difference = value["value"] - reference["value"]
    deviation = difference / abs(reference["value"])
    entry["deviation"] = deviation
    for one in (value, reference):
        if one["interval"] is None:
            return entry | {"verdict": "info", "reason": f"an interval is unknown: {one.get('basis') or 'the run is too short'}"}
    halves = [0.5 * (high - low) for low, high in (value["interval"], reference["interval"])]
    half, scale = joint_half(*halves), abs(reference["value"])
    entry["joint_half_width"] = half
    packings = [_packings(one) for one in (value, reference)]
    if min(packings) < PACKINGS:
        return entry | {
            "verdict": "info",
            "reason": f"the joint interval (±{half / scale:.1%}) comes from within {min(packings)} packing{'s' * (min(packings) > 1)}; "
                      f"{PACKINGS} in each engine are needed to judge it",
        }
    limit = max(half, joint_limit(*halves, *packings, 1.0 - (1.0 - CONFIDENCE) / comparisons))
    if abs(difference) > limit:
        return entry | {"verdict": "fail", "reason": f"the joint interval is ±{half / scale:.1%}, chance allows ±{limit / scale:.1%}"}
    if half > CAP * scale:
        return entry | {"verdict": "info", "reason": f"the joint interval (±{half / scale:.0%}) is wider than 10 %"}
    if abs(difference) > half:
        return entry | {
            "verdict": "info",
            "reason": f"beyond the joint interval (±{half / scale:.1%}), as one of {comparisons} may be by chance (±{limit / scale:.1%}); "
                      "more packings would decide",
        }
    return entry | {"verdict": "pass", "reason": ""}


def _packings(quantity: dict[str, Any]) -> float:
    """Over how many packings the interval was taken; 1 or 2 when it comes from within them, infinite when it rests on no packing."""
    told = re.match(r"(?:within )?(\d+) replica", str(quantity.get("basis", "")))
    return int(told.group(1)) if told else math.inf
