"""Impacts of a drum: where they take energy, over the cross-section and along the shell, and how hard they are there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from dembark.postproc.field_figures import FieldFigure, Looks, bar, curve, grid_table, image, limits, long_table
from dembark.postproc.style import GREY, SEQUENTIAL, STYLE


def draw(datasets: Mapping[str, Any], looks: Looks) -> list[FieldFigure]:
    """Map of the cross-section, and the shell unrolled."""
    return [_map(datasets, looks), _shell(datasets, looks)]


def _map(datasets: Mapping[str, Any], looks: Looks) -> FieldFigure:
    first = next(iter(datasets.values())).attrs
    powers = {engine: np.log10(np.where(one.impact_power.values > 0.0, one.impact_power.values, np.nan))
              for engine, one in datasets.items()}
    scale = limits(list(powers.values()))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(min(7.2, 3.0 * len(datasets) + 0.8), 3.1), layout="constrained")
        panels = figure.subplots(1, len(datasets), squeeze=False)[0]
        for axes, (engine, one) in zip(panels, datasets.items(), strict=True):
            radius = one.attrs["drum_radius"]
            image(axes, powers[engine].T, (-radius, radius, -radius, radius), scale, SEQUENTIAL, smooth=False)
            size = 2.0 * one.log_radius.values
            axes.add_collection(EllipseCollection(size, size, np.zeros_like(size), units="x", facecolor="none", edgecolor="white",
                                                  linewidth=0.5, offsets=np.column_stack([one.log_x.values, one.log_z.values]),
                                                  transOffset=axes.transData))
            shell = axes.add_patch(Circle((0.0, 0.0), radius, fill=False, edgecolor=GREY, linewidth=1.6, clip_on=False))
            axes.images[0].set_clip_path(shell)
            axes.set(aspect="equal", xlim=(-1.04 * radius, 1.04 * radius), ylim=(-1.04 * radius, 1.04 * radius))
            axes.set_title(looks[engine].title, loc="center")
            axes.axis("off")
        bar(figure, list(panels), scale, SEQUENTIAL, "log₁₀ of the power dissipated in impacts (W/m²)", shrink=0.8, aspect=22, pad=0.02)
    loads = f" of {first['replicas']} loads" if first["replicas"] > 1 else ""
    caption = (
        f"Energy dissipated in impacts (approach of {first['impact_speed']:g} m/s or more) per time and area of the cross-section, over "
        f"{first['revolutions']} revolutions{loads}, from the records of {first['impacts']} impacts; each counts "
        f"at the position where it began. White: no impacts. Circles: logs of the last frame. The drum turns clockwise; logs are "
        f"{first['log_length']:g} m long."
    )
    table = grid_table(["x_m", "z_m", "power_W_per_m2"], {
        engine: (one.x.values, one.z.values, [one.impact_power.values]) for engine, one in datasets.items()})
    return FieldFigure("map", figure, "Impact power over the cross-section", caption, {"power": table})


def _shell(datasets: Mapping[str, Any], looks: Looks) -> FieldFigure:
    counts = {engine: np.log10(np.where(one.shell_peaks.values > 0.0, one.shell_peaks.values, np.nan)) for engine, one in datasets.items()}
    hit = np.nonzero(sum(one.shell_peaks.values.sum(axis=0) for one in datasets.values()))[0]
    rows = slice(max(0, hit[0] - 1), hit[-1] + 2) if len(hit) else slice(None)
    scale = limits(list(counts.values()))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 2.45), layout="constrained")
        left, *panels = figure.subplots(1, 1 + len(datasets), width_ratios=[1.25, *[1.0] * len(datasets)])
        for engine, one in datasets.items():
            curve(left, looks[engine], one.angle.values, one.shell_power.values, one.shell_power_half.values, marked=False)
        left.set(title="Power on the shell", xlabel="angle from the lowest point (°)", ylabel="W/m²", xlim=(-180, 180),
                 xticks=[-180, -90, 0, 90, 180])
        left.set_ylim(bottom=0.0)
        left.legend(fontsize=6.8)
        for number, (axes, (engine, one)) in enumerate(zip(panels, datasets.items(), strict=True)):
            force = np.log10(one.force.values)
            half = 0.5 * (force[1] - force[0])
            low, high = force[rows][0] - half, force[rows][-1] + half
            image(axes, counts[engine][:, rows].T, (-180.0, 180.0, low, high), scale, SEQUENTIAL, smooth=False)
            axes.set(title=looks[engine].title, xlabel="angle (°)", xticks=[-90, 0, 90])
            axes.set_yticks(ticks := [tick for tick in range(1, 7) if low <= tick <= high], [f"$10^{tick}$" for tick in ticks])
            if number:
                axes.set_yticklabels([])
            else:
                axes.set_ylabel("peak force (N)")
        bar(figure, list(panels), scale, SEQUENTIAL, "log₁₀ of impacts per revolution", aspect=18, pad=0.02)
    caption = (
        "Left: energy dissipated in impacts on the shell per time and area, against the angle, with 95 % intervals over quarter "
        "revolutions. Right: histogram of peak forces of impacts on the shell, angle by angle: number per revolution in bins of 10° "
        "and a fifth of a decade."
    )
    tables = {
        "shell_power": long_table(["angle_deg", "power_W_per_m2", "half_width"], {
            engine: [one.angle.values, one.shell_power.values, one.shell_power_half.values] for engine, one in datasets.items()}),
        "shell_peaks": grid_table(["angle_deg", "peak_force_N", "impacts_per_revolution"], {
            engine: (one.angle.values, one.force.values, [one.shell_peaks.values]) for engine, one in datasets.items()}),
    }
    return FieldFigure("shell", figure, "Impacts along the shell", caption, tables)
