"""Plane silo: the silo's checks for a packing between two walls a distance W apart, periodic in the third direction.

The walls have the area 2 dz for each W dz of the slab, a cylinder's 2 pi R dz for each pi R^2 dz: Janssen's balance is the same with W in
R's place, lambda = W / (2 K mu_mob). K is the mean normal stress of both walls over the mean sigma_zz of the cross-section W x period.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dembark.validation.checks.column import read
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica
from dembark.validation.checks.silo import results
from dembark.validation.references import JANSSEN, WALKER

REFERENCES = (JANSSEN, WALKER)


def picture(parameters: dict[str, Any]) -> dict[str, Any]:
    """How the report shows the packing: as it is, since nothing hides its inside but its own front."""
    return {"colour_by": "force", "scale": parameters["gravity"], "cut": False}


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, profiles and remarks for the report from all replicas of a series."""
    columns = [read(replica) for replica in replicas]
    found, drawn, remarks = results(columns, "W", "x")
    first = columns[0]
    return found, drawn, [
        *remarks,
        (
            f"The slab is a period of {first.area / first.size / first.diameter:.1f} d, so that grains pack in three dimensions; a layer "
            "one grain deep would need walls in front and behind, which carry weight too, or grains that are held in a plane."
        ),
    ]
