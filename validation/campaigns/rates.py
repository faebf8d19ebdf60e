"""Particle-steps per second and core: measured ones of a store, else those of the machine that the numbers below were measured on."""

from __future__ import annotations

import socket
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from dembark.validation.campaigns import store

MACHINE = "Intel Xeon (2 virtual cores), 2026-11-21, LIGGGHTS-PUBLIC 3.8.0 and YADE 2025.2.0"

# From `make validate` (profile quick, one run a core), except plane_silo, gravity_channel and single_contact, which are of single small
# runs beside other work. Small runs of logs are mostly the engine's start; each step of many logs costs more than in proportion.
MEASURED: Mapping[tuple[str, str], float] = {
    ("silo", "liggghts"): 3.3e6, ("silo", "yade"): 4.1e5,
    ("plug_flow", "liggghts"): 2.4e6, ("plug_flow", "yade"): 4.3e5,
    ("plane_silo", "liggghts"): 1.4e6, ("plane_silo", "yade"): 1.9e5,
    ("gravity_channel", "liggghts"): 1.1e6, ("gravity_channel", "yade"): 1.6e5,
    ("debarking_drum", "liggghts"): 7.4e5, ("debarking_drum", "yade"): 4.2e5,
    ("log_pile", "liggghts"): 7.5e5, ("log_pile", "yade"): 4.2e5,
    ("log_cradle", "liggghts"): 2.7e5, ("log_cradle", "yade"): 1.1e5,
    ("log_pair", "liggghts"): 3.0e4, ("log_pair", "yade"): 9.0e3,
    ("single_contact", "liggghts"): 9.0e4, ("single_contact", "yade"): 1.2e4,
}
# For other cases: about the mean of those with grains.
ANY_CASE = {"liggghts": 2e6, "yade": 3e5}


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

        The median of the store's runs of this case, those of this host and this number of cores before others; else the table.
        """
        rows = [row for row in self._rows if (row["case_name"], row["engine"]) == (case, engine)]
        mine = [row for row in rows if row["host"] == self._host]
        alike = [row for row in mine or rows if row["ranks"] * row["threads"] == cores]
        if chosen := alike or mine or rows:
            return Rate(_median(chosen), f"{len(chosen)} runs measured on {'this host' if mine else 'other hosts'}")
        if (case, engine) in MEASURED:
            return Rate(MEASURED[case, engine], f"measured on {MACHINE}")
        return Rate(ANY_CASE[engine], f"of other cases, measured on {MACHINE}")


def _median(rows: Iterable[Mapping[str, Any]]) -> float:
    return float(median(row["particle_steps_per_second"] / (row["ranks"] * row["threads"]) for row in rows))
