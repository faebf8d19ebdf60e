"""The comparison of `validation.judge.compare` as the content of a `comparison.json`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dembark.validation.judge import compare as judge
from dembark.validation.judge.result import COMPARISON, QuantityRecord, as_json, from_json, write


def compare(case_variant_folder: Path) -> dict[str, Any]:
    """Compare the engines below `case_variant_folder`, write its `comparison.json` and return that; see `judge.compare.compare`."""
    return as_json(write(case_variant_folder / COMPARISON, judge.compare(case_variant_folder)))


def pair(reference: Mapping[str, Any], value: Mapping[str, Any], reference_engine: str, engine: str,
         comparisons: int = 1) -> dict[str, Any]:
    """One quantity of two engines from entries of their `metrics.json`, see `judge.compare.pair`."""
    one, other = (from_json({"verdict": "info", **entry}, QuantityRecord) for entry in (reference, value))
    return as_json(judge.pair(one, other, reference_engine, engine, comparisons))
