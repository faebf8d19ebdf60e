"""Gravity-driven channel: grains fall between two flat frictional walls, periodic along the flow, at a given mean solid fraction.

x runs from wall to wall (0 to W), y and z are periodic, gravity points along -z, velocities are counted downward and shown over sqrt(g W).
What falls steadily is held by the walls' friction: mean(left + right) = weight, and while the mean velocity u still changes, weight times
1 - (du/dt) / g. Only the steady part is used, which is detected in the kinetic energy: it sums up what the balance lacks, while the
friction itself swings by as much as its mean. The velocity at the wall is that of the layer within one diameter, the greatest velocity the
mean over the middle half; the thickness of the shear zones is the length of the exponential that fits what is missing to the latter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dembark.postproc import profiles
from dembark.validation.checks.channel import Array, Channel, Mask, fitted_decay, frame_rows, steady_part
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica, pooled, profile, resampled, time_blocks, wall_friction
from dembark.validation.checks.widths import width_study
from dembark.validation.references import DEBNATH
from dembark.postproc.statistics import Estimate, block_mean

REFERENCES = (DEBNATH,)
FLATNESS = 0.02
BALANCE_TOLERANCE = 1e-3
# A mean velocity below this share of sqrt(g W) is creep: the grains are jammed between the walls.
LEAST_SPEED = 0.01
_ALL = np.ones(1, bool)


def picture(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """How the report shows the packing."""
    return {"colour_by": "velocity", "scale": float(np.sqrt(parameters["gravity"] * parameters["channel_width"])), "cut": False}


def read(replica: Replica) -> Channel:
    """Measure one run folder; the scale of velocities, `base_speed`, is sqrt(g W)."""
    values = replica.parameters
    width, depth, diameter, gravity = (float(values[name]) for name in ("channel_width", "channel_depth", "grain_diameter", "gravity"))
    steps = np.array([frame.step for frame in replica.grains()])
    times = replica.times()
    spacing = int(steps[1] - steps[0])
    window = times["step"] > steps[0] - spacing
    start, remark = steady_part(times["kinetic_energy"][window], times["step"][window], steps)
    used = steps >= start
    edges = np.linspace(0.0, width, 4 * round(width / (2.0 * diameter)) + 1)
    rows: dict[str, list[Any]] = {}
    paths, falls, levels, weight = [], [], np.zeros(2), 0.0
    for (grains, contacts), keep in zip(replica.paired_frames(), used, strict=True):
        if keep:
            levels, weight = np.array([grains.low[2], grains.high[2]]), float(grains.masses.sum()) * gravity
            paths.append(grains.positions)
            falls.append(float(np.average(-grains.velocities[:, 2], weights=grains.masses)))
            for name, row in frame_rows(_inside(grains), contacts, edges, levels, depth, periodic=True).items():
                rows.setdefault(name, []).append(row)
    clock, track, fall = steps[used] * replica.time_step, np.array(paths), np.array(falls)
    if fall.mean() < LEAST_SPEED * np.sqrt(gravity * width):
        remark = f"the grains are jammed between the walls: they creep at {fall.mean():.2g} m/s"
    inner = np.abs(track[:, :, 0].mean(axis=0) - 0.5 * width) < 0.25 * width
    return Channel(
        edges=edges,
        levels=levels,
        width=width,
        depth=depth,
        diameter=diameter,
        density=float(values["grain_density"]),
        base_speed=float(np.sqrt(gravity * width)),
        core_motion=-np.diff(track[:, inner, 2].mean(axis=1)) / np.diff(clock),
        grain_place=track[:, :, 0].mean(axis=0),
        grain_speed=-profiles.lagrangian_velocities(track, clock)[:, 2],
        force_error=block_mean(_imbalance(times, steps[used], fall / gravity / replica.time_step, weight)),
        wall_friction=wall_friction(values),
        height=float(levels[1] - levels[0]),
        steady_share=float(used.mean()),
        remark=remark,
        **{name: np.array(row) for name, row in rows.items()},
    )


def _inside(grains: Any) -> Any:
    """The frame with all grains in the box, where the walls' forces are to be sorted by height."""
    return type(grains)(**{**grains.__dict__, "positions": grains.wrapped})


def _imbalance(times: dict[str, Array], steps: Array, fall: Array, weight: float) -> Array:
    """Friction over weight, minus 1, plus what accelerates the grains, between frames; `fall` (frames,): mean velocity over g (steps)."""
    friction, when = times["left_fz"] + times["right_fz"], times["step"]
    held = [friction[(when > low) & (when <= high)].mean() / weight for low, high in zip(steps[:-1], steps[1:], strict=True)]
    return np.array(held) - 1.0 + np.diff(fall) / np.diff(steps)


def inertial_numbers(channel: Channel, frames: Mask) -> Array:
    """I across the channel, between the middles of neighbouring cells."""
    pressure = channel.pressure[frames].mean(axis=0)
    slope = np.diff(channel.velocity(frames, _ALL)) / np.diff(channel.middle)
    return profiles.inertial_number(slope, 0.5 * (pressure[1:] + pressure[:-1]), channel.diameter, channel.density)


def shear_inertial(channel: Channel, frames: Mask) -> float:
    """The largest I further than one diameter from the walls, where cells are not split by the layers."""
    place = 0.5 * (channel.middle[1:] + channel.middle[:-1])
    away = np.minimum(place, channel.width - place) > channel.diameter
    return float(inertial_numbers(channel, frames)[away].max())


def shear_zone(channel: Channel, frames: Mask) -> tuple[Array, Array]:
    """Distance from the nearer wall (m) and 1 - u / u_max there, both walls averaged, in cells of one diameter.

    The grains lie in layers at a wall; smaller cells would show the same grains' velocity at several places.
    """
    pairs = np.arange(0, len(channel.middle), 2)
    flow, solid = (np.add.reduceat(values[frames].sum(axis=(0, 2)), pairs) for values in (channel.flow, channel.solid))
    half = len(flow) // 2
    speed = (flow + flow[::-1])[:half] / (solid + solid[::-1])[:half]
    place = 0.5 * (channel.edges[:-1:2] + channel.edges[2::2])[:half]
    return place, 1.0 - speed / channel.core_velocity(frames, _ALL)


def thickness(channel: Channel, frames: Mask) -> float:
    """Thickness of the shear zones in d: the length of the exponential that fits them."""
    return min(fitted_decay(*shear_zone(channel, frames), channel.diameter), channel.width) / channel.diameter


def scaled_deficit(channel: Channel, frames: Mask) -> tuple[Array, Array]:
    """Distance from the layer at the nearer wall over the zones' thickness, and (u_max - u) / (u_max - u_slip) there; 1 at 0.

    The layer's centres are half a diameter off the wall, and its velocity is u_slip.
    """
    place, deficit = shear_zone(channel, frames)
    return (place - place[0]) / (thickness(channel, frames) * channel.diameter), deficit / (1.0 - channel.wall_velocity(frames, _ALL))


def fluctuation(channel: Channel, frames: Mask) -> Array:
    """Standard deviation (cells,) of the vertical velocities about the cell's mean, over sqrt(g W), without what all grains do together.

    The flow as a whole speeds up and slows down; that is no agitation.
    """
    solid, flow, flow2 = (values[frames].sum(axis=2) for values in (channel.solid, channel.flow, channel.flow2))
    common = (flow.sum(axis=1) / solid.sum(axis=1))[:, None]
    total = np.maximum(solid.sum(axis=0), 1e-300)
    mean = (flow - common * solid).sum(axis=0) / total
    square = (flow2 - 2.0 * common * flow + common**2 * solid).sum(axis=0) / total
    return np.sqrt(np.maximum(0.0, square - mean**2)) / channel.base_speed


def _scalars(channel: Channel) -> dict[str, Estimate]:
    frames = time_blocks(channel.flow.sum(axis=(1, 2)) / channel.solid.sum(axis=(1, 2)))
    core, away = channel.core, np.minimum(channel.middle, channel.width - channel.middle)
    near, zone = away < channel.diameter, away < 2.0 * channel.diameter
    measures = {
        "greatest": lambda f: channel.core_velocity(f, _ALL) / channel.base_speed,
        "slip": lambda f: channel.wall_velocity(f, _ALL) * channel.core_velocity(f, _ALL) / channel.base_speed,
        "ratio": lambda f: 1.0 / channel.wall_velocity(f, _ALL),
        "thickness": lambda f: thickness(channel, f),
        "flatness": lambda f: channel.flatness(f, _ALL),
        "inertial": lambda f: channel.inertial(f, _ALL),
        "shear_inertial": lambda f: shear_inertial(channel, f),
        "mobilisation": lambda f: channel.mobilisation(f, _ALL),
        "core_fluctuation": lambda f: float(fluctuation(channel, f)[core].mean()),
        "wall_fluctuation": lambda f: float(fluctuation(channel, f)[near].mean()),
        "fraction": lambda f: float(channel.fraction(f, _ALL)[core].mean()),
        "zone_fraction": lambda f: float(channel.fraction(f, _ALL)[zone].mean()),
        "mean_fraction": lambda f: float(channel.fraction(f, _ALL).mean()),
    }
    result = {name: resampled(lambda f, _, get=get: get(f), frames) for name, get in measures.items()}
    result["normal"] = block_mean(channel.normal.mean(axis=(1, 2)))
    result["force_error"] = channel.force_error
    return result


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, profiles and remarks for the report from all replicas of a series."""
    channels = [read(replica) for replica in replicas]
    scalars = [_scalars(channel) for channel in channels]
    unsteady = next((channel.remark for channel in channels if channel.remark), "")
    zero, first = Estimate(0.0, 0.0), channels[0]

    def over(name: str) -> Estimate:
        return pooled(scalars, name)

    balance = over("force_error")
    allowed = max(balance.half, BALANCE_TOLERANCE)
    balance_verdict = "info" if not balance.half <= 0.1 else "pass" if abs(balance.value) <= allowed else "fail"
    found = [
        Quantity(
            "core_flatness",
            "flat core: largest |u / u_max − 1| over the middle half",
            "1",
            over("flatness"),
            reference=zero,
            tolerance=FLATNESS,
            absolute=True,
            reason=unsteady,
            source="no shear in the plug (" + DEBNATH.short + ")",
            compared=False,
            detail="cells of one diameter",
        ),
        Quantity(
            "force_balance_error",
            "wall friction / weight − 1 + acceleration / g",
            "1",
            balance,
            reference=zero,
            tolerance=allowed,
            absolute=True,
            verdict=balance_verdict,
            source="Newton's second law",
            compared=False,
            detail="passes within its own interval, for time.csv holds samples of a friction that swings by as much as its mean",
        ),
        Quantity("greatest_velocity", "u_max / √(g W)", "1", over("greatest"), reason=unsteady, detail="mean over the middle half"),
        Quantity(
            "slip_velocity", "u_slip / √(g W)", "1", over("slip"), reason=unsteady, detail="of the layer within one diameter of a wall"
        ),
        Quantity("velocity_ratio", "u_max / u_slip", "1", over("ratio"), reason=unsteady),
        Quantity(
            "shear_zone_thickness",
            "thickness of the shear zones",
            "d",
            over("thickness"),
            reason=unsteady,
            detail="length of the exponential fitted to 1 − u / u_max in cells of one diameter, both walls",
        ),
        Quantity("solid_fraction", "solid fraction of the core", "1", over("fraction"), detail="by exact sphere slices"),
        Quantity("wall_solid_fraction", "solid fraction within two diameters of the walls", "1", over("zone_fraction")),
        Quantity("mean_solid_fraction", "mean solid fraction", "1", over("mean_fraction"), compared=False),
        Quantity("inertial_number", "inertial number of the core", "1", over("inertial"), compared=False),
        Quantity(
            "shear_inertial_number", "largest inertial number in the shear zones", "1", over("shear_inertial"), detail="beyond one diameter"
        ),
        Quantity("core_fluctuation", "velocity fluctuation in the core, over √(g W)", "1", over("core_fluctuation")),
        Quantity("wall_fluctuation", "velocity fluctuation at the walls, over √(g W)", "1", over("wall_fluctuation")),
        Quantity("wall_normal_stress", "mean normal stress of the walls", "Pa", over("normal")),
        Quantity(
            "wall_mobilisation",
            "τ / σ_xx at the walls",
            "1",
            over("mobilisation"),
            detail=f"the wall's static friction is {first.wall_friction:g}",
        ),
    ]
    remarks = [
        f"The steady part holds {first.steady_share:.0%} of the measuring window (MSER-5 and a drift test on the kinetic energy)."
        if not unsteady
        else unsteady[0].upper() + unsteady[1:] + ".",
        f"{DEBNATH.short}: {DEBNATH.statement}",
    ]
    return found, _profiles(channels), remarks


def study(name: str, points: Sequence[dict[str, Any]], along: str) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """The studies of the width: exponents of velocities and thickness, and the scaled profiles."""
    del along
    return width_study(points, name)


def _profiles(channels: Sequence[Channel]) -> list[dict[str, Any]]:
    first = channels[0]
    place, between = first.middle / first.diameter, 0.5 * (first.middle[1:] + first.middle[:-1]) / first.diameter
    frames = [np.ones(len(one.solid), bool) for one in channels]

    def entry(name: str, title: str, across: str, get: Any, where: Array = place) -> dict[str, Any]:
        rows = [get(one, keep) for one, keep in zip(channels, frames, strict=True)]
        return profile(name, title, "from the left wall x / d", across, where, rows)

    scaled = [scaled_deficit(one, keep) for one, keep in zip(channels, frames, strict=True)]
    # The cells' own places only: between them a straight line is far from an exponential.
    reach = np.mean([where for where, _ in scaled], axis=0)
    return [
        entry("velocity", "Velocity", "u / √(g W)", lambda c, f: c.velocity(f, _ALL) / c.base_speed),
        profile(
            "scaled_velocity",
            "Scaled velocity deficit",
            "distance from the layer at the wall over the thickness",
            "(u_max − u) / (u_max − u_slip)",
            reach,
            [deficit for _, deficit in scaled],
            reference=np.exp(-reach) * float(np.mean([_amplitude(*one) for one in scaled])),
            reference_label="exponential",
        ),
        entry("fluctuation", "Velocity fluctuation", "standard deviation of u / √(g W)", fluctuation),
        entry("solid_fraction", "Solid fraction", "φ", lambda c, f: c.fraction(f, _ALL)),
        entry("inertial_number", "Inertial number", "I", inertial_numbers, between),
    ]


def _amplitude(place: Array, deficit: Array) -> float:
    """a of the exponential a exp(-place) that fits best."""
    return float(np.exp(-place) @ deficit / np.sum(np.exp(-2.0 * place)))
