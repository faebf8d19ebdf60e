"""Fields of a channel: maps over width and height for each engine, and profiles across it, Eulerian and Lagrangian."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from dembark.postproc.field_figures import FieldFigure, Looks, bar, curve, grid_table, image, limits, long_table
from dembark.postproc.style import DIVERGING, SEQUENTIAL, STYLE

# Name in the dataset, label, colour map, and whether the scale is even about zero.
_MAPS = (
    ("velocity", "v / v₀", SEQUENTIAL, False),
    ("shear_rate", "∂v/∂x · d / v₀", DIVERGING, True),
    ("temperature", "log₁₀ T / v₀²", SEQUENTIAL, False),
    ("solid_fraction", "solid fraction", SEQUENTIAL, False),
)


def draw(datasets: Mapping[str, Any], looks: Looks) -> list[FieldFigure]:
    """Maps and profiles of all engines."""
    return [_maps(datasets, looks), _profiles(datasets, looks)]


def _values(one: Any, name: str) -> Any:
    values = one[name].values
    return np.log10(np.where(values > 0.0, values, np.nan)) if name == "temperature" else values


def _maps(datasets: Mapping[str, Any], looks: Looks) -> FieldFigure:
    first = next(iter(datasets.values())).attrs
    count, d = len(datasets), first["grain_diameter"]
    with matplotlib.rc_context(STYLE):
        # Three engines or more share the height of two, so that the page gets no longer.
        tall = 1.15 * min(count, 2) + 0.85
        figure = Figure(figsize=(7.2, tall))
        grid = figure.add_gridspec(1, len(_MAPS), left=0.085, right=0.985, bottom=0.46 / tall, top=1.0 - 0.1 / tall, wspace=0.14)
        for column, (name, label, paint, even) in enumerate(_MAPS):
            axes = grid[column].subgridspec(count, 1, hspace=0.1).subplots(squeeze=False)[:, 0]
            scale = limits([_values(one, name) for one in datasets.values()], 0.0 if even else None)
            for number, (engine, one) in enumerate(datasets.items()):
                high = float(one.z.values[-1] + 0.5 * (one.z.values[1] - one.z.values[0])) / d
                image(axes[number], _values(one, name).T, (0.0, one.attrs["channel_width"] / d, 0.0, high), scale, paint)
                axes[number].tick_params(labelsize=6.5, length=2.0)
                if number < count - 1:
                    axes[number].set_xticklabels([])
                if column:
                    axes[number].set_yticklabels([])
                else:
                    axes[number].set_ylabel(f"{looks[engine].title}\nz / d", fontsize=7)
            axes[-1].set_xlabel("x / d", fontsize=7, labelpad=1.0)
            bar(figure, list(axes), scale, paint, label, location="bottom", pad=0.46 / tall, aspect=16, fraction=0.07)
    caption = (
        "Coarse-grained fields in the window, at rest in the laboratory frame, walls at the left and right end, averaged along the "
        f"periodic direction and over {first['frames']} frames of the steady part: downward velocity, its slope across the channel, "
        "granular temperature T = ⟨v′²⟩/3 about the affine mean flow of each cell, solid fraction. "
        f"Gaussian kernel of width {first['width'] / d:g} d; same colour scales for all engines."
    )
    table = grid_table(["x_m", "z_m", *(name for name, *_ in _MAPS)], {
        engine: (one.x.values, one.z.values, [one[name].values for name, *_ in _MAPS]) for engine, one in datasets.items()})
    return FieldFigure("maps", figure, "Fields over width and height", caption, {"maps": table})


def _profiles(datasets: Mapping[str, Any], looks: Looks) -> FieldFigure:
    titles = {"velocity": "Velocity v / v₀", "shear_rate": "Shear rate, × d / v₀", "temperature": "Temperature T / v₀²",
              "solid_fraction": "Solid fraction"}
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 2.25))
        figure.subplots_adjust(left=0.05, right=0.99, bottom=0.3, top=0.88, wspace=0.3)
        panels = figure.subplots(1, len(titles))
        for axes, (name, title) in zip(panels, titles.items(), strict=True):
            for engine, one in datasets.items():
                place = one.x.values / one.attrs["grain_diameter"]
                curve(axes, looks[engine], place, one[f"{name}_profile"].values, one[f"{name}_profile_half"].values, marked=False)
                if name == "velocity":
                    axes.plot(place, one.velocity_lagrangian.values, color=looks[engine].colour, linestyle=(0, (1.5, 1.5)), linewidth=1.4,
                              label=f"{looks[engine].title}, Lagrangian")
            axes.set(title=title, xlabel="x / d")
            axes.tick_params(labelsize=6.5)
            if name == "temperature":
                axes.set_yscale("log")
            elif name != "shear_rate":
                axes.set_ylim(bottom=0.0)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="lower center", ncols=4, fontsize=6.8)
    caption = (
        "The same across the channel, averaged over the full height of the window, with 95 % intervals over time blocks. Full lines: "
        "Eulerian, momentum over mass in cells at rest; dotted: Lagrangian, displacements of single grains over the same time, smoothed "
        "with the same kernel."
    )
    columns = {engine: [one.x.values, one.velocity_lagrangian.values,
                        *(one[f"{name}_profile{end}"].values for name in titles for end in ("", "_half"))]
               for engine, one in datasets.items()}
    header = ["x_m", "velocity_lagrangian", *(f"{name}{end}" for name in titles for end in ("", "_half_width"))]
    return FieldFigure("profiles", figure, "Eulerian and Lagrangian profiles", caption, {"profiles": long_table(header, columns)})
