"""Bulk density: solid fraction of the bed as it was poured and after each tap."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from dembark.input_decks.common.estimates import over_chaotic, ratio
from dembark.input_decks.common.momentum import unaccounted
from dembark.input_decks.oedometer.measure import FRACTIONS
from dembark.postproc.measurement import Array, Estimate, Measurement, Replica, Replicas, Value, exact, profile
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.spheres import slice_volumes

# Random loose packing of rough spheres, Jerkins et al. (2008), and random close packing.
LOOSEST, CLOSEST = 0.550, 0.639
# Mean diameters of what is left out at the plate and below the surface, which lies above this share of the centres.
NEAR, BELOW, SHARE = 2.0, 1.0, 0.9


@cached_per_replica
def fractions(replica: Replica) -> Array:
    """(taps + 1,): of the bed at rest, before the first tap and after each."""
    d, found = replica.parameters["grain_diameter"], []
    for frame in replica.grains():
        z = frame.positions[:, 2]
        edges = np.array([NEAR * d, np.quantile(z, SHARE) - BELOW * d])
        found.append(slice_volumes(z, frame.radii, edges).sum() / (replica.derived["area"] * (edges[1] - edges[0])))
    return np.array(found)


def impulse_error(replica: Replica) -> float:
    """From frame to frame: impulse of the plate less that of the weight and what the grains gain, over that of the weight; the largest."""
    rows, gravity, dt = replica.times(), replica.parameters["gravity"], replica.time_step
    return max(abs(unaccounted(one, other, rows, ["plate"], "z", -gravity, dt)) / (
        float(one.masses.sum()) * gravity * (other.step - one.step) * dt) for one, other in pairwise(replica.grains()))


def measure(replicas: Replicas) -> Measurement:
    """Densities and solid fractions of all packings, and the fraction against the number of taps."""
    p, found = replicas[0].parameters, [fractions(replica) for replica in replicas]
    loose, tapped = over_chaotic(each[0] for each in found), over_chaotic(each[-1] for each in found)
    density = p["grain_density"]

    def bulk(fraction: Estimate) -> Value:
        return Value(Estimate(density * fraction.value, density * fraction.half, fraction.basis))

    known, wet = FRACTIONS.get(replicas[0].derived["grain_static"]), p["bridge_volume"] > 0.0
    rubbing = replicas[0].derived["grain_static"] > 0.0
    values = {
        "poured_fraction": Value(loose, None if known is None else exact(known), inapplicable="liquid bridges" if wet else ""),
        "fraction_in_limits": Value(loose, exact(0.5 * (LOOSEST + CLOSEST)),
                                    inapplicable="liquid bridges" if wet else "" if rubbing else "grains without friction"),
        "tapped_fraction": Value(tapped),
        "poured_density": bulk(loose),
        "tapped_density": bulk(tapped),
        "hausner_ratio": Value(over_chaotic(each[-1] / each[0] for each in found) if len(found) > 1 else ratio(tapped, loose)),
        "impulse_error": Value(exact(max(map(impulse_error, replicas))), exact(0.0)),
    }
    return Measurement(values, [profile("taps", "Solid fraction against taps", "taps", "solid fraction",
                                        np.arange(len(found[0]), dtype=float), found)])
