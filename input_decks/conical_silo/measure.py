"""Conical silo."""

import numpy as np

from dembark.postproc.measurement import Estimate, Measurement, Replicas, Value, profile


def measure(replicas: Replicas) -> Measurement:
    """x."""
    rows = replicas[0].times()
    t, n = rows["time"], rows["remaining"]
    inside = (n < 0.8 * n[0]) & (n > 0.3 * n[0])
    return Measurement({"rate": Value(Estimate(-float(np.polyfit(t[inside], n[inside], 1)[0]), np.inf, "one run"))},
                       [profile("remaining", "Grains left", "time (s)", "grains", t, [n])])
