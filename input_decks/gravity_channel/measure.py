"""Gravity-driven channel: grains fall between two flat frictional walls, periodic along the flow, at a given mean solid fraction.
Velocities over sqrt(g W): at the wall, of the layer within one diameter; the greatest, mean over the middle half. Balance: mean(left +
right) = weight (1 - (du/dt) / g). Thickness of the shear zones: length of the exponential fitted to u_max - u in cells of one diameter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.input_decks.plug_flow import channel
from dembark.input_decks.plug_flow.channel import Channel, Mask, read_periodic, unsteady
from dembark.postproc.measurement import Array, Curve, Estimate, Measurement, Points, Replicas, Value, exact, pooled, profile
from dembark.postproc.studies import quantity

# Quantities without a verdict where no steady flow was found.
FLOW = ("greatest_velocity", "slip_velocity", "velocity_ratio", "shear_zone_thickness", "core_flatness")
# What grows with the width: the curve's title and label, and the published power.
GROWN = {"greatest_velocity": ("Maximum velocity", "u_max (m/s)", 0.5), "slip_velocity": ("Velocity at the wall", "u_slip (m/s)", 0.5),
         "thickness": ("Thickness of the shear zones", "thickness / d", 1.0)}
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
    """Across the channel: velocity, also scaled with one exponential, fluctuation, solid fraction and inertial number."""
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


def measure(replicas: Replicas) -> Measurement:
    """Values, profiles and remarks of all replicas of a series."""
    channels = [read_periodic(replica) for replica in replicas]
    found = [estimates(one) for one in channels]
    reason, zero = next((one.remark for one in channels if one.remark), unsteady([one.course for one in channels])), exact(0.0)
    references = {"core_flatness": zero, "force_balance_error": zero}
    details = {"wall_mobilisation": f"the wall's static friction is {replicas[0].derived['wall_static']:g}"}
    values = {name: Value(pooled(found, name), references.get(name), reason=reason if name in FLOW else "",
                          detail=details.get(name, "")) for name in found[0]}
    share = float(np.mean([one.steady_share for one in channels]))
    remark = f"Steady parts hold {share:.0%} of the measuring windows (MSER-5 and a drift test on the kinetic energy)."
    return Measurement(values, profiles(channels), [reason[0].upper() + reason[1:] + "." if reason else remark])


def study(_name: str, points: Points, along: str) -> Measurement:
    """Exponents of velocities and thickness in the width, and the scaled profiles of all widths."""
    points, widths = ordered(points, along)
    given, cells = points[0]["parameters"], widths / float(points[0]["parameters"]["grain_diameter"])
    speeds = np.sqrt(widths * float(given["gravity"]))
    grown = {"greatest_velocity": PowerLawFit.of(points, "greatest_velocity", cells, speeds),
             "slip_velocity": PowerLawFit.of(points, "slip_velocity", cells, speeds),
             "thickness": PowerLawFit.of(points, "shear_zone_thickness", cells)}
    reasons = [quantity(point, "greatest_velocity")["reason"] for point in points]
    broken = next((f"W = {width:.0f} d: {reason}" for width, reason in zip(cells, reasons, strict=True) if reason), "")
    short = f"the abstract refers to sufficiently wide channels without a width; these are {cells[0]:.0f} to {cells[-1]:.0f} d"
    scaled = [(np.array(one["place"], float), np.array(one["value"], float))
              for point in points for one in point["profiles"] if one["name"] == "scaled_velocity"]
    amplitude, worst = common_exponential(scaled)
    ratio = PowerLawFit.of(points, "velocity_ratio", cells)
    spread = Estimate(float(np.abs(ratio.values / ratio.values.mean() - 1.0).max()), float((ratio.halves / ratio.values).max()),
                      "largest of the widths")
    values = {
        **{f"exponent_{name}": Value(grown[name].exponent, exact(power), reason=broken or short) for name, (*_, power) in GROWN.items()},
        "ratio_spread": Value(spread, exact(0.0), reason=broken),
        "profile_collapse": Value(
            Estimate(worst, 0.0, "largest over all positions and widths"), exact(0.0),
            reason=broken or "the abstract does not state how the profile is scaled; this scaling was chosen here after the first runs",
            detail=f"(u_max − u)/(u_max − u_slip) against {amplitude:.2f} exp(−distance/thickness) in cells of one diameter; the distance "
                   "is measured from the layer at the wall"),
    }
    curves = [grown[name].curve(name, title, "width W / d", label, power, "proportional to " + ("√W" if power == 0.5 else "W"))
              for name, (title, label, power) in GROWN.items()]
    curves += [profile(f"scaled_velocity_{width:.0f}", f"Scaled velocity deficit, W = {width:.0f} d", *SCALED, place, [value],
                       reference=amplitude * np.exp(-place), reference_label="one exponential for all widths")
               for (place, value), width in zip(scaled, cells, strict=True)]
    core, wall = (PowerLawFit.of(points, name, cells).values for name in ("solid_fraction", "wall_solid_fraction"))
    loose = ", ".join(f"{one:.3f} and {other:.3f} at {width:.0f} d" for one, other, width in zip(core, wall, cells, strict=True))
    return Measurement(values, curves, [
        (f"Solid fraction of the core and within two diameters of the walls: {loose}. Velocities proportional to √W require shear zones "
         "of the same solid fraction; in a channel in which the plug leaves room for only one or two layers they become looser with the "
         "width, and the flow becomes faster.")])
