"""Plane silo: the silo's quantities for a packing between two walls a distance W apart, periodic in the third direction. The walls have the
area 2 dz for each W dz of the slab, a cylinder's 2 pi R dz for each pi R^2 dz: Janssen's balance is the same with W in R's place, lambda =
W / (2 K mu_mob). K is the mean normal stress of both walls over the mean sigma_zz of the cross-section W x period."""

from dataclasses import replace

from dembark.input_decks.silo import quantities
from dembark.input_decks.silo.column import read
from dembark.postproc.measurement import Measurement, Replicas


def measure(replicas: Replicas) -> Measurement:
    """Values, profiles and remarks of all replicas of a series."""
    given = replicas[0].parameters
    found = quantities.measured([read(replica) for replica in replicas], "W", "x", replicas[0].derived)
    remark = (f"The period of the slab is {given['slab_depth'] / given['grain_diameter']:.1f} d, so that grains pack in three dimensions; "
              "a layer one grain deep would need front and rear walls, which carry weight too, or grains constrained to a plane.")
    return replace(found, remarks=[*found.remarks, remark])
