"""Bulk density: solid fraction of the bed as it was poured and after each tap."""

from __future__ import annotations

import numpy as np

from dembark.input_decks.common.estimates import over_chaotic, ratio
from dembark.postproc.measurement import Array, Estimate, Measurement, Replica, Replicas, Value, exact, profile
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.spheres import slice_volumes

# Solid fractions of equal spheres with this coefficient of friction, compressed at low pressure, Agnolin and Roux (2007).
FRACTIONS = {0.0: 0.639, 0.3: 0.593}
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


def weight_error(replica: Replica) -> float:
    """Force on the plate over the weight − 1, of the bed at rest that is farthest from 0."""
    rows, numbers = replica.times(), replica.derived
    weight = replica.grains()[0].masses.sum() * replica.parameters["gravity"]
    rests = numbers["first"] + numbers["stride"] * np.arange(replica.parameters["taps"] + 1)
    last = np.searchsorted(rows["step"], rests, side="right") - 1
    errors = rows["plate_fz"][last] / weight - 1.0
    return float(errors[np.argmax(np.abs(errors))])


def measure(replicas: Replicas) -> Measurement:
    """Densities and solid fractions of all packings, and the fraction against the number of taps."""
    p, found = replicas[0].parameters, [fractions(replica) for replica in replicas]
    loose, tapped = over_chaotic(each[0] for each in found), over_chaotic(each[-1] for each in found)
    density = p["grain_density"]

    def bulk(fraction: Estimate) -> Value:
        return Value(Estimate(density * fraction.value, density * fraction.half, fraction.basis))

    known, wet = FRACTIONS.get(replicas[0].derived["grain_static"]), p["bridge_volume"] > 0.0
    values = {
        "poured_fraction": Value(loose, None if known is None else exact(known), inapplicable="liquid bridges" if wet else ""),
        "fraction_in_limits": Value(loose, exact(0.5 * (LOOSEST + CLOSEST)), inapplicable="liquid bridges" if wet else ""),
        "tapped_fraction": Value(tapped),
        "poured_density": bulk(loose),
        "tapped_density": bulk(tapped),
        "hausner_ratio": Value(over_chaotic(each[-1] / each[0] for each in found) if len(found) > 1 else ratio(tapped, loose)),
        "weight_error": Value(exact(max(map(weight_error, replicas), key=abs)), exact(0.0)),
    }
    return Measurement(values, [profile("taps", "Solid fraction against taps", "taps", "solid fraction",
                                        np.arange(len(found[0]), dtype=float), found)])
