"""Draws the figures of the documentation into figures/: friction curves, capillary force curves, error maps of their models,
schemes of integration, and predicted pressures.

The first error map shows figures/capillary_errors.csv, which capillary_errors.py computes; the schemes of integration are those of
figures/schemes.json, which benchmarks/schemes.py computes.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import capillary_errors
import capillary_ratio_errors
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.colors import BoundaryNorm
from numpy.typing import NDArray

from dembark.physics import CAPILLARY_MODELS, FinnieRabinowicz, capillary_force, rupture_distance
from dembark.physics.young_laplace import bridge, rupture_gap

Map = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], str]  # volumes, gaps, percent and title

FOLDER = Path(__file__).with_name("figures")
PREDICTION = FOLDER.parents[1] / "input_decks/dam_break_box/prediction.csv"
STYLE = {"font.size": 8, "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False, "lines.linewidth": 1.2,
         "savefig.dpi": 130, "figure.constrained_layout.use": True}
STIFFNESS, AREA, STRENGTH = 1e5, 1e-8, 1e8  # N/m, m^2, Pa


def law(**changes: object) -> FinnieRabinowicz:
    """The law of the figures, with changes."""
    values = {"static_friction": 0.6, "kinetic_friction": 0.4, "critical_slip_distance": 1e-5}
    return FinnieRabinowicz(**{**values, **changes})


def save(figure: plt.Figure, name: str) -> None:
    """Write figures/<name>.png and forget the figure."""
    figure.savefig(FOLDER / f"{name}.png", metadata={"Software": None})
    plt.close(figure)


def friction() -> None:
    """Limit curve, slip weakening, pre-sliding curves and a cycle."""
    figure, axes = plt.subplots(2, 2, figsize=(7.2, 5.0))
    limit, weakening, loading, cycle = axes.ravel()

    force = np.linspace(1e-3, 6.0, 200)
    saturated = law(static_friction=0.5, kinetic_friction=0.5, interface_shear_strength=STRENGTH)
    far = np.array([saturated.drive(n, STIFFNESS, AREA, [1.0])[0] for n in force])
    limit.plot(force, far, label=r"$\tau_s A = 1$ N")
    limit.plot(force, 0.5 * force, "--", color="0.5", label=r"Coulomb, $\mu N$")
    limit.axhline(STRENGTH * AREA, color="0.5", linestyle=":", label=r"$\tau_s A$")
    limit.set(xlabel="normal force N (N)", ylabel=r"$T_\mathrm{max}$ (N)", ylim=(0.0, 1.6), title="Finnie and Shaw: the limit saturates")

    slip = np.linspace(0.0, 6e-5, 200)
    for distance in (5e-6, 1e-5, 2e-5):
        weakening.plot(1e6 * slip, law(critical_slip_distance=distance).friction_coefficient(slip),
                       label=rf"$s_c$ = {1e6 * distance:.0f} µm")
    weakening.set(xlabel="slip s (µm)", ylabel=r"$\mu(s)$", ylim=(0.35, 0.65), title="Rabinowicz: friction falls with slip")

    path = np.linspace(0.0, 4e-5, 400)
    for presliding in ("linear", "exponential"):
        loading.plot(1e6 * path, law(presliding=presliding).drive(1.0, STIFFNESS, AREA, path), label=presliding)
    loading.set(xlabel="displacement (µm)", ylabel="T (N), N = 1 N", title="Loading at constant normal force")

    turns = [0.0, 2e-5, -2e-5, 2e-5]
    there = np.concatenate([np.linspace(a, b, 400) for a, b in pairwise(turns)])
    for presliding in ("linear", "exponential"):
        cycle.plot(1e6 * there, law(presliding=presliding).drive(1.0, STIFFNESS, AREA, there), label=presliding)
    cycle.set(xlabel="displacement (µm)", ylabel="T (N)", title="Cycle: static friction returns after each stick")
    for axis in axes.ravel():
        axis.legend(loc="lower left" if axis is cycle else "best")
    save(figure, "friction")


def capillary() -> None:
    """Force against gap: all models at one volume, and `exact` for several volumes and angles."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 3.0))
    volume, theta = 1e-2, 0.0
    for model in CAPILLARY_MODELS:
        gaps = np.linspace(0.0, rupture_distance(volume, theta, 1.0, 1.0, model=model), 200)
        left.plot(gaps, capillary_force(1.0, 1.0, gaps, volume, 1.0, theta, model=model), label=model,
                  linewidth=2.0 if model == "exact" else 1.0)
    points = np.linspace(0.0, rupture_gap(volume, theta), 9)
    left.plot(points, [bridge(volume, gap, theta).force for gap in points], "k.", markersize=4, label="independent solution")
    left.set(xlabel="gap S / R", ylabel=r"F / ($\gamma R$)", title=r"V = 0.01 R³, $\theta$ = 0")
    for angle, line in ((0, "-"), (30, "--"), (60, ":")):
        for colour, volume in enumerate((1e-4, 1e-3, 1e-2)):
            radians = float(np.radians(angle))
            gaps = np.linspace(0.0, rupture_distance(volume, radians, 1.0, 1.0), 300)
            right.plot(gaps, capillary_force(1.0, 1.0, gaps, volume, 1.0, radians), line, color=f"C{colour}",
                       label=f"V = {volume:g} R³, θ = {angle}°")
    right.set(xlabel="gap S / R", ylabel=r"F / ($\gamma R$)", title="exact")
    left.legend(fontsize=6.5)
    right.legend(fontsize=6)
    save(figure, "capillary_force")


def maps(name: str, size: float, steps: Sequence[float], label: str, rows: Sequence[Any], angles: Sequence[int],
         cell: Callable[[Any, int], Map]) -> None:
    """Maps of `cell(row, angle)`, (volumes, gaps, percent, title), one for each of `rows` and `angles`: grey where percent is NaN. The
    colours change at `steps` (%) and their opposites; `size` is the height in inches."""
    bounds = [*(-step for step in reversed(steps)), *steps]
    norm = BoundaryNorm(bounds, 256, extend="both")
    figure, axes = plt.subplots(len(rows), len(angles), figsize=(7.2, size), sharex=True, sharey=True)
    for row, line in zip(rows, axes, strict=True):
        for angle, axis in zip(angles, line, strict=True):
            volumes, gaps, percent, title = cell(row, angle)
            drawn = axis.pcolormesh(volumes, gaps, percent.T, cmap="RdBu_r", norm=norm, shading="nearest")
            axis.set_facecolor("0.75")
            axis.set_xscale("log")
            axis.set_title(title, fontsize=7)
    for axis in axes[-1]:
        axis.set_xlabel("V / R³")
    for axis in axes[:, 0]:
        axis.set_ylabel("gap / rupture distance")
    figure.colorbar(drawn, ax=axes, label=label, shrink=0.5, ticks=bounds)
    save(figure, name)


def error_map() -> None:
    """Deviation of each model over volume and gap for three contact angles."""
    columns = capillary_errors.read()
    volumes = np.unique(columns["volume_over_R3"])
    shares = np.unique(columns["gap_over_rupture"][columns["gap_over_rupture"] < 1.0])

    def cell(model: str, angle: int) -> Map:
        chosen = (columns["contact_angle_deg"] == angle) & (columns["gap_over_rupture"] < 1.0)
        percent = 100.0 * columns[model][chosen].reshape(len(volumes), len(shares))
        worst = np.abs(percent[percent > -100.0]).max()
        title = f"{model}, θ = {angle}°, worst {worst:.{0 if worst > 1.0 else 3}f} %"
        return volumes, shares, np.where(percent <= -100.0, np.nan, percent), title

    maps("capillary_errors", 9.0, [1, 2, 5, 10, 20, 50], "model / exact solution − 1 (%); grey: the model's bridge has ruptured",
         CAPILLARY_MODELS, capillary_errors.ANGLES, cell)


def ratio_map() -> None:
    """Error of the effective radius over volume and gap for unequal spheres and walls."""
    def cell(ratio: float, angle: int) -> Map:
        force, end = capillary_ratio_errors.effective_radius_errors(ratio, angle)
        name = "wall" if ratio == 0.0 else f"radii 1:{1.0 / ratio:.0f}"
        title = f"{name}, {angle}°, rupture to {100.0 * end[np.argmax(np.abs(end))]:+.0f} %"
        return capillary_ratio_errors.VOLUMES, capillary_ratio_errors.SHARES, 100.0 * force, title

    maps("capillary_ratio_errors", 7.2, [0.5, 1, 2, 5, 10, 20, 50], "equal spheres of R = 2R* / exact − 1 (%)",
         capillary_ratio_errors.RATIOS, capillary_ratio_errors.ANGLES, cell)


def schemes() -> None:
    """Error over cost of schemes of integration on four problems."""
    found = json.loads((FOLDER / "schemes.json").read_text(encoding="utf-8"))
    shown = {"engines": ("leapfrog of the engines", "k", "o"), "verlet": ("velocity Verlet", "C0", "s"),
             "ab2": ("Adams–Bashforth 2", "C1", "v"), "ab4": ("Adams–Bashforth 4", "C2", "^"), "pece": ("Adams PECE 4", "C3", "D"),
             "rkf45": ("RKF45, constant step", "C4", "P"),
             "rkf45_controlled": ("RKF45, controlled", "C4", "x"), "midpoint": ("implicit midpoint", "C5", "*")}
    problems = {"alternating": ("oscillator, fast and slow by turns", "fastest period"),
                "impact": ("impact, e = 0.7", "duration of the impact"),
                "block": ("block that slides, stops, rings", "period of its spring"),
                "bed": ("50 grains fall on a floor", "duration of an impact")}
    figure, axes = plt.subplots(2, 2, figsize=(7.2, 6.0))
    for axis, (name, (title, time)) in zip(axes.ravel(), problems.items(), strict=True):
        for scheme, (label, colour, marker) in shown.items():
            rows = [row for row in found[name] if row["scheme"] == scheme]
            axis.loglog([row["cost"] for row in rows], [row["error"] for row in rows], marker=marker, markersize=3, color=colour,
                        linestyle="--" if scheme == "rkf45_controlled" else "-", linewidth=0.9, label=label)
        axis.set(xlabel=f"evaluations of the forces per {time}", ylabel="error", title=title)
    axes[0, 0].legend(fontsize=6)
    save(figure, "schemes")


def far_wall() -> None:
    """Pressures that the case dam_break_box predicts on the far wall, with three spacings."""
    table = np.genfromtxt(PREDICTION, delimiter=",", names=True)
    figure, axes = plt.subplots(2, 2, figsize=(7.2, 4.6), sharex=True)
    for axis, height in zip(axes.ravel(), (3, 15, 30, 80), strict=True):
        for particles, style in ((16, ":"), (22, "--"), (32, "-")):
            axis.plot(table["time"], table[f"z{height}_{particles}"], style, color="0.2", label=f"{particles} particles over the depth")
        axis.set_title(f"{height} mm")
        axis.set_ylim(0.0)
    axes[0, 0].legend()
    for axis in axes[1]:
        axis.set_xlabel(r"$t\,\sqrt{g/H}$")
    for axis in axes[:, 0]:
        axis.set_ylabel(r"$p / (\rho g H)$")
    save(figure, "far_wall_pressure")


def main() -> None:
    """Draw all figures."""
    FOLDER.mkdir(exist_ok=True)
    with plt.rc_context(STYLE):
        friction()
        capillary()
        error_map()
        ratio_map()
        schemes()
        far_wall()


if __name__ == "__main__":
    main()
