"""Particle-steps per second and core: measured ones of a store, else those in the facts of the engine."""

from __future__ import annotations

import socket
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from dembark.validation import engines
from dembark.validation.campaigns import store


@dataclass(frozen=True)
class Rate:
    """Particle-steps per second and core, and where the number is from."""

    value: float
    source: str


class Rates:
    """The rates to reckon with for a campaign whose store, if it has one yet, lies at `path`."""

    def __init__(self, path: Path | None = None) -> None:
        rows = store.read_runs(path, state="finished") if path is not None and path.is_file() else []
        self._host = socket.gethostname()
        self._rows = [row for row in rows if row["particle_steps_per_second"] and row["ranks"] and row["threads"]]

    def of(self, case: str, engine: str, cores: int = 1) -> Rate:
        """Rate for runs of `case` in `engine` on `cores` cores.

        The median of the store's runs of this case, those of this host and this number of cores before others; else the engine's facts.
        """
        rows = [row for row in self._rows if (row["case_name"], row["engine"]) == (case, engine)]
        mine = [row for row in rows if row["host"] == self._host]
        alike = [row for row in mine or rows if row["ranks"] * row["threads"] == cores]
        if chosen := alike or mine or rows:
            return Rate(_median(chosen), f"{len(chosen)} runs measured on {'this host' if mine else 'other hosts'}")
        facts = engines.facts(engine)
        if case in facts.rates:
            return Rate(facts.rates[case], f"measured on {facts.measured_on}")
        return Rate(facts.typical_rate, f"of other cases, measured on {facts.measured_on}")


def _median(rows: Iterable[Mapping[str, Any]]) -> float:
    return float(median(row["particle_steps_per_second"] / (row["ranks"] * row["threads"]) for row in rows))
