"""Fields of a silo: maps over radius and height as a cut through the cylinder, and profiles with Janssen's law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dembark.postproc.field_figures import FieldFigure, Looks, bar, curve, grid_table, image, limits, long_table
from dembark.postproc.style import DIVERGING, GREY, SEQUENTIAL, STYLE

Array = NDArray[np.float64]


def draw(datasets: Mapping[str, Any], looks: Looks) -> list[FieldFigure]:
    """Maps and profiles of all engines."""
    return [_maps(datasets, looks), _profiles(datasets, looks)]


def _inside(one: Any) -> Any:
    """The part of a dataset within the vessel and below the surface."""
    keep = (one.height > 0.0) & (one.height < one.attrs["filling_height"])
    return one.isel(radius=np.nonzero((one.radius < one.attrs["vessel_radius"]).values)[0], height=np.nonzero(keep.values)[0])


def _panels(one: Any) -> dict[str, Array]:
    """What is mapped, (radius, height); dimming by the walls taken out."""
    cover = one.coverage.values
    vertical = one.stress_zz.values / cover
    held = vertical > 0.05 * np.nanmax(vertical)
    return {
        "stress_zz_kPa": 1e-3 * vertical,
        "stress_rr_kPa": 1e-3 * one.stress_rr.values / cover,
        "stress_zr_kPa": 1e-3 * one.stress_zr.values / cover,
        "k": np.divide(one.stress_rr.values, one.stress_zz.values, out=np.full(cover.shape, np.nan), where=held),
        "solid_fraction": one.solid_fraction.values / cover,
    }


_LABELS = {"stress_zz_kPa": "σ$_{zz}$ (kPa)", "stress_rr_kPa": "σ$_{rr}$ (kPa)", "stress_zr_kPa": "σ$_{rz}$ (kPa)",
           "k": "K = σ$_{rr}$/σ$_{zz}$", "solid_fraction": "solid fraction"}


def _maps(datasets: Mapping[str, Any], looks: Looks) -> FieldFigure:
    shown = {engine: _inside(one) for engine, one in datasets.items()}
    panels = {engine: _panels(one) for engine, one in shown.items()}
    count, tall = len(datasets), 4.0
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.2, tall))
        outer = figure.add_gridspec(1, len(_LABELS), left=0.055, right=0.985, bottom=0.1, top=0.94, wspace=0.28)
        for column, (name, label) in enumerate(_LABELS.items()):
            axes = outer[column].subgridspec(1, count, wspace=0.06).subplots(squeeze=False)[0]
            scale = limits([one[name] for one in panels.values()], 1.0 if name == "k" else None)
            paint = DIVERGING if name == "k" else f"{SEQUENTIAL}_r" if name == "stress_zr_kPa" else SEQUENTIAL
            for number, (engine, one) in enumerate(shown.items()):
                d = one.attrs["grain_diameter"]
                radius, top = one.attrs["vessel_radius"] / d, one.attrs["filling_height"] / d
                # Two engines: the left and the right half of one cut through the silo.
                mirrored = count == 2 and number == 0
                values = panels[engine][name].T
                image(axes[number], values[:, ::-1] if mirrored else values, (0.0, radius, 0.0, top), scale, paint)
                axes[number].set(xticks=[0.0, radius], xticklabels=["R", ""] if mirrored else ["0", "R"])
                axes[number].set_title(looks[engine].title, fontsize=6.0, loc="center", fontweight="normal", pad=2.5)
                axes[number].tick_params(labelsize=6.5, length=2.0)
                if number or column:
                    axes[number].set_yticklabels([])
            if column == 0:
                axes[0].set_ylabel("height z / d")
            bar(figure, list(axes), scale, paint, label, location="bottom", pad=0.075, aspect=11, fraction=0.035)
    first = next(iter(datasets.values())).attrs
    caption = (
        "Cut through the silo, axis in the middle: coarse-grained fields with the lines of the contacts with wall and base, averaged "
        f"around the axis and over {first['frames']} frames of {first['replicas']} packing{'s' if first['replicas'] > 1 else ''}. Gaussian "
        "kernel of width 1 d; the average around the axis is taken in closed form, so that mass is conserved exactly and momentum but "
        "for the quadrature along the contacts. Each value is divided by the part of its kernel that lies inside the vessel. Same colour "
        "scale for all engines; compression positive, σ_rz is negative where the wall carries weight."
    )
    table = grid_table(["radius_m", "height_m", *_LABELS], {
        engine: (one.radius.values, one.height.values, list(panels[engine].values())) for engine, one in shown.items()})
    return FieldFigure("maps", figure, "Fields over radius and height", caption, {"maps": table})


def _profiles(datasets: Mapping[str, Any], looks: Looks) -> FieldFigure:
    shown = {engine: _inside(one) for engine, one in datasets.items()}
    first = next(iter(datasets.values()))
    bands = first.band_bounds.values
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 2.75))
        grid = figure.add_gridspec(1, 1 + len(bands), width_ratios=[1.25, *[1.0] * len(bands)], left=0.065, right=0.985, bottom=0.26,
                                   top=0.88, wspace=0.32)
        left = figure.add_subplot(grid[0])
        for engine, one in shown.items():
            d = one.attrs["grain_diameter"]
            curve(left, looks[engine], one.height.values / d, 1e-3 * one.stress_zz_section.values, 1e-3 * one.stress_zz_section_half.values,
                  upward=True, marked=False)
            left.plot(1e-3 * one.janssen.values, one.height.values / d, color=left.lines[-1].get_color(), linestyle=(0, (4, 2)),
                      linewidth=1.0, label=f"Janssen ({looks[engine].title})")
        left.set(xlabel="σ$_{zz}$ (kPa)", ylabel="height z / d", title="σ$_{zz}$ of the section", xlim=(0.0, None), ylim=(0.0, None))
        right = [figure.add_subplot(grid[1 + number]) for number in range(len(bands))]
        for number, axes in enumerate(right):
            for engine, one in shown.items():
                curve(axes, looks[engine], one.radius.values / one.attrs["vessel_radius"], one.k_profile.values[number],
                      one.k_profile_half.values[number])
                axes.plot([1.0], [_wall_ratio(one, bands[number])], "*", markersize=7, color=axes.lines[-1].get_color(),
                          markeredgecolor="white", markeredgewidth=0.4, clip_on=False, zorder=5)
            low, high = bands[number] / first.attrs["grain_diameter"]
            axes.set(xlabel="r / R", title=f"z = {low:.0f} … {high:.0f} d", xlim=(0.0, 1.0))
        top = max(axes.get_ylim()[1] for axes in right)
        for number, axes in enumerate(right):
            axes.set_ylim(0.0, top)
            if number:
                axes.set_yticklabels([])
        right[0].set_ylabel("K = σ$_{rr}$ / σ$_{zz}$")
        handles, labels = left.get_legend_handles_labels()
        right[0].plot([], [], "*", color=GREY, markersize=7, markeredgecolor="white", label="with the normal stress of the wall")
        more = right[0].get_legend_handles_labels()
        figure.legend([*handles, more[0][-1]], [*labels, more[1][-1]], loc="lower center", ncols=5, fontsize=6.8, handlelength=1.6,
                      columnspacing=1.2)
    caption = (
        "Left: vertical stress of the coarse-grained field, mean over the cross-section, and Janssen's law with K, μ_mob and ρ_b of the "
        "same column. Right: ratio of radial to vertical stress from the axis to the wall, averaged over the heights given; stars: the "
        "normal stress measured at the wall over σ_zz of the outermost ring. Bands: 95 % intervals; those on the left only include "
        "variations in time."
    )
    tables = {
        "section": long_table(["height_m", "sigma_zz_Pa", "half_width_Pa", "janssen_Pa", "wall_normal_Pa", "wall_shear_Pa"], {
            engine: [one.height.values, one.stress_zz_section.values, one.stress_zz_section_half.values, one.janssen.values,
                     one.wall_normal.values, one.wall_shear.values] for engine, one in shown.items()}),
        "k": long_table(["height_low_m", "height_high_m", "radius_m", "k", "half_width"], {
            engine: [*(np.repeat(bands[:, side], one.sizes["radius"]) for side in (0, 1)), np.tile(one.radius.values, len(bands)),
                     one.k_profile.values, one.k_profile_half.values] for engine, one in shown.items()}),
    }
    return FieldFigure("profiles", figure, "Stress compared with Janssen, and K from the axis to the wall", caption, tables)


def _wall_ratio(one: Any, band: Array) -> float:
    """Normal stress of the wall over the vertical stress of the outermost ring, at the heights of `band` (m)."""
    here = (one.height.values > band[0]) & (one.height.values < band[1])
    return float(one.wall_normal.values[here].sum() / (one.stress_zz / one.coverage).values[-1, here].sum())
