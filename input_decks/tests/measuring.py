"""What the measure.py of a case makes of a run, judged as its case.toml declares."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from dembark.input_decks.common import part_noise
from dembark.input_decks.common.liquid import liquid_values
from dembark.input_decks.common.log_run import LogRun, read
from dembark.postproc.measurement import Measurement
from dembark.postproc.replica import Replica
from dembark.validation import metrics
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.judge import comparison as judge
from dembark.validation.judge import verdict
from dembark.validation.judge.result import COMPARISON, METRICS, QuantityRecord, as_json, from_json, write

# The measured quantities with their verdicts, by name.
Verdicts = Mapping[str, Mapping[str, Any]]


class Control(NamedTuple):
    """Wrong physics by the name that case.toml has for it: what the case measures `right`, without it, and `wrong`, with it."""

    name: str
    right: Verdicts
    wrong: Verdicts


def module(case: str) -> ModuleType:
    """measure.py of `case`."""
    return deck.load_module(Path(find(case).folder, "measure.py"), f"measure_{case}")


def defaults(case: str, **changes: Any) -> dict[str, Any]:
    """The parameters of `case` in SI units, some of them changed."""
    return {name: one.value for name, one in find(case).parameters.items()} | changes


def logs(case: str, run: LogRun) -> Measurement:
    """What the measure.py of a `case` of logs makes of a run that was read."""
    replica = Replica(Path(), {})
    replica.__dict__["_read"] = {read.__wrapped__: run}
    return module(case).measure([replica])


def judged(case: str, found: Measurement) -> dict[str, dict[str, Any]]:
    """The measured quantities with their verdicts, by name."""
    return {one.name: as_json(one) for one in verdict.quantities(find(case), found)}


def measure(folder: Path) -> dict[str, Any]:
    """Content of the `metrics.json` of the runs in `folder`, which is written."""
    return as_json(write(folder / METRICS, metrics.measure(folder)))


def measured(folder: Path) -> dict[str, dict[str, Any]]:
    """The quantities of the runs in `folder` with their verdicts, by name."""
    return {one["name"]: one for one in measure(folder)["quantities"]}


def dried(case: str) -> Control:
    """What `case` measures of liquid that is kept, and of liquid a thousandth of which dries up unbooked."""
    def of_run(kept: float) -> dict[str, dict[str, Any]]:
        rows = np.linspace(1.0, kept, 200)
        times = {f"liquid_{place}": amount * rows for place, amount in (("grains", 3.0), ("bridges", 1.0), ("walls", 0.5), ("lost", 0.0))}
        run = SimpleNamespace(parameters={"liquid_content": 0.01, "grain_count": 10}, times=lambda: times | {"bridge_count": 20.0 * rows})
        return judged(case, Measurement(liquid_values([run])))

    return Control("liquid that dries up", of_run(1.0), of_run(0.999))


def octave_left_out(measured: Callable[[], Verdicts]) -> Control:
    """What is `measured` of the same impacts on a part with all third octaves, and without the last of them."""
    right, both = measured(), part_noise.mean_squares

    def without_the_last(*given: Any) -> Any:
        bands, squares = both(*given)
        return type(bands)(bands.numbers[:-1]), squares[:-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(part_noise, "mean_squares", without_the_last)
        return Control("a third octave that is left out", right, measured())


def compared(folder: Path) -> dict[str, dict[str, Any]]:
    """The quantities of a case and variant with their verdicts on the engines, by name."""
    return {one["name"]: one for one in as_json(write(folder / COMPARISON, judge.compare(folder)))["quantities"]}


def pair(*entries: Mapping[str, Any], engines: tuple[str, str] = ("liggghts", "yade")) -> dict[str, Any]:
    """One quantity of two engines from entries of their `metrics.json`, compared."""
    one, other = (from_json(entry, QuantityRecord) for entry in entries)
    return as_json(judge.pair(one, other, *engines))


def point(parameters: Mapping[str, Any], values: Mapping[str, float], half: float | None = 0.0, part: float = 0.0, **more: Any) -> Any:
    """A result for a study: quantities by name, known to `half` and the `part` of themselves; None: without an interval."""
    def interval(value: float) -> list[float] | None:
        return None if half is None else [value - half - part * abs(value), value + half + part * abs(value)]

    return {"parameters": dict(parameters), **more,
            "quantities": [{"name": name, "value": None if np.isnan(value) else value, "interval": interval(value), "basis": ""}
                           for name, value in values.items()]}


def names(found: Verdicts, verdict: str) -> set[str]:
    """Names of the quantities with this verdict."""
    return {name for name, one in found.items() if one["verdict"] == verdict}
