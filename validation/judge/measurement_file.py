"""What measure.py returned for the runs of a series, kept in `measurement.json`: it is judged again without being measured again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dembark.common.files import read_json, write_atomic
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.statistics import Estimate

from .inputs import KEY

FILE = "measurement.json"


@dataclass(frozen=True)
class Measured:
    """A measurement without fields and map, which are in `files` of the folder if there are any; `inputs_hash`: see `inputs`; `facts`: when
    it was measured, and by which commit."""

    inputs_hash: str
    found: Measurement
    facts: Mapping[str, Any]
    files: tuple[str, ...] = ()


def write(folder: Path, one: Measured) -> Measured:
    """Write it into the `folder` of the series; returns what `read` gives."""
    values = {name: asdict(value) for name, value in one.found.values.items()}
    content = {KEY: one.inputs_hash, "measured": dict(one.facts), "values": values,
               "profiles": list(one.found.profiles), "remarks": list(one.found.remarks), "files": list(one.files)}
    # Infinite half-widths are kept as Python's JSON writes them: no other program reads this file.
    write_atomic(folder / FILE, (json.dumps(content, indent=1, default=float) + "\n").encode())
    return read(folder, one.inputs_hash) or one


def read(folder: Path, inputs_hash: str) -> Measured | None:
    """The measurement in `folder`; None when there is none of the inputs `inputs_hash`, or one of its files is gone."""
    content = read_json(folder / FILE)
    if content is None or content.get(KEY) != inputs_hash or not all((folder / name).exists() for name in content["files"]):
        return None
    values = {name: Value(**entry | {part: _estimate(entry[part]) for part in ("estimate", "reference")})
              for name, entry in content["values"].items()}
    return Measured(inputs_hash, Measurement(values, content["profiles"], content["remarks"]), content["measured"], tuple(content["files"]))


def _estimate(given: dict[str, Any] | None) -> Estimate | None:
    return None if given is None else Estimate(**given | {"samples": tuple(given["samples"])})
