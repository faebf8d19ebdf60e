"""Plug flow: a packing sinks between two vertical walls on a plate that moves down at the constant speed v0.

Only the steady part is used; it is detected in the wall friction (MSER-5 and a drift test).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from dembark.postproc.instruments import channel_fields
from dembark.postproc.instruments.channel import Channel, read
from dembark.postproc.instruments.liquid import liquid_values
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.replica import Array, Replica
from dembark.postproc.resampling import pooled, profile, resampled, time_blocks
from dembark.postproc.statistics import CONFIDENCE, Estimate, block_mean

# A wall zone whose velocity deficit is below this cannot be told from the core's own scatter.
LEAST_DEFICIT = 0.02
# What nothing is said of when no steady part was found.
JUDGED = ("core_flatness", "flux_error", "inertial_number", "force_balance_error")
REMARKS = (
    "The published flow is driven by gravity alone; here the plate sets the speed, so the widths are shown and not judged by it.",
    ("Published widths of shear zones exist for rough and smooth walls; none of these papers could be read for this report, so no range is "
     "quoted."),
)


def measure(replicas: Sequence[Replica]) -> Measurement:
    """Values, profiles, remarks and fields of all replicas of a series."""
    channels = [read(replica) for replica in replicas]
    scalars = [_scalars(channel) for channel in channels]
    over = {name: pooled(scalars, name) for name in scalars[0]}
    first, unsteady, slip = channels[0], next((one.remark for one in channels if one.remark), ""), 1.0 - over["wall_slip"].value
    faint = f"the walls' layer lags by {slip:.1%} only: no shear zone to measure" if slip < LEAST_DEFICIT else ""
    values = {name: Value(one) for name, one in over.items()}
    values |= {name: Value(over[name], Estimate(0.0, 0.0), reason=unsteady) for name in JUDGED}
    values |= {name: Value(over[name], reason=faint, compared=not faint) for name in ("shear_zone_width", "shear_zone_width_90")}
    told = f"the wall's static friction is {replicas[0].derived['wall_static']:g}"
    values["wall_mobilisation"] = Value(over["wall_mobilisation"], detail=told)
    fields = channel_fields.measured(replicas, unsteady)
    steady = f"The steady part holds {first.steady_share:.0%} of the measuring window (MSER-5 and a drift test on the wall friction)."
    d, window = first.diameter, first.levels[-1] - first.levels[0]
    size = (f"The channel is {first.width / d:.0f} d wide and filled {first.height / d:.0f} d high; the cells that rest in the laboratory "
            f"cover {window / d:.0f} d of it.")
    remarks = [unsteady + "." if unsteady else steady, size, *REMARKS]
    return Measurement({**values, **liquid_values(replicas), **fields.values}, _profiles(channels), remarks, fields.fields)


def _scalars(one: Channel) -> dict[str, Estimate]:
    frames, count = time_blocks(one.shear.sum(axis=(1, 2))), one.solid.shape[2]
    near = one.from_wall < one.diameter
    measures = {
        "core_flatness": one.flatness,
        "core_velocity": lambda f, b: one.core_velocity(f, b) / one.speed,
        "wall_slip": one.wall_velocity,
        "shear_zone_width": one.decay_length,
        "shear_zone_width_90": one.ninety_width,
        "inertial_number": one.inertial,
        "wall_mobilisation": one.mobilisation,
        "core_fluctuation": lambda f, b: float(one.fluctuation(f, b)[one.core].mean()),
        "wall_fluctuation": lambda f, b: float(np.nanmean(one.fluctuation(f, b)[near])),
        "solid_fraction": lambda f, b: float(one.fraction(f, b)[one.core].mean()),
    }
    errors = one.flux_errors()
    # With as many heights as bands, each gets the interval with which all together hold 95 % (Bonferroni).
    each = [block_mean(column, 1.0 - (1.0 - CONFIDENCE) / errors.shape[1]) for column in errors.T]
    return {
        **{name: resampled(measure, frames, np.arange(count) * max(4, count // 2) // count) for name, measure in measures.items()},
        "flux_error": max(each, key=lambda found: abs(found.value) - (found.half if np.isfinite(found.half) else 0.0)),
        "force_balance_error": one.force_error,
        "core_velocity_lagrangian": block_mean(one.core_motion / one.speed),
        "wall_normal_stress": block_mean(one.normal.mean(axis=(1, 2))),
        "wall_shear_stress": block_mean(one.shear.mean(axis=(1, 2))),
    }


def _profiles(channels: Sequence[Channel]) -> list[dict[str, Any]]:
    first = channels[0]
    place, levels = first.middle / first.diameter, (0.5 * (first.levels[1:] + first.levels[:-1]) - first.levels[0]) / first.diameter

    def across(name: str, title: str, label: str, get: Callable[[Channel], Array], reference: Array | None = None) -> dict[str, Any]:
        rows = [np.interp(place, one.middle / one.diameter, get(one)) for one in channels]
        return profile(name, title, "from the left wall x / d", label, place, rows, reference=reference,
                       reference_label="" if reference is None else "the plate, v₀")

    def upward(name: str, title: str, label: str, get: Callable[[Channel], Array]) -> dict[str, Any]:
        curves, top = [get(one).mean(axis=(0, 2)) for one in channels], np.linspace(0, 1, len(levels))
        rows = [np.interp(top, np.linspace(0, 1, len(curve)), curve) for curve in curves]
        return profile(name, title, "height in the window z / d", label, levels, rows, vertical=True)

    def of_grains(one: Channel) -> Array:
        cell = np.clip(np.searchsorted(one.edges, one.grain_place) - 1, 0, len(one.middle) - 1)
        count = np.bincount(cell, minlength=len(one.middle))
        return np.where(count > 0, np.bincount(cell, one.grain_speed, len(one.middle)) / np.maximum(count, 1), np.nan) / one.speed

    plate = np.ones_like(place)
    return [
        across("velocity", "Velocity, Eulerian", "v / v₀", lambda c: c.velocity(c.frames) / c.speed, plate),
        across("velocity_lagrangian", "Velocity, Lagrangian", "v / v₀", of_grains, plate),
        across("fluctuation", "Velocity fluctuation", "standard deviation of v / v₀", lambda c: c.fluctuation(c.frames)),
        across("solid_fraction", "Solid fraction", "φ", lambda c: c.fraction(c.frames)),
        upward("wall_normal", "Wall normal stress", "σ_xx (Pa)", lambda c: c.normal),
        upward("wall_shear", "Wall shear stress", "τ (Pa)", lambda c: c.shear),
    ]
