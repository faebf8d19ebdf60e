"""Fitted parameters with their posterior, as `dembark calibrate` writes them: `fitted.toml`, and the table of samples next to it."""

from __future__ import annotations

import csv
import hashlib
import random
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dembark.common.choices import Value, pick
from dembark.common.errors import DembarkError
from dembark.common.units import finite
from dembark.validation.case.folders import find
from dembark.validation.case.model import Case
from dembark.validation.case.resolve import merged, portable
from dembark.validation.case.tables import load_toml

POSTERIOR, FITTED = "posterior.csv", "fitted.toml"
DENSITY = "log_density"


@dataclass(frozen=True)
class FittedParameters:
    """What a calibration found: `samples` of the posterior (n) by parameter, in SI units; values that were `fixed` in it; `facts` for the
    record of a run: the file, its checksum, the targets, and the `conditions` of the calibration, all other parameters."""

    path: Path
    samples: tuple[Mapping[str, float], ...]
    fixed: Mapping[str, Value]
    facts: Mapping[str, Any]

    def members(self, case: Case, count: int, changes: Mapping[str, Value]) -> list[dict[str, Value]]:
        """What each of `count` members changes of `case`: what was fixed, `changes`, and one draw of the posterior; the first members are
        the same for any count. DembarkError where the case lacks a parameter, or a change is of a fitted one."""
        for name in (*self.samples[0], *self.fixed):
            pick(name, case.parameters, "parameter", f"of {self.path} in case {case.name}")
        if both := [name for name in changes if name in self.samples[0]]:
            raise DembarkError(f"{both[0]} is set and fitted", f"in {self.path}", "leave one of them out")
        if count > len(self.samples):
            raise DembarkError(f"{count} members", f"{self.path} has {len(self.samples)} samples", "ask for fewer")
        order = random.Random(0).sample(range(len(self.samples)), len(self.samples))
        integers = {name for name in self.samples[0] if case.parameters[name].is_whole}
        return [{**self.fixed, **changes, **{name: round(value) if name in integers else value for name, value in self.samples[k].items()}}
                for k in order[:count]]


def checksum(content: bytes) -> str:
    """Of the table of samples."""
    return hashlib.sha256(content).hexdigest()


def read(path: Path) -> FittedParameters:
    """The parameters in the file `path`; DembarkError with one line for what is no such file, or where its samples are missing or not those
    that were written with it."""
    data = load_toml(path)
    given, sweep = data.get("posterior"), (data.get("sweeps") or [{}])[0]
    complete = isinstance(sweep, Mapping) and {"case", "profile", "variant", "engines"} <= sweep.keys()
    if not complete or not isinstance(given, Mapping) or not {"file", "sha256", "targets"} <= given.keys():
        raise DembarkError(f"{path} has no table [posterior]", "", "give the fitted.toml that 'dembark calibrate' wrote")
    table = path.parent / str(given["file"])
    try:
        content = table.read_bytes()
    except OSError as error:
        raise DembarkError(f"the samples of {path} cannot be read", str(error)) from None
    if checksum(content) != given["sha256"]:
        raise DembarkError(f"{table} was changed", f"its checksum is not that in {path.name}", "bring it back, or fit again")
    rows = list(csv.DictReader(content.decode().splitlines()))
    samples = tuple({name: finite(float(text), name) for name, text in row.items() if name != DENSITY} for row in rows)
    if not samples:
        raise DembarkError(f"{table} has no samples", "", "fit again")
    case = find(sweep["case"])
    fixed: dict[str, Value] = dict(sweep.get("fixed", {}))
    conditions = portable(merged(case, sweep["profile"], sweep["variant"], fixed))
    facts = {"file": str(path), "sha256": given["sha256"], "case": case.name, "variant": sweep["variant"], "engine": sweep["engines"][0],
             "targets": given["targets"], "names": list(samples[0]),
             "conditions": {name: value for name, value in conditions.items() if name not in samples[0]}}
    return FittedParameters(path, samples, fixed, facts)
