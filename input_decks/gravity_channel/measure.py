"""Gravity-driven channel: grains fall between two flat frictional walls, periodic along the flow, at a given mean solid fraction.

Velocities are shown over sqrt(g W). What falls steadily is held by the walls' friction: mean(left + right) = weight, and while the mean
velocity u still changes, weight times 1 - (du/dt) / g. Only the steady part is used, which is detected in the kinetic energy: it sums up
what the balance lacks, while the friction itself swings by as much as its mean. The velocity at the wall is that of the layer within one
diameter, the greatest velocity the mean over the middle half; the thickness of the shear zones is the length of the exponential that fits
what is missing to the latter, in cells of one diameter. The studies ask how these grow with the width.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from dembark.postproc import profiles
from dembark.postproc.instruments.channel import Channel, Mask, cells_across, frame_rows, joined, steady_part
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.replica import Array, Replica
from dembark.postproc.resampling import pooled, profile, resampled, time_blocks
from dembark.postproc.statistics import Estimate, block_mean
from dembark.postproc.studies import measured

BALANCE_TOLERANCE = 1e-3
# A mean velocity below this share of sqrt(g W) is creep: the grains are jammed between the walls.
LEAST_SPEED = 0.01
ZERO = Estimate(0.0, 0.0)
# Axes of the scaled profiles.
SCALED = ("distance from the layer at the wall over the thickness", "(u_max − u) / (u_max − u_slip)")


def read(replica: Replica) -> Channel:
    """Measure one run folder; the scale of velocities is sqrt(g W)."""
    given, times, steps = replica.parameters, replica.times(), np.array([frame.step for frame in replica.grains()])
    gravity, width = float(given["gravity"]), float(given["channel_width"])
    window = times["step"] > 2 * steps[0] - steps[1]
    start, remark = steady_part(times["kinetic_energy"][window], times["step"][window], steps)
    used, edges, depth = steps >= start, cells_across(width, float(given["grain_diameter"])), float(given["channel_depth"])
    rows, paths, falls, levels, weight = [], [], [], np.zeros(2), 0.0
    for (grains, contacts), keep in zip(replica.paired_frames(), used, strict=True):
        if keep:
            levels, weight = np.array([grains.low[2], grains.high[2]]), float(grains.masses.sum()) * gravity
            paths.append(grains.positions)
            falls.append(float(np.average(-grains.velocities[:, 2], weights=grains.masses)))
            # All grains in the box, where the walls' forces are to be sorted by height.
            rows.append(frame_rows(replace(grains, positions=grains.wrapped), contacts, edges, levels, depth, periodic=True))
    fall, track, speed = np.array(falls), np.array(paths), float(np.sqrt(gravity * width))
    if fall.mean() < LEAST_SPEED * speed:
        remark = f"the grains are jammed between the walls: they creep at {fall.mean():.2g} m/s"
    balance = block_mean(_imbalance(times, steps[used], fall / gravity / replica.time_step, weight))
    return joined(given, rows, track, np.full(track.shape[1], True), steps[used] * replica.time_step, levels=levels, speed=speed,
                  force_error=balance, height=float(levels[1] - levels[0]), steady_share=float(used.mean()), remark=remark)


def _imbalance(times: Mapping[str, Array], steps: Array, fall: Array, weight: float) -> Array:
    """Friction over weight, minus 1, plus what accelerates the grains, between frames; `fall` (frames,): mean velocity over g (steps)."""
    friction, when = times["left_fz"] + times["right_fz"], times["step"]
    held = [friction[(when > low) & (when <= high)].mean() / weight for low, high in pairwise(steps)]
    return np.array(held) - 1.0 + np.diff(fall) / np.diff(steps)


def inertial_numbers(one: Channel, frames: Mask) -> Array:
    """I across the channel, between the middles of neighbouring cells."""
    pressure, slope = one.pressure[frames].mean(axis=0), np.diff(one.velocity(frames)) / np.diff(one.middle)
    return profiles.inertial_number(slope, 0.5 * (pressure[1:] + pressure[:-1]), one.diameter, one.density)


def shear_inertial(one: Channel, frames: Mask) -> float:
    """The largest I further than one diameter from the walls, where cells are not split by the layers."""
    place = 0.5 * (one.middle[1:] + one.middle[:-1])
    return float(inertial_numbers(one, frames)[np.minimum(place, one.width - place) > one.diameter].max())


def thickness(one: Channel, frames: Mask) -> float:
    """Thickness of the shear zones in d."""
    return one.decay_length(frames, cells=2, start=1.0)


def scaled_deficit(one: Channel) -> tuple[Array, Array]:
    """Distance from the layer at the nearer wall over the zones' thickness, and (u_max - u) / (u_max - u_slip) there; 1 at 0.

    The layer's centres are half a diameter off the wall, and its velocity is u_slip.
    """
    place, deficit = one.deficit(one.frames, cells=2)
    return (place - place[0]) / (thickness(one, one.frames) * one.diameter), deficit / (1.0 - one.wall_velocity(one.frames))


def _scalars(one: Channel) -> dict[str, Estimate]:
    frames = time_blocks(one.flow.sum(axis=(1, 2)) / one.solid.sum(axis=(1, 2)))
    near, zone = one.from_wall < one.diameter, one.from_wall < 2.0 * one.diameter
    measures: dict[str, Callable[[Mask], float]] = {
        "greatest_velocity": lambda f: one.core_velocity(f) / one.speed,
        "slip_velocity": lambda f: one.wall_velocity(f) * one.core_velocity(f) / one.speed,
        "velocity_ratio": lambda f: 1.0 / one.wall_velocity(f),
        "shear_zone_thickness": lambda f: thickness(one, f),
        "core_flatness": one.flatness,
        "inertial_number": one.inertial,
        "shear_inertial_number": lambda f: shear_inertial(one, f),
        "wall_mobilisation": one.mobilisation,
        "core_fluctuation": lambda f: float(one.fluctuation(f, apart=True)[one.core].mean()),
        "wall_fluctuation": lambda f: float(one.fluctuation(f, apart=True)[near].mean()),
        "solid_fraction": lambda f: float(one.fraction(f)[one.core].mean()),
        "wall_solid_fraction": lambda f: float(one.fraction(f)[zone].mean()),
        "mean_solid_fraction": lambda f: float(one.fraction(f).mean()),
    }
    return {**{name: resampled(lambda f, _, get=get: get(f), frames) for name, get in measures.items()},
            "wall_normal_stress": block_mean(one.normal.mean(axis=(1, 2))), "force_balance_error": one.force_error}


def measure(replicas: Sequence[Replica]) -> Measurement:
    """Values, profiles and remarks of all replicas of a series."""
    channels = [read(replica) for replica in replicas]
    scalars = [_scalars(channel) for channel in channels]
    over = {name: pooled(scalars, name) for name in scalars[0]}
    unsteady, balance = next((one.remark for one in channels if one.remark), ""), over["force_balance_error"]
    allowed, static = max(balance.half, BALANCE_TOLERANCE), replicas[0].derived["wall_static"]
    verdict = "info" if not balance.half <= 0.1 else "pass" if abs(balance.value) <= allowed else "fail"
    flow = ("greatest_velocity", "slip_velocity", "velocity_ratio", "shear_zone_thickness")
    values = {
        **{name: Value(one, reason=unsteady if name in flow else "") for name, one in over.items()},
        "core_flatness": Value(over["core_flatness"], ZERO, reason=unsteady),
        "force_balance_error": Value(balance, ZERO, bound=allowed, verdict=verdict),
        "wall_mobilisation": Value(over["wall_mobilisation"], detail=f"the wall's static friction is {static:g}"),
    }
    share = channels[0].steady_share
    remark = f"The steady part holds {share:.0%} of the measuring window (MSER-5 and a drift test on the kinetic energy)."
    return Measurement(values, _profiles(channels), [unsteady[0].upper() + unsteady[1:] + "." if unsteady else remark])


def _profiles(channels: Sequence[Channel]) -> list[dict[str, Any]]:
    first = channels[0]
    place, between = first.middle / first.diameter, 0.5 * (first.middle[1:] + first.middle[:-1]) / first.diameter

    def entry(name: str, title: str, across: str, get: Callable[[Channel], Array], where: Array = place) -> dict[str, Any]:
        return profile(name, title, "from the left wall x / d", across, where, [get(one) for one in channels])

    scaled = [scaled_deficit(one) for one in channels]
    # The cells' own places only: between them a straight line is far from an exponential.
    reach = np.mean([where for where, _ in scaled], axis=0)
    law = np.exp(-reach) * float(np.mean([common_exponential([one])[0] for one in scaled]))
    return [
        entry("velocity", "Velocity", "u / √(g W)", lambda c: c.velocity(c.frames) / c.speed),
        profile("scaled_velocity", "Scaled velocity deficit", *SCALED, reach, [deficit for _, deficit in scaled], reference=law,
                reference_label="exponential"),
        entry("fluctuation", "Velocity fluctuation", "standard deviation of u / √(g W)", lambda c: c.fluctuation(c.frames, apart=True)),
        entry("solid_fraction", "Solid fraction", "φ", lambda c: c.fraction(c.frames)),
        entry("inertial_number", "Inertial number", "I", lambda c: inertial_numbers(c, c.frames), between),
    ]


def exponent(widths: Array, values: Sequence[Estimate]) -> Estimate:
    """Slope of ln(value) against ln(width) by least squares, with the half-width that the values' own intervals give it."""
    place = np.log(widths) - np.log(widths).mean()
    weights = place / np.sum(place**2)
    slope = float(weights @ np.log([one.value for one in values]))
    half = float(np.sqrt(np.sum((weights * [one.half / one.value for one in values]) ** 2)))
    return Estimate(slope, half, f"propagated from {len(widths)} widths")


def common_exponential(curves: Sequence[tuple[Array, Array]]) -> tuple[float, float]:
    """(a, largest deviation) of the one function a exp(-place) that fits all curves best."""
    place, value = (np.concatenate(parts) for parts in zip(*curves, strict=True))
    a = float(np.exp(-place) @ value / np.sum(np.exp(-2.0 * place)))
    return a, float(np.abs(value - a * np.exp(-place)).max())


def study(_name: str, points: Sequence[Mapping[str, Any]], along: str) -> Measurement:
    """Exponents of velocities and thickness in the width, and the scaled profiles of all widths."""
    points = sorted(points, key=lambda point: float(point["parameters"][along]))
    given, widths = points[0]["parameters"], np.array([float(point["parameters"][along]) for point in points])
    cells, speeds = widths / float(given["grain_diameter"]), np.sqrt(widths * float(given["gravity"]))
    grown = {key: [measured(point, key, factor) for point, factor in zip(points, speeds, strict=True)]
             for key in ("greatest_velocity", "slip_velocity")}
    grown["thickness"] = [measured(point, "shear_zone_thickness") for point in points]
    ratio = [measured(point, "velocity_ratio") for point in points]
    reasons = [next(one["reason"] for one in point["quantities"] if one["name"] == "greatest_velocity") for point in points]
    broken = next((f"W = {width:.0f} d: {reason}" for width, reason in zip(cells, reasons, strict=True) if reason), "")
    short = f"the abstract speaks of sufficiently wide channels and names no width; these are {cells[0]:.0f} to {cells[-1]:.0f} d"
    curves = [tuple(np.array(one[part], float) for part in ("place", "value"))
              for point in points for one in point["profiles"] if one["name"] == "scaled_velocity"]
    amplitude, worst = common_exponential(curves)
    spread = max(abs(one.value / np.mean([each.value for each in ratio]) - 1.0) for one in ratio)
    powers = {"greatest_velocity": 0.5, "slip_velocity": 0.5, "thickness": 1.0}
    values = {f"exponent_{key}": Value(exponent(widths, grown[key]), Estimate(power, 0.0), reason=broken or short)
              for key, power in powers.items()}
    widest = max(one.half / one.value for one in ratio)
    values["ratio_spread"] = Value(Estimate(spread, widest, "largest of the widths"), ZERO, reason=broken)
    values["profile_collapse"] = Value(
        Estimate(worst, 0.0, "largest of all places and widths"), ZERO,
        reason=broken or "the abstract does not say how the profile is scaled; this scaling was chosen here, with first runs at hand",
        detail=f"(u_max − u)/(u_max − u_slip) against {amplitude:.2f} exp(−distance/thickness) in cells of one diameter; the distance is "
               "that from the layer at the wall")
    fractions = [[measured(point, key).value for point in points] for key in ("solid_fraction", "wall_solid_fraction")]
    loose = ", ".join(f"{core:.3f} and {wall:.3f} at {width:.0f} d" for core, wall, width in zip(*fractions, cells, strict=True))
    remark = (f"Solid fraction of the core and within two diameters of the walls: {loose}. Velocities in proportion to √W belong to "
              "shear zones of the same solid fraction; those of a channel in which the plug leaves them room for one or two layers only "
              "get looser as it gets wider, and the flow faster.")
    return Measurement(values, _growth(cells, grown, powers, curves, amplitude), [remark])


def _growth(widths: Array, grown: Mapping[str, Sequence[Estimate]], powers: Mapping[str, float], curves: Sequence[tuple[Array, ...]],
            amplitude: float) -> list[dict[str, Any]]:
    titles = {"greatest_velocity": ("Greatest velocity", "u_max (m/s)"), "slip_velocity": ("Velocity at the wall", "u_slip (m/s)"),
              "thickness": ("Thickness of the shear zones", "thickness / d")}
    drawn = []
    for name, power in powers.items():
        middle, halves = (np.array([getattr(one, part) for one in grown[name]]) for part in ("value", "half"))
        law = np.exp(np.mean(np.log(middle) - power * np.log(widths))) * widths**power
        drawn.append(profile(name, titles[name][0], "width W / d", titles[name][1], widths, [middle], half=halves, reference=law,
                             reference_label="proportional to " + ("√W" if power == 0.5 else "W")))
    return drawn + [
        profile(f"scaled_velocity_{width:.0f}", f"Scaled velocity deficit, W = {width:.0f} d", *SCALED, place, [value],
                reference=amplitude * np.exp(-place), reference_label="one exponential for all widths")
        for (place, value), width in zip(curves, widths, strict=True)
    ]
