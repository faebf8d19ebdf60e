"""Flow in a channel on a plate that sinks: velocities over that of the plate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dembark.postproc.instruments import channel
from dembark.postproc.instruments.channel import Channel
from dembark.postproc.measurement import CONFIDENCE, Curve, Estimate, block_mean


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
