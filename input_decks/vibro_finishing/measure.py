"""Vibratory finishing: circulation of the bed, spin and revolutions of a free part, power and noise; what reverses with the drive."""

import math
from collections.abc import Callable

import numpy as np

from dembark.input_decks.common.estimates import divided, over_chaotic, ratio
from dembark.input_decks.common.momentum import BRIDGED_PARTS, imbalance
from dembark.input_decks.common.part_impacts import impact_measurement
from dembark.input_decks.common.power_law import ordered
from dembark.input_decks.common.vibratory_trough import Trough, drifts, numerical_changes, read, rigidity, spectra
from dembark.postproc.measurement import Estimate, Measurement, Points, Replicas, Value, exact, over_replicas
from dembark.postproc.studies import measured

from .touches import contact_record, part_surface


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of all replicas of a series."""
    runs, p = [read(replica) for replica in replicas], replicas[0].parameters
    drive, diameter = 2.0 * math.pi * p["motion_frequency"], p["grain_diameter"]

    def over(number: Callable[[Trough], Estimate], scale: float = 1.0) -> Value:
        return Value(divided(over_replicas([number(one) for one in runs]), scale))

    def once(number: Callable[[Trough], float]) -> Value:
        return Value(over_chaotic(number(one) for one in runs))

    values = {
        "momentum_balance": Value(exact(max(one.momentum_gap("trough") for one in runs)), exact(0.0)),
        "circulation": over(Trough.turning, drive), "spin": over(Trough.spin, drive), "revolution": over(Trough.revolution, drive),
        "part_height": over(Trough.height, diameter), "power": over(lambda one: one.power("trough")),
        "noise": once(lambda one: one.noise("trough")), "stirring": over(Trough.fluctuation_ratio),
        "agitation": over(Trough.agitation),
    }
    if p["part"] == "sphere":
        values["energy_balance"] = Value(exact(np.max([imbalance(one.rows, BRIDGED_PARTS) for one in runs])), exact(0.0))
    else:
        changes = [rigidity(list(one.grains()), int(one.derived["body_spheres"])) for one in replicas]
        values["rigidity"] = Value(exact(max(changes) / diameter), exact(0.0))
    if p["part"] == "sphere" and p["part_diameter"] == diameter and p["part_density"] == p["grain_density"]:
        worst = max((one.likeness() for one in runs), key=abs)
        values["likeness"] = Value(exact(worst), exact(0.0))
    records = [contact_record(one) for one in replicas]
    # The record has neither friction between grains and part nor bridges.
    derived = replicas[0].derived
    if derived["grain_static"] == 0.0 and not derived["wet"]:
        values["touch_balance"] = Value(exact(max(one.gap for one in records)), exact(0.0))
    hits = impact_measurement(records, part_surface(replicas[0]), p, runs[0].speed)
    return Measurement({**values, **hits.values}, [drifts(runs), spectra(runs, "trough"), *hits.profiles], surface=hits.surface)


def study(name: str, points: Points, along: str) -> Measurement:
    """The circulation over that of the reversed drive, and of one up and down; or how far the steady motion depends on the numerics."""
    points, _ = ordered(points, along)
    if name == "sense":
        back, none, fore = (measured(point, "circulation") for point in points)
        return Measurement({"reversal": Value(ratio(back, fore), exact(-1.0)), "vertical": Value(ratio(none, fore), exact(0.0))})
    return numerical_changes(points, ("circulation", "spin", "revolution"))
