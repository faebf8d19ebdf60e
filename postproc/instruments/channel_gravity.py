"""Gravity-driven flow in a channel: velocities over sqrt(g W), and profiles scaled with the thickness of the shear zones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dembark.postproc.instruments import channel
from dembark.postproc.instruments.channel import Channel, Mask
from dembark.postproc.measurement import Array, Curve, Estimate, profile

# Axes of the scaled profiles.
SCALED = ("distance from the layer at the wall over the thickness", "(u_max − u) / (u_max − u_slip)")


def thickness(one: Channel, frames: Mask) -> float:
    """Thickness of the shear zones in d."""
    return one.decay_length(frames, cells=2, start=1.0)


def common_exponential(curves: Sequence[tuple[Array, Array]]) -> tuple[float, float]:
    """(a, largest deviation) of the one function a exp(-place) that fits all curves best."""
    place, value = (np.concatenate(parts) for parts in zip(*curves, strict=True))
    a = float(np.exp(-place) @ value / np.sum(np.exp(-2.0 * place)))
    return a, float(np.abs(value - a * np.exp(-place)).max())


def estimates(one: Channel) -> dict[str, Estimate]:
    """All that is measured of one run, velocities over sqrt(g W)."""
    zone = one.from_wall < 2.0 * one.diameter
    return channel.estimates(one, one.flow.sum(axis=(1, 2)) / one.solid.sum(axis=(1, 2)), {
        "greatest_velocity": lambda f, _: one.core_velocity(f) / one.speed,
        "slip_velocity": lambda f, _: one.wall_velocity(f) * one.core_velocity(f) / one.speed,
        "velocity_ratio": lambda f, _: 1.0 / one.wall_velocity(f),
        "shear_zone_thickness": lambda f, _: thickness(one, f),
        "shear_inertial_number": lambda f, _: one.shear_inertial(f),
        "wall_solid_fraction": lambda f, _: float(one.fraction(f)[zone].mean()),
        "mean_solid_fraction": lambda f, _: float(one.fraction(f).mean()),
    }, apart=True)


def profiles(channels: Sequence[Channel]) -> list[Curve]:
    """Across the channel: velocity, also scaled beside one exponential, fluctuation, solid fraction and inertial number."""
    scaled = [one.scaled_deficit(thickness(one, one.frames)) for one in channels]
    # The cells' own places only: between them a straight line is far from an exponential.
    reach = np.mean([where for where, _ in scaled], axis=0)
    law = np.exp(-reach) * float(np.mean([common_exponential([one])[0] for one in scaled]))
    return [
        channel.across(channels, "velocity", "Velocity", "u / √(g W)", lambda c: c.velocity(c.frames) / c.speed),
        profile("scaled_velocity", "Scaled velocity deficit", *SCALED, reach, [deficit for _, deficit in scaled], reference=law,
                reference_label="exponential"),
        channel.across(channels, "fluctuation", "Velocity fluctuation", "standard deviation of u / √(g W)",
                       lambda c: c.fluctuation(c.frames, apart=True)),
        channel.across(channels, "solid_fraction", "Solid fraction", "φ", lambda c: c.fraction(c.frames)),
        channel.across(channels, "inertial_number", "Inertial number", "I", lambda c: c.inertial_numbers(c.frames)),
    ]


def scaled_curves(curves: Sequence[tuple[Array, Array]], widths: Array, amplitude: float) -> list[Curve]:
    """The scaled profiles `curves` of channels of `widths` (in d), each beside `amplitude` exp(-place)."""
    return [profile(f"scaled_velocity_{width:.0f}", f"Scaled velocity deficit, W = {width:.0f} d", *SCALED, place, [value],
                    reference=amplitude * np.exp(-place), reference_label="one exponential for all widths")
            for (place, value), width in zip(curves, widths, strict=True)]
