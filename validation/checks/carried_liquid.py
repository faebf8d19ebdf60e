"""Liquid that grains carry, in any case with the parameter `liquid_content`: is it conserved, and where is it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica
from dembark.postproc.statistics import Estimate, block_mean, over_replicas

# Sums over thousands of grains in any order, and 15 digits of each number in time.csv.
ROUND_OFF = 1e-12


def carried(replica: Replica) -> bool:
    """Whether bridges borrow their liquid from the grains."""
    return float(replica.parameters.get("liquid_content") or 0.0) > 0.0


def liquid_quantities(replicas: Sequence[Replica]) -> list[Quantity]:
    """Change of the total over the whole run, bridges a grain and the part of the liquid in them over its second half; none when bridges
    have volumes of their own."""
    if not carried(replicas[0]):
        return []
    tables = [replica.times() for replica in replicas]
    totals = [sum(times[f"liquid_{place}"] for place in ("grains", "bridges", "walls", "lost")) for times in tables]
    change = max(float(np.abs(total / total[0] - 1.0).max()) for total in totals)
    late = [slice(len(total) // 2, None) for total in totals]
    grains = float(replicas[0].parameters["grain_count"])
    return [
        Quantity("liquid_total", "liquid: largest change of the total, over the total", "1",
                 Estimate(change, 0.0, "none, nothing is random"),
                 reference=Estimate(0.0, 0.0), tolerance=ROUND_OFF, absolute=True, compared=False, source="conservation law",
                 detail=f"on grains, in bridges and on walls, and what left; {totals[0][0]:.4g} m³ at the start, over the whole run"),
        Quantity("bridge_count", "liquid bridges a grain", "1",
                 over_replicas([block_mean(times["bridge_count"][part] / grains) for times, part in zip(tables, late, strict=True)])),
        Quantity("liquid_in_bridges", "part of the liquid that is in bridges", "1",
                 over_replicas([block_mean((times["liquid_bridges"] / total)[part])
                                for times, total, part in zip(tables, totals, late, strict=True)])),
    ]
