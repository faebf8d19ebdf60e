"""What measure.py returned for the runs of a series, kept in `measurement.json`: it is judged again without being measured again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from dembark.common.files import read_json, write_json
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.statistics import Estimate

from .inputs import KEY

FILE = "measurement.json"
_ESTIMATES = ("estimate", "reference")


@dataclass(frozen=True)
class Measured:
    """A measurement without its fields, which are in the file `fields` if there are any; `inputs_hash`: see `inputs`; `facts`: when it was
    measured, and by which commit."""

    inputs_hash: str
    found: Measurement
    facts: Mapping[str, Any]
    fields: str = ""


def write(folder: Path, one: Measured) -> Measured:
    """Write it into the `folder` of the series; returns what `read` gives."""
    values = {name: _value_as_json(value) for name, value in one.found.values.items()}
    write_json(folder / FILE, {KEY: one.inputs_hash, "measured": dict(one.facts), "values": values, "profiles": list(one.found.profiles),
                               "remarks": list(one.found.remarks), "fields": one.fields})
    return read(folder, one.inputs_hash) or one


def read(folder: Path, inputs_hash: str) -> Measured | None:
    """The measurement in `folder`; None when there is none of the inputs `inputs_hash`, or its fields are gone."""
    content = read_json(folder / FILE)
    if content is None or content.get(KEY) != inputs_hash or not (folder / content["fields"]).exists():
        return None
    values = {name: _value(entry) for name, entry in content["values"].items()}
    return Measured(inputs_hash, Measurement(values, content["profiles"], content["remarks"]), content["measured"], content["fields"])


def _value_as_json(value: Value) -> dict[str, Any]:
    entry = {one.name: getattr(value, one.name) for one in fields(value)}
    for name in _ESTIMATES:
        if entry[name] is not None:
            one = entry[name]
            entry[name] = [_number(one.value), _number(one.half), one.basis, [_number(sample) for sample in one.samples]]
    return entry | {name: _number(entry[name]) for name in ("half", "bound", "scale")}


def _value(entry: Mapping[str, Any]) -> Value:
    def estimate(given: Sequence[Any] | None) -> Estimate | None:
        return None if given is None else Estimate(float(given[0]), float(given[1]), given[2], tuple(map(float, given[3])))

    numbers = {name: None if entry[name] is None else float(entry[name]) for name in ("half", "bound", "scale")}
    return Value(**{**entry, **numbers, **{name: estimate(entry[name]) for name in _ESTIMATES}})


def _number(value: float | None) -> float | str | None:
    """JSON has no infinities: those are texts, which `float` reads."""
    return None if value is None else float(value) if math.isfinite(value) else str(float(value))
