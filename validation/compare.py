"""Whether two engines agree: each compared quantity's difference within the joint interval, and never more than 10 % apart; or, where
nothing is random, within a bound that the quantity brings along."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dembark.common.errors import RunError
from dembark.common.files import read_json, write_json
from dembark.validation.statistics import joint_half

CAP = 0.10


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
    by_name = {quantity["name"]: quantity for quantity in first["quantities"]}
    return [
        pair(by_name[quantity["name"]], quantity, first["engine"], second["engine"])
        for quantity in second["quantities"]
        if quantity.get("compared") and by_name.get(quantity["name"], {}).get("compared")
    ]


def pair(reference: dict[str, Any], value: dict[str, Any], reference_engine: str, engine: str) -> dict[str, Any]:
    """One quantity of two engines with its verdict.

    pass: the difference is within the joint 95 % interval and at most 10 %. fail: it is larger than the interval. info: the joint
    interval is unknown or so wide that it cannot tell 10 %; or the difference is below 10 % and beyond intervals that come from within
    fewer than three packings, which cannot hold what varies from one packing to the next.

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
    if value["interval"] is None or reference["interval"] is None:
        return entry | {"verdict": "info", "reason": "an interval is unknown: the run is too short"}
    half = joint_half(*(0.5 * (high - low) for low, high in (value["interval"], reference["interval"])))
    relative = half / abs(reference["value"])
    entry["joint_half_width"] = half
    if abs(difference) > half and (abs(deviation) > CAP or _over_packings(value, reference)):
        return entry | {"verdict": "fail", "reason": f"the joint interval is ±{relative:.1%}"}
    if relative > CAP:
        return entry | {"verdict": "info", "reason": f"the joint interval (±{relative:.0%}) is wider than 10 %"}
    if abs(difference) > half:
        return entry | {
            "verdict": "info",
            "reason": f"beyond the intervals within the runs (±{relative:.1%}); three packings are needed to judge it",
        }
    return entry | {"verdict": "pass", "reason": ""}


def _over_packings(*quantities: dict[str, Any]) -> bool:
    """Whether the intervals hold what varies from packing to packing."""
    return not any(str(quantity.get("basis", "")).startswith("within") for quantity in quantities)
