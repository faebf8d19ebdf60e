"""Liquid that grains carry, in any case with the parameter `liquid_content`: is it conserved, and where is it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dembark.postproc.measurement import Array, Estimate, Replica, Value, block_mean, exact, over_replicas


def liquid_values(replicas: Sequence[Replica]) -> dict[str, Value]:
    """`liquid_total`, change over the run; `bridge_count` a grain and the part `liquid_in_bridges` over its second half. Empty
    when bridges have volumes of their own."""
    if not float(replicas[0].parameters.get("liquid_content") or 0.0) > 0.0:
        return {}
    tables, grains = [replica.times() for replica in replicas], float(replicas[0].parameters["grain_count"])
    totals = [np.sum([times[f"liquid_{place}"] for place in ("grains", "bridges", "walls", "lost")], axis=0) for times in tables]

    def late(series: Sequence[Array]) -> Estimate:
        return over_replicas([block_mean(one[len(one) // 2 :]) for one in series])

    return {
        "liquid_total": Value(exact(max(float(np.abs(total / total[0] - 1.0).max()) for total in totals)), exact(0.0),
                              detail=f"on grains, in bridges, on walls and lost; {totals[0][0]:.4g} m³ at the start"),
        "bridge_count": Value(late([times["bridge_count"] / grains for times in tables])),
        "liquid_in_bridges": Value(late([times["liquid_bridges"] / total for times, total in zip(tables, totals, strict=True)])),
    }
