"""Plug flow: a packing sinks between two vertical walls on a plate that moves down at constant speed v0.

x runs from wall to wall (0 to W, the planes of the walls; the first layer's centres are half a diameter inside, and glued grains of a
rough wall stand on these planes), y is periodic, gravity points along -z. Eulerian means are taken over cells that rest in the
laboratory and stay filled for all frames used, weighting each grain by its exact volume in the cell; Lagrangian ones are
displacements of single grains. Only the steady part is used; it is detected in the wall friction (MSER-5 and a drift test).
Velocities are counted downward.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dembark.validation.checks.carried_liquid import liquid_quantities
from dembark.validation.checks.channel import Array, Channel, read
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica, pooled, profile, resampled, time_blocks
from dembark.validation.references import DEBNATH
from dembark.postproc.statistics import CONFIDENCE, Estimate, block_mean

REFERENCES = (DEBNATH,)
FLATNESS = 0.02
# Mass is conserved exactly; what is allowed is what grains entering and leaving a level between two frames may leave of it.
FLUX = 0.02
BALANCE_TOLERANCE = 1e-3
QUASI_STATIC = 1e-3
# A wall zone whose velocity deficit is below this cannot be told from the core's own scatter.
LEAST_DEFICIT = 0.02


def _scalars(channel: Channel) -> dict[str, Estimate]:
    frames = time_blocks(channel.shear.sum(axis=(1, 2)))
    bands = np.arange(channel.solid.shape[2]) * max(4, channel.solid.shape[2] // 2) // channel.solid.shape[2]
    core, near = channel.core, np.minimum(channel.middle, channel.width - channel.middle) < channel.diameter
    measures = {
        "flatness": channel.flatness,
        "core": lambda f, b: channel.core_velocity(f, b) / channel.base_speed,
        "wall": channel.wall_velocity,
        "decay": channel.decay_length,
        "ninety": channel.ninety_width,
        "inertial": channel.inertial,
        "mobilisation": channel.mobilisation,
        "core_fluctuation": lambda f, b: float(channel.fluctuation(f, b)[core].mean()),
        "wall_fluctuation": lambda f, b: float(np.nanmean(channel.fluctuation(f, b)[near])),
        "fraction": lambda f, b: float(channel.fraction(f, b)[core].mean()),
    }
    result = {name: resampled(measure, frames, bands) for name, measure in measures.items()}
    result["normal"] = block_mean(channel.normal.mean(axis=(1, 2)))
    result["shear"] = block_mean(channel.shear.mean(axis=(1, 2)))
    result["force_error"] = channel.force_error
    errors = channel.flux_errors()
    # With as many heights as bands, each gets the interval with which all together hold 95 % (Bonferroni).
    each = [block_mean(column, 1.0 - (1.0 - CONFIDENCE) / errors.shape[1]) for column in errors.T]
    result["flux"] = max(each, key=lambda one: abs(one.value) - (one.half if np.isfinite(one.half) else 0.0))
    motion = block_mean(channel.core_motion)
    result["lagrangian"] = Estimate(motion.value / channel.base_speed, motion.half / channel.base_speed, motion.basis)
    return result


def picture(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """How the report shows the packing."""
    return {"colour_by": "velocity", "scale": parameters["base_speed"], "cut": False}


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, profiles and remarks for the report from all replicas of a series."""
    channels = [read(replica) for replica in replicas]
    scalars = [_scalars(channel) for channel in channels]
    unsteady = next((channel.remark for channel in channels if channel.remark), "")
    zero = Estimate(0.0, 0.0)

    def over(name: str) -> Estimate:
        return pooled(scalars, name)

    slip = Estimate(1.0 - over("wall").value, over("wall").half, over("wall").basis)
    faint = f"the walls' layer lags by {slip.value:.1%} only: no shear zone to measure" if slip.value < LEAST_DEFICIT else ""
    flux, inertial = over("flux"), over("inertial")
    found = [
        Quantity(
            "core_flatness",
            "flat core: largest |v / v_core − 1| over the middle half",
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
            "flux_error",
            "flux over v₀ ρ_b − 1, at the worst height",
            "1",
            flux,
            reference=zero,
            tolerance=FLUX,
            absolute=True,
            reason=unsteady,
            source="conservation of mass",
            compared=False,
            detail="the interval holds all heights together with 95 %",
        ),
        Quantity(
            "inertial_number",
            "inertial number of the core",
            "1",
            inertial,
            reference=zero,
            tolerance=QUASI_STATIC,
            absolute=True,
            reason=unsteady,
            source="quasi-static below 0.001",
            compared=False,
        ),
        Quantity(
            "force_balance_error",
            "(base + wall friction) / weight − 1",
            "1",
            over("force_error"),
            reference=zero,
            tolerance=BALANCE_TOLERANCE,
            absolute=True,
            reason=unsteady,
            source="Newton's second law",
            compared=False,
            detail="mean over the steady part of time.csv",
        ),
        Quantity("core_velocity", "v_core / v₀", "1", over("core"), detail="Eulerian, middle half"),
        Quantity(
            "core_velocity_lagrangian",
            "v_core / v₀, Lagrangian",
            "1",
            over("lagrangian"),
            detail="mean displacement of grains of the middle half",
            compared=False,
        ),
        Quantity(
            "wall_slip",
            "velocity of the layer at the wall over v_core",
            "1",
            over("wall"),
            detail="within one diameter of the wall's plane",
        ),
        Quantity(
            "shear_zone_width",
            "decay length of the shear zone",
            "d",
            over("decay"),
            reason=faint,
            compared=not faint,
            detail="exponential fit to 1 − v / v_core, both walls",
        ),
        Quantity(
            "shear_zone_width_90",
            "distance from the wall where 90 % of the deficit is gone",
            "d",
            over("ninety"),
            reason=faint,
            compared=not faint,
        ),
        Quantity("core_fluctuation", "velocity fluctuation in the core, over v₀", "1", over("core_fluctuation")),
        Quantity("wall_fluctuation", "velocity fluctuation at the walls, over v₀", "1", over("wall_fluctuation")),
        Quantity("solid_fraction", "solid fraction of the core", "1", over("fraction"), detail="by exact sphere slices"),
        Quantity("wall_normal_stress", "mean normal stress of the side walls", "Pa", over("normal")),
        Quantity("wall_shear_stress", "mean shear stress of the side walls", "Pa", over("shear")),
        Quantity(
            "wall_mobilisation",
            "τ / σ_xx at the side walls",
            "1",
            over("mobilisation"),
            detail=f"the wall's static friction is {channels[0].wall_friction:g}",
        ),
    ]
    first = channels[0]
    remarks = [
        f"The steady part holds {first.steady_share:.0%} of the measuring window (MSER-5 and a drift test on the wall friction)."
        if not unsteady
        else unsteady + ".",
        (
            f"The channel is {first.width / first.diameter:.0f} d wide and filled {first.height / first.diameter:.0f} d high; "
            f"the cells that rest in the laboratory cover {(first.levels[-1] - first.levels[0]) / first.diameter:.0f} d of it."
        ),
        (
            f"{DEBNATH.short}: {DEBNATH.statement} That flow is driven by gravity alone; here the plate sets the speed, so the widths "
            "are shown and not judged by it."
        ),
        (
            "Published widths of shear zones exist for rough and smooth walls; none of these papers could be read for this report, so no "
            "range is quoted."
        ),
    ]
    return [*found, *liquid_quantities(replicas)], _profiles(channels), remarks


def fields(replicas: Sequence[Replica], found: Sequence[Quantity]) -> Any:
    """Fields over width and height, with quantities drawn from them."""
    from dembark.validation.checks.fields_channel import measure

    return measure(replicas, next(one.reason for one in found if one.name == "core_flatness"))


def _profiles(channels: Sequence[Channel]) -> list[dict[str, Any]]:
    first = channels[0]
    whole = [(np.ones(len(one.solid), bool), np.ones(one.solid.shape[2], bool)) for one in channels]
    place = first.middle / first.diameter

    def entry(name: str, title: str, across: str, get: Any, reference: Array | None = None, label: str = "") -> dict[str, Any]:
        rows = [np.interp(place, one.middle / one.diameter, get(one, *masks)) for one, masks in zip(channels, whole, strict=True)]
        return profile(name, title, "from the left wall x / d", across, place, rows, reference=reference, reference_label=label)

    def grains(one: Channel) -> Array:
        cell = np.clip(np.searchsorted(one.edges, one.grain_place) - 1, 0, len(one.middle) - 1)
        count = np.bincount(cell, minlength=len(one.middle))
        return np.where(count > 0, np.bincount(cell, one.grain_speed, len(one.middle)) / np.maximum(count, 1), np.nan) / one.base_speed

    levels = (0.5 * (first.levels[1:] + first.levels[:-1]) - first.levels[0]) / first.diameter

    def upward(name: str, title: str, across: str, get: Any) -> dict[str, Any]:
        rows = [np.interp(np.linspace(0, 1, len(levels)), np.linspace(0, 1, one.solid.shape[2]), get(one)) for one in channels]
        return profile(name, title, "height in the window z / d", across, levels, rows, vertical=True)

    return [
        entry(
            "velocity",
            "Velocity, Eulerian",
            "v / v₀",
            lambda c, f, b: c.velocity(f, b) / c.base_speed,
            np.ones_like(place),
            "the plate, v₀",
        ),
        entry("velocity_lagrangian", "Velocity, Lagrangian", "v / v₀", lambda c, f, b: grains(c), np.ones_like(place), "the plate, v₀"),
        entry("fluctuation", "Velocity fluctuation", "standard deviation of v / v₀", lambda c, f, b: c.fluctuation(f, b)),
        entry("solid_fraction", "Solid fraction", "φ", lambda c, f, b: c.fraction(f, b)),
        upward("wall_normal", "Wall normal stress", "σ_xx (Pa)", lambda c: c.normal.mean(axis=(0, 2))),
        upward("wall_shear", "Wall shear stress", "τ (Pa)", lambda c: c.shear.mean(axis=(0, 2))),
    ]
