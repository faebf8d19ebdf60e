"""Curves of a run compared with published ones, read from figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from dembark.input_decks.common.estimates import reference_rows
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.resampling import profile
from dembark.postproc.statistics import Estimate

from .impacts import worst


def with_published(found: Measurement, path: Path, variant: str, labels: Mapping[str, str]) -> Measurement:
    """`found` with a value <method>_<quantity> for each published curve of `variant`, where it is farthest, and the curves. `path`: a table
    with the columns variant, quantity, material, method, x, y, x_uncertainty and y_uncertainty (95 % limits of the reading), and left_out,
    why a point is drawn but not judged. The curve <quantity>_<material> of `found` is interpolated to the points in its range; farthest is
    where the difference exceeds its uncertainty most. `labels`: who published, by method."""
    own = {one["name"]: one for one in found.profiles}
    rows = [row for row in reference_rows(path, variant=variant) if f"{row['quantity']}_{row['material']}" in own]
    values, curves, excess = dict(found.values), list(found.profiles), dict[str, float]()
    for (method, quantity, material), group in groupby(rows, lambda row: (row["method"], row["quantity"], row["material"])):
        points = list(group)
        one, name = own[f"{quantity}_{material}"], f"{method}_{quantity}"
        x, y, x_half, y_half = np.array([[row.number(key) for key in ("x", "y", "x_uncertainty", "y_uncertainty")] for row in points]).T
        place, first = np.unique(one["place"], return_index=True)
        smooth, inside = PchipInterpolator(place, np.array(one["value"])[first]), (place[0] <= x) & (x <= place[-1])
        judged = np.array([not row.get("left_out") for row in points])[inside]
        x, y, x_half, y_half = (each[inside] for each in (x, y, x_half, y_half))
        simulated, read_half = smooth(x), np.hypot(y_half, smooth(x, 1) * x_half)
        half = np.abs(simulated - np.interp(x, place, smooth(place)))
        beyond = np.where(judged, np.abs(simulated - y) - np.hypot(half, read_half), -np.inf)
        k = worst(beyond)
        if beyond[k] > excess.get(name, -np.inf):
            excess[name] = beyond[k]
            values[name] = Value(Estimate(simulated[k], half[k], "interpolation"), Estimate(y[k], read_half[k], "reading of the figure"),
                                 detail=f"material {material} at {one['along']} = {x[k]:.3g}, the worst of {judged.sum()} points"
                                 + (f", {(~judged).sum()} left out" if not judged.all() else ""))
        curves.append(profile(f"{name}_{material}", f"{one['title']}, published", one["along"], one["across"], x, [simulated], half=half,
                              reference=y, reference_half=read_half, reference_label=labels[method]))
    return replace(found, values=values, profiles=curves)
