"""Silo: stresses of a packing in a vertical cylinder whose wall creeps upward, against Janssen's law with nothing fitted.

sigma_zz = rho_b g lambda (1 - exp(-h / lambda)), lambda = R / (2 K mu_mob), h the depth below the surface; K and mu_mob are measured, none
is taken from the material's friction. The study is the classical experiment: the mass that the base feels against the mass filled in.
"""

from dataclasses import replace

from dembark.postproc.instruments import silo, silo_fields
from dembark.postproc.instruments.column import read
from dembark.postproc.instruments.liquid import liquid_values
from dembark.postproc.measurement import Measurement, Points, Replica, Replicas


def prepare(replica: Replica) -> None:
    """What needs no other replica: done while they still run."""
    silo.scalars(read(replica))


def measure(replicas: Replicas) -> Measurement:
    """Values, profiles, remarks and fields of all replicas of a series."""
    found = silo.measured([read(replica) for replica in replicas], "R", "r", replicas[0].derived)
    fields = silo_fields.measured(replicas, found.values)
    return replace(found, values={**found.values, **liquid_values(replicas), **fields.values}, remarks=[*found.remarks, *fields.remarks],
                   fields=fields.fields)


def study(_name: str, points: Points, _along: str) -> Measurement:
    """The apparent mass of the fillings `points` against Janssen's law for the base."""
    return silo.fillings(points, "R")
