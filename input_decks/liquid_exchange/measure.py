"""Liquid exchange: the liquid of each grain, the wall and the bridges against the rule on the prescribed paths, to round-off. The reference
follows from the parameters alone, so that the set-up of the decks is checked, too."""

import math

import numpy as np

from dembark.physics.exact.liquid_row import Row, Rule, books
from dembark.postproc.measurement import Measurement, Numbers, Replicas, number, profile

# Diameters and periods of the grains over those of the first, and which of them are wet at the start.
SIZES = np.array([1.0, 0.7, 1.2, 0.8, 1.0])
PERIODS = np.array([1.0, 1.37, 0.83, 1.61, 1.13])
WET = np.array([1.0, 0.0, 0.0, 1.0, 0.0])


def case(p: Numbers) -> tuple[Row, Rule]:
    """The row of a run with parameters `p`, and how its liquid is shared."""
    radii, gap = 0.5 * p["grain_diameter"] * SIZES, p["gap"] * p["grain_diameter"]
    middles = gap * np.arange(1, 6) + 2.0 * np.cumsum(radii) - radii
    return (
        Row(radii, middles, p["period"] * PERIODS, p["amplitude"] * p["grain_diameter"], middles[-1] + radii[-1] + gap,
            p["liquid_content"] * 4.0 / 3.0 * math.pi * radii**3 * WET, p["wall_liquid"], p["wall_share"], p["wall_part"]),
        Rule(p["liquid_share"], p["liquid_share_factor"], p["liquid_return"], p["max_bridge"] or math.inf, p["contact_angle"]))


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of the run (there is one)."""
    p, times = replicas[0].parameters, replicas[0].times()
    due = books(*case(p), p["time_step"], times["step"])
    total, numbers = due.total[0], range(1, len(SIZES) + 1)
    grains = np.stack([times[f"liquid_{k}"] for k in numbers], axis=1)
    everything = sum(times[f"liquid_{place}"] for place in ("grains", "bridges", "walls", "lost"))
    errors = {
        "total_liquid_error": everything / total - 1.0,
        "sum_error": (times["liquid_grains"] - grains.sum(axis=1)) / total,
        "lost": times["liquid_lost"] / total,
        **{f"liquid_{k}_error": (grains - due.grains)[:, k - 1] / total for k in numbers},
        "wall_liquid_error": (times["liquid_walls"] - due.wall) / total,
        "bridge_volume_error": (times["liquid_bridges"] - due.bridges) / total,
        "bridge_count_error": times["bridge_count"] - due.count,
    }
    changes, changes_due = (np.abs(np.diff(count)).sum() for count in (times["bridge_count"], due.count))
    values = {name: number(np.abs(error).max(), 0.0) for name, error in errors.items()}
    values |= {f"liquid_{k}": number(grains[-1, k - 1], due.grains[-1, k - 1], bound=1e-12 * total, scale=total) for k in numbers}
    shown = [(f"liquid_{k}", f"Liquid of grain {k}", grains[:, k - 1], due.grains[:, k - 1]) for k in numbers]
    curves = [profile(name, title, "time (s)", "V (mm³)", times["time"], [1e9 * found], reference=1e9 * known, reference_label="rule")
              for name, title, found, known in [*shown, ("bridges", "Liquid in bridges", times["liquid_bridges"], due.bridges)]]
    return Measurement(values | {"changes": number(changes, changes_due)}, curves,
                       [f"Total liquid: {total:.6g} m³. The paths are prescribed; forces have no effect."])
