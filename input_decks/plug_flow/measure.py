"""Plug flow: a packing sinks between two vertical walls on a plate that moves down at the constant speed v0. Only the steady part is used;
it is detected in the wall friction (MSER-5 and a drift test)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dembark.input_decks.common.liquid import liquid_values
from dembark.postproc.measurement import CONFIDENCE, Curve, Estimate, Measurement, Replicas, Value, block_mean, pooled

from . import channel, fields, fluctuations
from .channel import Channel

# A wall zone whose velocity deficit is below this cannot be distinguished from the core's own scatter.
LEAST_DEFICIT = 0.02
# What nothing is said of when no steady part was found.
JUDGED = ("core_flatness", "flux_error", "inertial_number", "force_balance_error")
# Of channels with a front and a rear wall, from the abstracts of Natarajan et al. (1995) and of Moka and Nott (2005): two to two and a half
# times; an order of magnitude, in log10; the same distribution; a power law.
MEASURED = {"anisotropy": 2.25, "diffusion_ratio": 1.0, "distribution_difference": 0.0, "tail_growth": 1.0}
REMARKS = (
    "The published flow is driven by gravity alone; here the plate sets the speed, so the widths are shown without a verdict.",
    ("Published widths of shear zones exist for rough and smooth walls; none of these papers was available for this report, so no range is "
     "given."),
)


def estimates(one: Channel) -> dict[str, Estimate]:
    """All that is measured of one run, velocities over that of the plate."""
    errors = one.flux_errors()
    # With as many heights as bands, each gets the interval with which all together hold 95 % (Bonferroni).
    each = [block_mean(column, 1.0 - (1.0 - CONFIDENCE) / errors.shape[1]) for column in errors.T]
    return {
        **channel.estimates(one, one.shear.sum(axis=(1, 2)), {
            "core_velocity": lambda f, b: one.core_velocity(f, b) / one.speed,
            "wall_slip": one.wall_velocity,
            "shear_zone_width": one.decay_length,
            "shear_zone_width_90": one.ninety_width,
        }),
        "flux_error": max(each, key=lambda found: abs(found.value) - (found.half if np.isfinite(found.half) else 0.0)),
        "core_velocity_lagrangian": block_mean(one.core_motion / one.speed),
        "wall_shear_stress": block_mean(one.shear.mean(axis=(1, 2))),
    }


def profiles(channels: Sequence[Channel]) -> list[Curve]:
    """Across the channel: velocities, fluctuation and solid fraction; up the walls: their stresses."""
    plate = {"reference": np.ones(len(channels[0].middle)), "reference_label": "the plate, v₀"}
    return [
        channel.across(channels, "velocity", "Velocity, Eulerian", "v / v₀", lambda c: c.velocity(c.frames) / c.speed, **plate),
        channel.across(channels, "velocity_lagrangian", "Velocity, Lagrangian", "v / v₀", lambda c: c.lagrangian() / c.speed, **plate),
        channel.across(channels, "fluctuation", "Velocity fluctuation", "standard deviation of v / v₀", lambda c: c.fluctuation(c.frames)),
        channel.across(channels, "solid_fraction", "Solid fraction", "φ", lambda c: c.fraction(c.frames)),
        channel.upward(channels, "wall_normal", "Wall normal stress", "σ_xx (Pa)", lambda c: c.normal),
        channel.upward(channels, "wall_shear", "Wall shear stress", "τ (Pa)", lambda c: c.shear),
    ]


def measure(replicas: Replicas) -> Measurement:
    """Values, profiles, remarks and fields of all replicas of a series."""
    channels = [channel.read(replica) for replica in replicas]
    found = [estimates(one) for one in channels]
    over = {name: pooled(found, name) for name in found[0]}
    first, unsteady, slip = channels[0], channel.unsteady([one.course for one in channels]), 1.0 - over["wall_slip"].value
    faint = f"the layer at the walls lags by only {slip:.1%}: no shear zone to measure" if slip < LEAST_DEFICIT else ""
    values = {name: Value(one) for name, one in over.items()}
    values |= {name: Value(over[name], Estimate(0.0, 0.0), reason=unsteady) for name in JUDGED}
    values |= {name: Value(over[name], reason=faint, compared=not faint) for name in ("shear_zone_width", "shear_zone_width_90")}
    detail = f"the wall's static friction is {replicas[0].derived['wall_static']:g}"
    values["wall_mobilisation"] = Value(over["wall_mobilisation"], detail=detail)
    maps, curves = fields.measured(replicas, unsteady), profiles(channels)
    # Only through a wall that ends the channel can grains be seen.
    if not replicas[0].grains()[0].periodic[1]:
        motions = [fluctuations.Motion.of(one) for one in channels]
        values |= {name: Value(one, Estimate(MEASURED[name], 0.0) if name in MEASURED else None, reason=unsteady)
                   for name, one in fluctuations.estimates(motions).items()}
        curves += fluctuations.profiles(motions)
    share = float(np.mean([one.steady_share for one in channels]))
    steady = f"Steady parts hold {share:.0%} of the measuring windows (MSER-5 and a drift test on the wall friction)."
    d, window = first.diameter, first.levels[-1] - first.levels[0]
    size = (f"The channel is {first.width / d:.0f} d wide and filled {first.height / d:.0f} d high; the cells, which are at rest in the "
            f"laboratory frame, cover {window / d:.0f} d of it.")
    remarks = [unsteady + "." if unsteady else steady, size, *REMARKS]
    return Measurement({**values, **liquid_values(replicas), **maps.values}, curves, remarks, maps.fields)
