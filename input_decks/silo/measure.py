"""Silo: stresses of a packing in a vertical cylinder whose wall creeps upward, against Janssen's law with nothing fitted.

sigma_zz = rho_b g lambda (1 - exp(-h / lambda)), lambda = R / (2 K mu_mob), h the depth below the surface; K and mu_mob are measured, none
is taken from the material's friction. The study is the classical experiment: the mass that the base feels against the mass filled in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dembark.postproc.instruments import janssen, silo, silo_fields
from dembark.postproc.instruments.column import read
from dembark.postproc.instruments.liquid import liquid_values
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.replica import Replica
from dembark.postproc.resampling import profile
from dembark.postproc.statistics import Estimate
from dembark.postproc.studies import measured, propagated


def measure(replicas: Sequence[Replica]) -> Measurement:
    """Values, profiles, remarks and fields of all replicas of a series."""
    found = silo.measured([read(replica) for replica in replicas], "R", "r", replicas[0].derived)
    fields = silo_fields.measured(replicas, found.values)
    return replace(found, values={**found.values, **liquid_values(replicas), **fields.values}, remarks=[*found.remarks, *fields.remarks],
                   fields=fields.fields)


def study(_name: str, points: Sequence[Mapping[str, Any]], _along: str) -> Measurement:
    """The apparent mass of the fillings `points` against Janssen's law for the base, M_app = M_sat (1 - exp(-M / M_sat))."""
    points = sorted(points, key=lambda point: measured(point, "filled_mass").value)
    mass = np.array([measured(point, "filled_mass").value for point in points])
    shares = [measured(point, "apparent_mass_ratio") for point in points]
    apparent, halves = mass * [one.value for one in shares], mass * [one.half for one in shares]
    # Mass of a piece of the column as high as the radius.
    per_radius = mass[-1] / measured(points[-1], "filling_height").value
    predicted, top = measured(points[-1], "janssen_length_predicted"), float(apparent.max())
    fitted = propagated(lambda values: janssen.fitted_length(mass, values, values.max()) / per_radius, apparent, halves,
                        "the apparent masses")
    pair = janssen.fitted_pair(mass, apparent, [(top, 0.02 * top), (top, 0.3 * top)], ((0.05 * top, 50.0 * top), (0.0, 0.95 * top)), top)
    law = janssen.stress(mass, predicted.value * per_radius)
    gain = Estimate(janssen.gain(mass, apparent, fitted.value * per_radius, pair), 0.0)
    values = {
        "filling_length": Value(fitted, predicted),
        "largest_apparent_mass": Value(Estimate(float(apparent[-1]), float(halves[-1]), shares[-1].basis), Estimate(float(law[-1]), 0.0)),
        "filling_two_parameter_gain": Value(gain, detail=f"with it λ is {pair[0] / per_radius:.2f} R and the zone holds {pair[1]:.3g} kg; "
                                                         f"{len(points)} fillings"),
    }
    curve = profile("apparent_mass", "Apparent mass", "filled mass (kg)", "force on the base / g (kg)", mass, [apparent], half=halves,
                    reference=law, reference_label="Janssen, nothing fitted")
    remark = ("Each point is a packing of its own, filled by rain to that height, with the wall creeping upward, so that all have the same "
              "history.")
    return Measurement(values, [curve], [remark])
