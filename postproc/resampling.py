"""Intervals from one replica by resampling its time and its places, over replicas, and the profiles of a report with their bands."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError

from .replica import Array
from .statistics import ONE_SAMPLE, Estimate, TimeBlocks, jackknife, over_replicas


def resampled(measure: Callable[[NDArray[np.bool_], NDArray[np.bool_]], float], frames: TimeBlocks, places: NDArray[np.int64] | None = None,
              overlap: float = 1.0) -> Estimate:
    """`measure(keep_frames, keep_places)` with an interval from what varies in time and, with `places`, from place to place.

    `overlap`: variance among places that share samples, over that among independent ones. The wider of the two jackknife intervals counts:
    places stand for the disorder of the packing, which time does not average out, and their spread holds their own variation in time;
    blocks of time show what all places do together.
    """
    everywhere = np.ones(0 if places is None else len(places), bool)
    in_time = jackknife(lambda keep: measure(keep, everywhere), frames.groups, name="time blocks")
    in_time = Estimate(in_time.value, in_time.half * frames.widening, ONE_SAMPLE if frames.single else in_time.basis)
    if places is None:
        return in_time
    always = np.ones(len(frames.groups), bool)
    in_space = jackknife(lambda keep: measure(always, keep), places, name="sectors or bands")
    in_space = Estimate(in_space.value, in_space.half / math.sqrt(overlap), in_space.basis)
    return max(in_time, in_space, key=lambda one: one.half)


def pooled(replicas: Sequence[Mapping[str, Estimate]], name: str) -> Estimate:
    """The quantity `name` over replicas."""
    return over_replicas([one[name] for one in replicas])


def profile(name: str, title: str, along: str, across: str, place: Array, values: Sequence[Array], *, half: Array | None = None,
            vertical: bool = False, reference: Array | None = None, reference_half: Array | None = None, reference_label: str = "",
            note: str = "") -> dict[str, Any]:
    """A profile for figure and CSV: `values` of each replica at the same `place`. The band: the half-widths `half` of 95 % intervals, where
    given and all known; else Student's interval over three or more replicas, or the range of two.

    `along` and `across` label the axes of place and value; `vertical` draws the place upwards. `reference_half`: half-widths of the 95 %
    intervals of a measured `reference`. DembarkError for a name that cannot be that of a file, and for numbers that do not fit the places.
    """
    if not re.fullmatch(r"[\w.+-]+", name):
        raise DembarkError(f"a curve is called {name!r}", "files are named after it", "take letters, digits, '_', '.', '+' and '-'")
    table = _fitting(name, np.asarray(place, float), values, reference, half, reference_half)
    mean = table.mean(axis=0)
    entry: dict[str, Any] = {"name": name, "title": title, "along": along, "across": across, "vertical": vertical, "place": _numbers(place),
                             "value": _numbers(mean), "note": note}
    if half is not None and np.isfinite(half).all():
        entry |= {"low": _numbers(mean - half), "high": _numbers(mean + half), "band": "95 % interval"}
    elif len(table) == 2:
        entry |= {"low": _numbers(table.min(axis=0)), "high": _numbers(table.max(axis=0)), "band": "range of 2 replicas"}
    elif len(table) > 2:
        spread = np.array([over_replicas([Estimate(value, 0.0) for value in column]).half for column in table.T])
        entry |= {"low": _numbers(mean - spread), "high": _numbers(mean + spread), "band": f"95 % interval over {len(table)} replicas"}
    if reference is not None:
        entry |= {"reference": _numbers(reference), "reference_label": reference_label}
    if reference is not None and reference_half is not None:
        entry |= {"reference_low": _numbers(reference - reference_half), "reference_high": _numbers(reference + reference_half)}
    return entry


def _fitting(name: str, place: Array, values: Sequence[Array], reference: Array | None, *halves: Array | None) -> Array:
    """The `values` (replicas, n) of the curve `name` at the places (n,); DembarkError when one of them, the `reference` or the `halves`
    has another number of them."""
    rows = [np.asarray(one, float) for one in values]
    fitting = [*rows, *(np.asarray(one, float) for one in (reference,) if one is not None)]
    # One half-width for all places will do.
    fitting += [width for one in halves if one is not None and (width := np.asarray(one, float)).ndim]
    if not rows or any(one.shape != place.shape or one.ndim != 1 for one in fitting):
        shapes = ", ".join("×".join(map(str, one.shape)) or "one number" for one in fitting)
        raise DembarkError(f"the curve {name} has {'×'.join(map(str, place.shape))} places, but {shapes or 'no'} values", "",
                           "give a value for each place, and an array of values for each replica")
    return np.array(rows)


def _numbers(values: Array) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in np.asarray(values)]
