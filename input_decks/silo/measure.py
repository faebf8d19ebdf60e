"""Silo: stresses of a packing in a vertical cylinder whose wall creeps upward, against Janssen's law sigma_zz = rho_b g lambda (1 - exp(-h
/ lambda)), lambda = R / (2 K mu), h: depth below the surface."""

from dataclasses import replace

from dembark.input_decks.common.liquid import liquid_values
from dembark.postproc.measurement import Measurement, Points, Replicas

from . import fields, floor, quantities
from .column import read


def measure(replicas: Replicas) -> Measurement:
    """Values, profiles, remarks and fields of all replicas of a series; where the wall is at rest, of the forces on the floor alone: such a
    wall mobilises no known part of its friction."""
    if not replicas[0].parameters["wall_speed"]:
        found = floor.measured(replicas)
        return replace(found, values={**found.values, **liquid_values(replicas)})
    found = quantities.measured([read(replica) for replica in replicas], "R", "r", replicas[0].derived)
    maps = fields.measured(replicas, found.values)
    return replace(found, values={**found.values, **liquid_values(replicas), **maps.values}, remarks=[*found.remarks, *maps.remarks],
                   fields=maps.fields)


def study(name: str, points: Points, _along: str) -> Measurement:
    """How much friction the walls mobilise, or the apparent masses of all `points` but `dry`, which they are predicted from."""
    return quantities.mobilisation(points) if name == "mobilisation" else quantities.base_prediction(points)
